"""The base class of breakdown laws: the true field at which a film breaks down."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.law import Law
from dielast.numerics.arrays import Flags, Floats


class BreakdownLaw(Law):
    """Base of the breakdown laws. A law defines at least `at` and `scaled`, and `of_film` if it `follows_film`."""

    __slots__ = ()

    follows_film: ClassVar[bool] = False
    """Whether the field depends on the present state of the film; the law is then evaluated at every moment, else once, at the
    prestretch. The constants of such a law are numbers, and may be replaced by arrays.
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
        """Whether the law was stated for equibiaxial prestretches (any shape), and needs no substitute there."""
        return np.ones(np.shape(prestretch), dtype=bool)

    def outside(self, prestretch: float) -> str:
        """The substitute for the law at a prestretch for which it was not stated, and how to state it, for a warning."""
        return ""

    def typical_fields(self) -> Floats:
        """Fields (k,) in V/m by which the plausibility of the law is judged."""
        return np.atleast_1d(self.at(1.0))
