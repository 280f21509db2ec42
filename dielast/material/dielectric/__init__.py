"""The dielectric laws, one module each."""

from dielast.material.dielectric.constant import (
    VACUUM_PERMITTIVITY as VACUUM_PERMITTIVITY,
    ConstantPermittivity as ConstantPermittivity,
)
from dielast.material.dielectric.linear import LinearPermittivity as LinearPermittivity
from dielast.material.dielectric.table import PermittivityTable as PermittivityTable
from dielast.material.law import DielectricLaw as DielectricLaw
from dielast.registry import Registry

DIELECTRICS: Registry[type[DielectricLaw]] = Registry(
    "dielectric law",
    ConstantPermittivity,
    LinearPermittivity,
    PermittivityTable,
    group="dielast.dielectric",
    base=DielectricLaw,
)
