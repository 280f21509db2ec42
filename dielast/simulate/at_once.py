"""Loads applied at once: where they take a film, and how far it can hold them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, Moment, Signal
from dielast.mechanics.jump import jump
from dielast.mechanics.passive.framed import membrane
from dielast.mechanics.passive.settle import settle
from dielast.mechanics.span import Controls
from dielast.mechanics.stability import Fold
from dielast.mechanics.watch import Watch
from dielast.numerics.columns import Cases, Flags, Floats, paired, where
from dielast.numerics.integrate import Status
from dielast.simulate.film import Condition, Film

MAX_MOVE = 0.05  # in Lambda: a load applied at once that moves the film further is followed in smaller shares
SMALLEST_SHARE = 1e-7  # of a load; where no smaller one has an equilibrium nearby, none has


def apply_at_once(film: Film, controls: Controls, target: Floats, jumps: Flags, status: Cases, watch: Watch | None) -> Film:
    """The films after the load jumps to the `target` (3, cases) in some cases, `jumps` (cases,).

    Without a `watch` films go to the nearest equilibrium. With one, films under voltage go to the equilibrium that the present one
    leads to; where there is none, that is a pull-in, and the damper holds the film first. The `status` (cases,) of films that find
    no equilibrium is changed.
    """
    condition = film.condition
    after = replace(
        condition,
        internal=condition.internal.copy(),
        log_squared_stretch=condition.log_squared_stretch.copy(),
        nominal_stress=condition.nominal_stress.copy(),
        field=condition.field.copy(),
        next_step=np.where(jumps, 0.0, condition.next_step),
        border=None if condition.border is None else condition.border.copy(),
    )
    columns = where(jumps)
    if watch is not None:
        after.field[columns] = target[2, columns]
        columns = _hold(film, controls, target, columns, after, watch)
    if not columns.size:
        return replace(film, condition=after)
    present = replace(film, condition=after).take(columns).moment(controls, columns, np.zeros(columns.size))
    moved, stable = moved_at_once(present, target[:, columns])
    status[columns[~stable]] = Status.NO_START
    if watch is not None:  # a film to which all that is asked for has happened need not go on
        vanished = columns[~stable]
        status[vanished[watch.done[vanished]]] = Status.STOPPED
    _put(after, columns, moved, stable)
    after.field[columns[stable]] = target[2, columns[stable]]
    return replace(film, condition=after)


def moved_at_once(moment: Moment, target: Floats, nearby: float | None = None) -> tuple[Moment, Flags]:
    """The films of a moment under the `target` (3, k) with every viscous stretch frozen, and whether (k,) they hold it: as `jump`
    or `settle`; if an equilibrium `nearby` is wanted, others are not looked for.
    """
    if moment.surroundings is None:
        before, controls = moment.log_squared_stretch, moment.controls
        log_squared, nominal, stable = jump(moment.points, controls, target, moment.internal, before, nearby)
        return replace(moment, log_squared_stretch=log_squared, nominal_stress=nominal, field=target[2]), stable
    around, stable = settle(moment.surroundings, moment.internal, target[2], nearby)
    log_squared, nominal = membrane(around.border, target, moment.controls)
    there = replace(moment, log_squared_stretch=log_squared, nominal_stress=nominal, field=target[2], surroundings=around)
    return there, stable


def _put(after: Condition, columns: Cases, moved: Moment, there: Flags) -> None:
    """Write where films (k,) have moved to, those that are `there` (k,)."""
    some = columns[there]
    after.log_squared_stretch[:, some], after.nominal_stress[:, some] = (
        moved.log_squared_stretch[:, there],
        moved.nominal_stress[:, there],
    )
    if moved.surroundings is not None and after.border is not None:
        after.border[:, some] = moved.surroundings.border[:, there]


def _hold(present: Film, controls: Controls, target: Floats, columns: Cases, after: Condition, watch: Watch) -> Cases:
    """Write how films that hold the load are `after` it, and note what happens to the others, which are returned."""
    on_the_way = {
        lookout.criterion: lookout.signal
        for lookout in watch.lookouts
        if lookout.signal is not None and lookout.criterion.found_in_jumps
    }
    film = present.take(columns)
    time = film.condition.time
    begin = film.moment(controls, columns, watch.clock.age(columns, time))
    way = follow_load(begin, film.condition.acting(controls), target[:, columns], on_the_way)
    reached = way.reached
    _put(after, columns, reached, way.held)
    # the damper is slack again
    slack = reached.log_squared_stretch if reached.surroundings is None else reached.surroundings.stretch()
    after.internal[:, -1, ..., columns[way.held]] = np.moveaxis(slack[..., way.held], -1, 0)
    # a voltage that is lowered ends a snapped-through state, which is no failure
    failed = ~way.held & (np.abs(target[2, columns]) > np.abs(film.condition.field))
    for lookout in watch.lookouts:
        if lookout.criterion in way.events:
            event = way.events[lookout.criterion]
            new = failed & np.isfinite(event.field)
        elif lookout.criterion.ends_equilibria:
            event, new = reached, failed
        else:
            continue
        noted = where(new & ~lookout.seen[columns])
        watch.note(lookout, time[noted], event.take(noted))
    return columns[~way.held]


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """Where a load applied at once takes films: as they are where it is `reached`, or as far as there is an equilibrium, and
    whether that is the whole load, `held` (k,). `events` are the moments at which signals fell on the way, by criterion, with a
    field that is NaN where they did not.
    """

    reached: Moment
    held: Flags
    events: Mapping[Criterion, Moment]


def follow_load(begin: Moment, present: Floats, target: Floats, signals: Mapping[Criterion, Signal]) -> Way:
    """As `jump`, but with the damper left out, and only to the equilibrium that the one of the moment `begin` leads to as the load
    goes from `present` to `target`, both (3, k), in shares so small that the film never moves far.
    """
    modulus = begin.points.modulus.copy()
    modulus[-1] = 0.0
    bare = replace(begin.points, modulus=modulus)
    start = replace(begin, points=bare, surroundings=None if begin.surroundings is None else begin.surroundings.without_damper())
    count = target.shape[1]

    def load_at(share: Floats, columns: Cases) -> Floats:
        load = np.array((1 - share) * present[:, columns] + share * target[:, columns])
        # the square of the field is what pulls; its sign is that of the voltage to come
        size = np.sqrt((1 - share) * present[2, columns] ** 2 + share * target[2, columns] ** 2)
        load[2] = np.copysign(size, target[2, columns])
        return load

    log_squared, nominal = begin.log_squared_stretch.copy(), begin.nominal_stress.copy()
    border = None if begin.surroundings is None else begin.surroundings.border.copy()
    reached, share, smooth = np.zeros(count), np.ones(count), np.zeros(count, dtype=bool)
    events = {
        criterion: replace(
            begin,
            field=np.full(count, np.nan),
            log_squared_stretch=np.full_like(log_squared, np.nan),
            nominal_stress=np.full_like(nominal, np.nan),
            surroundings=None
            if begin.surroundings is None
            else replace(begin.surroundings, border=begin.surroundings.border.copy()),
        )
        for criterion in signals
    }
    going = np.arange(count)
    while going.size:
        going = paired(going)
        wanted = np.minimum(reached[going] + share[going], 1.0)
        load = load_at(wanted, going)
        from_here = replace(start.take(going), log_squared_stretch=log_squared[:, going])
        if border is not None and from_here.surroundings is not None:
            from_here = replace(from_here, surroundings=replace(from_here.surroundings, border=border[:, going]))
        there, stable = moved_at_once(from_here, load, MAX_MOVE)
        moved, stress = there.log_squared_stretch, there.nominal_stress
        apart = np.max(np.abs(moved - log_squared[:, going]), axis=0)
        near = stable & (apart <= MAX_MOVE)
        closely = share[going] < 2 * SMALLEST_SHARE  # as closely as the load can be divided
        falls, met = np.zeros(going.size, dtype=bool), np.zeros(going.size, dtype=bool)
        for criterion, signal in signals.items():
            event = events[criterion]
            fallen = near & np.isnan(event.field[going]) & (signal(there) <= 0)
            new, columns = fallen & closely, going[fallen & closely]
            event.field[columns] = load[2, new]
            event.log_squared_stretch[:, columns], event.nominal_stress[:, columns] = moved[:, new], stress[:, new]
            if event.surroundings is not None and there.surroundings is not None:
                event.surroundings.border[:, columns] = there.surroundings.border[:, new]
            falls, met = falls | fallen, met | new
        near &= ~falls | met
        columns = going[near]
        log_squared[:, columns], nominal[:, columns], reached[columns] = moved[:, near], stress[:, near], wanted[near]
        if border is not None and there.surroundings is not None:
            border[:, columns] = there.surroundings.border[:, near]
        # what follows a steep place may be taken in larger shares again
        larger = near & smooth[going] & (apart <= 0.5 * MAX_MOVE)
        smooth[going] = near
        share[going] = np.where(met, 1.0, np.where(near, np.where(larger, 2.0, 1.0), 0.5) * share[going])
        going = np.flatnonzero((reached < 1) & (share >= SMALLEST_SHARE))
    ends = where((reached > 0) & (reached < 1))
    if ends.size and border is None:  # where the equilibrium ends, exactly
        frozen = replace(bare.take(ends), rate=np.zeros((modulus.shape[0], ends.size)))
        fold = Fold(
            frozen,
            begin.controls,
            lambda share: load_at(share, ends),
            lambda _: frozen.modulus,
            begin.internal[:, :, ends],
            log_squared[:, ends],
            reached[ends],
        )
        end, _, log_squared[:, ends], nominal[:, ends] = fold.find()
        reached[ends] = np.minimum(end, 1 - 1e-15)
    limit = load_at(reached, np.arange(count))[2]
    around = None if begin.surroundings is None or border is None else replace(begin.surroundings, border=border)
    reached_moment = replace(begin, log_squared_stretch=log_squared, nominal_stress=nominal, field=limit, surroundings=around)
    return Way(reached_moment, reached >= 1, events)
