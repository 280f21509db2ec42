"""The base class of damage laws: the rate at which a film ages in a field."""

from __future__ import annotations

from typing import Self

from numpy.typing import ArrayLike

from dielast.material.law import Law
from dielast.numerics.columns import Floats


class DamageLaw(Law):
    """Base of the damage laws. A law defines `rate`, `lasting` and `scaled`.

    Its constants are numbers, and may be replaced by arrays.
    """

    __slots__ = ()

    def rate(self, field: ArrayLike) -> Floats:
        """dD/dt in 1/s at the magnitude of the true field in V/m, of any shape; the film fails where the integral D reaches 1."""
        raise NotImplementedError

    def lasting(self, factor: float) -> Self:
        """The law of a film that fails at `factor` times the damage."""
        raise NotImplementedError

    def scaled(self, factor: float) -> Self:
        """The law of a film with the same damage at a field `factor` times as large."""
        raise NotImplementedError
