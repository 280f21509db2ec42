"""A load history run through the solver piece by piece: what `relax`, `creep` and every other simulation have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast import kinematics
from dielast.errors import InputError
from dielast.gent import Floats
from dielast.integrate import Status, Stride, integrate
from dielast.jump import jump
from dielast.load import Control, Piece, Ramp
from dielast.point import LoadedPoints, Points
from dielast.symmetric import EQUIBIAXIAL, UNIAXIAL, SymmetricPoints, Symmetry

REASONS = {
    Status.STEP_VANISHED: "the rates grow beyond all bounds",
    Status.TOO_MANY_STEPS: "the integration takes too many steps",
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one case ended: `completed`, or at `time` (s) because of `reason`."""

    completed: bool
    time: float
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """Where all cases stand: x (2, n, cases), Lambda and nominal stress (2, cases), nominal field and time (cases,)."""

    internal: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    field: Floats
    time: Floats

    @classmethod
    def rest(cls, points: Points) -> Condition:
        """Undeformed and relaxed at time 0."""
        springs, cases = points.rate.shape
        return cls(np.zeros((2, springs, cases)), np.zeros((2, cases)), np.zeros((2, cases)), np.zeros(cases), np.zeros(cases))

    def prescribed(self, controls: tuple[Control, Control]) -> Floats:
        """The present values (3, cases) of what a load with these controls prescribes."""
        stretched = np.array([[control is Control.STRETCH] for control in controls])
        values = np.where(stretched, np.exp(0.5 * self.log_squared_stretch), self.nominal_stress)
        return np.concatenate((values, self.field[None]))


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """A history at output times: `time` (cases, times), Lambda and nominal stress (2, cases, times), and on request x, shape
    (2, n, cases, times). What lies after a case's failure is NaN, and its `outcome` says so.
    """

    time: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    internal: Floats | None
    outcome: tuple[Outcome, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Recorder:
    """Writes the dense output at `relative` times (cases, times) since the piece began into `border` (4, cases, times) and x.

    Times outside the piece are NaN. Observes the stepper.
    """

    relative: Floats
    border: Floats
    internal: Floats | None

    def start(self, condition: Condition) -> None:
        """Write what holds when the piece begins."""
        case, column = np.nonzero(self.relative == 0)
        self.border[:2, case, column] = condition.log_squared_stretch[:, case]
        self.border[2:, case, column] = condition.nominal_stress[:, case]
        if self.internal is not None:
            self.internal[:, :, case, column] = condition.internal[:, :, case]

    def __call__(self, stride: Stride) -> None:
        """Write what lies within the step."""
        columns = np.flatnonzero(stride.accepted)
        wanted = self.relative[stride.cases[columns]]
        hit, column = np.nonzero((wanted > stride.time[columns, None]) & (wanted <= stride.until[columns, None]))
        if not hit.size:
            return
        moment, pooled = wanted[hit, column], columns[hit]
        fraction = (moment - stride.time[pooled]) / stride.step[pooled]
        system, case = stride.system, stride.cases[pooled]
        assert isinstance(system, LoadedPoints | SymmetricPoints)
        rows = slice(-2, None) if self.internal is None else slice(None)
        state = stride.dense(rows, pooled, fraction)
        driven = system.load.take(pooled).value(moment)
        log_squared, nominal = system.membrane(state, driven)
        self.border[:2, case, column] = log_squared
        self.border[2:, case, column] = nominal
        if self.internal is not None:
            self.internal[:, :, case, column] = system.internal(state)


def run(
    points: Points,
    pieces: Sequence[Piece],
    *,
    times: Floats | None = None,
    points_per_decade: int = 30,
    rtol: float = 1e-6,
    internal: bool = False,
) -> Record:
    """Run `pieces` from rest. Output at `times` (cases, k) in s, or logarithmically from the start of every piece to its end.

    At the very moment of a load applied at once, given times show what was before, except at time 0. Raises `InputError` for loads out of reach,
    a rate of the wrong sign, or times outside the history.
    """
    check_reach(points, pieces)
    symmetry = symmetry_of(pieces)
    condition = Condition.rest(points)
    cases = condition.time.size
    outcome: list[Outcome | None] = [None] * cases
    recorders: list[Recorder] = []
    starts: list[Floats] = []
    spans = np.zeros(cases)
    for index, piece in enumerate(pieces):
        present = condition.prescribed(piece.controls)
        try:
            end, duration = piece.resolve(present)
        except InputError as error:
            raise InputError(f"step {index}: {error}") from None
        alive = np.array([reached is None for reached in outcome])
        start_of_piece = condition.time
        at_once = alive & (duration == 0) & np.any(end != present, axis=0)
        if at_once.any():
            condition, failed = _apply(points, piece, end, condition, at_once)
            for case in np.flatnonzero(failed):
                outcome[case] = Outcome(False, float(condition.time[case]), "no stable equilibrium with the load applied at once")
            alive &= ~failed
        if times is None:
            relative = duration[:, None] * log_fractions(points, duration, spans, at_once, points_per_decade)
        else:
            relative = _within(times, start_of_piece, duration, first=index == 0, last=index == len(pieces) - 1)
        recorder = Recorder(
            np.where(alive[:, None], relative, np.nan),
            np.full((4, *relative.shape), np.nan),
            np.full((*condition.internal.shape, relative.shape[1]), np.nan) if internal else None,
        )
        recorder.start(condition)
        ramp = Ramp.between(piece.controls, np.where(at_once, end, present), end, duration)
        condition, status, reached = _traverse(points, ramp, symmetry, condition, np.where(alive, duration, 0.0), rtol, recorder)
        for case in np.flatnonzero(status):
            moment = float(reached[case])
            outcome[case] = Outcome(False, moment, REASONS[Status(status[case])])
            recorder.border[:, case, start_of_piece[case] + relative[case] > moment] = np.nan
        recorders.append(recorder)
        starts.append(start_of_piece[:, None] + relative)
        spans = duration
    ended = tuple(each or Outcome(True, float(time)) for each, time in zip(outcome, condition.time, strict=True))
    if times is None:
        columns = np.concatenate(starts, axis=1)
        border = np.concatenate([recorder.border for recorder in recorders], axis=2)
        inner = np.concatenate([recorder.internal for recorder in recorders if recorder.internal is not None], axis=3) if internal else None
        return Record(columns, border[:2], border[2:], inner, ended)
    border, inner = recorders[0].border, recorders[0].internal
    for recorder in recorders[1:]:
        chosen = np.isfinite(recorder.relative)
        border[:, chosen] = recorder.border[:, chosen]
        if inner is not None and recorder.internal is not None:
            inner[:, :, chosen] = recorder.internal[:, :, chosen]
    return Record(times, border[:2], border[2:], inner, ended)
