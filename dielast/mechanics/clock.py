"""How long the voltage has been on: the time of which the time scale of pull-in is a share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.mechanics.span import Load
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.stride import Stride

JUST_INSIDE = 0.01  # fraction of a span, from either end, at which the magnitude of the voltage shows whether it rises at that end


@dataclass(slots=True, eq=False)
class VoltageClock:
    """A clock that restarts whenever the magnitude of the voltage begins to rise after a hold or a fall.

    `started` (cases,) is the time of the last restart in s since the voltage programme began; `rising` (cases,) says whether the
    magnitude rises now.
    """

    started: Floats
    rising: Flags

    @classmethod
    def at_rest(cls, cases: int) -> VoltageClock:
        """The clock before the programme."""
        return cls(np.zeros(cases), np.zeros(cases, dtype=bool))

    def age(self, cases: Cases, time: Floats) -> Floats:
        """The time (k,) in s since the last restart, of cases (k,) at times (k,) in s since the programme began."""
        return np.asarray(time - self.started[cases])

    def jump(self, time: Floats, before: Floats, after: Floats) -> None:
        """The nominal field jumps from `before` to `after` at a `time`, all (cases,)."""
        up = np.abs(after) > np.abs(before)
        self.started = np.where(up & ~self.rising, time, self.started)
        self.rising = np.where(after == before, self.rising, up)

    def follow(self, stride: Stride, load: Load, start: Floats) -> Cases:
        """Follow a step of a piece that began at `start` (cases,) in s; returns the columns in which the clock restarted."""
        opening, ending = stride.accepted & (stride.time == 0), stride.accepted & (stride.until == stride.duration)
        restarted = np.zeros(0, dtype=np.intp)
        if opening.any() or ending.any():
            # within a span the magnitude is monotonic, or rises and then falls
            begin, after_begin, before_end, end = (
                np.abs(load.value(share * stride.duration)[2]) for share in (0.0, JUST_INSIDE, 1 - JUST_INSIDE, 1.0)
            )
            restarted = np.flatnonzero(opening & (after_begin > begin) & ~self.rising[stride.cases])
            self.started[stride.cases[restarted]] = (start[stride.cases] + stride.begin)[restarted]
            self.rising[stride.cases[opening]] = (after_begin > begin)[opening]
            self.rising[stride.cases[ending]] = (end > before_end)[ending]
        return restarted
