"""The dielectric laws, one module each."""

from __future__ import annotations

from dielast.material.dielectric.constant import VACUUM_PERMITTIVITY, ConstantPermittivity
from dielast.material.dielectric.gathered import StretchedDielectrics, stretched_dielectrics
from dielast.material.dielectric.law import DielectricLaw
from dielast.material.dielectric.linear import LinearPermittivity
from dielast.material.dielectric.table import PermittivityTable
from dielast.material.law import Registry

__all__ = [
    "DIELECTRICS",
    "VACUUM_PERMITTIVITY",
    "ConstantPermittivity",
    "DielectricLaw",
    "LinearPermittivity",
    "PermittivityTable",
    "StretchedDielectrics",
    "stretched_dielectrics",
]

DIELECTRICS: Registry[type[DielectricLaw]] = Registry("dielectric law")
DIELECTRICS.register(ConstantPermittivity)
DIELECTRICS.register(LinearPermittivity)
DIELECTRICS.register(PermittivityTable)
