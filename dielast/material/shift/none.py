"""No shift."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.argument_types import checked
from dielast.material.shift.law import ShiftLaw
from dielast.numerics.arrays import Floats


@checked
@dataclass(frozen=True, slots=True)
class NoShift(ShiftLaw):
    """Relaxation times that do not depend on temperature: log10 a = 0 at all temperatures; `reference_temperature` in degC."""

    reference_temperature: float

    name: ClassVar = "none"
    title: ClassVar = "no shift"
    is_fitted: ClassVar = False
    depends_on_temperature: ClassVar = False

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        """0 at every temperature."""
        return np.zeros(np.shape(temperature))
