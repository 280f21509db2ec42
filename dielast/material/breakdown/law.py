"""Base of the breakdown laws: the true field at which a film breaks down."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.law import Law
from dielast.numerics.arrays import Flags, Floats


class BreakdownLaw(Law):
    """Base of the breakdown laws; a law defines `at` and `scaled`, and with `follows_film` also `of_film`."""

    __slots__ = ()

    follows_film: ClassVar[bool] = False
    """Whether the field depends on the present stretch and thickness: the law is then evaluated at all times, else once, at the
    prestretch. The constants of such a law are numbers, and it must also take arrays of them.
    """

    def at(self, prestretch: ArrayLike) -> Floats:
        """The field in V/m at equibiaxial prestretches of any shape; for unequal ones, pass the square root of their product."""
        raise NotImplementedError

    def of_film(self, stretch: ArrayLike, thickness: ArrayLike) -> Floats:
        """The field in V/m of films at a `stretch` sqrt(l1 l2) and a present `thickness` in m, of any shape."""
        return self.at(stretch)

    def scaled(self, factor: float) -> Self:
        """The law for a breakdown field `factor` times as large, at every prestretch."""
        raise NotImplementedError

    def is_known_at(self, prestretch: ArrayLike) -> Flags:
        """Whether equibiaxial prestretches (any shape) lie within the range of the law."""
        return np.ones(np.shape(prestretch), dtype=bool)

    def outside(self, prestretch: float) -> str:
        """For a warning: the field that is taken at a prestretch outside the range of the law, and how to state another."""
        return ""

    def typical_fields(self) -> Floats:
        """Fields (k,) in V/m, to check whether they are those of films."""
        return np.atleast_1d(self.at(1.0))
