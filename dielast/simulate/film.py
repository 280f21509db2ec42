"""A prestretched film under voltage: what `actuate` and `failure_map` have in common.

The stretch is prescribed during prestretch and relaxation. When the voltage comes on, an axis is clamped, or the nominal stress
reached then is held as a dead load. Fields are nominal, V/L_3, throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from dielast.material.springs import EQUIBIAXIAL, Cases, Floats, Symmetry
from dielast.mechanics.events import Kind, Watch
from dielast.mechanics.jump import jump
from dielast.mechanics.load import Piece
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control, Controls
from dielast.mechanics.stability import Fold, damped
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleMeter
from dielast.simulate.follow import Condition, follow
from dielast.simulate.record import Recorder

MAX_MOVE = 0.05  # in Lambda: a load applied at once that moves the film further is followed in smaller shares
SMALLEST_SHARE = 1e-7  # of a load; where no smaller one has an equilibrium nearby, none has


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """Films ready for the voltage: damped `points` and their `condition`, time 0; `alike` if both axes are alike in all cases."""

    points: Points
    condition: Condition
    alike: bool

    @property
    def symmetry(self) -> Symmetry | None:
        """The symmetry that they keep."""
        return EQUIBIAXIAL if self.alike else None

    def take(self, cases: Cases) -> Film:
        """The same for some of the cases."""
        return Film(self.points.take(cases), self.condition.take(cases), self.alike)


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
    s; and the `Status` (cases,) of each. Use a film only where its status is COMPLETED.
    """
    first, second = (Control.STRESS if target is None else Control.STRETCH for target in stretch)
    zero = np.zeros_like(duration)
    targets = tuple(zero if target is None else target for target in stretch)
    pieces = [Piece((first, second), (targets[0], targets[1], None), duration)]
    if relax > 0:
        pieces.append(Piece((first, second), (None, None, None), np.full_like(duration, relax)))
    # only the viscous stretches at the end matter, not the stress on the way
    relaxing = replace(points, stress_floor=np.full_like(points.stress_floor, np.inf))
    symmetry = EQUIBIAXIAL if alike else None
    condition, status, _ = follow(relaxing, pieces, Condition.at_rest(points), symmetry=symmetry, rtol=rtol)
    damper = condition.log_squared_stretch[:, None]
    internal = np.concatenate((condition.internal, damper), axis=1)
    condition = replace(condition, internal=internal, time=zero, next_step=zero)
    return Film(damped(points), condition, alike), status


def programme(
    film: Film,
    pieces: Sequence[Piece],
    watch: Watch,
    *,
    rtol: float,
    recorder: Recorder | None = None,
    meter: CycleMeter | None = None,
) -> tuple[Floats, NDArray[np.intp]]:
    """Run films through a voltage programme: how far each came, in s, and its `Status`: completed, stopped by `watch`, or given
    up.
    """
    condition, status, _ = follow(
        film.points,
        pieces,
        film.condition,
        symmetry=film.symmetry,
        rtol=rtol,
        at_once=partial(_at_once, film.points, watch),
        watch=watch,
        recorder=recorder,
        meter=meter,
    )
    return condition.time, status


def _at_once(
    points: Points,
    watch: Watch,
    controls: Controls,
    present: Floats,
    end: Floats,
    condition: Condition,
    at_once: NDArray[np.bool_],
    status: NDArray[np.intp],
) -> Condition:
    """The condition after a voltage applied at once to some cases. Where the film cannot hold it, that is a pull-in, and the
    damper holds it first.
    """
    some = np.flatnonzero(at_once)
    jumped = connected_jump(
        points.take(some),
        controls,
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
            time = condition.time[cases]
            watch.note(kind, cases, time, watch.age(cases, time), *film)
        lost = np.resize(lost, max(2, lost.size))  # numbers in a lone column round differently
        log_squared, nominal, found = jump(points.take(lost), controls, end[:, lost], internal[:, :, lost], stretch[:, lost])
        vanished = lost[~found]
        # a film to which all that is asked for has happened need not go on
        status[vanished] = np.where(watch.done[vanished], Status.STOPPED, Status.NO_START)
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
    controls: Controls,
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
        near = found & (np.max(np.abs(moved - log_squared[:, going]), axis=0) <= MAX_MOVE)
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
    ends = np.flatnonzero((reached > 0) & (reached < 1))
    if ends.size:  # where the equilibrium ends, exactly
        pair = np.resize(ends, max(2, ends.size))  # numbers in a lone column round differently
        frozen = replace(bare.take(pair), rate=np.zeros((modulus.shape[0], pair.size)))
        fold = Fold(
            frozen,
            controls,
            lambda share: load_at(share, pair),
            lambda _: frozen.modulus,
            internal[:, :, pair],
            log_squared[:, pair],
            reached[pair],
        )
        share, _, moved, stress = (part[..., : ends.size] for part in fold.find())
        reached[ends], log_squared[:, ends], nominal[:, ends] = np.minimum(share, 1 - 1e-15), moved, stress
    limit = load_at(reached, np.arange(count))[2]
    return ConnectedJump(log_squared, nominal, limit, reached >= 1, breakdown_at, broken, stressed)
