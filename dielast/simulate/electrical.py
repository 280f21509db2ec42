"""What flows between the source, the film and its leak, and the energies of it, by quadrature on the stepper's dense output.

Per undeformed area and volume, with E~ the nominal field, D~ the nominal charge density and j~ the leak, the source at a voltage of
E_s times the thickness sends the current i = dD~/dt + j~, so that

    source's work       int E_s i dt
    leaked              int E~ j~ dt
    lost in resistance  int (E_s - E~) i dt.

What remains of the source's work, int E~ dD~, and the work of the loads, s_i dlambda_i, are stored in springs and dielectric, or
dissipated by the dashpots. Without a resistance E_s is E~. What is applied at once takes the film along states in which its viscous
stretches are frozen: the source's work is then all that is stored, less what the loads do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.io.result import Result
from dielast.material.leakage import Leakage
from dielast.mechanics.circuit import Circuit
from dielast.mechanics.electric import ELECTRIC, FIELD
from dielast.mechanics.point_material import SYMMETRIC, Points
from dielast.mechanics.span import Control, Controls, stretched
from dielast.mechanics.symmetric import Films
from dielast.numerics.columns import Cases, Flags, Floats, paired
from dielast.numerics.stride import DenseSteps, Stride
from dielast.simulate.film import Condition

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
NODES, WEIGHTS = 0.5 * (1 + _NODES), 0.5 * _WEIGHTS  # of a step

NEXT_TO_NOTHING = 1e-3  # of the film's voltage

EXTRA = ("charge", "source", "current", "work", "leaked", "lost")
"""Rows that a record has of what is electrical, beside the others."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Electrical(Result):
    """What is electrical about films: arrays (cases, times), None where there is no such thing.

    `source_voltage` in V of a source with a resistance; `charge_density` in C/m^2 and `current_density` in A/m^2, that from the
    source, per undeformed area of the electrode, and `charge` in C and `current` in A where its area is known. Per undeformed
    volume and since the programme began, in J/m^3: `electrical_energy` that the source has delivered, `leaked_energy` and
    `resistor_energy` that turned to heat in the leak and in the resistance.
    """

    charge_density: Floats
    current_density: Floats
    electrical_energy: Floats
    source_voltage: Floats | None = None
    charge: Floats | None = None
    current: Floats | None = None
    leaked_energy: Floats | None = None
    resistor_energy: Floats | None = None


UNITS = {
    **{"source_voltage": "V", "charge_density": "C/m^2", "charge": "C", "current_density": "A/m^2", "current": "A"},
    **{"electrical_energy": "J/m^3", "leaked_energy": "J/m^3", "resistor_energy": "J/m^3"},
}
"""Units of the columns, in their order."""


@dataclass(frozen=True, slots=True, eq=False)
class Flow:
    """Films at moments (k,): the nominal `field` and that of the `source` in V/m, the nominal `charge` in C/m^2, and the currents
    in A/m^2 of undeformed area, `leak` through the film and `current` from the source.
    """

    field: Floats
    source: Floats
    charge: Floats
    leak: Floats
    current: Floats


def nominal(points: Points, log_squared_stretch: Floats, acting: Floats) -> tuple[Floats, Floats]:
    """The nominal field in V/m and the nominal charge density in C/m^2 (cases,) of films at Lambda (2, cases) under what acts on
    them (cases,), one of the two.
    """
    capacity = points.permittivity_at(log_squared_stretch) * np.exp(log_squared_stretch[0] + log_squared_stretch[1])
    if points.electric is FIELD:
        return acting, capacity * acting
    return acting / capacity, acting


def leak_of(leakage: Leakage, log_squared_stretch: Floats, field: Floats) -> Floats:
    """The current through films (cases,) in A/m^2 of undeformed area at a nominal field (cases,)."""
    area = np.exp(0.5 * (log_squared_stretch[0] + log_squared_stretch[1]))
    return np.asarray(leakage.current_density(field * area) * area)


def flow(films: Films, leakage: Leakage, time: Floats, state: Floats, rate: Floats) -> Flow:
    """What flows at times (k,) in s since a span of load began, where the rows of the border of states (rows, k) change by `rate`
    (rows, k).
    """
    points, load = films.points, films.load
    driven, slope = films.driven(time, state), load.slope(time)
    log_squared, _ = films.membrane(state, driven)
    field, charge = nominal(points, log_squared, driven[ELECTRIC])
    leak = leak_of(leakage, log_squared, field)
    circuit = points.circuit
    if circuit is None and points.electric is FIELD:
        # of axes alike, the last row is that of both
        both = rate[[-2, -1] if films.border == -2 else [-1, -1]]
        moves = np.where(stretched(load.controls), 2 * slope[:2] / np.exp(0.5 * log_squared), both)
        _, share = points.capacitance(log_squared)
        change = charge * np.einsum("cm,cm->m", share, moves)
        capacity = nominal(points, log_squared, np.ones_like(field))[1]
        return Flow(field, field, charge, leak, capacity * slope[ELECTRIC] + change + leak)
    if circuit is None or circuit.resistance is None:
        return Flow(field, field, charge, leak, slope[ELECTRIC] + (leak if circuit is None else 0.0))
    return Flow(field, load.value(time)[ELECTRIC], charge, leak, rate[films.border] + leak)


