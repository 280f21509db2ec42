"""Currents and energies of source, film and leakage, by quadrature of the dense output.

Per undeformed area and volume, with E~ the nominal field, D~ the nominal charge density, j~ the leakage current and E_s the voltage
of the source over the thickness, the source delivers the current i = dD~/dt + j~, and

    work of the source            int E_s i dt
    leaked energy                 int E~ j~ dt
    energy lost in the resistance int (E_s - E~) i dt.

The rest of the work of the source, int E~ dD~, and the work of the edges, int s_i dlambda_i, are stored in springs and dielectric,
or dissipated by the dashpots. Without a resistance E_s is E~. A load applied at once takes the film through states with frozen
viscous stretches. The work of the source is then the stored energy less the work of the edges; where edges jump, the work of the
edges is the stored energy less int E~ dD~, exact if field or charge stays.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from dielast.material.dielectric import Leakage
from dielast.mechanics.electric import ELECTRIC, FIELD
from dielast.mechanics.equations import Films, films_of
from dielast.mechanics.film import FilmState
from dielast.mechanics.piece import Piece
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import SYMMETRIC
from dielast.mechanics.span import Control, Controls, Load, stretch_prescribed
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.stride import DenseSteps, TriedStep, joined_steps

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
PLACES = np.concatenate(([0.0], 0.5 * (1 + _NODES), [1.0]))  # fractions of a step: Gauss points and both ends
PLACE_WEIGHTS = np.pad(0.5 * _WEIGHTS, 1)

MANY = 512  # steps that are evaluated together
NEXT_TO_NOTHING = 1e-3  # voltage drop over that of the film, below which its rounding matters


@dataclass(frozen=True, slots=True, eq=False)
class Flow:
    """Currents of films at moments (k,): the nominal `field` and the field `source` of the source in V/m, the nominal `charge`
    density in C/m^2, and, in A/m^2 of undeformed area, the current `leak` through the film and the `current` from the source.
    """

    field: Floats
    source: Floats
    charge: Floats
    leak: Floats
    current: Floats


def flow(films: LoadedPoints, leakage: Leakage, time: Floats, state: Floats, rate: Floats) -> Flow:
    """The currents at times (k,) in s since a span of load began.

    `state` and `rate` (rows, k) are the rows of the border and their rates in 1/s.
    """
    points, load = films.points, films.load
    driven, slope = films.driven(time, state), load.slope(time)
    log_squared = films.of_both_axes(state, driven)
    field, charge = points.nominal(log_squared, driven[ELECTRIC])
    area = np.exp(0.5 * (log_squared[0] + log_squared[1]))
    leak = np.asarray(leakage.current_density(field * area) * area)
    circuit = points.circuit
    if circuit is None and points.electric == FIELD:
        # where both axes are equal, the last row belongs to both
        rate_of_axes = rate[[-2, -1] if films.border == -2 else [-1, -1]]
        rate_of_stretch = np.where(stretch_prescribed(load.controls), 2 * slope[:2] / np.exp(0.5 * log_squared), rate_of_axes)
        _, share = points.capacitance(log_squared)
        change = charge * np.einsum("cm,cm->m", share, rate_of_stretch)
        capacity = points.nominal(log_squared, np.ones_like(field))[1]
        return Flow(field, field, charge, leak, capacity * slope[ELECTRIC] + change + leak)
    if circuit is None or circuit.resistance is None:
        return Flow(field, field, charge, leak, slope[ELECTRIC] + (leak if circuit is None else 0.0))
    return Flow(field, load.value(time)[ELECTRIC], charge, leak, rate[films.border] + leak)


class ElectricMeter:
    """Integrates the energies `totals` (4, cases) in J/m^3: work of the source, leaked energy, energy lost in the resistance, work
    of the edges.

    Steps are stored, and evaluated together with others. `begin` is to be called before a piece of load, `follow` with every step,
    and `ask` for rows within that step, which `rows` returns in the order in which they were asked for.
    """

    def __init__(self, leakage: Leakage, cases: int) -> None:
        self.leakage, self._totals = leakage, np.zeros((4, cases))
        self._start = np.zeros(cases)
        self._piece: Piece | None = None
        self._system: LoadedPoints | None = None
        self._needs_springs = False
        self._kept: list[
            tuple[DenseSteps, Cases, Cases, Floats]
        ] = []  # steps of a pool, its columns (k,), their spans, when they begin
        self._size = 0
        self._asked: list[tuple[Cases, Floats]] = []  # the steps that contain the rows (k,), and the times of the rows
        self._stopped: list[Cases] = []  # the steps (k,) within which films stopped
        self._ready: list[Floats] = []
        self._ends: list[tuple[DenseSteps, Load, Floats, Floats]] = []  # with the times and energies at the beginning
        self.pass_on: Callable[[DenseSteps, Floats], None] | None = None
        """Called with steps (k,) and Lambda (2, places k) of their films at `PLACES`, as these are evaluated."""

    @property
    def totals(self) -> Floats:
        """The energies (4, cases) in J/m^3 since the programme began."""
        self._evaluate()
        return self._totals

    def leap(self, controls: Controls, before: FilmState, after: FilmState, moved: Flags) -> None:
        """Add the work of a load applied at once, which takes the films `before` to those `after`; edges jump in the cases `moved`
        (cases,).
        """
        gained = _stored(after) - _stored(before)
        change = np.exp(0.5 * after.log_squared_stretch) - np.exp(0.5 * before.log_squared_stretch)
        free = ~stretch_prescribed(controls)
        stress = after.nominal_stress
        if after.points.edges is not None:
            stress = 0.5 * (before.nominal_stress + stress)
        work = gained - np.sum(np.where(free, stress * change, 0.0), axis=0)
        if moved.any():
            (field, charge), (last, end) = (
                film.points.nominal(film.log_squared_stretch, film.electrical) for film in (before, after)
            )
            work = np.where(moved, 0.5 * (field + last) * (end - charge), work)
        work = np.where(np.isfinite(work), work, 0.0)
        self.totals[0] += work
        self.totals[3] += np.where(np.isfinite(gained), gained - work, 0.0)

    def begin(self, start: Floats, piece: Piece, system: Films) -> None:
        """Begin a piece of load at `start` (cases,) in s, with the films in its first span."""
        self._evaluate()
        assert isinstance(system, LoadedPoints)
        self._start, self._piece = start, piece
        # the stress along an axis counts only where its stretch is prescribed and moves
        moved = [any(np.any(target[axis] != piece.start[axis]) for target in piece.targets) for axis in range(2)]
        self._needs_springs = any(np.logical_and(moved, stretch_prescribed(piece.controls)[:, 0]))
        self._system = system if self._needs_springs else replace(system, points=system.points.without_springs())

    def ask_now(self, films: Films, state: Floats, cases: Cases) -> None:
        """Ask for rows at the beginning of a piece, from the complete state (rows, k)."""
        assert isinstance(films, LoadedPoints)
        time, totals = np.zeros(cases.size), self.totals
        flowing = flow(films, self.leakage.take(cases), time, state, equilibrium_rate(films, time, state))
        self._ready.append(self._rows(flowing, totals[:, cases]))

    def follow(self, stride: TriedStep, stopped: Flags) -> None:
        """Add a step; films of the columns `stopped` (pool,) stop within it, at times that are known when they have `ended`."""
        columns = stride.once
        if not columns.size:
            return
        if self._size >= MANY:
            self._evaluate()
        steps = stride.stored(slice(None) if self._needs_springs else slice(films_of(stride).border, None))
        self._kept.append((steps, columns, stride.span[columns], stride.begin[columns]))
        if (last := np.flatnonzero(stopped[columns])).size:
            self._stopped.append(self._size + last)
        self._size += columns.size

    def ask(self, stride: TriedStep, columns: Cases, time: Floats) -> None:
        """Ask for rows of columns (k,) at times (k,) in s since their spans began, within the step that was added last."""
        count = stride.once.size
        self._asked.append((self._size - count + np.minimum(np.searchsorted(stride.once, columns), count - 1), time))

    def rows(self, count: int) -> Floats:
        """The rows of `ELECTRICAL` but the last (7, count) that were asked for first, and have not been returned yet."""
        self._evaluate()
        ready = np.concatenate(self._ready, axis=1)
        self._ready = [ready[:, count:]]
        return ready[:, :count]

    def ended(self, time: Floats) -> Floats:
        """The rows of `ELECTRICAL` but the last (7, cases) at the times (cases,) in s at which films stopped.

        For films that stopped as a load was applied at once, charge and current are NaN; the energies are those after the jump if
        the film holds the load, and those before it otherwise.
        """
        none = np.full(time.size, np.nan)
        source = np.zeros(time.size) if self._piece is None else self._piece.start[ELECTRIC]
        rows = np.stack((none, source, none, *self.totals))
        for steps, load, start, before in self._ends:
            rows[:, steps.cases] = self._within(load, steps, before, time[steps.cases] - start)
        return rows

    def _evaluate(self) -> None:
        """Add the energies of the stored steps, and evaluate the rows that were asked for."""
        if not self._kept:
            return
        assert self._piece is not None
        assert self._system is not None
        steps = joined_steps([kept[:2] for kept in self._kept])
        span, begin = (np.concatenate([kept[index] for kept in self._kept]) for index in (2, 3))
        load = self._piece.span(steps.cases, span)[0]
        added = self._energies(load, steps, np.ones(self._size), self.pass_on)
        before, first = np.empty_like(added), 0
        for _, columns, _, _ in self._kept:  # the steps of a case follow each other
            part = slice(first, first + columns.size)
            cases = steps.cases[part]
            before[:, part] = self._totals[:, cases]
            self._totals[:, cases] = before[:, part] + added[:, part]
            first = part.stop
        if self._asked:
            index, time = (np.concatenate(asked) for asked in zip(*self._asked, strict=True))
            self._ready.append(self._within(load.take(index), steps.take(index), before[:, index], time))
        if self._stopped:
            last = np.concatenate(self._stopped)
            start = self._start[steps.cases[last]] + begin[last]
            self._ends.append((steps.take(last), load.take(last), start, before[:, last]))
        self._kept, self._size, self._asked, self._stopped = [], 0, [], []

    def _within(self, load: Load, steps: DenseSteps, before: Floats, time: Floats) -> Floats:
        """The rows of `ELECTRICAL` but the last (7, k) under a load of k cases, at times (k,) in s since the spans began, with the
        energies `before` (4, k) the steps.
        """
        fraction = np.clip((time - steps.time) / steps.step, 0.0, 1.0)
        _, _, flowing = self._flowing(load, steps, time, fraction)
        return self._rows(flowing, before + self._energies(load, steps, fraction))

    def _flowing(self, load: Load, steps: DenseSteps, time: Floats, fraction: Floats) -> tuple[LoadedPoints, Floats, Flow]:
        """The films (k,) at fractions (k,) of the steps, which are times (k,) in s since the spans began; their state, and the
        currents.
        """
        assert self._system is not None
        films = self._system.take(steps.cases).driven_by(np.arange(time.size), load)
        state, rate = steps.state(fraction), steps.rows(slice(films.border, None)).rate(fraction)
        return films, state, flow(films, self.leakage.take(steps.cases), time, state, rate)

    def _energies(
        self, load: Load, steps: DenseSteps, part: Floats, pass_on: Callable[[DenseSteps, Floats], None] | None = None
    ) -> Floats:
        """The energies (4, k) of the first `part` (k,) of the steps, under a load of k cases."""
        count = steps.cases.size
        many = np.tile(np.arange(count), PLACES.size)
        fraction = np.repeat(PLACES, count) * part[many]
        wide = steps.take(many)
        time = wide.time + fraction * wide.step
        films, state, flowing = self._flowing(load.take(many), wide, time, fraction)
        drop, circuit = flowing.source - flowing.field, films.points.circuit
        heat = drop * flowing.current
        if circuit is not None and circuit.resistance is not None:
            # a very small drop is below the tolerance of the charge; r i^2, which is never negative, is then more accurate
            small = np.abs(drop) < NEXT_TO_NOTHING * np.abs(flowing.field)
            heat = np.where(small, circuit.resistance * flowing.current**2, heat)
        driven = films.driven(time, state)
        log_squared, nominal = films.membrane(state, driven)
        power, term = work_of_edges(films, driven, films.load.slope(time), log_squared, nominal)
        if pass_on is not None:
            pass_on(steps, log_squared)
        powers = np.stack((flowing.source * flowing.current, flowing.field * flowing.leak, heat, power))
        powers = powers.reshape(4, PLACES.size, count)[..., paired(np.arange(count))]
        energies = np.einsum("n,rnk->rk", PLACE_WEIGHTS, powers)[:, :count] * part * steps.step
        energies[3] += term[-count:] - term[:count]
        return np.asarray(energies)

    @staticmethod
    def _rows(flowing: Flow, energies: Floats) -> Floats:
        return np.stack((flowing.charge, flowing.source, flowing.current, *energies))


def work_of_edges(films: Films, driven: Floats, slope: Floats, log_squared: Floats, nominal: Floats) -> tuple[Floats, Floats]:
    """A power (k,) in W/m^3 and a term (k,) in J/m^3, of films whose load has the values `driven` and the rates `slope` (3, k), at
    Lambda and nominal stresses (2, k): int s_i dlambda_i is the integral of the power, and the change of the term.

    Along an axis of prescribed stress it is integrated by parts, as the rate of the stretch is less exact than the stretch.
    """
    stretch, edges = np.exp(0.5 * log_squared), films.points.edges
    power, term = np.zeros_like(stretch)
    for axis, control in enumerate(films.load.controls):
        if control is Control.STRESS:
            power -= stretch[axis] * slope[axis]
            term += driven[axis] * stretch[axis]
            if edges is not None:
                term -= 0.5 * edges.stiffness[axis] * np.square(stretch[axis] - edges.home[axis])
        elif slope[axis].any():
            power += nominal[axis] * slope[axis]
    return power, term


def equilibrium_rate(films: LoadedPoints, time: Floats, state: Floats) -> Floats:
    """The rates (rows, k) in 1/s of the rows of the border, of films in equilibrium with the complete state (rows, k).

    They follow from the rates of the viscous stretches: dLambda/dt on free axes, 0 on held axes. The damper, the last spring, is
    omitted. NaN where there is no stable equilibrium.
    """
    points, load = films.points, films.load
    driven, slope = films.driven(time, state), load.slope(time)
    log_squared, nominal_stress = films.membrane(state, driven)
    undamped = points.undamped()
    stress, half = points.law.tangent(points.springs(films.internal(state), log_squared))
    flowing = points.flow.rate(stress)
    flowing[:, -1] = 0.0
    rate = np.zeros((-films.border, time.size))
    _, by_stretch, by_load = points.maxwell_tangent(log_squared, driven[ELECTRIC])
    change, circuit = slope[ELECTRIC], points.circuit
    if circuit is not None:
        permittivity, log_area = points.permittivity_at(log_squared), log_squared[0] + log_squared[1]
        supply = circuit.supply(permittivity, log_area, driven[ELECTRIC], load.value(time)[ELECTRIC], change)
        rate[0] = change = supply - circuit.leak(permittivity, log_area, driven[ELECTRIC])
    tangent = undamped.film_tangent(half, by_stretch, nominal_stress * np.exp(0.5 * log_squared), log_squared)
    right = np.einsum("nm,abnm,bnm->am", undamped.modulus, half[SYMMETRIC], flowing) + by_load * change
    free = [control is Control.STRESS for control in load.controls]
    if all(free):
        determinant = tangent[0, 0] * tangent[1, 1] - tangent[0, 1] * tangent[1, 0]
        first = tangent[1, 1] * right[0] - tangent[0, 1] * right[1]
        second = tangent[0, 0] * right[1] - tangent[1, 0] * right[0]
        stable = (determinant > 0) & (tangent[0, 0] > 0)
        rate_of_stretch = np.where(stable, np.stack((first, second)) / np.where(stable, determinant, 1.0), np.nan)
    else:
        diagonal = np.stack((tangent[0, 0], tangent[1, 1]))
        rate_of_stretch = np.where(np.array(free)[:, None], right / np.where(diagonal > 0, diagonal, np.nan), 0.0)
    open_rows = -films.border - (circuit is not None)
    rate[-open_rows:] = rate_of_stretch[-open_rows:]
    return rate


def _stored(film: FilmState) -> Floats:
    """The energy (cases,) in J/m^3 stored in springs and dielectric."""
    return film.points.stored(film.internal, film.log_squared_stretch, film.electrical)
