"""Films followed through the pieces of a load history, one after another: what every simulation has in common."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dielast.material.springs import Cases, Floats, Symmetry
from dielast.mechanics.course import Course
from dielast.mechanics.jump import jump
from dielast.mechanics.load import Piece
from dielast.mechanics.point import LoadedPoints, Points
from dielast.mechanics.span import Control, Controls, Load
from dielast.mechanics.symmetric import Films, SymmetricPoints
from dielast.numerics.integrate import Status, Stride, integrate
from dielast.simulate.cycles import CycleMeter
from dielast.simulate.record import Recorder

if TYPE_CHECKING:
    from dielast.mechanics.events import Watch

REASONS = {
    Status.STEP_VANISHED: "the rates grow beyond all bounds",
    Status.TOO_MANY_STEPS: "the integration takes too many steps",
    Status.STALLED: "the integration comes to a standstill",
    Status.NO_START: "no stable equilibrium within the springs' limits under a load applied at once",
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one case ended: `completed` at `time` (s), or broken off there because of `reason`."""

    completed: bool
    time: float
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """Where all cases stand: x (2, n, cases), Lambda and nominal stress (2, cases), nominal field and time (cases,), and the
    `next_step` (cases,) in s that the stepper would take if all went on smoothly, 0 where nothing is known of it.
    """

    internal: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    field: Floats
    time: Floats
    next_step: Floats

    @classmethod
    def at_rest(cls, points: Points) -> Condition:
        """Undeformed and relaxed at time 0."""
        springs, cases = points.rate.shape
        return cls(np.zeros((2, springs, cases)), *np.zeros((2, 2, cases)), *np.zeros((3, cases)))

    def take(self, cases: Cases) -> Condition:
        """The same for some of the cases."""
        strained = self.internal[:, :, cases], self.log_squared_stretch[:, cases], self.nominal_stress[:, cases]
        return Condition(*strained, self.field[cases], self.time[cases], self.next_step[cases])

    def prescribed(self, controls: Controls) -> Floats:
        """The present values (3, cases) of what a load with these controls prescribes."""
        stretched = np.array([[control is Control.STRETCH] for control in controls])
        values = np.where(stretched, np.exp(0.5 * self.log_squared_stretch), self.nominal_stress)
        return np.concatenate((values, self.field[None]))


Jump = Callable[[Controls, Floats, Floats, Condition, NDArray[np.bool_], NDArray[np.intp]], Condition]


@dataclass(frozen=True, slots=True, eq=False)
class _Driven:
    """The spans of a course, as the stepper takes them."""

    course: Course

    @property
    def spans(self) -> int:
        """How many."""
        return self.course.spans

    def enter(self, system: Films, columns: Cases, cases: Cases, index: Cases) -> tuple[Films, Floats]:
        """The system with columns of these cases in these spans, and how long these last."""
        load, lasts = self.course.span(cases, index)
        return system.driven_by(columns, load), lasts

    def smooth(self, index: Cases) -> NDArray[np.bool_]:
        """Whether spans go on smoothly from the span before."""
        return self.course.smooth(index)


def follow(
    points: Points,
    pieces: Sequence[Piece],
    condition: Condition,
    *,
    symmetry: Symmetry | None,
    rtol: float,
    at_once: Jump | None = None,
    watch: Watch | None = None,
    recorder: Recorder | None = None,
    meter: CycleMeter | None = None,
) -> tuple[Condition, NDArray[np.intp], NDArray[np.intp]]:
    """Follow cases through `pieces`: their condition then, the `Status` of each, and the number of steps it tried.

    A film may keep a `symmetry` throughout. `at_once` applies a load at once, by default the nearest equilibrium is taken. A case
    is stopped by its `watch`. Raises `InputError` for a rate of the wrong sign.
    """
    cases = condition.time.size
    status, steps, every = np.zeros(cases, dtype=np.intp), np.zeros(cases, dtype=np.intp), np.arange(cases)
    make = partial(loaded, symmetry=symmetry)
    for index, piece in enumerate(pieces):
        present = condition.prescribed(piece.controls)
        course = piece.resolve(present)
        # a load that is there already, but for rounding, does not jump
        apart = np.abs(course.start - present) > 4 * np.finfo(float).eps * np.abs(course.start)
        jumps = (status == Status.COMPLETED) & apart.any(axis=0)
        if jumps.any():
            if watch is not None:
                watch.jump(condition.time, condition.field, np.where(jumps, course.start[2], condition.field))
            condition = (at_once or partial(apply_at_once, points))(piece.controls, present, course.start, condition, jumps, status)
        system = make(points, course.span(every, np.zeros(cases, dtype=np.intp))[0])
        state = system.pack(condition.internal, condition.log_squared_stretch, condition.nominal_stress)
        alive = status == Status.COMPLETED
        if watch is not None:
            watch.begin(system, state, condition.time, alive & jumps)
        if recorder is not None:
            recorder.begin(course, condition.time, alive, jumps, system, state, last=index == len(pieces) - 1)
        if watch is not None:
            status[alive & watch.done] = Status.STOPPED
            alive = status == Status.COMPLETED
        if meter is not None:
            meter.begin(course)
        lasting = np.where(alive, course.duration, 0.0)
        if not lasting.any():
            continue

        def observe(stride: Stride) -> NDArray[np.bool_] | None:
            done = watch(stride) if watch is not None else None
            if recorder is not None:
                recorder(stride)
            if meter is not None:
                meter(stride)
            return done

        spans = _Driven(course) if course.spans > 1 else None
        result = integrate(system, state, lasting, rtol=rtol, observe=observe, first_step=condition.next_step, spans=spans)
        if meter is not None:
            meter.finish()
        driven = system.load.value(result.time) if spans is None else course.end
        membrane = system.membrane(result.state, driven)
        time = condition.time + result.time
        condition = Condition(system.internal(result.state), *membrane, driven[2], time, result.next_step)
        status = np.where(alive, result.status, status)
        steps += result.steps + result.rejected
        if watch is not None:
            watch.finish(points, make)
    return condition, status, steps


def loaded(points: Points, load: Load, symmetry: Symmetry | None) -> Films:
    """The equations of points under a span of load."""
    return LoadedPoints(points, load) if symmetry is None else SymmetricPoints(points, load, symmetry)


def apply_at_once(
    points: Points,
    controls: Controls,
    present: Floats,
    end: Floats,
    condition: Condition,
    jumps: NDArray[np.bool_],
    status: NDArray[np.intp],
) -> Condition:
    """The condition after a load applied at once to some cases; the `status` of those without an equilibrium is changed."""
    some = np.flatnonzero(jumps)
    some = np.resize(some, max(2, some.size))  # numbers in a lone column round differently
    log_squared, nominal, found = jump(
        points.take(some), controls, end[:, some], condition.internal[:, :, some], condition.log_squared_stretch[:, some]
    )
    status[some[~found]] = Status.NO_START
    some = some[found]
    stretch, stress, field = condition.log_squared_stretch.copy(), condition.nominal_stress.copy(), condition.field.copy()
    stretch[:, some], stress[:, some], field[some] = log_squared[:, found], nominal[:, found], end[2, some]
    next_step = np.where(jumps, 0.0, condition.next_step)
    return Condition(condition.internal, stretch, stress, field, condition.time, next_step)
