"""The dielectric laws, one module each."""

from __future__ import annotations

from dielast.material.dielectric.constant import VACUUM_PERMITTIVITY, ConstantPermittivity
from dielast.material.dielectric.linear import LinearPermittivity
from dielast.material.dielectric.table import PermittivityTable
from dielast.material.law import DielectricLaw, Registry

__all__ = ["DIELECTRICS", "VACUUM_PERMITTIVITY", "ConstantPermittivity", "DielectricLaw", "LinearPermittivity", "PermittivityTable"]

DIELECTRICS: Registry[type[DielectricLaw]] = Registry("dielectric law", ConstantPermittivity, LinearPermittivity, PermittivityTable)