@dataclass(slots=True, eq=False)
class _End:
    """The last step of a column of a case that was stopped within it: `start` (k,) of its span in s since the programme began, and
    the energies `before` (3, k) it.
    """

    steps: DenseSteps
    films: Films
    start: Floats
    before: Floats


class ElectricMeter:
    """Adds up the energies of films, `totals` (3, cases) in J/m^3: work of the source, leaked, and lost in the resistance."""

    def __init__(self, leakage: Leakage, cases: int) -> None:
        self.leakage, self.totals = leakage, np.zeros((3, cases))
        self._start, self._source = np.zeros(cases), np.zeros(cases)
        self._ends: list[_End] = []

    def leap(self, points: Points, controls: Controls, before: Condition, after: Condition) -> None:
        """Films went from one condition to another at once."""
        gained = _stored(points, after) - _stored(points, before)
        moved = np.exp(0.5 * after.log_squared_stretch) - np.exp(0.5 * before.log_squared_stretch)
        free = ~stretched(controls)
        work = gained - np.sum(np.where(free, after.nominal_stress * moved, 0.0), axis=0)
        self.totals[0] += np.where(np.isfinite(work), work, 0.0)

    def begin(self, start: Floats, source: Floats) -> None:
        """A piece of load begins at `start` (cases,) s with this value of the source (cases,)."""
        self._start, self._source = start, source

    def now(self, films: Films, state: Floats, cases: Cases) -> Floats:
        """Rows `EXTRA` (6, k) of films at the beginning of a piece, with the whole state (rows, k)."""
        time = np.zeros(cases.size)
        return self._rows(
            flow(films, self.leakage.take(cases), time, state, equilibrium_rate(films, time, state)), self.totals[:, cases]
        )

    def at(self, stride: Stride, columns: Cases, time: Floats) -> Floats:
        """Rows `EXTRA` (6, k) of columns (k,) at times (k,) in s since their spans began, within their steps."""
        films = _films(stride).take(columns)
        steps = DenseSteps.of(stride, slice(films.border, None), columns)
        return self._within(films, steps, self.totals[:, steps.cases], time)

    def follow(self, stride: Stride, stopped: Flags) -> None:
        """Add what a step contributes; columns that are `stopped` (pool,) are kept for `ended`."""
        columns = paired(np.flatnonzero(stride.accepted))
        if not columns.size:
            return
        films = _films(stride).take(columns)
        steps = DenseSteps.of(stride, slice(films.border, None), columns)
        before = self.totals[:, steps.cases]
        if (last := np.flatnonzero(stopped[columns])).size:
            start = self._start[steps.cases] + stride.begin[columns]
            self._ends.append(_End(steps.take(last), films.take(last), start[last], before[:, last]))
        self.totals[:, steps.cases] = before + self._energies(films, steps, np.ones(columns.size))

    def ended(self, time: Floats) -> Floats:
        """Rows `EXTRA` (6, cases) at the times (cases,) in s at which films were stopped; of a film that a load at once ended,
        charge and current are left open, and the energies are those of the load, where the film holds that, or before it.
        """
        none = np.full(time.size, np.nan)
        rows = np.stack((none, self._source, none, *self.totals))
        for end in self._ends:
            rows[:, end.steps.cases] = self._within(end.films, end.steps, end.before, time[end.steps.cases] - end.start)
        return rows

    def _within(self, films: Films, steps: DenseSteps, before: Floats, time: Floats) -> Floats:
        """Rows `EXTRA` (6, k) at times (k,) in s since the spans began; the energies `before` (3, k) are those before the steps."""
        fraction = np.clip((time - steps.time) / steps.step, 0.0, 1.0)
        flowing = flow(films, self.leakage.take(steps.cases), time, steps.state(fraction), steps.rate(fraction))
        return self._rows(flowing, before + self._energies(films, steps, fraction))

    def _energies(self, films: Films, steps: DenseSteps, part: Floats) -> Floats:
        """What the first `part` (k,) of steps contributes, (3, k)."""
        count = steps.cases.size
        many = np.tile(np.arange(count), NODES.size)
        fraction = np.repeat(NODES, count) * part[many]
        wide = steps.take(many)
        time = wide.time + fraction * wide.step
        flowing = flow(films.take(many), self.leakage.take(wide.cases), time, wide.state(fraction), wide.rate(fraction))
        powers = np.stack(
            (
                flowing.source * flowing.current,
                flowing.field * flowing.leak,
                _heat(films.points.circuit, flowing, many),
            )
        )
        weighted = np.einsum("n,rnk->rk", WEIGHTS, powers.reshape(3, NODES.size, count))
        return np.asarray(weighted * part * steps.step)

    @staticmethod
    def _rows(flowing: Flow, energies: Floats) -> Floats:
        return np.stack((flowing.charge, flowing.source, flowing.current, *energies))


