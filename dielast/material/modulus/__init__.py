"""The temperature dependence of the moduli of springs, one law per module."""

from __future__ import annotations

from dielast.material.law import Registry
from dielast.material.modulus.constant import ConstantModulus
from dielast.material.modulus.entropic import EntropicModulus
from dielast.material.modulus.law import ModulusLaw

__all__ = ["CONSTANT_MODULUS", "MODULI", "ConstantModulus", "EntropicModulus", "ModulusLaw"]

CONSTANT_MODULUS = ConstantModulus()
MODULI: Registry[type[ModulusLaw]] = Registry("law of moduli over temperature")
MODULI.register(ConstantModulus)
MODULI.register(EntropicModulus)
