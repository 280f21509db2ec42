"""The response of a film in each cycle of a waveform: extremes, mean, the component at the period, and work, by quadrature of the
dense output.

The load varies as -cos(2 pi t / T) times half of (high - low). A quantity y has the component a cos(w t - phi) at the period, with
a exp(i phi) = 2/T int y exp(i w t) dt and w = 2 pi / T. Its phase is its lead over the load: negative where y lags.
The work per undeformed volume is int s_1 dlambda_1 + s_2 dlambda_2 + E~ dD~ with the nominal stress s, the nominal field E~ and the
nominal charge density D~ = eps lambda_1^2 lambda_2^2 E~; in a periodic cycle, it is the dissipation of the film. If electrical
quantities are requested, the work includes the leakage E~ j~ dt, and the efficiency is the energy that returns to the source in a
cycle over the energy that it delivers: 1 without losses in film and circuit. In a programme of edges and electrodes it is the net
energy that one of source and edges receives over that which the other delivers. The cycles of such a programme are those of its
waveforms, or the laps of the steps that repeat, which have neither a load of one period nor a phase.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.material.dielectric import Leakage
from dielast.mechanics.electric import FIELD
from dielast.mechanics.equations import Films, films_of
from dielast.mechanics.piece import Cycles, Piece
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.stride import DenseSteps, TriedStep, joined_steps
from dielast.simulate.electrical import PLACE_WEIGHTS, PLACES, ElectricMeter, flow, work_of_edges

FINE = np.linspace(0.0, 1.0, 33)
# maps values at PLACES to those of their interpolating polynomial at FINE
POLYNOMIAL = np.vander(FINE, PLACES.size) @ np.linalg.inv(np.vander(PLACES, PLACES.size))
MANY = 512  # steps that are added to the sums together
_RAISED = np.arange(1, PLACES.size + 1)
# maps values at PLACES to the integrals of their interpolating polynomial from 0 to FINE
INTEGRAL = (FINE[:, None] ** _RAISED / _RAISED) @ np.linalg.inv(np.vander(PLACES, PLACES.size, increasing=True))
NAMES = (
    *("lowest", "highest", "mean", "amplitude", "phase", "work"),
    *("electrical_energy", "mechanical_work", "energy_per_mass", "efficiency"),
)
UNITS = {
    **{"phase": "rad", "work": "J/m^3", "efficiency": "1"},
    **{"electrical_energy": "J/m^3", "mechanical_work": "J/m^3", "energy_per_mass": "J/kg"},
}
EMPTY = {
    **{"lowest": np.inf, "highest": -np.inf, "total": 0.0},  # the extremes and the integral of the measured quantity
    **{"cosine": 0.0, "sine": 0.0},  # the integrals of its component at the period
    **{"work": 0.0, "delivered": 0.0, "returned": 0.0, "by_edges": 0.0},  # energies per undeformed volume
    **{"planned": 0.0, "lasted": 0.0},  # the planned and the reached duration
}
"""What is summed up over the steps of a cycle, by name, without any step."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CycleTable(TabularResult):
    """Cycles of waveforms, numbered from 1 through a history: arrays (cases, cycles), NaN for an unfinished cycle.

    `lowest`, `highest` and `mean` of the measured quantity in its `unit`; `amplitude` of its component at the period, and `phase`
    in rad by which it leads the load, negative where it lags; `work` done on the film, by source and load together, in J/m^3 of
    undeformed volume; `efficiency`, the returned over the delivered energy of the source, None unless it was requested. In a
    programme of edges and electrodes: the net `electrical_energy` of the source, the `mechanical_work` of the edges, and, with a
    density, the `energy_per_mass` in J/kg that the source receives.
    """

    unit: str

    lowest: Floats
    highest: Floats
    mean: Floats
    work: Floats
    amplitude: Floats | None = None
    phase: Floats | None = None
    efficiency: Floats | None = None
    electrical_energy: Floats | None = None
    mechanical_work: Floats | None = None
    energy_per_mass: Floats | None = None

    def case(self, row: int) -> dict[str, Floats]:
        """The finished cycles of a case, (cycles,), by their headers."""
        finished = np.isfinite(self.mean[row])
        arrays = {name: getattr(self, name) for name in NAMES}
        values = {
            f"{name} [{UNITS.get(name, self.unit)}]": array[row, finished] for name, array in arrays.items() if array is not None
        }
        return {"cycle": np.flatnonzero(finished) + 1, **values}

    def columns(self) -> Table:
        """The table of all cases, one after another."""
        return case_table({row: self.case(row) for row in range(len(self.mean))})


