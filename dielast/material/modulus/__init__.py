"""Laws of moduli over temperature, one module each."""

from dielast.material.law import ModulusLaw as ModulusLaw
from dielast.material.modulus.constant import ConstantModulus as ConstantModulus
from dielast.material.modulus.entropic import EntropicModulus as EntropicModulus
from dielast.registry import Registry

CONSTANT_MODULUS = ConstantModulus()
MODULI: Registry[type[ModulusLaw]] = Registry("law of moduli over temperature", ConstantModulus, EntropicModulus)
