"""Straight pieces of load, and the rows of output along them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dielast.base.errors import InputError, located
from dielast.mechanics.cases import of_case
from dielast.mechanics.electric import Drive
from dielast.mechanics.span import Control, Controls, Load
from dielast.numerics.arrays import ByCase, Cases, Flags, Floats

RAMP_DECADES = 3  # of log-spaced rows before the end of a ramp or of the first cycle
HOLD_DECADES = 6  # of log-spaced rows before the end of a hold, at least
JUMP_DECADES = 12  # the same after a load applied at once, to which the fastest branches respond
KINK = 1e-4  # first row of a hold after a ramp, as a fraction of the duration of the ramp
COINCIDENCE = 1e-6  # relative distance in time below which two rows are one
EVEN_ROWS = 100  # rows of a ramp or of half a cycle, evenly spaced in the prescribed quantity


@dataclass(frozen=True, slots=True, eq=False)
class Line(ByCase):
    """A straight line from `start` to `end` (3, cases) within a `duration` (cases,) in s, 0 for a jump; or, if `rate` is not None,
    at this signed rate (cases,) in 1/s or Pa/s of the `paced` quantity, along the axis with the largest change, or of the
    electrical quantity, in V/(m s) or A/m^2.

    A span ends where the voltage passes 0. The start is NaN until the line has begun.
    """

    controls: Controls
    start: Floats
    end: Floats
    duration: Floats
    rate: Floats | None = None
    paced: Control | Drive = Control.STRETCH
    step: int = 0
    drive: Drive | None = None
    lap: int = 0
    cycles: ClassVar[int] = 0
    longest_step: ClassVar[None] = None

    @classmethod
    def to(
        cls,
        controls: Controls,
        targets: tuple[Floats | None, Floats | None, Floats | None],
        duration: Floats,
        rate: Floats | None = None,
        paced: Control | Drive = Control.STRETCH,
        drive: Drive | None = None,
    ) -> Line:
        """The line from the present values to `targets`, each (cases,), or None for a quantity that keeps its value."""
        present = np.full((3, duration.size), np.nan)
        end = np.array([keeps if target is None else target for keeps, target in zip(present, targets, strict=True)])
        return cls(controls, present, end, duration, rate, paced, drive=drive)

    @property
    def targets(self) -> tuple[Floats, ...]:
        """The end alone."""
        return (self.end,)

    @property
    def at_once(self) -> Flags:
        """Whether (cases,) the end is reached at once."""
        return np.asarray((self.duration == 0) & (self.rate is None))

    def begin(self, present: Floats) -> Line:
        """The line that starts from the `present` values (3, cases), or at its end where its duration is 0."""
        end = np.where(np.isnan(self.end), present, self.end)
        duration = self.duration if self.rate is None else self._lasts(self.rate, present, end)
        return replace(self, start=np.where(duration > 0, present, end), end=end, duration=duration)

    def _lasts(self, rate: Floats, present: Floats, end: Floats) -> Floats:
        """The duration (cases,) in s at the `rate` (cases,)."""
        if isinstance(self.paced, Drive):
            move = np.where(np.abs(end[2] - present[2]) <= 1e-12 * np.abs(end[2]), 0.0, end[2] - present[2])
            with located(step=self.step):
                return lasts_at(rate, move, self.paced.value)
        paced = [control is self.paced and not np.isnan(self.end[axis]).any() for axis, control in enumerate(self.controls)]
        moves = (end - present)[:2][paced]
        move = np.take_along_axis(moves, np.argmax(np.abs(moves), axis=0)[None], axis=0)[0]
        # a target equal to the present value but for rounding
        move = np.where(np.abs(move) <= 1e-12 * np.abs(end[:2]).max(axis=0), 0.0, move)
        with located(step=self.step):
            return lasts_at(rate, move, self.paced.value)

    @property
    def spans(self) -> int:
        """The number of spans."""
        return 2 if np.any(self._passes) else 1

    @property
    def _passes(self) -> Flags:
        """Whether (cases,) the voltage passes 0."""
        return np.asarray(self.start[2] * self.end[2] < 0)

    @property
    def _share(self) -> Floats:
        """The fraction (cases,) of the line after which the voltage passes 0."""
        start, end = self.start[2], self.end[2]
        return np.asarray(start / np.where(start == end, 1.0, start - end))

    def span(self, cases: Cases, index: Cases) -> tuple[Load, Floats]:
        """The line, or its part before (index 0) or after (index 1) the voltage passes 0, and its durations (k,) in s."""
        start, end, lasts = self.start[:, cases], self.end[:, cases], self.duration[cases]
        if self.spans == 1:
            return Load.between(self.controls, start, end, lasts), lasts
        passes = self._passes[cases]
        share = whole(np.where(passes, self._share[cases], 1.0))
        middle = start + share * (end - start)
        middle[2, passes] = 0.0
        first = index == 0
        start, end = np.where(first, start, middle), np.where(first, middle, end)
        lasts = lasts * np.where(first, share, 1 - share)
        return Load.between(self.controls, start, end, lasts), lasts

    def smooth(self, index: Cases) -> Flags:
        """True (k,) but for the first span: a line has no kink."""
        return index > 0

    def rows(self, per_decade: int, kept: Cases, before: Floats) -> Floats:
        """Times (cases, k), log-spaced; on a ramp, also evenly spaced."""
        if not np.any(self.duration > 0):
            return np.zeros((self.duration.size, 1))
        moves = np.any(self.start != self.end, axis=0)
        duration = np.where(self.duration > 0, self.duration, 1.0)
        finest = np.ceil(np.log10(duration) - np.log10(KINK * np.where(before > 0, before, 1.0)))
        soon = np.maximum(finest, HOLD_DECADES)
        # a voltage that begins to rise restarts the clock of the pull-in time scale
        ramp_decades = JUMP_DECADES if np.any(self.start[2] != self.end[2]) else RAMP_DECADES
        decades = np.where(moves, ramp_decades, np.where(before > 0, soon, JUMP_DECADES))
        after = np.arange(int(decades.max()) * per_decade + 1) / per_decade - decades[:, None]
        spaced = 10.0 ** np.where(after <= 0, np.round(after, 12), np.nan)
        ramp = merged(np.linspace(0.0, 1.0, EVEN_ROWS + 1)[1:], np.logspace(-ramp_decades, 0, ramp_decades * per_decade + 1))
        fractions = np.full((duration.size, max(spaced.shape[1], ramp.size)), np.nan)
        fractions[:, : spaced.shape[1]] = spaced
        fractions[moves] = np.append(ramp, np.full(fractions.shape[1] - ramp.size, np.nan))
        return np.asarray(self.duration[:, None] * fractions)

    def rises(self, kept: Cases) -> Floats:
        """The time (cases, 1) at which the voltage begins to rise in magnitude: at the start, or where it passes 0; else NaN."""
        grows = self._passes | (np.abs(self.end[2]) > np.abs(self.start[2]))
        return np.where(grows, np.where(self._passes, self._share, 0.0) * self.duration, np.nan)[:, None]


def lasts_at(rate: Floats, move: Floats, quantity: str, unit: str = "") -> Floats:
    """The duration (cases,) in s of a `move` of a `quantity` at a `rate` per s; `InputError` if the rate has the wrong sign."""
    against = move * rate < 0
    if np.any(against):
        case = int(np.argmax(against))
        raise InputError(wrong_way(float(rate[case]), float(move[case]), quantity, unit), case=of_case(case, move.size))
    return np.asarray(np.abs(move / rate))


def wrong_way(rate: float, move: float, quantity: str, unit: str = "") -> str:
    """The message for a `rate` of a `quantity` whose sign differs from that of the `move`, in the `unit` if it is stated."""
    name, pace = (quantity, f"{rate:g} {unit}/s") if unit else ("target", f"{rate:g}")
    to_go = f"{move:+g} {unit} are" if unit else f"{move:+g} of {quantity} is"
    sign = "positive" if move > 0 else "negative"
    return f"rate {pace} leads away from the {name}: {to_go} to go, so the rate must be {sign}"


def whole(share: Floats) -> Floats:
    """The fraction `share`, rounded to 0 or 1 where it differs from these only by rounding."""
    return np.where(share < 1e-12, 0.0, np.where(share > 1 - 1e-12, 1.0, share))


def merged(rows: Floats, more: Floats) -> Floats:
    """Ascending `rows`, with those rows of `more` inserted that do not coincide with one of them."""
    after = np.searchsorted(rows, more)
    below, above = rows[np.maximum(after - 1, 0)], rows[np.minimum(after, rows.size - 1)]
    apart = np.minimum(np.abs(more - below), np.abs(more - above)) > COINCIDENCE * more
    return np.sort(np.concatenate((rows, more[apart])))
