"""Pieces of a history from known values on: a straight line, cycles of a waveform, or a chain of straight lines through points.

A course is made of smooth spans, one after another, through which the stepper goes without starting anew.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from dielast.mechanics.span import Cases, Controls, Floats, Load, Wave

RAMP_DECADES = 3  # of log-spaced rows before the end of a ramp, or of the first cycle
HOLD_DECADES = 6  # of log-spaced rows before the end of a hold, at least
JUMP_DECADES = 12  # the same after a load applied at once, which the fastest branches show
TURN_DECADES = 5  # the same after a triangle turns around, on a third as many points
KINK = 1e-4  # of the duration of a ramp; a hold after it has rows from such a time on
COINCIDENCE = 1e-6  # of the time since a piece began
EVEN_ROWS = 100  # rows of a ramp or half a cycle, evenly spaced in what is driven


class Course(Protocol):
    """A piece of a history as spans; arrays are of shape (cases,) or, for asked cases and spans, (k,)."""

    @property
    def controls(self) -> Controls:
        """What is prescribed."""

    @property
    def spans(self) -> int:
        """How many, some of which may last for no time."""

    @property
    def start(self) -> Floats:
        """Prescribed values (3, cases) at the beginning."""

    @property
    def end(self) -> Floats:
        """Prescribed values (3, cases) at the end."""

    @property
    def duration(self) -> Floats:
        """Of the whole course, in s (cases,)."""

    @property
    def cycles(self) -> int:
        """How often the load goes around."""

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The load of spans (k,) of cases (k,), and how long they last (k,)."""

    def smooth(self, index: Cases) -> NDArray[np.bool_]:
        """Whether spans (k,) go on smoothly from the span before."""

    def take(self, cases: Cases) -> Self:
        """The same for some of the cases."""

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """Times (cases, rows) of output since the beginning, or NaN, in full for the cycles `kept` (counted from 0).
        A time of 0 is asked for where the load jumps to its beginning. `before` (cases,) is how long what went before moved the
        load, 0 if it jumped.
        """

    def rises(self, kept: Cases) -> Floats:
        """Times (cases, k) since the beginning at which the size of the voltage begins to rise, in the cycles `kept`; or NaN."""


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A straight line from `start` to `end` (3, cases) within `duration` (cases,). Its spans end where the voltage passes 0."""

    controls: Controls
    start: Floats
    end: Floats
    duration: Floats
    spans: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "spans", 2 if np.any(self.start[2] * self.end[2] < 0) else 1)

    @property
    def cycles(self) -> int:
        """None."""
        return 0

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The line, or its part before (0) or after (1) it passes 0 V."""
        start, end, lasts = self.start[:, cases], self.end[:, cases], self.duration[cases]
        if self.spans == 1:
            return Load.between(self.controls, start, end, lasts), lasts
        share = _whole(np.where(start[2] * end[2] < 0, start[2] / np.where(start[2] == end[2], 1.0, start[2] - end[2]), 1.0))
        middle = start + share * (end - start)
        middle[2, start[2] * end[2] < 0] = 0.0
        first = index == 0
        start, end = np.where(first, start, middle), np.where(first, middle, end)
        lasts = lasts * np.where(first, share, 1 - share)
        return Load.between(self.controls, start, end, lasts), lasts

    def smooth(self, index: Cases) -> NDArray[np.bool_]:
        """A line has no kink."""
        return index > 0

    def take(self, cases: Cases) -> Line:
        """The same for some of the cases."""
        return Line(self.controls, self.start[:, cases], self.end[:, cases], self.duration[cases])

    @property
    def moves(self) -> NDArray[np.bool_]:
        """In which cases (cases,) it goes anywhere."""
        return np.asarray(np.any(self.start != self.end, axis=0))

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """Log-spaced, and on a ramp evenly spaced, too."""
        if not np.any(self.duration > 0):
            return np.zeros((self.duration.size, 1))
        duration = np.where(self.duration > 0, self.duration, 1.0)
        finest = np.ceil(np.log10(duration) - np.log10(KINK * np.where(before > 0, before, 1.0)))
        soon = np.clip(finest, HOLD_DECADES, JUMP_DECADES)
        # a voltage that begins to rise sets the clock of the pull-in time scale to 0
        ramp_decades = JUMP_DECADES if np.any(self.start[2] != self.end[2]) else RAMP_DECADES
        decades = np.where(self.moves, ramp_decades, np.where(before > 0, soon, JUMP_DECADES))
        after = np.arange(int(decades.max()) * per_decade + 1) / per_decade - decades[:, None]
        spaced = 10.0 ** np.where(after <= 0, np.round(after, 12), np.nan)
        ramp = _merged(np.linspace(0.0, 1.0, EVEN_ROWS + 1)[1:], np.logspace(-ramp_decades, 0, ramp_decades * per_decade + 1))
        fractions = np.full((duration.size, max(spaced.shape[1], ramp.size)), np.nan)
        fractions[:, : spaced.shape[1]] = spaced
        fractions[self.moves] = np.append(ramp, np.full(fractions.shape[1] - ramp.size, np.nan))
        return np.asarray(self.duration[:, None] * fractions)

    def rises(self, kept: Cases) -> Floats:
        """At its beginning, or where it passes 0 V."""
        start, end = self.start[2], self.end[2]
        passes = start * end < 0
        share = np.where(passes, start / np.where(start == end, 1.0, start - end), 0.0)
        return np.where(passes | (np.abs(end) > np.abs(start)), share * self.duration, np.nan)[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class Cycles:
    """Cycles from `low` to `high` and back in a `period` in s, all (cases,), of a sine or a triangle, along the `driven` rows (3,)
    of the load; the other rows stay at their `base` (3, cases).

    `edges` (m + 1, cases) are the phases, from 0 to 1, at which the spans of a cycle begin and end: a triangle's kinks, and where
    the size of a voltage begins to rise.
    """

    controls: Controls
    base: Floats
    driven: NDArray[np.bool_]
    low: Floats
    high: Floats
    period: Floats
    cycles: int
    triangle: bool
    edges: Floats

    @classmethod
    def of(
        cls,
        controls: Controls,
        base: Floats,
        driven: NDArray[np.bool_],
        wave: tuple[Floats, Floats, Floats],
        cycles: int,
        triangle: bool,
    ) -> Cycles:
        """Cycles of these low and high values and periods."""
        low, high, period = wave
        zero, one = np.zeros_like(low), np.ones_like(low)
        edges = [zero, 0.5 * one, one] if triangle else [zero, one]
        if driven[2]:
            # share of the swing, and then of the period, after which the voltage is nearest to 0
            share = _whole(np.clip(np.where(high == low, 0.0, -low / np.where(high == low, 1.0, high - low)), 0.0, 1.0))
            rises = 0.5 * share if triangle else np.arccos(1 - 2 * share) / (2 * np.pi)
            edges = [zero, rises, 0.5 * one, 1 - rises, one] if triangle else [zero, rises, 1 - rises, one]
        return cls(controls, base, driven, low, high, period, cycles, triangle, np.array(edges))

    @property
    def spans(self) -> int:
        """In all cycles together."""
        return self.cycles * (len(self.edges) - 1)

    @property
    def start(self) -> Floats:
        """The low value."""
        return np.where(self.driven[:, None], self.low, self.base)

    @property
    def end(self) -> Floats:
        """The low value."""
        return self.start

    @property
    def duration(self) -> Floats:
        """Of all cycles."""
        return self.period * self.cycles

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """Parts of a cycle; each cycle is like the first."""
        part = index % (len(self.edges) - 1)
        begin, end = self.edges[part, cases], self.edges[part + 1, cases]
        low, high, period = self.low[cases], self.high[cases], self.period[cases]
        swing, lasts = np.where(self.driven[:, None], 0.5 * (high - low), 0.0), period * (end - begin)
        base = np.where(self.driven[:, None], low, self.base[:, cases])
        if self.triangle:
            up = 1 - np.abs(2 * np.array((begin, end)) - 1)
            return Load.between(self.controls, base + 2 * swing * up[0], base + 2 * swing * up[1], lasts), lasts
        angle = 2 * np.pi * begin
        start = base + swing * (1 - np.cos(angle))
        return Load(self.controls, start, np.zeros_like(start), Wave(swing, angle, 2 * np.pi / period)), lasts

    def smooth(self, index: Cases) -> NDArray[np.bool_]:
        """A triangle has kinks where it turns around."""
        part = index % (len(self.edges) - 1)
        return (index > 0) & (~np.isin(part, (0, (len(self.edges) - 1) // 2)) if self.triangle else True)

    def take(self, cases: Cases) -> Cycles:
        """The same for some of the cases."""
        some = {name: getattr(self, name)[cases] for name in ("low", "high", "period")}
        return replace(self, base=self.base[:, cases], edges=self.edges[:, cases], **some)

    def rises(self, kept: Cases) -> Floats:
        """In each cycle where the voltage is nearest to 0, on its way up and down."""
        if not self.driven[2]:
            return np.full((self.period.size, 1), np.nan)
        up = self.edges[1]
        down = np.where((up > 0) & (up < 0.5), 1 - up, np.nan)
        return np.asarray(self.period[:, None] * np.concatenate([kept + phase[:, None] for phase in (up, down)], axis=1))

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """Evenly spaced in phase in the cycles `kept`, and log-spaced after each turn, or the beginning of a sine."""
        # as a ramp of the voltage, the first cycle sets the clock of the pull-in time scale to 0
        decades = JUMP_DECADES if self.driven[2] else RAMP_DECADES
        even, spaced = np.linspace(0.0, 1.0, 2 * EVEN_ROWS + 1), np.logspace(-decades, 0, decades * per_decade + 1)
        if self.triangle:  # which shows the fast branches after each turn
            turned = 0.5 * np.logspace(-TURN_DECADES, 0, TURN_DECADES * max(per_decade // 3, 1) + 1)
            even = _merged(even, np.concatenate((turned, 0.5 + turned)))
        phases = np.concatenate(([0.0], *(cycle + even for cycle in kept), [float(self.cycles)]))
        phases = phases[np.diff(phases, prepend=-1.0) > 0]  # one cycle ends where the next begins
        if kept.size and kept[0] == 0:
            phases = _merged(phases, spaced)
        return np.asarray(self.period[:, None] * phases)


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Straight lines through points of `time` in s and `value`, both (points,), the first at time 0, along the `driven` rows (3,)
    of the load, where the value is multiplied by a `scale` (cases,); the other rows stay at their `base` (3, cases).
    """

    controls: Controls
    base: Floats
    driven: NDArray[np.bool_]
    time: Floats
    value: Floats
    scale: Floats

    @classmethod
    def of(cls, controls: Controls, base: Floats, driven: NDArray[np.bool_], time: Floats, value: Floats, scale: Floats) -> Chain:
        """The chain through these points, with points more where a voltage passes 0."""
        through = np.flatnonzero(value[:-1] * value[1:] < 0) if driven[2] else np.zeros(0, dtype=np.intp)
        if through.size:
            before, after = value[through], value[through + 1]
            lasts = time[through + 1] - time[through]
            time = np.insert(time, through + 1, time[through] + before / (before - after) * lasts)
            value = np.insert(value, through + 1, 0.0)
        return cls(controls, base, driven, time, value, scale)

    @property
    def spans(self) -> int:
        """Between the points."""
        return self.time.size - 1

    @property
    def cycles(self) -> int:
        """None that are known."""
        return 0

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

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """From one point to the next."""
        base, driven, scale = self.base[:, cases], self.driven[:, None], self.scale[cases]
        lasts = self.time[index + 1] - self.time[index]
        start, end = (np.where(driven, self.value[at] * scale, base) for at in (index, index + 1))
        return Load.between(self.controls, start, end, lasts), lasts

    def smooth(self, index: Cases) -> NDArray[np.bool_]:
        """Every point is a kink."""
        return np.zeros(index.shape, dtype=bool)

    def take(self, cases: Cases) -> Chain:
        """The same for some of the cases."""
        return replace(self, base=self.base[:, cases], scale=self.scale[cases])

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


def _whole(share: Floats) -> Floats:
    """A share of a piece, none or all of it where it is that but for rounding."""
    return np.where(share < 1e-12, 0.0, np.where(share > 1 - 1e-12, 1.0, share))


def _merged(rows: Floats, more: Floats) -> Floats:
    """Ascending `rows`, and those of `more` between them that do not coincide with one but for rounding."""
    after = np.searchsorted(rows, more)
    below, above = rows[np.maximum(after - 1, 0)], rows[np.minimum(after, rows.size - 1)]
    apart = np.minimum(np.abs(more - below), np.abs(more - above)) > COINCIDENCE * more
    return np.sort(np.concatenate((rows, more[apart])))
