"""The loop over the pieces of a load history, which all simulations share."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dielast.mechanics.at_once import apply_at_once
from dielast.mechanics.film import Film
from dielast.mechanics.piece import Piece
from dielast.mechanics.slack import Contact
from dielast.mechanics.watch import Watch
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.integrate import Status, integrate
from dielast.numerics.stride import Stride
from dielast.simulate.cycles import CycleMeter
from dielast.simulate.record import Recorder


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
    contact: Contact | None = None,
) -> Followed:
    """Follow films through `pieces`, to the end or until the `watch` stops a case.

    Films with a watch have a damper as their last spring; specimens with a `contact` bear no pressure along axis 1. Loads applied
    at once are treated by `apply_at_once`. Raises `InputError` for a rate of the wrong sign.
    """
    cases = film.time.size
    status, steps, every = np.zeros(cases, dtype=np.intp), np.zeros(cases, dtype=np.intp), np.arange(cases)
    controls = pieces[0].controls if pieces else None
    observers = [observer for observer in (watch, *recorders, meter) if observer is not None]

    def observe(stride: Stride) -> Flags | None:
        return next((done for done in [observer(stride) for observer in observers] if done is not None), None)

    for index, ahead in enumerate(pieces):
        switched = film.under(ahead.drive)
        changed = switched is not film or ahead.controls != controls
        film, controls = switched, ahead.controls
        present = film.prescribed(controls)
        piece = ahead.begin(present)
        # a load that differs from the present one only by rounding does not jump
        apart = np.abs(piece.start - present) > 4 * np.finfo(float).eps * np.abs(piece.start)
        jumps = (status == Status.COMPLETED) & apart.any(axis=0)
        if jumps.any():
            if watch is not None:
                watch.clock.jump(film.time, present[2], np.where(jumps, piece.start[2], present[2]))
            before = film
            acting = piece.start
            if film.points.circuit is not None:  # the source jumps, and the charge as far as the circuit lets it
                charge = film.points.circuit.charge_after(film.field, present[2], piece.start[2])
                acting = np.concatenate((piece.start[:2], charge[None]))
            film = apply_at_once(film, piece.controls, acting, jumps, status, watch)
            for recorder in recorders:
                if recorder.electric is not None:
                    recorder.electric.leap(piece.controls, before, film, np.any(piece.start[:2] != present[:2], axis=0))
            if film.points.circuit is not None:
                film = replace(film, source=np.where(jumps, piece.start[2], present[2]))
        if contact is not None:
            film = contact.begin(film, piece.controls, piece.start, jumps, status)
        system = film.equations(piece.span(every, np.zeros_like(every))[0])
        state = film.state(system)
        alive = status == Status.COMPLETED
        if watch is not None:
            watch.begin(system, state, film.time, alive & (jumps | changed), changed)
        for recorder in recorders:
            recorder.begin(piece, film.time, alive, jumps, system, state, last=index == len(pieces) - 1)
        if watch is not None:
            status[alive & watch.done] = Status.STOPPED
            alive = status == Status.COMPLETED
        if meter is not None:
            meter.begin(piece, system, state)
        lasting = np.where(alive, piece.duration, 0.0)
        if not lasting.any():
            if meter is not None:
                meter.finish()
            continue
        result = integrate(
            system,
            state,
            lasting,
            rtol=rtol,
            observe=observe,
            first_step=film.next_step,
            longest_step=piece.longest_step,
            spans=piece if piece.spans > 1 else None,
            turns=contact if film.slack is not None else None,
        )
        if meter is not None:
            meter.finish()
        if contact is not None and film.slack is not None:
            film = replace(film, slack=contact.slack)
            system = film.equations(system.load)
        driven = piece.end if piece.spans > 1 else system.load.value(result.time)
        film = film.reached(system, result.state, driven, film.time + result.time, result.next_step)
        status = np.where(alive, result.status, status)
        steps += result.steps + result.rejected
        if watch is not None:
            watch.finish(lambda columns, load, film=film: film.take(columns).equations(load))  # type: ignore[misc]
    return Followed(film, status, steps)
