"""A load history run through the solver piece by piece: what `relax`, `creep` and every other simulation have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError
from dielast.gent import Floats
from dielast.integrate import Status, integrate
from dielast.jump import jump
from dielast.load import Control, Piece, Ramp, of_case
from dielast.point import LoadedPoints, Points
from dielast.simulate.output import Condition, Output, Recorder
from dielast.symmetric import EQUIBIAXIAL, UNIAXIAL, SymmetricPoints, Symmetry

REASONS = {
    Status.STEP_VANISHED: "the rates grow beyond all bounds",
    Status.TOO_MANY_STEPS: "the integration takes too many steps",
    Status.STALLED: "the integration comes to a standstill",
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one case ended: `completed` at `time` (s), or broken off there because of `reason`."""

    completed: bool
    time: float
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """A history at output times: `time` (cases, times) in s, Lambda and nominal stress (2, cases, times), and on request x, shape
    (2, n, cases, times). What lies after a case's failure is NaN, and its `outcome` says so; `steps` counts each case's tries.
    """

    time: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    internal: Floats | None
    outcome: tuple[Outcome, ...]
    steps: NDArray[np.intp]


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

    At the very moment of a load applied at once, given times show what was before, except at time 0. Raises `InputError` for a
    load out of reach, a rate of the wrong sign, or times after the end.
    """
    check_reach(points, pieces)
    symmetry = symmetry_of(pieces)
    output = Output(points, times, points_per_decade, internal)
    condition = at_rest(points)
    cases = condition.time.size
    ended: list[Outcome | None] = [None] * cases
    steps = np.zeros(cases, dtype=np.intp)
    for index, piece in enumerate(pieces):
        present = prescribed(condition, piece.controls)
        try:
            end, duration = piece.resolve(present)
        except InputError as error:
            raise InputError(f"step {index}: {error}") from None
        alive = np.array([outcome is None for outcome in ended])
        at_once = alive & (duration == 0) & np.any(end != present, axis=0)
        condition, lost = apply_at_once(points, piece.controls, end, condition, at_once)
        for case in np.flatnonzero(lost).tolist():
            ended[case] = Outcome(
                False, float(condition.time[case]), "no stable equilibrium within the springs' limits under a load applied at once"
            )
        alive &= ~lost
        recorder = output.recorder(condition.time, duration, bool(np.any(end != present)), last=index == len(pieces) - 1)
        recorder.relative[~alive] = np.nan
        recorder.start(condition)
        ramp = Ramp.between(piece.controls, np.where(at_once, end, present), end, duration)
        condition, status, taken = _traverse(points, ramp, symmetry, condition, np.where(alive, duration, 0.0), rtol, recorder)
        steps += taken
        for case in np.flatnonzero(status).tolist():
            ended[case] = Outcome(False, float(condition.time[case]), REASONS[Status(status[case])])
    outcomes = tuple(outcome or Outcome(True, float(time)) for outcome, time in zip(ended, condition.time, strict=True))
    time, border, inner = output.collect()
    for case, outcome in enumerate(outcomes):
        if outcome.completed and time[case].max() > outcome.time * (1 + 1e-12):
            late = f"{of_case(case, cases)}output time {time[case].max():g} s"
            raise InputError(f"{late} lies after the end of the history at {outcome.time:g} s")
    return Record(time, border[:2], border[2:], inner, outcomes, steps)


def symmetry_of(pieces: Sequence[Piece]) -> Symmetry | None:
    """The symmetry that a film at rest keeps throughout a history, if any."""
    stress = Control.STRESS

    def free(target: Floats | None) -> bool:
        return target is None or not np.any(target)

    if all(piece.controls[1] is stress and free(piece.target[1]) and free(piece.target[2]) for piece in pieces):
        return UNIAXIAL
    alike = all(
        piece.controls[0] is piece.controls[1]
        and (piece.target[0] is piece.target[1] or np.array_equal(np.asarray(piece.target[0]), np.asarray(piece.target[1])))
        for piece in pieces
    )
    return EQUIBIAXIAL if alike else None


def check_reach(points: Points, pieces: Sequence[Piece]) -> None:
    """`InputError` for a stretch beyond the equilibrium spring's limit, or the branches' if at once from rest."""
    for index, piece in enumerate(pieces):
        held = [
            np.asarray(target)
            for control, target in zip(piece.controls, piece.target, strict=False)
            if control is Control.STRETCH and target is not None
        ]
        at_once = np.zeros(points.stress_floor.shape, dtype=bool)
        if index == 0 and piece.duration is not None:
            at_once |= piece.duration == 0
        beyond, limit = out_of_reach(points, held, at_once)
        if beyond.any():
            case = int(np.argmax(beyond))
            stretch = max(float(value[case]) for value in held)
            raise InputError(
                f"step {index}: {of_case(case, beyond.size)}stretch {stretch:g} is beyond the Gent limit, J_lim = {limit[case]:g}"
            )


def out_of_reach(points: Points, held: Sequence[Floats], at_once: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], Floats]:
    """Which cases the stretches of the axes that are `held`, each (cases,), lead beyond a Gent limit, and that J_lim (cases,).

    It is the equilibrium spring's, or also the branches' where the stretches are reached `at_once` from rest.
    """
    limit = points.law.largest_invariant()
    limit = limit.reshape(limit.shape[0], -1)
    equilibrium, branches = (np.broadcast_to(rows.min(axis=0, initial=np.inf), at_once.shape) for rows in (limit[:1], limit[1:]))
    reach = np.where(at_once, np.minimum(equilibrium, branches), equilibrium)
    if not held:
        return np.zeros(at_once.shape, dtype=bool), reach - 3
    squared = [np.square(stretch) for stretch in held]
    # an axis left open settles where I1 is least
    invariant = sum(squared) + (1 / (squared[0] * squared[1]) if len(squared) == 2 else 2 / np.sqrt(squared[0]))
    return np.asarray(invariant >= reach), reach - 3


def at_rest(points: Points) -> Condition:
    """Undeformed and relaxed at time 0."""
    springs, cases = points.rate.shape
    return Condition(np.zeros((2, springs, cases)), *np.zeros((2, 2, cases)), *np.zeros((3, cases)))


def prescribed(condition: Condition, controls: tuple[Control, Control]) -> Floats:
    """The present values (3, cases) of what a load with these controls prescribes."""
    stretched = np.array([[control is Control.STRETCH] for control in controls])
    values = np.where(stretched, np.exp(0.5 * condition.log_squared_stretch), condition.nominal_stress)
    return np.concatenate((values, condition.field[None]))


def apply_at_once(
    points: Points, controls: tuple[Control, Control], end: Floats, condition: Condition, at_once: NDArray[np.bool_]
) -> tuple[Condition, NDArray[np.bool_]]:
    """The condition after a load applied at once to some cases, and which of them found no equilibrium."""
    lost = np.zeros_like(at_once)
    if not at_once.any():
        return condition, lost
    some = np.flatnonzero(at_once)
    some = np.resize(some, max(2, some.size))  # numbers in a lone column round differently
    log_squared, nominal, found = jump(
        points.take(some), controls, end[:, some], condition.internal[:, :, some], condition.log_squared_stretch[:, some]
    )
    lost[some[~found]] = True
    some = some[found]
    stretch, stress, field = condition.log_squared_stretch.copy(), condition.nominal_stress.copy(), condition.field.copy()
    stretch[:, some], stress[:, some], field[some] = log_squared[:, found], nominal[:, found], end[2, some]
    next_step = np.where(at_once, 0.0, condition.next_step)
    return Condition(condition.internal, stretch, stress, field, condition.time, next_step), lost


def _traverse(
    points: Points, ramp: Ramp, symmetry: Symmetry | None, condition: Condition, duration: Floats, rtol: float, recorder: Recorder
) -> tuple[Condition, NDArray[np.intp], NDArray[np.intp]]:
    """The condition after a smooth piece of load, each case's status, and how many steps it tried."""
    if not duration.any():
        return condition, np.zeros(duration.size, dtype=np.intp), np.zeros(duration.size, dtype=np.intp)
    system = LoadedPoints(points, ramp) if symmetry is None else SymmetricPoints(points, ramp, symmetry)
    state = system.pack(condition.internal, condition.log_squared_stretch, condition.nominal_stress)
    result = integrate(system, state, duration, rtol=rtol, observe=recorder, first_step=condition.next_step)
    driven = ramp.value(result.time)
    log_squared, nominal = system.membrane(result.state, driven)
    reached = Condition(
        system.internal(result.state), log_squared, nominal, driven[2], condition.time + result.time, result.next_step
    )
    return reached, result.status, result.steps + result.rejected
