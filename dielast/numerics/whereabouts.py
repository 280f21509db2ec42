"""Where the cases that advance together stand."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from dielast.numerics.columns import Cases, Floats


@dataclass(slots=True, eq=False)
class Whereabouts:
    """Where each column of a pool stands: all arrays (pool,).

    A column integrates a case through a span of a `duration` s, which begins `begin` s after the integration. `time` s of the span
    are done, and `rounding` s that are too few for the digits of `time` (compensated summation).
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
    def fresh(cls, cases: Cases, duration: Floats) -> Whereabouts:
        """Columns (k,) that are at the beginning of the first span, of a `duration` (k,) s."""
        zero = np.zeros((6, cases.size))
        return cls(cases, np.zeros_like(cases), zero[0], duration, *zero[1:])

    def take(self, columns: Cases) -> Whereabouts:
        """Some of the columns."""
        return Whereabouts(*(getattr(self, one.name)[columns] for one in fields(self)))

    def joined(self, other: Whereabouts) -> Whereabouts:
        """These columns, and then those of the other."""
        return Whereabouts(*(np.concatenate((getattr(self, one.name), getattr(other, one.name))) for one in fields(self)))
