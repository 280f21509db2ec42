"""How long the voltage has been on: the time that pull-in's time scale is a share of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.mechanics.span import Load
from dielast.numerics.columns import Cases, Flags, Floats
from dielast.numerics.stride import Stride

JUST_INSIDE = 0.01  # share of a span; at this distance from its ends the size of the voltage tells whether it rises there


@dataclass(slots=True, eq=False)
class VoltageClock:
    """Starts anew whenever the size of the voltage begins to rise, after a hold or a fall.

    `started` (cases,) is when it did last, in s since the voltage programme began; `rising` (cases,) whether the size rises now.
    """

    started: Floats
    rising: Flags

    @classmethod
    def at_rest(cls, cases: int) -> VoltageClock:
        """The clock before the programme."""
        return cls(np.zeros(cases), np.zeros(cases, dtype=bool))

    def age(self, cases: Cases, time: Floats) -> Floats:
        """How long (k,) in s the voltage of cases (k,) has been on, at times (k,) in s since the programme began."""
        return np.asarray(time - self.started[cases])

    def jump(self, time: Floats, before: Floats, after: Floats) -> None:
        """The nominal field jumps from `before` to `after` at a `time`, all (cases,)."""
        up = np.abs(after) > np.abs(before)
        self.started = np.where(up & ~self.rising, time, self.started)
        self.rising = np.where(after == before, self.rising, up)

    def follow(self, stride: Stride, load: Load, start: Floats) -> Cases:
        """Go through a step of a piece that began at `start` (cases,); returns the columns for which the clock started anew."""
        opening, ending = stride.accepted & (stride.time == 0), stride.accepted & (stride.until == stride.duration)
        restarted = np.zeros(0, dtype=np.intp)
        if opening.any() or ending.any():
            # within a span the size falls after it rises, or keeps to one of them
            begin, soon, late, end = (
                np.abs(load.value(share * stride.duration)[2]) for share in (0.0, JUST_INSIDE, 1 - JUST_INSIDE, 1.0)
            )
            restarted = np.flatnonzero(opening & (soon > begin) & ~self.rising[stride.cases])
            self.started[stride.cases[restarted]] = (start[stride.cases] + stride.begin)[restarted]
            self.rising[stride.cases[opening]] = (soon > begin)[opening]
            self.rising[stride.cases[ending]] = (end > late)[ending]
        return restarted
