"""Pieces of a history: what a step prescribes, through smooth spans of load.

Rows of prescribed values (3, cases) are the stretch or the nominal stress in Pa of axes 1 and 2, and the nominal field V/L_3 in
V/m. NaN stands for the value that is present when the piece begins, which is known only once the films have come to it; `begin`
gives the piece with this value. A new form of load is a further class in the union `Piece`.

A piece has the number `step` (from 0) of the step of the history to which it belongs, its `controls`, its `targets` (values
(3, cases) that bound all values after its start, the first one first), `at_once` (whether it may begin with a jump to the first
target), and `take` to select cases. Pieces of a programme also have the `drive` of the electrodes, None for the present one, and
the number `lap` (from 1) of the repetition to which they belong, 0 outside of repetitions.

Once it has begun, it has its `start`, `end` and `duration`, the number of its `spans` and of its `cycles`; `span` gives the load
and the duration of the spans `index` of `cases` (k,), and `smooth` whether there is no kink at the beginning of a span. No step
through it may take more than its `longest_step` (cases,) in s, if there is one. `rows` are suitable times of output, and `rises`
the times at which the magnitude of the voltage begins to rise; both are (cases, k) in s since the piece began, or NaN.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dielast.mechanics.cases import spread
from dielast.mechanics.electric import Drive
from dielast.mechanics.line import EVEN_ROWS, JUMP_DECADES, RAMP_DECADES, Line, merged, whole
from dielast.mechanics.load import Waveform
from dielast.mechanics.span import Control, Controls, Load, Wave
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats

LEAST_STEPS = 16  # steps in a cycle of a sine, 8 in a cycle of its square, which drives a film under voltage
TURN_DECADES = 5  # of log-spaced rows after a triangle turns around, with a third of the usual rows per decade


def rows_after_turn(per_decade: int) -> Floats:
    """Suitable times of output after the load has turned around, as parts of the time until it does so again."""
    return np.logspace(-TURN_DECADES, 0, TURN_DECADES * max(per_decade // 3, 1) + 1)


@dataclass(frozen=True, slots=True, eq=False)
class Cycles(ByCase):
    """Cycles from `low` to `high` (3, cases) and back in a `period` (cases,) in s, of a sine or a triangle.

    `edges` (m + 1, cases) are the phases, from 0 to 1, at which the spans of a cycle begin and end: the kinks of a triangle, and,
    if `electrical`, the phases at which the magnitude of the voltage begins to rise, `rising` (2, cases); where a row with an aim
    passes 0, they are `divided` there. Each row is ahead of the cycle by its `lead` (3, cases), a part of the period. Rows with an
    `aim` (3, cases) that is not NaN go straight to it meanwhile, from their low, which is their high.
    """

    controls: Controls
    low: Floats
    high: Floats
    period: Floats
    cycles: int
    triangle: bool
    electrical: bool
    edges: Floats
    rising: Floats
    lead: Floats | None = None
    aim: Floats | None = None
    divided: bool = False
    step: int = 0
    drive: Drive | None = None
    lap: int = 0

    @classmethod
    def of(
        cls,
        controls: Controls,
        low: Floats,
        high: Floats,
        wave: Waveform,
        lead: Floats | None = None,
        aim: Floats | None = None,
    ) -> Cycles:
        """Cycles between these values (3, cases), with the period, the number and the shape of a waveform."""
        period = spread(wave.period, "period", low.shape[1])
        triangle, electrical = wave.shape == "triangle", not np.isnan(low[2]).any()
        zero, one = np.zeros_like(period), np.ones_like(period)
        rises = np.full_like(period, np.nan)
        edges = [zero, 0.5 * one, one] if triangle else [zero, one]
        if electrical:
            # fraction of the swing, and then of the period, after which the voltage is closest to 0
            swing = high[2] - low[2]
            share = whole(np.clip(np.where(swing == 0, 0.0, -low[2] / np.where(swing == 0, 1.0, swing)), 0.0, 1.0))
            rises = 0.5 * share if triangle else np.arccos(1 - 2 * share) / (2 * np.pi)
            edges = [zero, rises, 0.5 * one, 1 - rises, one] if triangle else [zero, rises, 1 - rises, one]
        rising = np.array((rises, np.where((rises > 0) & (rises < 0.5), 1 - rises, np.nan)))
        if lead is not None:
            rising = (rising - lead[2]) % 1.0
            kinks = [(part - row) % 1.0 for row in lead for part in (0.0, 0.5)] if triangle else []
            inner = np.sort(np.array([np.where(np.isnan(phase), 1.0, phase) for phase in (*rising, *kinks)]), axis=0)
            edges = [zero, *inner, one]
        return cls(controls, low, high, period, wave.cycles, triangle, electrical, np.array(edges), rising, lead, aim)

    def begin(self, present: Floats) -> Cycles:
        """The cycles of films with the `present` values (3, cases)."""
        low, high = (np.where(np.isnan(values), present, values) for values in (self.low, self.high))
        begun = replace(self, low=low, high=high)
        if not np.any(begun.passes):
            return begun
        # in every cycle a span ends at the phase at which, in one of them, the voltage passes 0
        passed = np.where(begun.passes, begun.share_before_zero * self.cycles % 1.0, 1.0)
        return replace(begun, edges=np.sort(np.concatenate((self.edges, passed[None])), axis=0), divided=True)

    @property
    def passes(self) -> Flags:
        """Whether (cases,) a voltage or a charge passes 0 on its way to its aim."""
        return np.asarray(self.start[2] * self.end[2] < 0) if self.aim is not None else np.zeros(self.period.shape, dtype=bool)

    @property
    def share_before_zero(self) -> Floats:
        """The fraction (cases,) of all cycles after which the electrical row passes 0, where it does on its way to an aim."""
        start, end = self.start[2], self.end[2]
        return np.where(self.passes, start / np.where(start == end, 1.0, start - end), 0.0)

    @property
    def targets(self) -> tuple[Floats, ...]:
        """The values at which it turns around, after the first ones, and those that it goes to."""
        turns = (self.low, self.high) if self.lead is None else (self.start, self.low, self.high)
        return turns if self.aim is None else (*turns, self.end)

    @property
    def at_once(self) -> Flags:
        """True (cases,): the load may jump to its first value."""
        return np.ones(self.period.shape, dtype=bool)

    @property
    def spans_of_cycle(self) -> int:
        """The number of spans in a cycle."""
        return len(self.edges) - 1

    @property
    def spans(self) -> int:
        """The number of spans in all cycles."""
        return self.cycles * self.spans_of_cycle

    @property
    def start(self) -> Floats:
        """The values (3, cases) at the beginning, which are the low ones unless a row is ahead."""
        if self.lead is None:
            return self.low
        up = self._up(self.lead) if self.triangle else 0.5 * (1 - np.cos(2 * np.pi * self.lead))
        return np.asarray(self.low + (self.high - self.low) * up)

    @property
    def end(self) -> Floats:
        """The values (3, cases) at the end, which are those at the beginning but for the rows with an aim."""
        return self.start if self.aim is None else np.where(np.isnan(self.aim), self.start, self.aim)

    @staticmethod
    def _up(phase: Floats) -> Floats:
        """The height of a triangle at phases, from 0 to 1."""
        return np.asarray(1 - np.abs(2 * (phase % 1.0) - 1))

    @property
    def duration(self) -> Floats:
        """The duration (cases,) of all cycles in s."""
        return self.period * self.cycles

    @property
    def longest_step(self) -> Floats | None:
        """A fraction (cases,) of the period of a sine in s; None for a triangle, whose straight lines are spans."""
        return None if self.triangle else self.period / LEAST_STEPS

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The load and the durations (k,) in s of spans; all cycles are equal, but for the rows with an aim."""
        load, lasts = self._span(cases, index % self.spans_of_cycle)
        if self.aim is None:
            return load, lasts
        ahead, turns = (self.end - self.start)[:, cases], index // self.spans_of_cycle
        before = (turns + self.edges[index % self.spans_of_cycle, cases]) / self.cycles
        return replace(load, start=load.start + before * ahead, rate=load.rate + ahead / self.duration[cases]), lasts

    def _span(self, cases: Cases, part: Cases) -> tuple[Load, Floats]:
        """The load and the durations (k,) in s of the spans `part` (k,) of a cycle, as if there were no aim."""
        period = self.period[cases]
        begin, end = self.edges[part, cases], self.edges[part + 1, cases]
        low, high = (values.take(cases, axis=-1) for values in (self.low, self.high))
        swing, lasts = 0.5 * (high - low), period * (end - begin)
        if self.triangle:
            up = 1 - np.abs(2 * np.array((begin, end)) - 1)
            if self.lead is not None:
                up = np.array([self._up(phase + self.lead[:, cases]) for phase in (begin, end)])
            return Load.between(self.controls, low + 2 * swing * up[0], low + 2 * swing * up[1], lasts), lasts
        angle = 2 * np.pi * (begin if self.lead is None else begin + self.lead[:, cases])
        start = low + swing * (1 - np.cos(angle))
        return Load(self.controls, start, np.zeros_like(start), Wave(swing, angle, 2 * np.pi / period)), lasts

    def smooth(self, index: Cases) -> Flags:
        """Whether (k,) there is no kink: a triangle has kinks where it turns around."""
        if self.triangle and (self.lead is not None or self.divided):
            return np.zeros(index.shape, dtype=bool)
        part = index % self.spans_of_cycle
        return (index > 0) & (~np.isin(part, (0, self.spans_of_cycle // 2)) if self.triangle else True)

    def rises(self, kept: Cases) -> Floats:
        """The times (cases, k) in the cycles `kept` at which the voltage is closest to 0, on the way up and on the way down; where
        it has an aim, the beginning or where it passes 0.
        """
        if not self.electrical:
            grows = self.passes | (np.abs(self.end[2]) > np.abs(self.start[2]))
            return np.where(grows, self.share_before_zero * self.duration, np.nan)[:, None]
        return np.asarray(self.period[:, None] * np.concatenate([kept + phase[:, None] for phase in self.rising], axis=1))

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """Times (cases, k), evenly spaced in the cycles `kept`, log-spaced after each turn of a triangle and after the start."""
        # the first cycle of a voltage, as a ramp, restarts the clock of the pull-in time scale
        decades = JUMP_DECADES if self.electrical else RAMP_DECADES
        phases_of_rows, spaced = np.linspace(0.0, 1.0, 2 * EVEN_ROWS + 1), np.logspace(-decades, 0, decades * per_decade + 1)
        if self.triangle:  # fast branches relax after each turn
            turned = 0.5 * rows_after_turn(per_decade)
            phases_of_rows = merged(phases_of_rows, np.concatenate((turned, 0.5 + turned)))
        phases = np.concatenate(([0.0], *(cycle + phases_of_rows for cycle in kept), [float(self.cycles)]))
        phases = phases[np.diff(phases, prepend=-1.0) > 0]  # one cycle ends where the next begins
        if kept.size and kept[0] == 0:
            phases = merged(phases, spaced)
        return np.asarray(self.period[:, None] * phases)


@dataclass(frozen=True, slots=True, eq=False)
class Chain(ByCase):
    """Straight lines through points of `time` in s (points,) and `value` (points, 3), the first at time 0, with one span for each
    line.

    The load is `base` + `scale` times the value, both (3, cases).
    """

    controls: Controls
    base: Floats
    scale: Floats
    time: Floats
    value: Floats
    step: int = 0
    drive: Drive | None = None
    lap: int = 0
    cycles: ClassVar[int] = 0
    longest_step: ClassVar[None] = None

    @classmethod
    def of(cls, controls: Controls, base: Floats, scale: Floats, time: Floats, value: Floats) -> Chain:
        """The chain through these points, with a point inserted wherever a voltage changes its sign."""
        voltage = value[:, 2]
        sign_changes = np.flatnonzero(voltage[:-1] * voltage[1:] < 0) if scale[2].any() else np.zeros(0, dtype=np.intp)
        if sign_changes.size:
            before, after = value[sign_changes], value[sign_changes + 1]
            lasts = time[sign_changes + 1] - time[sign_changes]
            share = before[:, 2] / (before[:, 2] - after[:, 2])
            middle = before + share[:, None] * (after - before)
            middle[:, 2] = 0.0
            time = np.insert(time, sign_changes + 1, time[sign_changes] + share * lasts)
            value = np.insert(value, sign_changes + 1, middle, axis=0)
        return cls(controls, base, scale, time, value)

    def take(self, cases: Cases) -> Chain:
        """The selected cases (k,), which share all points."""
        return replace(self, base=self.base[:, cases], scale=self.scale[:, cases])

    def begin(self, present: Floats) -> Chain:
        """The lines of films with the `present` values (3, cases)."""
        return replace(self, base=np.where(np.isnan(self.base), present, self.base))

    @property
    def targets(self) -> tuple[Floats, Floats, Floats]:
        """The first values, the smallest and the largest."""
        return self.start, self._at(self.value.min(axis=0)), self._at(self.value.max(axis=0))

    @property
    def at_once(self) -> Flags:
        """True (cases,): the load may jump to its first value."""
        return np.ones(self.base.shape[1], dtype=bool)

    def _at(self, value: Floats) -> Floats:
        """The load (3, cases) at a `value` (3,) or (cases, 3) of the points."""
        return np.asarray(self.base + (value[:, None] if value.ndim == 1 else value.T) * self.scale)

    @property
    def spans(self) -> int:
        """The number of intervals between points."""
        return self.time.size - 1

    @property
    def start(self) -> Floats:
        """The values (3, cases) at the first point."""
        return self._at(self.value[0])

    @property
    def end(self) -> Floats:
        """The values (3, cases) at the last point."""
        return self._at(self.value[-1])

    @property
    def duration(self) -> Floats:
        """The time (cases,) in s from the first to the last point."""
        return np.full(self.base.shape[1], self.time[-1])

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The straight lines from the points `index` (k,) to the next, and their durations (k,) in s."""
        piece, lasts = self.take(cases), self.time[index + 1] - self.time[index]
        start, end = (piece._at(self.value[at]) for at in (index, index + 1))
        return Load.between(self.controls, start, end, lasts), lasts

    def smooth(self, index: Cases) -> Flags:
        """False (k,): every point is a kink."""
        return np.zeros(index.shape, dtype=bool)

    def rises(self, kept: Cases) -> Floats:
        """NaN (cases, 1): rises are not searched for in a table, as a measured voltage has too many of them."""
        return np.full((self.base.shape[1], 1), np.nan)

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """The times (cases, k) of all points, and times between them so dense that neither value nor time advances by more than
        1/`EVEN_ROWS` of its range from one row to the next.
        """
        value, lasts, duration = self.value[:, self.scale.any(axis=1)], np.diff(self.time), float(self.time[-1])
        change, value_range = np.abs(np.diff(value, axis=0)), np.ptp(value, axis=0)
        share = np.maximum(np.max(change / np.where(value_range > 0, value_range, 1.0), axis=1, initial=0.0), lasts / duration)
        between = np.maximum(np.ceil(EVEN_ROWS * share * (1 - 1e-9)).astype(np.intp), 1)
        span = np.repeat(np.arange(between.size), between)
        part = (np.arange(span.size) - np.repeat(np.cumsum(between) - between, between)) / between[span]
        rows = np.append(self.time[span] + part * lasts[span], duration)
        return np.broadcast_to(rows, (self.base.shape[1], rows.size))


Piece = Line | Cycles | Chain


def loads_axis_1_alone(piece: Piece) -> Flags:
    """Whether (cases,) a piece loads films along axis 1 alone, if neither axis 2 nor the electrodes have been loaded before."""
    across = np.nan_to_num([rows[1:] for rows in piece.targets])
    return np.asarray(~across.any(axis=(0, 1)) & (piece.controls[1] is Control.STRESS))