@dataclass(slots=True, eq=False)
class CycleMeter:
    """An observer of the stepper that evaluates waveforms. `begin` and `finish` are to be called before and after a piece of load.

    The measured quantity is the stretch of axis 1 or, with `stress`, its nominal stress, divided by `unit` (cases,). The efficiency
    is computed if there is a `leakage`, even one of conductivity 0. The energies of laps are differences of those of the `electric`
    meter, which all programmes have.
    """

    points: PointMaterial
    unit: Floats
    stress: bool
    leakage: Leakage | None = None
    programme: bool = False
    density: Floats | None = None
    electric: ElectricMeter | None = None
    _tables: list[dict[str, Floats]] = field(default_factory=list)
    _piece: Piece | None = None
    """The piece of load, if it is a waveform or part of a lap."""
    _lap: int = 0
    _buffer: list[tuple[DenseSteps, Cases, Cases, Floats, Flags, Flags]] = field(default_factory=list)
    """Steps to evaluate together: the dense output of a pool, and of its columns (k,) the spans, when these begin, whether the step
    ends its span, and whether the film is slack.
    """
    _size: int = 0
    _system: Films | None = None
    _sums: dict[str, Floats] = field(default_factory=dict)
    """The sums of `EMPTY` (cases, cycles)."""
    _at_rest: Floats = field(default_factory=lambda: np.zeros(0))
    """The measured quantity at the beginning of the waveform (cases,)."""
    _finished: Cases = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    _totals: Floats | None = None
    """The energies of the electric meter (4, cases) at the end of the last piece of load, and when the lap began."""
    _totals_before: Floats | None = None

    def begin(self, piece: Piece, system: Films, state: Floats) -> None:
        """Begin a piece of load with this state (rows, cases)."""
        if self._lap and piece.lap != self._lap:
            self._close()
        self._piece = piece if isinstance(piece, Cycles) or piece.lap else None
        if self._piece is None:
            return
        stretched = isinstance(system, LoadedPoints) and system.stretched
        self.points, cases = system.points if stretched else system.points.without_springs(), self.unit.size
        if not self._lap:
            self._sums = {name: np.full((cases, piece.cycles or 1), value) for name, value in EMPTY.items()}
            self._finished = np.zeros(cases, dtype=np.intp)
            self._totals_before = np.zeros((4, cases)) if self._totals is None else self._totals
            membrane = system.membrane(state, system.driven(np.zeros(cases), state))
            self._at_rest = self._measured(*membrane, np.arange(cases))
        self._lap = piece.lap
        if self.electric is not None:
            self.electric.pass_on = self._add_of_lap if self._lap else None
        self._sums["planned"] += piece.duration[:, None]

    def __call__(self, stride: TriedStep) -> None:
        """Store the step of a waveform until it is added to the sums."""
        if self._piece is None or self._lap:
            return
        columns = stride.once
        if not columns.size:
            return
        self._system = system = films_of(stride)
        steps = stride.stored(system.of_membrane)
        slack = (
            system.slack[columns] if isinstance(system, LoadedPoints) and system.slack is not None else np.zeros(columns.size, bool)
        )
        ends_span = (stride.until == stride.duration)[columns]
        self._buffer.append((steps, columns, stride.span[columns], stride.begin[columns], ends_span, slack))
        self._size += columns.size
        if self._size >= MANY:
            self._add()

    def _measured(self, log_squared: Floats, nominal: Floats, cases: Cases) -> Floats:
        """The measured quantity (k,) at Lambda and nominal stresses (2, k) of these cases."""
        return np.asarray((nominal if self.stress else np.exp(0.5 * log_squared))[0] / self.unit[cases])

    def finish(self) -> None:
        """End a piece of load."""
        if self.electric is not None:
            self._totals = self.electric.totals.copy()
        if self._piece is None:
            return
        if self._buffer:
            self._add()
        if not self._lap:
            self._close()

    def _close(self) -> None:
        """Store the cycles of a waveform, or a lap of steps that repeat."""
        lowest, highest, total, cosine, sine, work, delivered, returned, by_edges, planned, lasted = self._sums.values()
        piece, table = self._piece, dict[str, Floats]()
        if isinstance(piece, Cycles):
            period = piece.period[:, None]
            table["amplitude"] = 2 / period * np.hypot(cosine, sine)
            behind = np.arctan2(sine, cosine) - np.where((piece.high > piece.low).any(axis=0), np.pi, 0.0)[:, None]
            table["phase"] = -np.remainder(behind + np.pi, 2 * np.pi) + np.pi
            ended = np.arange(planned.shape[1]) < self._finished[:, None]
        else:
            period, ended = np.where(planned > 0, planned, np.nan), lasted >= planned * (1 - 1e-9)
            assert self._totals is not None
            assert self._totals_before is not None
            delivered, _, lost, by_edges = (part[:, None] for part in self._totals - self._totals_before)
            work, returned = delivered - lost + by_edges, np.zeros_like(delivered)
        table |= {"lowest": lowest, "highest": highest, "mean": total / period, "work": work}
        if self.leakage is not None:
            table["efficiency"] = returned / np.where(delivered > 0, delivered, np.nan)
        if self.leakage is not None and self.programme:
            net = delivered - returned
            table |= {"electrical_energy": net, "mechanical_work": by_edges}
            given, received = np.maximum(net, by_edges), -np.minimum(net, by_edges)
            table["efficiency"] = np.where((given > 0) & (received > 0), received / np.where(given > 0, given, 1.0), np.nan)
            if self.density is not None:
                table["energy_per_mass"] = -net / self.density[:, None]
        self._tables.append({name: np.where(ended, values, np.nan) for name, values in table.items()})
        # many small arrays would take far more memory than their numbers
        while len(self._tables) > 1 and self._tables[-2]["mean"].shape[1] <= self._tables[-1]["mean"].shape[1]:
            self._tables[-2:] = [_joined(self._tables[-2:])]
        self._lap = 0

    def collect(self) -> CycleTable | None:
        """The table of all cycles so far, None without any."""
        if self._lap:
            self._close()
        if not self._tables:
            return None
        return CycleTable("Pa" if self.stress else "1", **_joined(self._tables))

    def _add_of_lap(self, steps: DenseSteps, log_squared: Floats) -> None:
        """Add steps (k,) of a lap, whose stretch is measured, to the sums, from Lambda (2, places k) at `PLACES`."""
        measured = np.exp(0.5 * log_squared[0]).reshape(PLACES.size, -1) / self.unit[steps.cases]
        self._add_measured(steps, np.zeros_like(steps.cases), measured)

    def _add_measured(self, steps: DenseSteps, cycle: Cases, measured: Floats, least: float = -np.inf) -> None:
        """Add steps (k,) of these cycles to the extremes and the mean of the quantity `measured` (places, k) at `PLACES`, which is
        `least` at the least: the polynomial through its values may be lower.
        """
        where, fine = (steps.cases, cycle), np.maximum(_applied(POLYNOMIAL, measured), least)
        np.minimum.at(self._sums["lowest"], where, fine.min(axis=0))
        np.maximum.at(self._sums["highest"], where, fine.max(axis=0))
        np.add.at(self._sums["total"], where, steps.step * _applied(PLACE_WEIGHTS, measured))
        np.add.at(self._sums["lasted"], where, steps.step)

    def _add(self) -> None:
        """Add the stored steps of a waveform to the sums."""
        piece, system = self._piece, self._system
        assert piece is not None
        assert system is not None
        steps = joined_steps([kept[:2] for kept in self._buffer])
        span, begin, ends_span, slack = (np.concatenate([kept[index] for kept in self._buffer]) for index in (2, 3, 4, 5))
        self._buffer, self._size = [], 0
        load, cycle = piece.span(steps.cases, span)[0], np.zeros_like(span)
        if isinstance(piece, Cycles):
            cycle = span // piece.spans_of_cycle
            # the part of the cycle is the last one that lasts for some time
            ended = ends_span & (piece.edges[span % piece.spans_of_cycle + 1, steps.cases] >= 1)
            np.maximum.at(self._finished, steps.cases[ended], cycle[ended] + 1)
        count, places = steps.cases.size, PLACES.size
        many = np.tile(np.arange(count), places)
        share = np.repeat(PLACES, count)
        wide, driving = steps.take(many), load.take(many)
        local = wide.time + share * wide.step
        films, state, points = replace(system, load=driving), wide.state(share), self.points.take(wide.cases)
        if isinstance(films, LoadedPoints):
            films = replace(films, points=points, slack=None if films.slack is None else slack[many])
        value, slope = films.driven(local, state), driving.slope(local)
        log_squared, nominal = films.membrane(state, value)
        measured = self._measured(log_squared, nominal, wide.cases).reshape(places, count)
        slackens = (
            self.stress and load.controls[0] is Control.STRETCH and isinstance(films, LoadedPoints) and films.slack is not None
        )
        self._add_measured(steps, cycle, measured, 0.0 if slackens else -np.inf)
        where = steps.cases, cycle
        sums = self._sums
        sent: Floats | None = None
        if self.leakage is None:
            field, charge = points.nominal(log_squared, value[2])
            if points.electric == FIELD:  # by parts, as the rate of the charge has no closed form
                power, boundary_term = -charge * slope[2], charge * field
            else:
                power, boundary_term = field * slope[2], np.zeros_like(local)
        else:
            assert isinstance(films, LoadedPoints)
            flowing = flow(films, self.leakage.take(wide.cases), local, state, wide.rate(share))
            power, boundary_term = flowing.field * flowing.current, np.zeros_like(local)
            sent = _both_ways((flowing.source * flowing.current).reshape(places, count))
        edge_power, edge_term = work_of_edges(films, value, slope, log_squared, nominal)

        def integral(power: Floats, term: Floats) -> Floats:
            along, term = power.reshape(places, count), term.reshape(places, count)
            return np.asarray(steps.step * _applied(PLACE_WEIGHTS, along) + term[-1] - term[0])

        work = integral(power + edge_power, boundary_term + edge_term)
        assert isinstance(piece, Cycles)
        turn = 2 * np.pi * (((begin[many] + local) / piece.period[wide.cases]) - cycle[many]).reshape(places, count)
        # subtract the value at rest: the quadrature error of a constant must not appear as a component at the period
        deviation = measured - self._at_rest[wide.cases].reshape(places, count)
        for name, part in (("cosine", deviation * np.cos(turn)), ("sine", deviation * np.sin(turn))):
            np.add.at(sums[name], where, steps.step * _applied(PLACE_WEIGHTS, part))
        np.add.at(sums["work"], where, work)
        if self.programme:
            np.add.at(sums["by_edges"], where, integral(edge_power, edge_term))
        for name, part in zip(("delivered", "returned"), () if sent is None else sent, strict=False):
            np.add.at(sums[name], where, steps.step * part)