def _heat(circuit: Circuit | None, flowing: Flow, columns: Cases) -> Floats:
    """The power (k,) in W/m^3 lost in the resistance, (E_s - E~) i; where next to nothing of the voltage drops there, the tolerance
    of the charge is more than what drops, and r i^2 is the better number, which is never negative.
    """
    drop = flowing.source - flowing.field
    heat = drop * flowing.current
    if circuit is None or circuit.resistance is None:
        return np.asarray(heat)
    return np.where(np.abs(drop) < NEXT_TO_NOTHING * np.abs(flowing.field), circuit.resistance[columns] * flowing.current**2, heat)


def equilibrium_rate(films: Films, time: Floats, state: Floats) -> Floats:
    """How fast the rows of the border (rows, k) of films in equilibrium change, with the whole state (rows, k), from the rates of
    the viscous stretches: dLambda/dt on the free axes. The damper, which is the last of the springs, has no part in it; NaN where
    there is no stable equilibrium. Rows of held axes are 0.
    """
    points, load = films.points, films.load
    driven, slope = films.driven(time, state), load.slope(time)
    log_squared, nominal_stress = films.membrane(state, driven)
    modulus = points.modulus.copy()
    modulus[-1] = 0.0
    stress, half = points.law.tangent(points.springs(films.internal(state), log_squared))
    flowing = points.rate * (3 * stress - stress.sum(axis=0))
    flowing[:, -1] = 0.0
    rate = np.zeros((-films.border, time.size))
    charge_rate = np.zeros_like(time)
    _, by_stretch, by_load = points.maxwell_tangent(log_squared, driven[ELECTRIC])
    circuit = points.circuit
    if circuit is None:
        charge_rate = slope[ELECTRIC]
    else:
        permittivity, log_area = points.permittivity_at(log_squared), log_squared[0] + log_squared[1]
        supply = circuit.supply(permittivity, log_area, driven[ELECTRIC], load.value(time)[ELECTRIC], slope[ELECTRIC])
        rate[0] = charge_rate = supply - circuit.leak(permittivity, log_area, driven[ELECTRIC])
    tangent = np.einsum("nm,cnm->cm", modulus, half)[SYMMETRIC] - by_stretch
    tangent[(0, 1), (0, 1)] -= 0.5 * nominal_stress * np.exp(0.5 * log_squared)
    right = np.einsum("nm,abnm,bnm->am", modulus, half[SYMMETRIC], flowing) + by_load * charge_rate
    free = [control is Control.STRESS for control in load.controls]
    if all(free):
        determinant = tangent[0, 0] * tangent[1, 1] - tangent[0, 1] * tangent[1, 0]
        first = tangent[1, 1] * right[0] - tangent[0, 1] * right[1]
        second = tangent[0, 0] * right[1] - tangent[1, 0] * right[0]
        stable = (determinant > 0) & (tangent[0, 0] > 0)
        moves = np.where(stable, np.stack((first, second)) / np.where(stable, determinant, 1.0), np.nan)
    else:
        diagonal = np.stack((tangent[0, 0], tangent[1, 1]))
        moves = np.where(np.array(free)[:, None], right / np.where(diagonal > 0, diagonal, np.nan), 0.0)
    open_rows = -films.border - (circuit is not None)
    rate[-open_rows:] = moves[-open_rows:]
    return rate


def _stored(points: Points, condition: Condition) -> Floats:
    """Energy (cases,) in J/m^3 of springs and dielectric."""
    log_squared = condition.log_squared_stretch
    squared = points.springs(condition.internal, log_squared)
    field, charge = nominal(points, log_squared, condition.field)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sum(points.modulus * points.law.energy(squared), axis=0) + 0.5 * field * charge)


def _films(stride: Stride) -> Films:
    assert isinstance(stride.system, Films)
    return stride.system
