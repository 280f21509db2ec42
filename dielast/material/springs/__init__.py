"""The hyperelastic laws of springs, one module each."""

from __future__ import annotations

from dielast.material.law import Registry
from dielast.material.springs.gent import Gent
from dielast.material.springs.law import EQUIBIAXIAL, UNIAXIAL, CardForm, SpringLaw, Symmetry, gathered
from dielast.material.springs.neo_hookean import NeoHookean
from dielast.numerics.columns import Cases, Floats

__all__ = [
    "EQUIBIAXIAL",
    "SPRINGS",
    "UNIAXIAL",
    "CardForm",
    "Cases",
    "Floats",
    "Gent",
    "NeoHookean",
    "SpringLaw",
    "Symmetry",
    "gathered",
]

SPRINGS: Registry[type[SpringLaw]] = Registry("spring law")
SPRINGS.register(Gent)
SPRINGS.register(NeoHookean)
