"""A prestretched film under voltage: what `actuate` and `failure_map` have in common.

The stretch is prescribed during prestretch and relaxation. When the voltage comes on, an axis is clamped, or the nominal stress
reached then is held as a dead load. Fields are nominal, V/L_3, throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dielast.events import Films, Kind, Watch
from dielast.gent import Cases, Floats
from dielast.integrate import Status, Stride, integrate
from dielast.jump import jump
from dielast.load import Control, Piece, Ramp
from dielast.point import LoadedPoints, Points
from dielast.simulate.history import apply_at_once, at_rest, prescribed
from dielast.simulate.output import Condition
from dielast.simulate.trace import PieceTrace, Trace
from dielast.stability import damped
from dielast.symmetric import EQUIBIAXIAL, SymmetricPoints

NUDGE = 0.05  # in Lambda: a load applied at once that moves the film further is followed in smaller shares
SMALLEST_SHARE = 1e-7  # of a load; where no smaller one has an equilibrium nearby, none has


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """Films ready for the voltage: damped `points` and their `condition`, time 0; `alike` if both axes are alike in all cases."""

    points: Points
    condition: Condition
    alike: bool

    def take(self, cases: Cases) -> Film:
        """The same for some of the cases."""
        c = self.condition
        some = Condition(
            c.internal[:, :, cases],
            c.log_squared_stretch[:, cases],
            c.nominal_stress[:, cases],
            c.field[cases],
            c.time[cases],
            c.next_step[cases],
        )
        return Film(self.points.take(cases), some, self.alike)


def prestretch(
    points: Points,
    stretch: tuple[Floats | None, Floats | None],
    duration: Floats,
    relax: float,
    *,
    alike: bool,
    rtol: float,
) -> tuple[Film, NDArray[np.intp]]:
    """Films stretched within `duration` (cases,) s to `stretch` (cases,) an axis, None for an axis left free, and held for `relax`
    s; and the `Status` (cases,) of each, which is worth nothing unless completed.
    """
    controls = tuple(Control.STRESS if target is None else Control.STRETCH for target in stretch)
    zero = np.zeros_like(duration)
    targets = tuple(zero if target is None else target for target in stretch)
    pieces = [Piece((controls[0], controls[1]), (targets[0], targets[1], None), duration)]
    if relax > 0:
        pieces.append(Piece((controls[0], controls[1]), (None, None, None), np.full_like(duration, relax)))
    condition, status = at_rest(points), np.zeros(duration.size, dtype=np.intp)
    # only the viscous stretches at the end matter, not the stress on the way
    relaxing = replace(points, stress_floor=np.full_like(points.stress_floor, np.inf))
    for piece in pieces:
        present = prescribed(condition, piece.controls)
        end, lasting = piece.resolve(present)
        at_once = (lasting == 0) & np.any(end != present, axis=0)
        condition, lost = apply_at_once(points, piece.controls, end, condition, at_once)
        ramp = Ramp.between(piece.controls, np.where(at_once, end, present), end, lasting)
        status = np.where(lost, Status.STEP_VANISHED, status)
        alive = status == Status.COMPLETED
        condition, ended = _traverse(_system(relaxing, ramp, alike), condition, np.where(alive, lasting, 0.0), rtol, None, None)
        status = np.where(alive, ended, status)
    damper = condition.log_squared_stretch[:, None]
    internal = np.concatenate((condition.internal, damper), axis=1)
    condition = replace(condition, internal=internal, time=zero, next_step=zero)
    return Film(damped(points), condition, alike), status


def programme(
    film: Film, pieces: Sequence[Piece], watch: Watch, *, rtol: float, trace: Trace | None = None
) -> tuple[Floats, NDArray[np.intp]]:
    """Run films through a voltage programme: how far each came, in s, and its `Status`: completed, stopped by `watch`, or given
    up.
    """
    points, condition = film.points, film.condition
    status = np.zeros(condition.time.size, dtype=np.intp)
    for index, piece in enumerate(pieces):
        present = prescribed(condition, piece.controls)
        end, duration = piece.resolve(present)
        alive = status == Status.COMPLETED
        at_once = alive & (duration == 0) & np.any(end != present, axis=0)
        condition = _at_once(points, piece, present, end, condition, at_once, watch, status)
        ramp = Ramp.between(piece.controls, np.where(duration == 0, end, present), end, duration)
        system = _system(points, ramp, film.alike)
        state = system.pack(condition.internal, condition.log_squared_stretch, condition.nominal_stress)
        alive = status == Status.COMPLETED
        watch.begin(system, state, condition.time, alive & (at_once | (index == 0)))
        piece_trace = None if trace is None else trace.pieces[index]
        if piece_trace is not None:
            piece_trace.start(system, state, alive)
        status[alive & watch.done] = Status.STOPPED
        alive = status == Status.COMPLETED
        condition, ended = _traverse(system, condition, np.where(alive, duration, 0.0), rtol, watch, piece_trace)
        status = np.where(alive, ended, status)
        watch.finish(system)
    return condition.time, status


def _at_once(
    points: Points,
    piece: Piece,
    present: Floats,
    end: Floats,
    condition: Condition,
    at_once: NDArray[np.bool_],
    watch: Watch,
    status: NDArray[np.intp],
) -> Condition:
    """The condition after a voltage applied at once to some cases. Where the film cannot hold it, that is a pull-in, and the
    damper holds it first.
    """
    some = np.flatnonzero(at_once)
    if not some.size:
        return condition
    jumped = connected_jump(
        points.take(some),
        piece.controls,
        present[:, some],
        end[:, some],
        condition.internal[:, :, some],
        condition.log_squared_stretch[:, some],
        condition.nominal_stress[:, some],
        watch.breakdown_field[some],
    )
    log_squared, nominal, held = jumped.log_squared_stretch, jumped.nominal_stress, jumped.held
    internal, stretch, stress, field = (
        x.copy() for x in (condition.internal, condition.log_squared_stretch, condition.nominal_stress, condition.field)
    )
    field[some] = end[2, some]
    stretch[:, some[held]], stress[:, some[held]] = log_squared[:, held], nominal[:, held]
    internal[:, -1, some[held]] = log_squared[:, held]
    lost = some[~held]
    if lost.size:
        # a voltage that is lowered ends a snapped-through state, which is no pull-in
        grows = np.abs(end[2, lost]) > np.abs(present[2, lost])
        broken = grows & np.isfinite(jumped.breakdown_at[~held])
        for kind, which, at, where, stressed in (
            (
                Kind.BREAKDOWN,
                broken,
                jumped.breakdown_at[~held],
                jumped.broken_log_squared_stretch[:, ~held],
                jumped.broken_nominal_stress[:, ~held],
            ),
            (Kind.PULL_IN, grows, jumped.reached[~held], log_squared[:, ~held], nominal[:, ~held]),
        ):
            new = which & ~watch.seen(kind, lost)
            cases = lost[new]
            film = points.take(cases), condition.internal[:, :, cases], where[:, new], stressed[:, new], at[new]
            watch.note(kind, cases, condition.time[cases], *film)
        lost = np.resize(lost, max(2, lost.size))  # numbers in a lone column round differently
        log_squared, nominal, found = jump(points.take(lost), piece.controls, end[:, lost], internal[:, :, lost], stretch[:, lost])
        vanished = lost[~found]
        # a film to which all that is asked for has happened need not go on
        status[vanished] = np.where(watch.done[vanished], Status.STOPPED, Status.STEP_VANISHED)
        stretch[:, lost[found]], stress[:, lost[found]] = log_squared[:, found], nominal[:, found]
    return Condition(internal, stretch, stress, field, condition.time, np.where(at_once, 0.0, condition.next_step))


@dataclass(frozen=True, slots=True, eq=False)
class ConnectedJump:
    """Where a load applied at once takes the film: Lambda and nominal stress (2, cases), the nominal field `reached` (cases,) up to
    which there is an equilibrium, and whether that is the whole load. On the way the true field meets the breakdown field at the
    nominal field `breakdown_at` (cases,), NaN if it does not, where Lambda is `broken_log_squared_stretch`, and the nominal stress
    `broken_nominal_stress`.
    """

    log_squared_stretch: Floats
    nominal_stress: Floats
    reached: Floats
    held: NDArray[np.bool_]
    breakdown_at: Floats
    broken_log_squared_stretch: Floats
    broken_nominal_stress: Floats


def connected_jump(
    points: Points,
    controls: tuple[Control, Control],
    present: Floats,
    end: Floats,
    internal: Floats,
    log_squared_stretch: Floats,
    nominal_stress: Floats,
    breakdown_field: Floats,
) -> ConnectedJump:
    """As `jump`, but with the damper left out, and only to the equilibrium that the present one leads to as the load goes from
    `present` to `end`, both (3, cases), in shares so small that the film never moves far.
    """
    modulus = points.modulus.copy()
    modulus[-1] = 0.0
    bare = replace(points, modulus=modulus)
    count = end.shape[1]

    def load_at(share: Floats, cases: Cases) -> Floats:
        load = np.array((1 - share) * present[:, cases] + share * end[:, cases])
        # the square of the field is what pulls; its sign is that of the voltage to come
        load[2] = np.copysign(np.sqrt((1 - share) * present[2, cases] ** 2 + share * end[2, cases] ** 2), end[2, cases])
        return load

    log_squared, nominal = log_squared_stretch.copy(), nominal_stress.copy()
    reached, share = np.zeros(count), np.ones(count)
    breakdown_at, broken, stressed = np.full(count, np.nan), np.full_like(log_squared, np.nan), np.full_like(log_squared, np.nan)
    going = np.arange(count)
    while going.size:
        wanted = np.minimum(reached[going] + share[going], 1.0)
        pair = np.resize(going, max(2, going.size))  # numbers in a lone column round differently
        load = load_at(np.resize(wanted, pair.size), pair)
        moved, stress, found = jump(bare.take(pair), controls, load, internal[:, :, pair], log_squared[:, pair])
        moved, stress, found = moved[:, : going.size], stress[:, : going.size], found[: going.size]
        near = found & (np.max(np.abs(moved - log_squared[:, going]), axis=0) <= NUDGE)
        true_field = np.abs(load[2, : going.size]) * np.exp(0.5 * np.sum(moved, axis=0))
        breaks = near & np.isnan(breakdown_at[going]) & (true_field >= breakdown_field[going])
        met = breaks & (share[going] < 2 * SMALLEST_SHARE)  # as closely as the load can be divided
        breakdown_at[going[met]], broken[:, going[met]] = load[2, : going.size][met], moved[:, met]
        stressed[:, going[met]] = stress[:, met]
        near &= ~breaks | met
        there = going[near]
        log_squared[:, there], nominal[:, there], reached[there] = moved[:, near], stress[:, near], wanted[near]
        share[going] = np.where(met, 1.0, np.where(near, share[going], 0.5 * share[going]))
        going = going[(reached[going] < 1) & (share[going] >= SMALLEST_SHARE)]
    limit = load_at(reached, np.arange(count))[2]
    return ConnectedJump(log_squared, nominal, limit, reached >= 1, breakdown_at, broken, stressed)


def _system(points: Points, ramp: Ramp, alike: bool) -> Films:
    """The equations under one smooth piece of load."""
    return SymmetricPoints(points, ramp, EQUIBIAXIAL) if alike else LoadedPoints(points, ramp)


def _traverse(
    system: Films, condition: Condition, duration: Floats, rtol: float, watch: Watch | None, trace: PieceTrace | None
) -> tuple[Condition, NDArray[np.intp]]:
    """The condition after a smooth piece of load, and each case's status."""
    if not duration.any():
        return condition, np.zeros(duration.size, dtype=np.intp)

    def observe(stride: Stride) -> NDArray[np.bool_] | None:
        if trace is not None:
            trace(stride)
        return watch(stride) if watch is not None else None

    state = system.pack(condition.internal, condition.log_squared_stretch, condition.nominal_stress)
    result = integrate(system, state, duration, rtol=rtol, observe=observe, first_step=condition.next_step)
    driven = system.load.value(result.time)
    log_squared, nominal = system.membrane(result.state, driven)
    reached = Condition(
        system.internal(result.state), log_squared, nominal, driven[2], condition.time + result.time, result.next_step
    )
    return reached, result.status
