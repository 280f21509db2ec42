"""Base of the dielectric laws: the permittivity of a film."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.law import Law
from dielast.numerics.arrays import Floats

LogRatio = tuple[Floats, Floats, Floats]
"""ln(eps/eps_0), its derivatives (2, ...) and its second derivatives 11, 12, 22 (3, ...), see `DielectricLaw.log_ratio`."""


class DielectricLaw(Law):
    """Base of the dielectric laws; a law defines `at`, and `log_ratio` if the permittivity depends on stretch."""

    __slots__ = ()
    depends_on_stretch: ClassVar[bool] = False

    def brief(self) -> float | DielectricLaw | None:
        """The shortest form that `Material` takes: a number in F/m for a constant permittivity, None for none."""
        return self

    def at(self, temperature: ArrayLike) -> Floats:
        """The permittivity in F/m of the undeformed film at temperatures in degC, of the same shape; raises `InputError` for a
        temperature at which it is unknown.
        """
        raise NotImplementedError

    def typical(self, temperature: float) -> Floats:
        """Permittivities in F/m (any shape), to check the constants; `temperature` is the reference temperature in degC."""
        return self.at(temperature)

    def log_ratio(self, log_squared_stretch: Floats) -> LogRatio:
        """ln(eps/eps_0), with eps_0 that of the undeformed film, and its derivatives in Lambda_i = 2 ln lambda_i, at Lambda (2,
        ...).

        It must be symmetric in the axes. It is not finite where the law gives no positive permittivity.
        """
        shape = np.shape(log_squared_stretch)[1:]
        return np.zeros(shape), np.zeros((2, *shape)), np.zeros((3, *shape))
