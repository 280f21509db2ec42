"""The hyperelastic laws of springs, one module each."""

from __future__ import annotations

from dielast.material.law import Registry
from dielast.material.springs.arruda_boyce import ArrudaBoyce
from dielast.material.springs.gathered import gathered
from dielast.material.springs.gent import Gent
from dielast.material.springs.law import EQUIBIAXIAL, UNIAXIAL, CardForm, SpringLaw, Symmetry
from dielast.material.springs.mooney_rivlin import MooneyRivlin
from dielast.material.springs.neo_hookean import NeoHookean
from dielast.material.springs.ogden import Ogden
from dielast.material.springs.yeoh import Yeoh

__all__ = [
    "EQUIBIAXIAL",
    "SPRINGS",
    "UNIAXIAL",
    "ArrudaBoyce",
    "CardForm",
    "Gent",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden",
    "SpringLaw",
    "Symmetry",
    "Yeoh",
    "gathered",
]

SPRINGS: Registry[type[SpringLaw]] = Registry("spring law", Gent, NeoHookean, Yeoh, ArrudaBoyce, MooneyRivlin, Ogden)