def _joined(tables: Sequence[dict[str, Floats]]) -> dict[str, Floats]:
    """Tables of arrays (cases, cycles) as one, with the names of the first."""
    return {name: np.concatenate([table[name] for table in tables], axis=1) for name in tables[0]}


def _applied(weights: Floats, values: Floats) -> Floats:
    """`weights` (places,) or (k, places) times `values` (places, steps), (steps,) or (k, steps).

    Unlike a matrix product, it rounds alike for any number of steps.
    """
    steps = np.arange(values.shape[1])
    return np.asarray(np.einsum("...p,pm->...m", weights, values[:, paired(steps)])[..., : steps.size])


def _both_ways(power: Floats) -> Floats:
    """The energies (2, steps) delivered and returned in steps of length 1, from the power (places, steps) at `PLACES`."""
    at, moved = _applied(POLYNOMIAL, power), np.diff(_applied(INTEGRAL, power), axis=0)
    begin, end = at[:-1], at[1:]
    # where the power changes its sign, it is nearly linear
    turns, width = begin * end < 0, FINE[1] - FINE[0]
    size = np.where(turns, 2 * (np.abs(begin) + np.abs(end)), 1.0)
    delivered, returned = (
        np.square(np.maximum(sign * begin, 0.0) + np.maximum(sign * end, 0.0)) / size * width for sign in (1, -1)
    )
    delivered, returned = np.where(turns, delivered, np.maximum(moved, 0.0)), np.where(turns, returned, np.maximum(-moved, 0.0))
    return np.stack([_applied(np.ones(len(energy)), energy) for energy in (delivered, returned)])
