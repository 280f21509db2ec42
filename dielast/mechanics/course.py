"""Pieces of a history: what a step prescribes, as a course of smooth spans through which the stepper goes.

A `Piece` states a load of step `origin` (from 0) of the history. Its start is known only once the films have come to it; `begin`
then turns it into a `Course`. Rows of prescribed values (3, cases) are the stretch or the nominal stress in Pa of axes 1 and 2, and
the nominal field V/L_3 in V/m. A new form of load is a further class in these unions.

A piece has its `controls`, its `target` (values at the end of a ramp, at the beginning of a waveform or table), the rows that are
`driven` by a waveform or table, the `extremes` of their values, `at_once` (whether it may begin with a jump), `take` to select
cases, and `begin`.

A course has its `start`, `end` and `duration`, the number of its `spans` and of its `cycles`; `span` gives the load and the
duration of the spans `index` of `cases` (k,), and `smooth` whether there is no kink at the beginning of a span. No step through it
may take more than its `longest_step` (cases,) in s. `rows` are suitable times of output, and `rises` the times at which the
magnitude of the voltage begins to rise; both are (cases, k) in s since the course began, or NaN.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from dielast.mechanics.cases import spread
from dielast.mechanics.line import EVEN_ROWS, JUMP_DECADES, RAMP_DECADES, Line, Ramp, Targets, merged, whole
from dielast.mechanics.load import Waveform
from dielast.mechanics.span import Controls, Load, Wave
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats

LEAST_STEPS = 16  # steps in a cycle of a sine, 8 in a cycle of its square, which drives a film under voltage
TURN_DECADES = 5  # of log-spaced rows after a triangle turns around, with a third of the usual rows per decade


@dataclass(frozen=True, slots=True, eq=False)
class _Driven(ByCase):
    """A load that prescribes the values over time of the `driven` rows (axes 1 and 2, and the field).

    The other rows keep their `base` (3, cases); NaN stands for the value that is present when the course begins.
    """

    controls: Controls
    base: Floats
    driven: tuple[bool, bool, bool]

    def begin(self, present: Floats) -> Self:
        """The course that starts from the `present` values (3, cases)."""
        return replace(self, base=np.where(np.isnan(self.base), present, self.base))

    def filled(self, values: Floats) -> Floats:
        """The `values` (cases,) in the driven rows, and the base in the others, (3, cases)."""
        return np.where(np.array(self.driven)[:, None], values, self.base)

    @property
    def start(self) -> Floats:
        """The values (3, cases) at the beginning."""
        raise NotImplementedError

    @property
    def target(self) -> Targets:
        """The values (cases,) at the beginning; None for a row that keeps its present value."""
        first, second, third = (None if np.isnan(row).any() else row for row in self.start)
        return first, second, third

    @property
    def at_once(self) -> Flags:
        """Whether (cases,) the load may jump to its first value: always."""
        return np.ones(self.base.shape[1], dtype=bool)


@dataclass(frozen=True, slots=True, eq=False)
class Cycles(_Driven):
    """Cycles from `low` to `high` and back in a `period` in s, all (cases,), of a sine or a triangle.

    `edges` (m + 1, cases) are the phases, from 0 to 1, at which the spans of a cycle begin and end: the kinks of a triangle, and
    the phases at which the magnitude of a voltage begins to rise.
    """

    low: Floats
    high: Floats
    period: Floats
    cycles: int
    triangle: bool
    edges: Floats
    origin: int = 0

    @classmethod
    def of(
        cls, controls: Controls, base: Floats, driven: tuple[bool, bool, bool], wave: Waveform, scale: Floats, origin: int = 0
    ) -> Cycles:
        """The cycles of a waveform, its values multiplied by `scale` (cases,)."""
        low, high, period = (spread(getattr(wave, name), name, scale.size) for name in ("low", "high", "period"))
        low, high, triangle = low * scale, high * scale, wave.shape == "triangle"
        zero, one = np.zeros_like(low), np.ones_like(low)
        edges = [zero, 0.5 * one, one] if triangle else [zero, one]
        if driven[2]:
            # fraction of the swing, and then of the period, after which the voltage is closest to 0
            share = whole(np.clip(np.where(high == low, 0.0, -low / np.where(high == low, 1.0, high - low)), 0.0, 1.0))
            rises = 0.5 * share if triangle else np.arccos(1 - 2 * share) / (2 * np.pi)
            edges = [zero, rises, 0.5 * one, 1 - rises, one] if triangle else [zero, rises, 1 - rises, one]
        return cls(controls, base, driven, low, high, period, wave.cycles, triangle, np.array(edges), origin)

    def extremes(self) -> tuple[Floats, ...]:
        """The smallest and the largest value (cases,)."""
        return np.minimum(self.low, self.high), np.maximum(self.low, self.high)

    @property
    def spans(self) -> int:
        """The number of spans in all cycles."""
        return self.cycles * (len(self.edges) - 1)

    @property
    def start(self) -> Floats:
        """The values (3, cases) at the beginning, where the driven rows are low."""
        return self.filled(self.low)

    @property
    def end(self) -> Floats:
        """The values (3, cases) at the end, which are those at the beginning."""
        return self.start

    @property
    def duration(self) -> Floats:
        """The duration (cases,) of all cycles in s."""
        return self.period * self.cycles

    @property
    def longest_step(self) -> Floats:
        """A fraction (cases,) of the period of a sine in s; unlimited for a triangle, whose straight lines are spans."""
        return np.full_like(self.period, np.inf) if self.triangle else self.period / LEAST_STEPS

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The load and the durations (k,) in s of spans; all cycles are equal."""
        part, course = index % (len(self.edges) - 1), self.take(cases)
        every = np.arange(cases.size)
        begin, end = course.edges[part, every], course.edges[part + 1, every]
        swing = np.where(np.array(self.driven)[:, None], 0.5 * (course.high - course.low), 0.0)
        base, lasts = course.start, course.period * (end - begin)
        if self.triangle:
            up = 1 - np.abs(2 * np.array((begin, end)) - 1)
            return Load.between(self.controls, base + 2 * swing * up[0], base + 2 * swing * up[1], lasts), lasts
        angle = 2 * np.pi * begin
        start = base + swing * (1 - np.cos(angle))
        return Load(self.controls, start, np.zeros_like(start), Wave(swing, angle, 2 * np.pi / course.period)), lasts

    def smooth(self, index: Cases) -> Flags:
        """Whether (k,) there is no kink: a triangle has kinks where it turns around."""
        part = index % (len(self.edges) - 1)
        return (index > 0) & (~np.isin(part, (0, (len(self.edges) - 1) // 2)) if self.triangle else True)

    def rises(self, kept: Cases) -> Floats:
        """The times (cases, k) in the cycles `kept` at which the voltage is closest to 0, on the way up and on the way down."""
        if not self.driven[2]:
            return np.full((self.period.size, 1), np.nan)
        up = self.edges[1]
        down = np.where((up > 0) & (up < 0.5), 1 - up, np.nan)
        return np.asarray(self.period[:, None] * np.concatenate([kept + phase[:, None] for phase in (up, down)], axis=1))

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """Times (cases, k), evenly spaced in the cycles `kept`, log-spaced after each turn of a triangle and after the start."""
        # the first cycle of a voltage, as a ramp, restarts the clock of the pull-in time scale
        decades = JUMP_DECADES if self.driven[2] else RAMP_DECADES
        phases_of_rows, spaced = np.linspace(0.0, 1.0, 2 * EVEN_ROWS + 1), np.logspace(-decades, 0, decades * per_decade + 1)
        if self.triangle:  # fast branches relax after each turn
            turned = 0.5 * np.logspace(-TURN_DECADES, 0, TURN_DECADES * max(per_decade // 3, 1) + 1)
            phases_of_rows = merged(phases_of_rows, np.concatenate((turned, 0.5 + turned)))
        phases = np.concatenate(([0.0], *(cycle + phases_of_rows for cycle in kept), [float(self.cycles)]))
        phases = phases[np.diff(phases, prepend=-1.0) > 0]  # one cycle ends where the next begins
        if kept.size and kept[0] == 0:
            phases = merged(phases, spaced)
        return np.asarray(self.period[:, None] * phases)


@dataclass(frozen=True, slots=True, eq=False)
class Chain(_Driven):
    """Straight lines through points of `time` in s and `value`, both (points,), the first at time 0, with one span for each line.

    The values are multiplied by `scale` (cases,).
    """

    time: Floats
    value: Floats
    scale: Floats
    origin: int = 0
    cycles: ClassVar[int] = 0

    @classmethod
    def of(
        cls,
        controls: Controls,
        base: Floats,
        driven: tuple[bool, bool, bool],
        time: Floats,
        value: Floats,
        scale: Floats,
        origin: int = 0,
    ) -> Chain:
        """The chain through these points, with a point inserted wherever a voltage changes its sign."""
        sign_changes = np.flatnonzero(value[:-1] * value[1:] < 0) if driven[2] else np.zeros(0, dtype=np.intp)
        if sign_changes.size:
            before, after = value[sign_changes], value[sign_changes + 1]
            lasts = time[sign_changes + 1] - time[sign_changes]
            time = np.insert(time, sign_changes + 1, time[sign_changes] + before / (before - after) * lasts)
            value = np.insert(value, sign_changes + 1, 0.0)
        return cls(controls, base, driven, time, value, scale, origin)

    def take(self, cases: Cases) -> Chain:
        """The selected cases (k,), which share all points."""
        return replace(self, base=self.base[:, cases], scale=self.scale[cases])

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
        return self.filled(self.value[0] * self.scale)

    @property
    def end(self) -> Floats:
        """The values (3, cases) at the last point."""
        return self.filled(self.value[-1] * self.scale)

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
        course, lasts = self.take(cases), self.time[index + 1] - self.time[index]
        start, end = (course.filled(self.value[at] * course.scale) for at in (index, index + 1))
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


Piece = Ramp | Cycles | Chain
Course = Line | Cycles | Chain
