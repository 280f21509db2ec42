"""Laws of moduli over temperature, one module each."""

from __future__ import annotations

from dielast.material.law import ModulusLaw, Registry
from dielast.material.modulus.constant import ConstantModulus
from dielast.material.modulus.entropic import EntropicModulus

__all__ = ["CONSTANT_MODULUS", "MODULI", "ConstantModulus", "EntropicModulus", "ModulusLaw"]

CONSTANT_MODULUS = ConstantModulus()
MODULI: Registry[type[ModulusLaw]] = Registry("law of moduli over temperature", ConstantModulus, EntropicModulus)
