"""The loop over the pieces of a load history, which all simulations share."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from dielast.material.springs import UNIAXIAL
from dielast.mechanics.at_once import apply_at_once
from dielast.mechanics.film import FilmState
from dielast.mechanics.piece import Piece, loads_axis_1_alone
from dielast.mechanics.slack import Contact
from dielast.mechanics.span import Controls
from dielast.mechanics.watch import Watch
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.integrate import KEEPER, Status, Stepper
from dielast.numerics.stride import TriedStep
from dielast.simulate.cycles import CycleMeter
from dielast.simulate.recorder import Recorder

MANY = 100  # spans of a piece of load that are worth a progress bar


@dataclass(slots=True, eq=False)
class Course:
    """Films on their way through `pieces`: the `film` at the end of those that lie behind, the `Status` (cases,), and the number of
    `steps` (cases,) tried. All that is needed to go on is here, and can be pickled between two steps.
    """

    film: FilmState
    pieces: Sequence[Piece]
    rtol: float
    watch: Watch | None
    recorders: Sequence[Recorder]
    meter: CycleMeter | None
    status: Cases
    steps: Cases
    index: int = 0
    piece: Piece | None = None
    """The piece under way."""
    stepper: Stepper | None = None
    controls: Controls | None = None
    contact: Contact | None = None

    @property
    def time(self) -> Floats:
        """The time (cases,) in s at which each case ended."""
        return self.film.time

    def run(self, keep: Callable[[Any], None] | None = None) -> None:
        """Go on to the end; `keep` is called with the course after every step."""
        while self.index < len(self.pieces):
            if self.stepper is None:
                self._begin(self.pieces[self.index])
            if self.stepper is not None:
                self.stepper.run(self._observe, None if keep is None else partial(keep, self))
            self._end()
            self.index += 1

    def show(self, progress: Callable[[int, int, str], None]) -> None:
        """Call `progress` with the finished number, the total number and the plural of the cycles, or the rows of a table, of a
        piece that has many.
        """
        if self.stepper is None or self.piece is None or self.piece.spans < MANY:
            return
        at, count = self.stepper.at, self.piece.cycles or self.piece.spans
        done = int(at.span[self.stepper.active].min(initial=self.piece.spans)) * count // self.piece.spans
        progress(done, count, "cycles" if self.piece.cycles else "rows of the load")

    def _observe(self, stride: TriedStep) -> Flags | None:
        observers = [observer for observer in (self.watch, *self.recorders, self.meter) if observer is not None]
        return next((done for done in [observer(stride) for observer in observers] if done is not None), None)

    def _begin(self, ahead: Piece) -> None:
        """Begin a piece; there is no stepper if it lasts no time."""
        watch, every = self.watch, np.arange(self.status.size)
        switched = self.film.under(ahead.drive)
        changed = switched is not self.film or ahead.controls != (self.controls or self.pieces[0].controls)
        film, controls = switched, ahead.controls
        if film.symmetry == UNIAXIAL and not loads_axis_1_alone(ahead).all():
            film = replace(film, symmetry=None)
        present = film.prescribed(controls)
        piece = ahead.begin(present)
        # a load that differs from the present one only by rounding does not jump
        apart = np.abs(piece.start - present) > 4 * np.finfo(float).eps * np.abs(piece.start)
        jumps = (self.status == Status.COMPLETED) & apart.any(axis=0)
        if jumps.any():
            if watch is not None:
                watch.clock.jump(film.time, present[2], np.where(jumps, piece.start[2], present[2]))
            before = film
            acting = piece.start
            if film.points.circuit is not None:  # the source jumps, and the charge as far as the circuit lets it
                charge = film.points.circuit.charge_after(film.electrical, present[2], piece.start[2])
                acting = np.concatenate((piece.start[:2], charge[None]))
            film = apply_at_once(film, piece.controls, acting, jumps, self.status, watch)
            for recorder in self.recorders:
                if recorder.electric is not None:
                    recorder.electric.leap(piece.controls, before, film, np.any(piece.start[:2] != present[:2], axis=0))
            if film.points.circuit is not None:
                film = replace(film, source=np.where(jumps, piece.start[2], present[2]))
        if self.contact is not None:
            film = self.contact.begin(film, piece.controls, piece.start, jumps, self.status)
        system = film.equations(piece.span(every, np.zeros_like(every))[0])
        state = film.state(system)
        alive = self.status == Status.COMPLETED
        if watch is not None:
            watch.begin(system, state, film.time, alive & (jumps | changed), changed)
        for recorder in self.recorders:
            recorder.begin(piece, film.time, alive, jumps, system, state, last=self.index == len(self.pieces) - 1)
        if watch is not None:
            self.status[alive & watch.done] = Status.STOPPED
            alive = self.status == Status.COMPLETED
        if self.meter is not None:
            self.meter.begin(piece, system, state)
        lasting = np.where(alive, piece.duration, 0.0)
        self.film, self.controls, self.piece = film, controls, piece
        if lasting.any():
            spans = piece if piece.spans > 1 else None
            self.stepper = Stepper(
                system,
                state,
                lasting,
                rtol=self.rtol,
                first_step=film.next_step,
                longest_step=piece.longest_step,
                spans=spans,
                turns=self.contact if film.slack is not None else None,
            )

    def _end(self) -> None:
        """End the piece."""
        if self.meter is not None:
            self.meter.finish()
        if self.stepper is None:
            return
        assert self.piece is not None
        system: Any = self.stepper.system_of_all
        result = self.stepper.result
        if self.contact is not None and self.film.slack is not None:
            self.film = replace(self.film, slack=self.contact.slack)
            system = self.film.equations(system.load)
        driven = self.piece.end if self.piece.spans > 1 else system.load.value(result.time)
        film = self.film = self.film.reached(system, result.state, driven, self.film.time + result.time, result.next_step)
        self.status = np.where(self.status == Status.COMPLETED, result.status, self.status)
        self.steps += result.steps + result.rejected
        self.stepper = None
        if self.watch is not None:
            self.watch.finish(lambda columns, load: film.take(columns).equations(load))


def follow(
    film: FilmState,
    pieces: Sequence[Piece],
    *,
    rtol: float,
    watch: Watch | None = None,
    recorders: Sequence[Recorder] = (),
    meter: CycleMeter | None = None,
    contact: Contact | None = None,
) -> Course:
    """Follow films through `pieces`, to the end or until the `watch` stops a case. A course that was kept is continued, with the
    watch, the recorders, the meter and the contact that were kept with it.

    Films with a watch have a damper as their last spring; specimens with a `contact` bear no pressure along axis 1. Loads applied
    at once are treated by `apply_at_once`. Raises `InputError` for a rate of the wrong sign.
    """
    keeper, none = KEEPER.get(), np.zeros(film.time.size, dtype=np.intp)
    course: Course | None = None if keeper is None else keeper.resumed()
    if course is None:
        course = Course(film, pieces, rtol, watch, recorders, meter, none, none.copy(), contact=contact)
    course.run(None if keeper is None else keeper.keep)
    return course
