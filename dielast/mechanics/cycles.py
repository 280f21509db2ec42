"""Cycles of a waveform as a course of smooth spans."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dielast.mechanics.cases import spread
from dielast.mechanics.line import EVEN_ROWS, JUMP_DECADES, RAMP_DECADES, Targets, merged, whole
from dielast.mechanics.load import Waveform
from dielast.mechanics.span import Controls, Load, Wave
from dielast.numerics.columns import Cases, Flags, Floats

LEAST_STEPS = 16  # in a cycle of a sine, 8 in a cycle of its square, to which a film under voltage responds
TURN_DECADES = 5  # of log-spaced rows after a triangle turns around, on a third as many points as elsewhere


@dataclass(frozen=True, slots=True, eq=False)
class Cycles:
    """Cycles from `low` to `high` and back in a `period` in s, all (cases,), of a sine or a triangle, along the `driven` rows (3,)
    of the load; the other rows stay at their `base` (3, cases), NaN for a value that is the present one when the course begins.

    `edges` (m + 1, cases) are the phases, from 0 to 1, at which the spans of a cycle begin and end: a triangle's kinks, and where
    the size of a voltage begins to rise.
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
        """The cycles of a waveform, its values multiplied by a `scale` (cases,)."""
        low, high, period = (spread(getattr(wave, name), name, scale.size) for name in ("low", "high", "period"))
        low, high, triangle = low * scale, high * scale, wave.shape == "triangle"
        zero, one = np.zeros_like(low), np.ones_like(low)
        edges = [zero, 0.5 * one, one] if triangle else [zero, one]
        if driven[2]:
            # share of the swing, and then of the period, after which the voltage is nearest to 0
            share = whole(np.clip(np.where(high == low, 0.0, -low / np.where(high == low, 1.0, high - low)), 0.0, 1.0))
            rises = 0.5 * share if triangle else np.arccos(1 - 2 * share) / (2 * np.pi)
            edges = [zero, rises, 0.5 * one, 1 - rises, one] if triangle else [zero, rises, 1 - rises, one]
        return cls(controls, base, driven, low, high, period, wave.cycles, triangle, np.array(edges), origin)

    def begin(self, present: Floats) -> Cycles:
        """The course from the `present` values (3, cases) on."""
        return replace(self, base=np.where(np.isnan(self.base), present, self.base))

    def take(self, cases: Cases) -> Cycles:
        """The same for some of the cases."""
        values = {name: getattr(self, name)[cases] for name in ("low", "high", "period")}
        return replace(self, base=self.base[:, cases], edges=self.edges[:, cases], **values)

    @property
    def target(self) -> Targets:
        """The low value, and what the other rows are held at."""
        return targets(self.start)

    @property
    def at_once(self) -> Flags:
        """It jumps to the low value, if it is not there."""
        return np.ones(self.low.size, dtype=bool)

    def extremes(self) -> tuple[Floats, ...]:
        """The least and the largest value (cases,)."""
        return np.minimum(self.low, self.high), np.maximum(self.low, self.high)

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

    @property
    def longest_step(self) -> Floats:
        """A share of a sine's period; the lines of a triangle are spans."""
        return np.full_like(self.period, np.inf) if self.triangle else self.period / LEAST_STEPS

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

    def smooth(self, index: Cases) -> Flags:
        """A triangle has kinks where it turns around."""
        part = index % (len(self.edges) - 1)
        return (index > 0) & (~np.isin(part, (0, (len(self.edges) - 1) // 2)) if self.triangle else True)

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
            even = merged(even, np.concatenate((turned, 0.5 + turned)))
        phases = np.concatenate(([0.0], *(cycle + even for cycle in kept), [float(self.cycles)]))
        phases = phases[np.diff(phases, prepend=-1.0) > 0]  # one cycle ends where the next begins
        if kept.size and kept[0] == 0:
            phases = merged(phases, spaced)
        return np.asarray(self.period[:, None] * phases)


def targets(begins: Floats) -> Targets:
    """The values (3, cases) with which a path begins, None for a row that stays as it is (NaN)."""
    first, second, third = (None if np.isnan(row).any() else row for row in begins)
    return first, second, third
