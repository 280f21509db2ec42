"""Points of a table as a course of straight spans."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.mechanics.cycles import targets
from dielast.mechanics.line import EVEN_ROWS, Targets
from dielast.mechanics.span import Controls, Load
from dielast.numerics.columns import Cases, Flags, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Straight lines through points of `time` in s and `value`, both (points,), the first at time 0, along the `driven` rows (3,)
    of the load, where the value is multiplied by a `scale` (cases,); the other rows stay at their `base` (3, cases), NaN for a
    value that is the present one when the course begins.
    """

    controls: Controls
    base: Floats
    driven: Flags
    time: Floats
    value: Floats
    scale: Floats
    origin: int = 0
    cycles: int = field(init=False, default=0)

    @classmethod
    def of(
        cls, controls: Controls, base: Floats, driven: Flags, time: Floats, value: Floats, scale: Floats, origin: int = 0
    ) -> Chain:
        """The chain through these points, with points more where a voltage passes 0."""
        through = np.flatnonzero(value[:-1] * value[1:] < 0) if driven[2] else np.zeros(0, dtype=np.intp)
        if through.size:
            before, after = value[through], value[through + 1]
            lasts = time[through + 1] - time[through]
            time = np.insert(time, through + 1, time[through] + before / (before - after) * lasts)
            value = np.insert(value, through + 1, 0.0)
        return cls(controls, base, driven, time, value, scale, origin)

    def begin(self, present: Floats) -> Chain:
        """The course from the `present` values (3, cases) on."""
        return replace(self, base=np.where(np.isnan(self.base), present, self.base))

    def take(self, cases: Cases) -> Chain:
        """The same for some of the cases."""
        return replace(self, base=self.base[:, cases], scale=self.scale[cases])

    @property
    def target(self) -> Targets:
        """The first point, and what the other rows are held at."""
        return targets(self.start)

    @property
    def at_once(self) -> Flags:
        """It jumps to the first point, if it is not there."""
        return np.ones(self.scale.size, dtype=bool)

    def extremes(self) -> tuple[Floats, ...]:
        """The least and the largest value (cases,)."""
        return self.value.min() * self.scale, self.value.max() * self.scale

    @property
    def spans(self) -> int:
        """Between the points."""
        return self.time.size - 1

    @property
    def start(self) -> Floats:
        """The first point."""
        return np.where(self.driven[:, None], self.value[0] * self.scale, self.base)

    @property
    def end(self) -> Floats:
        """The last point."""
        return np.where(self.driven[:, None], self.value[-1] * self.scale, self.base)

    @property
    def duration(self) -> Floats:
        """To the last point."""
        return np.full(self.scale.size, self.time[-1])

    @property
    def longest_step(self) -> Floats:
        """Any step sees a straight line whole."""
        return np.full(self.scale.size, np.inf)

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """From one point to the next."""
        base, driven, scale = self.base[:, cases], self.driven[:, None], self.scale[cases]
        lasts = self.time[index + 1] - self.time[index]
        start, end = (np.where(driven, self.value[at] * scale, base) for at in (index, index + 1))
        return Load.between(self.controls, start, end, lasts), lasts

    def smooth(self, index: Cases) -> Flags:
        """Every point is a kink."""
        return np.zeros(index.shape, dtype=bool)

    def rises(self, kept: Cases) -> Floats:
        """Not looked for: a measured voltage rises again and again."""
        return np.full((self.scale.size, 1), np.nan)

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """At each point, and so many between that neither value nor time moves on by more than a share."""
        move, lasts = np.abs(np.diff(self.value)), np.diff(self.time)
        reach, length = float(np.ptp(self.value)), float(self.time[-1])
        share = np.maximum(move / reach if reach > 0 else move, lasts / length)
        between = np.maximum(np.ceil(EVEN_ROWS * share * (1 - 1e-9)).astype(np.intp), 1)
        span = np.repeat(np.arange(between.size), between)
        part = (np.arange(span.size) - np.repeat(np.cumsum(between) - between, between)) / between[span]
        rows = np.append(self.time[span] + part * lasts[span], length)
        return np.broadcast_to(rows, (self.scale.size, rows.size))
