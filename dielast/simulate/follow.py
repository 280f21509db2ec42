"""The loop over the pieces of a load history, which all simulations share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dielast.mechanics.course import Course, Piece
from dielast.mechanics.symmetric import Films
from dielast.mechanics.watch import Watch
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.integrate import Status, integrate
from dielast.numerics.stride import Stride
from dielast.simulate.at_once import apply_at_once
from dielast.simulate.cycles import CycleMeter
from dielast.simulate.film import Film
from dielast.simulate.record import Recorder


@dataclass(frozen=True, slots=True, eq=False)
class _Driven:
    """The spans of a course, with the interface of the stepper."""

    course: Course

    @property
    def spans(self) -> int:
        """The number of spans."""
        return self.course.spans

    def lasts(self, cases: Cases, index: Cases) -> Floats:
        """The durations (k,) in s of the spans `index` (k,) of `cases` (k,)."""
        return self.course.span(cases, index)[1]

    def enter(self, system: Films, columns: Cases, cases: Cases, index: Cases) -> tuple[Films, Floats]:
        """The system whose `columns` (k,), of `cases` (k,), enter the spans `index` (k,), and the durations (k,) of these spans."""
        load, lasts = self.course.span(cases, index)
        return system.driven_by(columns, load), lasts

    def smooth(self, index: Cases) -> Flags:
        """Whether (k,) there is no kink at the beginning of the spans `index` (k,)."""
        return self.course.smooth(index)


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """The `film` at the end of the history, the `Status` (cases,), and the number of `steps` (cases,) tried."""

    film: Film
    status: Cases
    steps: Cases

    @property
    def time(self) -> Floats:
        """The time (cases,) in s at which each case ended."""
        return self.film.time


def follow(
    film: Film,
    pieces: Sequence[Piece],
    *,
    rtol: float,
    watch: Watch | None = None,
    recorders: Sequence[Recorder] = (),
    meter: CycleMeter | None = None,
) -> Followed:
    """Follow films through `pieces`, to the end or until the `watch` stops a case.

    Films with a watch have a damper as their last spring. Loads applied at once are treated by `apply_at_once`. Raises `InputError`
    for a rate of the wrong sign.
    """
    cases = film.time.size
    status, steps, every = np.zeros(cases, dtype=np.intp), np.zeros(cases, dtype=np.intp), np.arange(cases)
    observers = [observer for observer in (watch, *recorders, meter) if observer is not None]

    def observe(stride: Stride) -> Flags | None:
        return next((done for done in [observer(stride) for observer in observers] if done is not None), None)

    for index, piece in enumerate(pieces):
        present = film.prescribed(piece.controls)
        course = piece.begin(present)
        # a load that differs from the present one only by rounding does not jump
        apart = np.abs(course.start - present) > 4 * np.finfo(float).eps * np.abs(course.start)
        jumps = (status == Status.COMPLETED) & apart.any(axis=0)
        if jumps.any():
            if watch is not None:
                watch.clock.jump(film.time, present[2], np.where(jumps, course.start[2], present[2]))
            before = film
            film = apply_at_once(film, piece.controls, _acting(film, present, course.start), jumps, status, watch)
            for recorder in recorders:
                if recorder.electric is not None:
                    recorder.electric.leap(piece.controls, before, film)
            if film.points.circuit is not None:
                film = replace(film, source=np.where(jumps, course.start[2], present[2]))
        system = film.equations(course.span(every, np.zeros_like(every))[0])
        state = film.state(system)
        alive = status == Status.COMPLETED
        if watch is not None:
            watch.begin(system, state, film.time, alive & jumps)
        for recorder in recorders:
            recorder.begin(course, film.time, alive, jumps, system, state, last=index == len(pieces) - 1)
        if watch is not None:
            status[alive & watch.done] = Status.STOPPED
            alive = status == Status.COMPLETED
        if meter is not None:
            meter.begin(course, system, state)
        lasting = np.where(alive, course.duration, 0.0)
        if not lasting.any():
            if meter is not None:
                meter.finish()
            continue
        spans = _Driven(course) if course.spans > 1 else None
        result = integrate(
            system,
            state,
            lasting,
            rtol=rtol,
            observe=observe,
            first_step=film.next_step,
            longest_step=course.longest_step,
            spans=spans,
        )
        if meter is not None:
            meter.finish()
        driven = system.load.value(result.time) if spans is None else course.end
        film = film.reached(system, result.state, driven, film.time + result.time, result.next_step)
        status = np.where(alive, result.status, status)
        steps += result.steps + result.rejected
        if watch is not None:
            watch.finish(lambda some, load, film=film: film.take(some).equations(load))  # type: ignore[misc]
    return Followed(film, status, steps)


def _acting(film: Film, present: Floats, start: Floats) -> Floats:
    """The values (3, cases) that act on films once the source has jumped from the `present` values to the `start` of a course."""
    if film.points.circuit is None:
        return start
    charge = film.points.circuit.charge_after(film.field, present[2], start[2])
    return np.concatenate((start[:2], charge[None]))
