"""The part of a step that is known in closed form: what fades after a kink of the load.

After a kink, the rate of a fast unknown differs from that of the load which it follows. To first order, this difference a fades as
exp(-k t), k its rate of relaxation, and the unknown x contains

    R(t) = a (1 - exp(-k t))/k.

The stepper integrates the remainder x - R, which has no transient but by what the linear response leaves, of second order in a: the
idea of exponential methods (Hochbruck and Ostermann, Acta Numerica 19 (2010) 209), for the transient alone. As k is that of the
Jacobian of a step, its terms in R cancel in the linear system of the step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol, runtime_checkable

import numpy as np

from dielast.numerics.arrays import ByCase, Cases, Floats

STILL = 1e-200  # a decay in a step as good as none


@dataclass(frozen=True, slots=True, eq=False)
class Fading(ByCase):
    """What fades in each step: `rate` is a (m, n, cases) in 1/s, in m rows for each of n rates of relaxation; `beyond`
    (m, n, cases) in 1/s is what fades besides, to second order, by which first steps are chosen.
    """

    rate: Floats
    beyond: Floats

    def put(self, columns: Cases, other: Fading) -> Fading:
        """This, with its `columns` (k,) replaced by those of `other`."""
        mine = replace(self, rate=self.rate.copy(), beyond=self.beyond.copy())
        mine.rate[..., columns], mine.beyond[..., columns] = other.rate, other.beyond
        return mine


@runtime_checkable
class Responsive(Protocol):
    """Equations whose response to a kink may be known: their `linearise` takes a (m, n, cases) as a further argument."""

    def fading(self, time: Floats, state: Floats, lasts: Floats) -> Fading | None:
        """What fades in a `state` (rows, cases) at `time` (cases,) in s, in a smooth load that `lasts` (cases,) s more; None where
        it is not known.
        """


def relaxed(decay: Floats, share: Floats | float = 1.0) -> tuple[Floats, Floats]:
    """exp(-decay share) - 1, and (1 - exp(-decay share))/decay, which is `share` where there is no decay."""
    against = -np.maximum(decay, STILL)
    fallen = np.expm1(against * share)
    return fallen, np.asarray(fallen / against)


@dataclass(frozen=True, slots=True, eq=False)
class Response(ByCase):
    """R of selected rows: of the unknowns that relax at `decay` (n, cases) in 1/s, with a in `inner` (rows, cases), whose rates are
    those of number `index` (rows,); and of `others`, a number of rows of unknowns without such a part.
    """

    decay: Floats
    inner: Floats
    others: int
    end: Floats
    """R (rows, cases) at the end of the step."""
    middle: Floats
    """R (rows, cases) in its middle."""
    index: tuple[int, ...]
    path: Any = None
    """What the unknowns that relax follow besides, a function of time as a class by case; None: nothing."""

    def rows(self, rows: slice) -> Response | None:
        """The selected rows, None if none of them has a part."""
        count = len(self.index)
        start, stop, _ = rows.indices(count + self.others)
        if start >= count:
            return None
        inner = slice(start, min(stop, count))
        path = self.path
        assert path is None or self.index[inner] == self.index
        ends = self.end[rows], self.middle[rows]
        return Response(self.decay, self.inner[inner], max(stop - count, 0), *ends, self.index[inner], path)

    def at(self, time: Floats) -> Floats:
        """R (rows, cases) at `time` (cases,) in s after the beginning of the step."""
        inner = self._times(time * relaxed(self.decay * time)[1])
        return self._with_others(inner if self.path is None else inner + self.path.at(time))

    def slope(self, time: Floats) -> Floats:
        """The rate of R (rows, cases) per s."""
        inner = self._times(np.exp(-self.decay * time))
        return self._with_others(inner if self.path is None else inner + self.path.slope(time))

    def _times(self, response: Floats) -> Floats:
        """The rows for a response (n, cases) to a = 1."""
        return np.asarray(self.inner * response[list(self.index)])

    def _with_others(self, inner: Floats) -> Floats:
        return np.concatenate((inner, np.zeros((self.others, inner.shape[1]))))
