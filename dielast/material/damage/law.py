"""Base of the damage laws: the rate of damage under a field."""

from __future__ import annotations

from typing import Self

from numpy.typing import ArrayLike

from dielast.material.law import Law
from dielast.numerics.arrays import Floats


class DamageLaw(Law):
    """Base of the damage laws; a law defines `rate`, `lasting` and `scaled`.

    Its constants are numbers, and it must also take arrays of them.
    """

    __slots__ = ()

    def rate(self, field: ArrayLike) -> Floats:
        """dD/dt in 1/s at the magnitude of the true field in V/m, of any shape; the film fails where the integral D reaches 1."""
        raise NotImplementedError

    def lasting(self, factor: float) -> Self:
        """The law of a film that fails at `factor` times the damage."""
        raise NotImplementedError

    def scaled(self, factor: float) -> Self:
        """The law of a film that withstands a field `factor` times as large for the same damage."""
        raise NotImplementedError
