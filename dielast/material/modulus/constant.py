"""Moduli that do not depend on temperature."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.law import ModulusLaw
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True)
class ConstantModulus(ModulusLaw):
    """The modulus at the reference temperature, at all temperatures."""

    name: ClassVar = "constant"
    title: ClassVar = "constant moduli"
    depends_on_temperature: ClassVar = False

    def factor(self, temperature: ArrayLike, reference_temperature: float) -> Floats:
        """1."""
        return np.ones(np.shape(temperature))
