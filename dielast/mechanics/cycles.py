"""Cycles of a waveform as a course of smooth spans."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dielast.mechanics.cases import spread
from dielast.mechanics.line import EVEN_ROWS, JUMP_DECADES, RAMP_DECADES, Targets, merged, whole
from dielast.mechanics.load import Waveform
from dielast.mechanics.span import Controls, Load, Wave
from dielast.numerics.arrays import Cases, Flags, Floats

LEAST_STEPS = 16  # steps in a cycle of a sine, 8 in a cycle of its square, which drives a film under voltage
TURN_DECADES = 5  # of log-spaced rows after a triangle turns around, with a third of the usual rows per decade


@dataclass(frozen=True, slots=True, eq=False)
class Cycles:
    """Cycles from `low` to `high` and back in a `period` in s, all (cases,), of a sine or a triangle.

    They prescribe the `driven` rows (3,) of the load. The other rows keep their `base` (3, cases); NaN stands for the value that is
    present when the course begins. `edges` (m + 1, cases) are the phases, from 0 to 1, at which the spans of a cycle begin and end:
    the kinks of a triangle, and the phases at which the magnitude of a voltage begins to rise.
    """

    controls: Controls
    base: Floats
    driven: Flags
    low: Floats
    high: Floats
    period: Floats
    cycles: int
    triangle: bool
    edges: Floats
    origin: int = 0

    @classmethod
    def of(cls, controls: Controls, base: Floats, driven: Flags, wave: Waveform, scale: Floats, origin: int = 0) -> Cycles:
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

    def begin(self, present: Floats) -> Cycles:
        """The course that starts from the `present` values (3, cases)."""
        return replace(self, base=np.where(np.isnan(self.base), present, self.base))

    def take(self, cases: Cases) -> Cycles:
        """The selected cases (k,)."""
        values = {name: getattr(self, name)[cases] for name in ("low", "high", "period")}
        return replace(self, base=self.base[:, cases], edges=self.edges[:, cases], **values)

    @property
    def target(self) -> Targets:
        """The low value of the driven rows, and the values of the other rows."""
        return targets(self.start)

    @property
    def at_once(self) -> Flags:
        """Whether (cases,) the load may jump to the low value: always."""
        return np.ones(self.low.size, dtype=bool)

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
        return np.where(self.driven[:, None], self.low, self.base)

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


def targets(begins: Floats) -> Targets:
    """The values (3, cases) at the beginning of a waveform or table; None for a row that keeps its present value (NaN)."""
    first, second, third = (None if np.isnan(row).any() else row for row in begins)
    return first, second, third
