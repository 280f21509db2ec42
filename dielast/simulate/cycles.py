"""The response of a film in each cycle of a waveform: extremes, mean, the component at the period, and work, by quadrature of the
dense output.

The load varies as -cos(2 pi t / T) times half of (high - low). A quantity y has the component a cos(w t - phi) at the period, with
a exp(i phi) = 2/T int y exp(i w t) dt and w = 2 pi / T. Its phase is its lead over the load: negative where y lags.
The work per undeformed volume is int s_1 dlambda_1 + s_2 dlambda_2 + E~ dD~ with the nominal stress s, the nominal field E~ and the
nominal charge density D~ = eps lambda_1^2 lambda_2^2 E~; in a periodic cycle, it is the dissipation of the film. If electrical
quantities are requested, the work includes the leakage E~ j~ dt, and the efficiency is the energy that returns to the source in a
cycle over the energy that it delivers: 1 without losses in film and circuit.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.material.leakage import Leakage
from dielast.mechanics.equations import Films, films_of
from dielast.mechanics.passive.framed import FramedFilms
from dielast.mechanics.piece import Cycles, Piece
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import Points
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.stride import DenseSteps, Stride
from dielast.simulate.electrical import NODES, WEIGHTS, flow

PLACES = np.concatenate(([0.0], NODES, [1.0]))  # fractions of a step: Gauss points and both ends
PLACE_WEIGHTS = np.pad(WEIGHTS, 1)
FINE = np.linspace(0.0, 1.0, 33)
# maps values at PLACES to those of their interpolating polynomial at FINE
POLYNOMIAL = np.vander(FINE, PLACES.size) @ np.linalg.inv(np.vander(PLACES, PLACES.size))
MANY = 512  # steps that are added to the sums together
_RAISED = np.arange(1, PLACES.size + 1)
# maps values at PLACES to the integrals of their interpolating polynomial from 0 to FINE
INTEGRAL = (FINE[:, None] ** _RAISED / _RAISED) @ np.linalg.inv(np.vander(PLACES, PLACES.size, increasing=True))
NAMES = ("lowest", "highest", "mean", "amplitude", "phase", "work", "efficiency")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CycleTable(TabularResult):
    """Cycles of waveforms, numbered from 1 through a history: arrays (cases, cycles), NaN for an unfinished cycle.

    `lowest`, `highest` and `mean` of the measured quantity in its `unit`; `amplitude` of its component at the period, and `phase`
    in rad by which it leads the load, negative where it lags; `work` done on the film, by source and load together, in J/m^3 of
    undeformed volume; `efficiency`, the returned over the delivered energy of the source, None unless it was requested.
    """

    unit: str

    lowest: Floats
    highest: Floats
    mean: Floats
    amplitude: Floats
    phase: Floats
    work: Floats
    efficiency: Floats | None = None

    def case(self, row: int) -> dict[str, Floats]:
        """The finished cycles of a case, (cycles,), by their headers."""
        finished = np.isfinite(self.mean[row])
        units = {"phase": "rad", "work": "J/m^3", "efficiency": "1"}
        arrays = {name: getattr(self, name) for name in NAMES}
        values = {
            f"{name} [{units.get(name, self.unit)}]": array[row, finished] for name, array in arrays.items() if array is not None
        }
        return {"cycle": np.flatnonzero(finished) + 1, **values}

    def columns(self) -> Table:
        """The table of all cases, one after another."""
        return case_table({row: self.case(row) for row in range(len(self.mean))})


@dataclass(slots=True, eq=False)
class CycleMeter:
    """An observer of the stepper that evaluates waveforms. `begin` and `finish` are to be called before and after a piece of load.

    The measured quantity is the stretch of axis 1 or, with `stress`, its nominal stress, divided by `unit` (cases,). The efficiency
    is computed if there is a `leakage`, even one of conductivity 0.
    """

    points: Points
    unit: Floats
    stress: bool
    leakage: Leakage | None = None
    _tables: list[Floats] = field(default_factory=list)
    _waveform: Cycles | None = None
    _buffer: list[tuple[DenseSteps, Cases, Floats, Flags, Flags]] = field(default_factory=list)
    """Steps (k,) to evaluate together: their dense output, the spans, when these begin, whether the step ends its span, and whether
    the film is slack.
    """
    _size: int = 0
    _system: Films | None = None
    _sums: Floats = field(default_factory=lambda: np.zeros((8, 0, 0)))
    _at_rest: Floats = field(default_factory=lambda: np.zeros(0))
    """The measured quantity at the beginning of the waveform (cases,)."""
    _finished: Cases = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def begin(self, piece: Piece, system: Films, state: Floats) -> None:
        """Begin a piece of load with this state (rows, cases)."""
        self._waveform = piece if isinstance(piece, Cycles) else None
        if self._waveform is not None:
            cases = self.unit.size
            self._sums = np.zeros((8, cases, piece.cycles))
            self._sums[0], self._sums[1] = np.inf, -np.inf
            self._finished = np.zeros(cases, dtype=np.intp)
            membrane = system.membrane(state, system.driven(np.zeros(cases), state))
            self._at_rest = self._measured(*membrane, np.arange(cases))

    def __call__(self, stride: Stride) -> None:
        """Store the step until it is added to the sums."""
        if self._waveform is None:
            return
        columns = np.flatnonzero(stride.accepted)
        if stride.cases.size == 2 and stride.cases[0] == stride.cases[1]:
            columns = columns[:1]  # a single case occupies two columns
        self._system = system = films_of(stride)
        steps = DenseSteps.of(stride, slice(system.border, None), columns)
        slack = (
            system.slack[columns] if isinstance(system, LoadedPoints) and system.slack is not None else np.zeros(columns.size, bool)
        )
        ends_span = (stride.until == stride.duration)[columns]
        self._buffer.append((steps, stride.span[columns], stride.begin[columns], ends_span, slack))
        self._size += columns.size
        if self._size >= MANY:
            self._add()

    def _measured(self, log_squared: Floats, nominal: Floats, cases: Cases) -> Floats:
        """The measured quantity (k,) at Lambda and nominal stresses (2, k) of these cases."""
        return np.asarray((nominal if self.stress else np.exp(0.5 * log_squared))[0] / self.unit[cases])

    def finish(self) -> None:
        """End a piece of load."""
        if self._waveform is None:
            return
        if self._buffer:
            self._add()
        lowest, highest, total, cosine, sine, work, delivered, returned = self._sums
        period = self._waveform.period[:, None]
        amplitude = 2 / period * np.hypot(cosine, sine)
        behind = np.arctan2(sine, cosine) - np.where((self._waveform.high > self._waveform.low).any(axis=0), np.pi, 0.0)[:, None]
        phase = -np.remainder(behind + np.pi, 2 * np.pi) + np.pi
        table = np.array((lowest, highest, total / period, amplitude, phase, work))
        if self.leakage is not None:
            efficiency = returned / np.where(delivered > 0, delivered, np.nan)
            table = np.concatenate((table, efficiency[None]))
        table[:, np.arange(table.shape[2]) >= self._finished[:, None]] = np.nan
        self._tables.append(table)

    def collect(self) -> CycleTable | None:
        """The table of all cycles so far, None without any."""
        return CycleTable("Pa" if self.stress else "1", *np.concatenate(self._tables, axis=2)) if self._tables else None

    def _add(self) -> None:
        """Add the stored steps to the sums."""
        waveform, system = self._waveform, self._system
        assert waveform is not None
        assert system is not None
        steps = DenseSteps.joined([kept[0] for kept in self._buffer])
        span, begin, ends_span, slack = (np.concatenate([kept[index] for kept in self._buffer]) for index in (1, 2, 3, 4))
        self._buffer, self._size = [], 0
        load, cycle = waveform.span(steps.cases, span)[0], span // waveform.spans_of_cycle
        # the part of the cycle is the last one that lasts for some time
        ended = ends_span & (waveform.edges[span % waveform.spans_of_cycle + 1, steps.cases] >= 1)
        np.maximum.at(self._finished, steps.cases[ended], cycle[ended] + 1)
        count, places = steps.cases.size, PLACES.size
        many = np.tile(np.arange(count), places)
        share = np.repeat(PLACES, count)
        wide, driving = steps.take(many), load.take(many)
        local = wide.time + share * wide.step
        films, state = replace(system, load=driving), wide.state(share)
        if isinstance(films, LoadedPoints) and films.slack is not None:
            films = replace(films, slack=slack[many])
        value, slope = films.driven(local, state), driving.slope(local)
        log_squared, nominal = films.membrane(state, value)
        stretch = np.exp(0.5 * log_squared)
        measured = self._measured(log_squared, nominal, wide.cases).reshape(places, count)
        sent: Floats | None = None
        if self.leakage is None:
            ratio = self.points.stretching.take(wide.cases).log_ratio(log_squared)[0]
            permittivity = self.points.permittivity[wide.cases] * np.exp(ratio)
            charge = permittivity * np.square(stretch[0] * stretch[1]) * value[2]
            power, boundary_term = -charge * slope[2], charge * value[2]
        else:
            assert not isinstance(films, FramedFilms)
            films = replace(films, points=self.points.take(wide.cases))
            flowing = flow(films, self.leakage.take(wide.cases), local, state, wide.rate(share))
            power, boundary_term = flowing.field * flowing.current, np.zeros_like(local)
            sent = _both_ways((flowing.source * flowing.current).reshape(places, count))
        for axis, control in enumerate(load.controls):
            if control is Control.STRETCH:
                power = power + nominal[axis] * slope[axis]
            elif control is Control.STRESS:  # integrated by parts, as the rate of the stretch has no closed form
                power, boundary_term = power - stretch[axis] * slope[axis], boundary_term + nominal[axis] * stretch[axis]
        boundary_term = boundary_term.reshape(places, count)
        work = steps.step * _applied(PLACE_WEIGHTS, power.reshape(places, count)) + boundary_term[-1] - boundary_term[0]
        turn = 2 * np.pi * (((begin[many] + local) / waveform.period[wide.cases]) - cycle[many]).reshape(places, count)
        fine = _applied(POLYNOMIAL, measured)
        # subtract the value at rest: the quadrature error of a constant must not appear as a component at the period
        deviation = measured - self._at_rest[wide.cases].reshape(places, count)
        where = steps.cases, cycle
        lowest, highest, total, cosine, sine, worked, delivered, returned = self._sums
        np.minimum.at(lowest, where, fine.min(axis=0))
        np.maximum.at(highest, where, fine.max(axis=0))
        for integral, part in ((total, measured), (cosine, deviation * np.cos(turn)), (sine, deviation * np.sin(turn))):
            np.add.at(integral, where, steps.step * _applied(PLACE_WEIGHTS, part))
        np.add.at(worked, where, work)
        for integral, part in zip((delivered, returned), () if sent is None else sent, strict=False):
            np.add.at(integral, where, steps.step * part)


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
