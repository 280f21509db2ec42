"""What a film does in each cycle of a waveform: extremes, mean, the component at the period, and work, by quadrature on the
stepper's dense output.

With the load's component -cos(2 pi t / T) times half of (high - low), a quantity y has the component a cos(w t - phi), where
a exp(i phi) = 2/T int y exp(i w t) dt, w = 2 pi / T. Its phase is the lead over the load's component: negative where y lags.
The work per undeformed volume is int s_1 dlambda_1 + s_2 dlambda_2 + E~ dD~ with the nominal stress s, the nominal field E~ and the
nominal charge density D~ = eps lambda_1^2 lambda_2^2 E~; in a cycle that repeats itself it is what the film dissipates. Where what
is electrical is asked for, the work contains what leaks, E~ j~ dt, and the efficiency is the energy that the source gets back in a
cycle over the energy that it gives: 1 for a film and a circuit without losses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.leakage import Leakage
from dielast.mechanics.course import Course
from dielast.mechanics.cycles import Cycles
from dielast.mechanics.passive.framed import FramedFilms
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control, Load
from dielast.mechanics.symmetric import Films
from dielast.numerics.columns import Cases, Floats
from dielast.numerics.stride import DenseSteps, Stride
from dielast.simulate.electrical import flow

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
PLACES = np.concatenate(([0.0], 0.5 * (1 + _NODES), [1.0]))  # in a step
WEIGHTS = np.concatenate(([0.0], 0.5 * _WEIGHTS, [0.0]))
FINE = np.linspace(0.0, 1.0, 33)
# values of the polynomial through those at PLACES
POLYNOMIAL = np.vander(FINE, PLACES.size) @ np.linalg.inv(np.vander(PLACES, PLACES.size))
MANY = 512  # steps whose sums are taken together
_RAISED = np.arange(1, PLACES.size + 1)
# integrals from 0 to FINE of the polynomial through values at PLACES
INTEGRAL = (FINE[:, None] ** _RAISED / _RAISED) @ np.linalg.inv(np.vander(PLACES, PLACES.size, increasing=True))
NAMES = ("lowest", "highest", "mean", "amplitude", "phase", "work", "efficiency")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CycleTable(TabularResult):
    """Cycles of waveforms, numbered from 1 through a history: arrays (cases, cycles), NaN for a cycle that was not finished.

    `lowest`, `highest` and `mean` of the measured quantity, in its `unit`, `amplitude` of its component at the period and the
    `phase` in rad by which that leads the load, negative where it lags; `work` done on the film in J/m^3 of undeformed volume;
    `efficiency`, what the source gets back of the energy that it gives, None unless it was asked for.
    """

    unit: str

    lowest: Floats
    highest: Floats
    mean: Floats
    amplitude: Floats
    phase: Floats
    work: Floats
    efficiency: Floats | None = None

    @property
    def names(self) -> list[str]:
        """The names of the columns."""
        return [name for name in NAMES if getattr(self, name) is not None]

    def case(self, row: int) -> dict[str, Floats]:
        """The cycles that a case finished, (cycles,), by their headers."""
        finished = np.isfinite(self.mean[row])
        units = {"phase": "rad", "work": "J/m^3", "efficiency": "1"}
        values = {f"{name} [{units.get(name, self.unit)}]": getattr(self, name)[row, finished] for name in self.names}
        return {"cycle": np.flatnonzero(finished) + 1, **values}

    def columns(self) -> Table:
        """All cases, one below the other."""
        return cycle_table({row: self.case(row) for row in range(len(self.mean))})

    @classmethod
    def joined(cls, tables: Sequence[CycleTable], place: Cases) -> CycleTable:
        """One table of cases, each of which is at its `place` (cases,) in the tables one after another."""
        names = tables[0].names
        return cls(tables[0].unit, *(np.concatenate([getattr(table, name) for table in tables])[place] for name in names))


def cycle_table(cases: Mapping[int, Mapping[str, Floats]]) -> Table:
    """The cycles of cases, by number, one below the other."""
    counts = [table["cycle"].size for table in cases.values()]
    columns = [Column("case", None, np.repeat(list(cases), counts))]
    for header in next(iter(cases.values())):
        name, _, unit = header.rstrip("]").partition(" [")
        columns.append(Column(name, unit or None, np.concatenate([table[header] for table in cases.values()])))
    return columns


@dataclass(slots=True, eq=False)
class CycleMeter:
    """Observes the stepper through waveforms; between pieces of load, `begin` and `finish` are called. What is measured is the
    stretch or, with `stress`, the nominal stress of axis 1, over a `unit` (cases,). With a `leakage`, if only of conductivity 0,
    there is the efficiency, too.
    """

    points: Points
    unit: Floats
    stress: bool
    leakage: Leakage | None = None
    _tables: list[Floats] = field(default_factory=list)
    _course: Cycles | None = None
    _buffer: list[tuple[DenseSteps, Load, Floats, Cases]] = field(default_factory=list)
    _size: int = 0
    _system: Films | None = None
    _sums: Floats = field(default_factory=lambda: np.zeros((8, 0, 0)))
    _rest: Floats = field(default_factory=lambda: np.zeros(0))
    """The measured quantity at the beginning of the waveform (cases,)."""
    _finished: Cases = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def begin(self, course: Course) -> None:
        """A piece of load begins."""
        self._course = course if isinstance(course, Cycles) else None
        if self._course is not None:
            cases = self.unit.size
            self._sums = np.zeros((8, cases, course.cycles))
            self._sums[0], self._sums[1] = np.inf, -np.inf
            self._finished, self._rest = np.zeros(cases, dtype=np.intp), np.zeros(cases)

    def __call__(self, stride: Stride) -> None:
        """Keep the step for the sums."""
        if self._course is None:
            return
        columns = np.flatnonzero(stride.accepted)
        opening = columns[(stride.begin[columns] == 0) & (stride.time[columns] == 0)]
        if opening.size:
            self._note_rest(stride, opening)
        if stride.cases.size == 2 and stride.cases[0] == stride.cases[1]:
            columns = columns[:1]  # a lone case
        system = stride.system
        assert isinstance(system, Films)
        self._system = system
        steps = DenseSteps.of(stride, slice(system.border, None), columns)
        parts = len(self._course.edges) - 1
        cycle = stride.span[columns] // parts
        self._buffer.append((steps, system.load.take(columns), stride.begin[columns], cycle))
        ended = (stride.until == stride.duration)[columns] & self._last_part(steps.cases, stride.span[columns] % parts)
        self._finished[steps.cases[ended]] = cycle[ended] + 1
        self._size += columns.size
        if self._size >= MANY:
            self._add()

    def _note_rest(self, stride: Stride, columns: Cases) -> None:
        """Note what is measured where a waveform begins."""
        system = stride.system
        assert isinstance(system, Films)
        start = system.driven(np.zeros(stride.cases.size), stride.before)
        log_squared, nominal = system.membrane(stride.before, start)
        values = nominal[0] if self.stress else np.exp(0.5 * log_squared[0])
        self._rest[stride.cases[columns]] = (values / self.unit[stride.cases])[columns]

    def finish(self) -> None:
        """A piece of load is through."""
        if self._course is None:
            return
        if self._buffer:
            self._add()
        lowest, highest, whole, cosine, sine, work, delivered, returned = self._sums
        period = self._course.period[:, None]
        amplitude = 2 / period * np.hypot(cosine, sine)
        behind = np.arctan2(sine, cosine) - np.where(self._course.high > self._course.low, np.pi, 0.0)[:, None]
        phase = -np.remainder(behind + np.pi, 2 * np.pi) + np.pi
        table = np.array((lowest, highest, whole / period, amplitude, phase, work))
        if self.leakage is not None:
            efficiency = returned / np.where(delivered > 0, delivered, np.nan)
            table = np.concatenate((table, efficiency[None]))
        table[:, np.arange(table.shape[2]) >= self._finished[:, None]] = np.nan
        self._tables.append(table)

    def collect(self) -> CycleTable | None:
        """All cycles, None if there are none."""
        return CycleTable("Pa" if self.stress else "1", *np.concatenate(self._tables, axis=2)) if self._tables else None

    def _last_part(self, cases: Cases, part: Cases) -> np.ndarray:
        """Whether nothing of the cycle comes after this part of it (k,)."""
        assert self._course is not None
        return np.asarray(self._course.edges[part + 1, cases] >= 1)

    def _add(self) -> None:
        """Add what the kept steps contribute."""
        course, system = self._course, self._system
        assert course is not None
        assert system is not None
        steps = DenseSteps.joined([kept[0] for kept in self._buffer])
        load = Load.joined([kept[1] for kept in self._buffer])
        begin, cycle = (np.concatenate([kept[index] for kept in self._buffer]) for index in (2, 3))
        self._buffer, self._size = [], 0
        count, places = steps.cases.size, PLACES.size
        many = np.tile(np.arange(count), places)
        share = np.repeat(PLACES, count)
        wide, driving = steps.take(many), load.take(many)
        local = wide.time + share * wide.step
        films, state = replace(system, load=driving), wide.state(share)
        value, slope = films.driven(local, state), driving.slope(local)
        log_squared, nominal = films.membrane(state, value)
        stretch = np.exp(0.5 * log_squared)
        measured = ((nominal if self.stress else stretch)[0] / self.unit[wide.cases]).reshape(places, count)
        sent: Floats | None = None
        if self.leakage is None:
            permittivity = self.points.permittivity[wide.cases]
            if self.points.stretching is not None:
                permittivity = permittivity * np.exp(self.points.stretching.take(wide.cases).log_ratio(log_squared)[0])
            charge = permittivity * np.square(stretch[0] * stretch[1]) * value[2]
            power, held = -charge * slope[2], charge * value[2]
        else:
            assert not isinstance(films, FramedFilms)
            films = replace(films, points=self.points.take(wide.cases))
            flowing = flow(films, self.leakage.take(wide.cases), local, state, wide.rate(share))
            power, held = flowing.field * flowing.current, np.zeros_like(local)
            sent = _both_ways((flowing.source * flowing.current).reshape(places, count))
        for axis, control in enumerate(load.controls):
            if control is Control.STRETCH:
                power = power + nominal[axis] * slope[axis]
            elif control is Control.STRESS:  # by parts, as the stretch has no rate in closed form
                power, held = power - stretch[axis] * slope[axis], held + nominal[axis] * stretch[axis]
        held = held.reshape(places, count)
        work = steps.step * (WEIGHTS @ power.reshape(places, count)) + held[-1] - held[0]
        turn = 2 * np.pi * (((begin[many] + local) / course.period[wide.cases]) - cycle[many]).reshape(places, count)
        fine = POLYNOMIAL @ measured
        # what is the same throughout has no component at the period, and must not leave that of the quadrature's error
        swing = measured - self._rest[wide.cases].reshape(places, count)
        where = steps.cases, cycle
        lowest, highest, whole, cosine, sine, worked, delivered, returned = self._sums
        np.minimum.at(lowest, where, fine.min(axis=0))
        np.maximum.at(highest, where, fine.max(axis=0))
        for integral, part in ((whole, measured), (cosine, swing * np.cos(turn)), (sine, swing * np.sin(turn))):
            np.add.at(integral, where, steps.step * (WEIGHTS @ part))
        np.add.at(worked, where, work)
        for integral, part in zip((delivered, returned), () if sent is None else sent, strict=False):
            np.add.at(integral, where, steps.step * part)


def _both_ways(power: Floats) -> Floats:
    """What flows on and what flows back (2, steps) in steps of length 1 with this power (places, steps) at `PLACES`."""
    at, moved = POLYNOMIAL @ power, np.diff(INTEGRAL @ power, axis=0)
    begin, end = at[:-1], at[1:]
    # where the power changes its sign it is as good as straight
    turns, width = begin * end < 0, FINE[1] - FINE[0]
    size = np.where(turns, 2 * (np.abs(begin) + np.abs(end)), 1.0)
    on, back = (np.square(np.maximum(sign * begin, 0.0) + np.maximum(sign * end, 0.0)) / size * width for sign in (1, -1))
    on, back = np.where(turns, on, np.maximum(moved, 0.0)), np.where(turns, back, np.maximum(-moved, 0.0))
    return np.stack((on.sum(axis=0), back.sum(axis=0)))
