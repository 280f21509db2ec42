"""The observer that records films at output times, from the dense output of the stepper."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from dielast.mechanics.criteria.criterion import FilmSnapshot
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.equations import Films, films_of
from dielast.mechanics.piece import Chain, Piece, rows_after_turn
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.watch import Watch
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.stride import TriedStep
from dielast.simulate.electrical import ElectricMeter
from dielast.simulate.output import Output
from dielast.simulate.record import DIGITS, ELECTRICAL, ROWS, Record, with_further

ROWS_AT_A_LOOK = np.arange(8)  # output rows to check at once: a step often passes several
MANY = 512  # rows of output that are evaluated together
MORE = -1  # the number of a row that is not listed in advance
AFTER = 1e-13  # of the duration of a piece; a row this soon after the beginning shows the state after a jump


Rows = tuple[Cases, Floats]  # cases (k,) and times (k,) in s


@dataclass(slots=True, eq=False)
class Schedule:
    """The rows of output to come: times `relative` (cases, rows) in s since a piece of load began, and the index of the `next` one
    of each case (cases,). Rows that are NaN are due in no step.
    """

    relative: Floats
    """Followed by NaN for as many rows as are checked at once."""
    next: Cases

    @classmethod
    def of(cls, rows: Floats, alive: Flags) -> Self:
        """The rows (cases, k) after 0 of the cases that are `alive`."""
        relative = np.full((alive.size, rows.shape[1] + ROWS_AT_A_LOOK.size), np.nan)
        relative[alive, : rows.shape[1]] = rows[alive]
        after = relative > 0
        return cls(relative, np.where(after.any(axis=1), np.argmax(after, axis=1), rows.shape[1]))

    def due(self, stride: TriedStep) -> tuple[Cases, Cases]:
        """Columns and rows (k,) of the output times within the step."""
        reached = self.relative[stride.cases, self.next[stride.cases]] <= stride.elapsed
        columns = np.flatnonzero(stride.accepted & reached)
        if not columns.size:
            return columns, columns
        due = []
        while columns.size:
            case = stride.cases[columns]
            rows = self.next[case, None] + ROWS_AT_A_LOOK
            within = self.relative[case[:, None], rows] <= stride.elapsed[columns, None]
            passed = within.sum(axis=1)
            due.append((np.repeat(columns, passed), rows[within]))
            self.next[case] += passed
            columns = columns[passed == ROWS_AT_A_LOOK.size]
        if len(due) == 1:
            return due[0]
        first, second = zip(*due, strict=True)
        return np.concatenate(first), np.concatenate(second)


@dataclass(slots=True, eq=False)
class Recorder:
    """An observer of the stepper that stores films at output times: Lambda and nominal stress of both axes, and the nominal field;
    with a `watch` the determinant of the tangent and the exposures, with `electric` the rows of `ELECTRICAL`, and x if requested.
    `begin` is to be called before a piece of load. Of the `laps` of a cycle of steps, those that the output keeps are stored.

    Values at times that a film does not reach are NaN.
    """

    output: Output
    watch: Watch | None = None
    electric: ElectricMeter | None = None
    laps: int = 0
    _times: list[Floats] = field(default_factory=list)
    _values: list[Floats] = field(default_factory=list)
    _internal: list[Floats] = field(default_factory=list)
    _waiting: list[tuple[Cases, Cases, Cases, Floats, Floats, Floats, Floats]] = field(default_factory=list)
    """Rows (k,) to evaluate together: columns of `_system`, cases, rows, times since the span began, ages, states (rows, k), and
    values (rows, k) of other observers.
    """
    _size: int = 0
    _system: Films | None = None
    _listed: Schedule = field(init=False)
    """The rows of the piece."""
    _turned: Schedule | None = None
    """Further rows, after a specimen went slack or taut; None without such specimens, and where times are stated."""
    _slack: Flags = field(default_factory=lambda: np.zeros(0, dtype=bool))
    _kept: Cases = field(default_factory=lambda: np.zeros(1, dtype=np.intp))
    _start: Floats = field(default_factory=lambda: np.zeros(0))
    _period: Floats = field(default_factory=lambda: np.zeros(0))
    """Of specimens that may go slack (cases,): whether they are; the start of the piece in s, its cycles to store, their period."""
    _more: list[Rows] = field(default_factory=list)
    """The further rows of the output, in the order of `_values_of_more` and `_internal_of_more`."""
    _values_of_more: list[Floats] = field(default_factory=list)
    _internal_of_more: list[Floats] = field(default_factory=list)
    _load_time: Floats = field(default_factory=lambda: np.array(np.inf))
    """The time (cases,) in s that the last change of the load took, plus the time since then."""

    @property
    def exposures(self) -> int:
        """The number of exposures."""
        return 0 if self.watch is None else len(self.watch.exposures)

    @property
    def width(self) -> int:
        """The number of values of a film at a time."""
        return ROWS + self.exposures + (0 if self.electric is None else len(ELECTRICAL))

    @property
    def needs_springs(self) -> bool:
        """Whether the values depend on the viscous stretches."""
        return self.watch is not None or self.output.internal

    def begin(self, piece: Piece, start: Floats, alive: Flags, jumped: Flags, system: Films, state: Floats, last: bool) -> None:
        """Begin a piece of load at `start` (cases,) in s, for the cases that are `alive`; those in `jumped` jump to its first
        value.
        """
        self._write()
        times = self.output.rows
        relative = self._rows(piece, start, jumped) if times is None else self._within(times, start, piece.duration, last)
        if not self._values or (times is None and relative.shape[1]):
            self._times.append(start[:, None] + relative)
            self._values.append(np.full((self.width, *relative.shape), np.nan))
            if self.output.internal:
                self._internal.append(np.full((2, system.points.modulus.shape[0], *relative.shape), np.nan))
        self._listed, self._turned = Schedule.of(relative, alive), None
        if times is None and isinstance(system, LoadedPoints) and system.slack is not None:
            self._slack, self._start, self._kept = system.slack.copy(), start, self.output.kept(max(piece.cycles, 1))
            self._period = piece.duration / max(piece.cycles, 1)
            self._turned = Schedule.of(np.full((start.size, 1 + self._after_turns.size), np.nan), alive)
        if self.electric is not None:
            self.electric.begin(start, piece, system)
        case, row = (paired(part) for part in np.nonzero(self._listed.relative == 0))
        if case.size:
            others = [] if self.watch is None else [self.watch.exposed(case)]
            if self.electric is not None:
                assert isinstance(system, LoadedPoints)
                self.electric.ask_now(system.take(case), state[:, case], case)
            at_start = np.zeros(case.size)
            part = slice(None) if self.needs_springs else system.of_membrane
            self._store(system, case, case, row, at_start, at_start, state[part, case], others)

    def _rows(self, piece: Piece, start: Floats, jumped: Flags) -> Floats:
        """Output times (cases, k) in s since a piece began, suited to its load and padded with NaN."""
        if piece.lap and piece.lap - 1 not in self.output.kept(self.laps):
            self._load_time = np.where(jumped, 0.0, self._load_time) + piece.duration
            return np.full((start.size, 0), np.nan)
        kept = self.output.kept(piece.cycles)
        rows = piece.rows(self.output.points_per_decade, kept, np.where(jumped, 0.0, self._load_time))
        lasts = piece.duration
        moving = np.any(piece.start != piece.end, axis=0) | (piece.cycles > 0)
        self._load_time = np.where(moving, lasts, np.where(jumped, 0.0, self._load_time) + lasts)
        if rows.shape[1] == 1:
            return rows
        # the first row repeats the last row of the piece before, unless the load jumps
        begins = jumped | (not self._times)
        rows = np.where((rows == 0) & ~begins[:, None], np.nan, rows)
        if not isinstance(piece, Chain):  # the points of a table are output times, however close they are
            rows = np.where((rows > 0) & (rows < np.minimum(DIGITS * start, lasts)[:, None]), np.nan, rows)
        if self.watch is not None and np.isfinite(rise := piece.rises(kept)).any():
            # the clock of the pull-in time scale restarts there, and the determinant jumps
            rise = np.where(rise < lasts[:, None], rise, np.nan)
            rows = np.concatenate((rows, np.where(rise > 0, rise, np.nan), rise + AFTER * lasts[:, None]), axis=1)
        # NaN come first, so that every case ends in the last column
        rows = np.sort(np.where(np.isfinite(rows), rows, -1.0), axis=1)
        rows = np.sort(np.where(np.diff(rows, axis=1, prepend=-1.0) > 0, rows, -1.0), axis=1)
        rows = rows[:, rows.shape[1] - int((rows >= 0).sum(axis=1).max()) :]
        return np.where(rows >= 0, rows, np.nan)

    @property
    def _after_turns(self) -> Floats:
        """The times (k,) of rows after a specimen went slack or taut, as parts of the time until the end of the span."""
        return rows_after_turn(self.output.points_per_decade)[:-1]

    def __call__(self, stride: TriedStep) -> None:
        """Store the output within the step."""
        if self.electric is not None:
            done = np.zeros_like(stride.accepted) if self.watch is None else self.watch.done[stride.cases]
            self.electric.follow(stride, done)
        pooled, rows = (paired(part) for part in self._listed.due(stride))
        if pooled.size:
            self._store_within(stride, pooled, rows, self._listed.relative[stride.cases[pooled], rows])
        if self._turned is not None:
            self._look_for_turns(stride, self._turned)
            pooled, rows = (paired(part) for part in self._turned.due(stride))
            if pooled.size:
                case = stride.cases[pooled]
                moment = self._turned.relative[case, rows]
                self._more.append((case, self._start[case] + moment))
                self._store_within(stride, pooled, np.full_like(rows, MORE), moment)

    def _look_for_turns(self, stride: TriedStep, rows: Schedule) -> None:
        """Let further rows begin with a step that begins as a specimen has just gone slack or taut."""
        system = films_of(stride)
        assert isinstance(system, LoadedPoints)
        assert system.slack is not None
        columns = np.flatnonzero(stride.accepted & (system.slack != self._slack[stride.cases]))
        if not columns.size:
            return
        case, now = stride.cases[columns], stride.begin[columns] + stride.time[columns]
        self._slack[case] = system.slack[columns]
        left = (stride.duration - stride.time)[columns, None] * self._after_turns
        left[left < DIGITS * (self._start[case] + now)[:, None]] = np.nan
        shown = np.isin(now // self._period[case], self._kept)
        later = np.sort(now[:, None] + np.concatenate((np.zeros((case.size, 1)), left), axis=1), axis=1)
        rows.relative[case[shown], : later.shape[1]] = later[shown]
        rows.next[case[shown]] = 0

    def _store_within(self, stride: TriedStep, pooled: Cases, rows: Cases, at: Floats) -> None:
        """Store rows (k,) of the columns `pooled` (k,) of a step, `at` (k,) in s since the piece began."""
        case, system = stride.cases[pooled], films_of(stride)
        moment = at - stride.begin[pooled]
        part = slice(None) if self.needs_springs else system.of_membrane
        # beside an event a step may be as short as the rounding of its time
        fraction = np.clip((moment - stride.time[pooled]) / stride.step[pooled], 0.0, 1.0)
        others = [] if self.watch is None else [self.watch.exposed_along(stride, pooled, fraction)]
        if self.electric is not None:
            self.electric.ask(stride, pooled, moment)
        self._store(system, pooled, case, rows, moment, stride.begin[pooled], stride.dense(part, pooled, fraction), others)

    def _store(
        self,
        system: Films,
        pooled: Cases,
        case: Cases,
        rows: Cases,
        moment: Floats,
        begin: Floats,
        state: Floats,
        others: list[Floats],
    ) -> None:
        """Store rows (k,) with states (rows, k) of the columns `pooled` (k,) of the system, which are evaluated later with others.

        They are at `moment` (k,) in s since a span began, which was `begin` (k,) in s after the beginning of the piece; `others`
        are the values (rows, k) of other observers.
        """
        if system is not self._system:
            self._write()
            self._system = system
        age = moment if self.watch is None else self.watch.age(case, begin, moment)
        beside = np.concatenate(others) if others else np.empty((0, case.size))
        self._waiting.append((pooled, case, rows, moment, age, state, beside))
        self._size += case.size
        if self._size >= MANY:
            self._write()

    def _write(self) -> None:
        """Evaluate the rows that wait for it."""
        if not self._waiting:
            return
        assert self._system is not None
        parts = (np.concatenate(part, axis=-1) for part in zip(*self._waiting, strict=True))
        pooled, case, rows, moment, age, state, others = parts
        self._waiting, self._size = [], 0
        values = [self._evaluated(self._system, state, pooled, case, moment, age), others]
        if self.electric is not None:
            films = self._system.take(pooled)
            log_squared, _ = films.membrane(state, driven := films.driven(moment, state))
            assert isinstance(films, LoadedPoints)
            stored = films.points.stored(films.compact(state), log_squared, driven[ELECTRIC])
            values += [self.electric.rows(case.size), stored[None]]
        listed, every = rows != MORE, np.concatenate(values)
        self._values[-1][:, case[listed], rows[listed]] = every[:, listed]
        self._values_of_more.append(every[:, ~listed])
        if self.output.internal:
            internal = self._system.internal(state)
            self._internal[-1][:, :, case[listed], rows[listed]] = internal[..., listed]
            self._internal_of_more.append(internal[..., ~listed])

    def _evaluated(self, system: Films, state: Floats, pooled: Cases, case: Cases, moment: Floats, age: Floats) -> Floats:
        """The values (rows, k) of states (rows, k) of the columns `pooled` (k,) of the system, without those of other observers.

        They are at `moment` (k,) in s since a span began; the voltage has been on for `age` (k,) s, which only a watch uses.
        """
        if self.watch is None:
            system = system.take(pooled)
            driven = system.driven(moment, state)
            bears_nothing = isinstance(system, LoadedPoints) and system.slack is not None
            log_squared, nominal = system.membrane(state, driven)
            if bears_nothing:  # below 0 only by the error of an event
                nominal = np.concatenate((np.maximum(nominal[:1], 0.0), nominal[1:]))
            return np.concatenate((log_squared, nominal, driven[2:], np.full((1, case.size), np.nan)))
        films = FilmSnapshot.of(system.take(pooled), case, age, moment, state)
        determinant = self.watch.stability(films).determinant
        field = films.points.nominal(films.log_squared_stretch, films.electrical)[0]
        return np.concatenate((films.log_squared_stretch, films.nominal_stress, field[None], determinant[None]))

    def collect(self) -> Record:
        """The record of all pieces."""
        self._write()
        time = np.concatenate(self._times, axis=1) if self.output.rows is None else self.output.rows
        internal = np.concatenate(self._internal, axis=3) if self.output.internal else None
        record = Record(time, np.concatenate(self._values, axis=2), internal, self.exposures)
        if not self._more:
            return record
        case, moment = (np.concatenate(part) for part in zip(*self._more, strict=True))
        internal = np.concatenate(self._internal_of_more, axis=2) if self.output.internal else None
        return with_further(record, case, moment, np.concatenate(self._values_of_more, axis=1), internal)

    @staticmethod
    def _within(times: Floats, start: Floats, duration: Floats, last: bool) -> Floats:
        """The times (cases, k) that lie in a piece, in s since its start, else NaN; the start belongs to the piece before."""
        begin, end = start[:, None], (start + duration)[:, None]
        rounding = 1e-12 * end if last else 0.0  # by which times may exceed the end
        relative = np.clip(times - begin, 0.0, duration[:, None])
        return np.where(((times > begin) | ((times == 0) & (begin == 0))) & (times <= end + rounding), relative, np.nan)
