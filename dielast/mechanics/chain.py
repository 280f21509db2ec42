"""Points of a table as a course of straight spans, one from each point to the next."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.mechanics.cycles import targets
from dielast.mechanics.line import EVEN_ROWS, Targets
from dielast.mechanics.span import Controls, Load
from dielast.numerics.arrays import Cases, Flags, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Straight lines through points of `time` in s and `value`, both (points,), the first at time 0.

    They prescribe the `driven` rows (3,) of the load, with values multiplied by `scale` (cases,). The other rows keep their `base`
    (3, cases); NaN stands for the value that is present when the course begins.
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
        """The chain through these points, with a point inserted wherever a voltage changes its sign."""
        sign_changes = np.flatnonzero(value[:-1] * value[1:] < 0) if driven[2] else np.zeros(0, dtype=np.intp)
        if sign_changes.size:
            before, after = value[sign_changes], value[sign_changes + 1]
            lasts = time[sign_changes + 1] - time[sign_changes]
            time = np.insert(time, sign_changes + 1, time[sign_changes] + before / (before - after) * lasts)
            value = np.insert(value, sign_changes + 1, 0.0)
        return cls(controls, base, driven, time, value, scale, origin)

    def begin(self, present: Floats) -> Chain:
        """The course that starts from the `present` values (3, cases)."""
        return replace(self, base=np.where(np.isnan(self.base), present, self.base))

    def take(self, cases: Cases) -> Chain:
        """The selected cases (k,)."""
        return replace(self, base=self.base[:, cases], scale=self.scale[cases])

    @property
    def target(self) -> Targets:
        """The first point of the driven rows, and the values of the other rows."""
        return targets(self.start)

    @property
    def at_once(self) -> Flags:
        """Whether (cases,) the load may jump to the first point: always."""
        return np.ones(self.scale.size, dtype=bool)

    def extremes(self) -> tuple[Floats, ...]:
        """The smallest and the largest value (cases,)."""
        return self.value.min() * self.scale, self.value.max() * self.scale

    @property
    def spans(self) -> int:
        """The number of intervals between points."""
        return self.time.size - 1

    @property
    def start(self) -> Floats:
        """The values (3, cases) at the first point."""
        return np.where(self.driven[:, None], self.value[0] * self.scale, self.base)

    @property
    def end(self) -> Floats:
        """The values (3, cases) at the last point."""
        return np.where(self.driven[:, None], self.value[-1] * self.scale, self.base)

    @property
    def duration(self) -> Floats:
        """The time (cases,) in s from the first to the last point."""
        return np.full(self.scale.size, self.time[-1])

    @property
    def longest_step(self) -> Floats:
        """Unlimited (cases,): a step sees a straight line in full."""
        return np.full(self.scale.size, np.inf)

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The straight lines from the points `index` (k,) to the next, and their durations (k,) in s."""
        base, driven, scale = self.base[:, cases], self.driven[:, None], self.scale[cases]
        lasts = self.time[index + 1] - self.time[index]
        start, end = (np.where(driven, self.value[at] * scale, base) for at in (index, index + 1))
        return Load.between(self.controls, start, end, lasts), lasts

    def smooth(self, index: Cases) -> Flags:
        """False (k,): every point is a kink."""
        return np.zeros(index.shape, dtype=bool)

    def rises(self, kept: Cases) -> Floats:
        """NaN (cases, 1): rises are not searched for in a table, as a measured voltage has too many of them."""
        return np.full((self.scale.size, 1), np.nan)

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """The times (cases, k) of all points, and times between them so dense that neither value nor time advances by more than
        1/`EVEN_ROWS` of its range from one row to the next.
        """
        change, lasts = np.abs(np.diff(self.value)), np.diff(self.time)
        value_range, duration = float(np.ptp(self.value)), float(self.time[-1])
        share = np.maximum(change / value_range if value_range > 0 else change, lasts / duration)
        between = np.maximum(np.ceil(EVEN_ROWS * share * (1 - 1e-9)).astype(np.intp), 1)
        span = np.repeat(np.arange(between.size), between)
        part = (np.arange(span.size) - np.repeat(np.cumsum(between) - between, between)) / between[span]
        rows = np.append(self.time[span] + part * lasts[span], duration)
        return np.broadcast_to(rows, (self.scale.size, rows.size))
