"""The position in time of the cases that advance together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import ByCase, Cases, Floats


@dataclass(slots=True, eq=False)
class Whereabouts(ByCase):
    """The position of each column of a pool: all arrays (pool,).

    A column integrates a case of index `cases` through the span of index `span`, which lasts `duration` s and begins `begin` s
    after the start of the integration. `time` in s is the time since the span began, `rounding` in s the rounding error of `time`
    (compensated summation). `next_step` is the step size to try, `last_step` and `last_error` (in tolerances) are those of the last
    accepted step, 0 before the first.
    """

    cases: Cases
    span: Cases
    begin: Floats
    duration: Floats
    time: Floats
    rounding: Floats
    next_step: Floats
    last_step: Floats
    last_error: Floats

    @classmethod
    def start(cls, cases: Cases, duration: Floats) -> Whereabouts:
        """Columns of `cases` (k,) at the beginning of their first span, which lasts `duration` (k,) s."""
        zero = np.zeros((6, cases.size))
        return cls(cases, np.zeros_like(cases), zero[0], duration, *zero[1:])
