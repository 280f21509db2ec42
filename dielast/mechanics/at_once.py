"""Loads applied at once: the state after the jump, and the largest load with an equilibrium."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal
from dielast.mechanics.film import FilmState
from dielast.mechanics.flow import Flow
from dielast.mechanics.jump import jump
from dielast.mechanics.passive.framed import membrane
from dielast.mechanics.passive.settle import settle
from dielast.mechanics.span import Controls
from dielast.mechanics.stability import Fold
from dielast.mechanics.watch import Watch
from dielast.numerics.arrays import Cases, Flags, Floats, paired, where
from dielast.numerics.integrate import Status

MAX_MOVE = 0.05  # largest change of Lambda in one part of a load applied at once; larger parts are divided
SMALLEST_SHARE = 1e-7  # smallest part of a load; if there is no equilibrium nearby for this part, there is none


def apply_at_once(
    film: FilmState, controls: Controls, target: Floats, jumps: Flags, status: Cases, watch: Watch | None
) -> FilmState:
    """The films after the load jumps to the `target` (3, cases) in the cases marked by `jumps` (cases,).

    Without a `watch`, films go to the nearest equilibrium. With one, films under voltage follow their equilibrium as the load
    increases; where it ends before the full load, they pull in, held at first by the damper. Where there is no equilibrium at all,
    `status` (cases,) is changed.
    """
    after = replace(film.copied(), next_step=np.where(jumps, 0.0, film.next_step))
    columns = where(jumps)
    if watch is not None:
        after.electrical[columns] = target[2, columns]
        columns = _hold(film, controls, target, columns, after, watch)
    if not columns.size:
        return after
    present = after.take(columns).snapshot(controls, columns, np.zeros(columns.size))
    state, stable = equilibrium_at_once(present, target[:, columns])
    status[columns[~stable]] = Status.NO_START
    if watch is not None:  # a film whose requested events have all happened has ended
        vanished = columns[~stable]
        status[vanished[watch.done[vanished]]] = Status.STOPPED
    _put(after, columns, state, stable)
    after.electrical[columns[stable]] = target[2, columns[stable]]
    return after


def equilibrium_at_once(snapshot: FilmSnapshot, target: Floats, nearby: float | None = None) -> tuple[FilmSnapshot, Flags]:
    """The films under the `target` (3, k) with every viscous stretch frozen, and whether (k,) they are in stable
    equilibrium, by `jump` or `settle`, which explain `nearby`.
    """
    if snapshot.surroundings is None:
        before, controls = snapshot.log_squared_stretch, snapshot.controls
        log_squared, nominal, stable = jump(snapshot.points, controls, target, snapshot.internal, before, nearby)
        return replace(snapshot, log_squared_stretch=log_squared, nominal_stress=nominal, electrical=target[2]), stable
    around, stable = settle(snapshot.surroundings, snapshot.internal, target[2], nearby)
    log_squared, nominal = membrane(around.border, target, snapshot.controls)
    after = replace(snapshot, log_squared_stretch=log_squared, nominal_stress=nominal, electrical=target[2], surroundings=around)
    return after, stable


def _writable(snapshot: FilmSnapshot, electrical: Floats) -> FilmSnapshot:
    """The films under this `electrical` quantity (k,), with arrays to which `_put` may write."""
    around = snapshot.surroundings
    return replace(
        snapshot,
        electrical=electrical,
        log_squared_stretch=snapshot.log_squared_stretch.copy(),
        nominal_stress=snapshot.nominal_stress.copy(),
        surroundings=None if around is None else replace(around, border=around.border.copy()),
    )


def _with_free_damper(snapshot: FilmSnapshot) -> FilmSnapshot:
    """The films with the damper free of stress at their present stretches."""
    internal, around = snapshot.internal.copy(), snapshot.surroundings
    internal[:, -1] = snapshot.log_squared_stretch if around is None else around.stretch()
    return replace(snapshot, internal=internal)


def _put(films: FilmState | FilmSnapshot, columns: Cases, moved: FilmSnapshot, chosen: Flags) -> None:
    """Write the stretches and stresses of the films `moved` (k,) to the `columns` (k,) of `films`, for those `chosen` (k,)."""
    columns = columns[chosen]
    films.log_squared_stretch[:, columns] = moved.log_squared_stretch[:, chosen]
    films.nominal_stress[:, columns] = moved.nominal_stress[:, chosen]
    around = films if isinstance(films, FilmState) else films.surroundings
    if moved.surroundings is not None and around is not None and around.border is not None:
        around.border[:, columns] = moved.surroundings.border[:, chosen]


def _hold(present: FilmState, controls: Controls, target: Floats, columns: Cases, after: FilmState, watch: Watch) -> Cases:
    """Write the state `after` the load of films that hold it, store the events on the way to it, and return the columns of the
    other films.
    """
    on_the_way = {
        search.criterion: search.signal
        for search in watch.searches
        if search.signal is not None and not search.criterion.ends_equilibria
    }
    film = present.take(columns)
    time = film.time
    begin = film.snapshot(controls, columns, watch.clock.age(columns, time))
    reached, held, events = follow_load(begin, film.acting(controls), target[:, columns], on_the_way)
    _put(after, columns, reached, held)
    after.internal[:, -1, ..., columns[held]] = np.moveaxis(reached.internal[:, -1][..., held], -1, 0)
    # a film that snaps back when its voltage is lowered has not failed
    rising = np.abs(target[2, columns]) > np.abs(film.electrical)
    rising |= np.any(np.abs(target[:2, columns] - film.acting(controls)[:2]) > 1e-12 * np.abs(target[:2, columns]), axis=0)
    for search in watch.searches:
        if search.criterion in events:
            event = events[search.criterion]
            new = rising & np.isfinite(event.electrical)
        elif search.criterion.ends_equilibria:
            event, new = reached, rising & ~held
        else:
            continue
        noted = where(new & ~search.seen[columns])
        watch.note(search, time[noted], event.take(noted))
    return columns[~held]


def follow_load(
    begin: FilmSnapshot, present: Floats, target: Floats, signals: Mapping[Criterion, Signal]
) -> tuple[FilmSnapshot, Flags, dict[Criterion, FilmSnapshot]]:
    """Follow the equilibrium of the films `begin` as their load grows from `present` to `target`, both (3, k).

    Viscous stretches are frozen as in `jump`, except that the damper follows, free of stress. The load grows in parts so small that
    Lambda changes by at most `MAX_MOVE` in each.

    Returns the films under the full load, or in the last state with an equilibrium; whether (k,) they hold the full load; and the
    moments at which signals fell to zero on the way, by criterion, with an electrical quantity of NaN in films without that event.
    """
    undamped, around = begin.points.undamped(), begin.surroundings
    way = replace(begin, points=undamped, surroundings=None if around is None else around.without_damper())
    way = _writable(way, begin.electrical)
    count = target.shape[1]

    def load_at(share: Floats, columns: Cases) -> Floats:
        load = np.array((1 - share) * present[:, columns] + share * target[:, columns])
        # the load on the film is the square of the field; the sign is that of the new voltage
        size = np.sqrt((1 - share) * present[2, columns] ** 2 + share * target[2, columns] ** 2)
        load[2] = np.copysign(size, target[2, columns])
        return load

    reached, share, smooth = np.zeros(count), np.ones(count), np.zeros(count, dtype=bool)
    events = {criterion: _writable(begin, np.full(count, np.nan)) for criterion in signals}
    going = np.arange(count)
    while going.size:
        going = paired(going)
        next_share = np.minimum(reached[going] + share[going], 1.0)
        load = load_at(next_share, going)
        # even without a modulus, a damper stretched beyond the limit of its law would have a stress of NaN
        trial, stable = equilibrium_at_once(_with_free_damper(way.take(going)), load, MAX_MOVE)
        change = np.max(np.abs(trial.log_squared_stretch - way.log_squared_stretch[:, going]), axis=0)
        near = stable & (change <= MAX_MOVE)
        located = share[going] < 2 * SMALLEST_SHARE  # located as accurately as the load can be divided
        falls, met = np.zeros(going.size, dtype=bool), np.zeros(going.size, dtype=bool)
        for criterion, signal in signals.items():
            event = events[criterion]
            fallen = near & np.isnan(event.electrical[going]) & (signal(trial) <= 0)
            new = fallen & located
            event.electrical[going[new]] = load[2, new]
            _put(event, going, trial, new)
            falls, met = falls | fallen, met | new
        near &= ~falls | met
        _put(way, going, trial, near)
        reached[going[near]] = next_share[near]
        # beyond a steep part the load may grow in larger parts again
        larger = near & smooth[going] & (change <= 0.5 * MAX_MOVE)
        smooth[going] = near
        share[going] = np.where(met, 1.0, np.where(near, np.where(larger, 2.0, 1.0), 0.5) * share[going])
        going = np.flatnonzero((reached < 1) & (share >= SMALLEST_SHARE))
    log_squared, nominal = way.log_squared_stretch, way.nominal_stress
    ends = where((reached > 0) & (reached < 1))
    if ends.size and around is None:  # locate the end of the equilibrium exactly
        frozen = undamped.take(ends)
        fold = Fold(
            replace(frozen, flow=Flow(np.zeros_like(frozen.modulus))),
            begin.controls,
            lambda share: load_at(share, ends),
            None,
            _with_free_damper(way).internal[:, :, ends],
            log_squared[:, ends],
            reached[ends],
        )
        end, _, log_squared[:, ends], nominal[:, ends] = fold.find()
        reached[ends] = np.minimum(end, 1 - 1e-15)
    if around is not None and way.surroundings is not None:
        around = replace(around, border=way.surroundings.border)
    limit = load_at(reached, np.arange(count))[2]
    films = replace(way, points=begin.points, electrical=limit, surroundings=around)
    events = {criterion: _with_free_damper(event) for criterion, event in events.items()}
    return _with_free_damper(films), reached >= 1, events
