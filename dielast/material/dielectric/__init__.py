"""The dielectric laws, one module each."""

from __future__ import annotations

from dielast.material.dielectric.constant import VACUUM_PERMITTIVITY, ConstantPermittivity
from dielast.material.dielectric.law import DielectricLaw
from dielast.material.law import Registry

__all__ = ["DIELECTRICS", "VACUUM_PERMITTIVITY", "ConstantPermittivity", "DielectricLaw"]

DIELECTRICS: Registry[type[DielectricLaw]] = Registry("dielectric law")
DIELECTRICS.register(ConstantPermittivity)
