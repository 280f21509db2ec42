"""A permittivity that is linear in the stretches."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.material.dielectric.constant import ConstantPermittivity
from dielast.material.law import Constant, DielectricLaw, LogRatio
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True)
class LinearPermittivity(DielectricLaw):
    """eps = eps_0 [1 + c (lambda_1 + lambda_2 - 2)] with eps_0 = `permittivity` in F/m, or a `relative_permittivity`, and
    c = `stretch_coefficient` (Zhao and Suo, J. Appl. Phys. 104 (2008) 123530; about -0.05 for VHB 4910).
    """

    permittivity: float = 0.0
    relative_permittivity: float | None = None
    stretch_coefficient: float = 0.0

    name: ClassVar = "linear"
    title: ClassVar = "permittivity linear in stretch"
    depends_on_stretch: ClassVar = True
    constants: ClassVar = (
        *ConstantPermittivity.constants,
        Constant("stretch_coefficient", "linear: c in permittivity [1 + c (l1 + l2 - 2)]; about -0.05 for VHB."),
    )

    def __post_init__(self) -> None:
        at_rest = ConstantPermittivity(self.permittivity, self.relative_permittivity).permittivity
        if not at_rest:
            raise InputError("a permittivity linear in stretch needs permittivity or relative_permittivity, that at stretch 1")
        if not np.isfinite(self.stretch_coefficient):
            raise InputError(f"{self.stretch_coefficient:g}: a finite number is needed", argument="stretch_coefficient")
        object.__setattr__(self, "permittivity", at_rest)
        object.__setattr__(self, "relative_permittivity", None)

    def at(self, temperature: ArrayLike) -> Floats:
        """eps_0 at every temperature."""
        return np.full(np.shape(temperature), self.permittivity)

    def log_ratio(self, log_squared_stretch: Floats) -> LogRatio:
        """ln r with r = 1 + c (l1 + l2 - 2): dr/dLambda_i = c l_i/2, d2r/dLambda_i^2 = c l_i/4."""
        first, second = np.exp(0.5 * log_squared_stretch)
        ratio = 1 + self.stretch_coefficient * (first + second - 2)
        one, two = (0.5 * self.stretch_coefficient / ratio) * first, (0.5 * self.stretch_coefficient / ratio) * second
        with np.errstate(invalid="ignore", divide="ignore"):
            logarithm = np.log(ratio)
        return logarithm, np.stack((one, two)), np.stack((one * (0.5 - one), -one * two, two * (0.5 - two)))
