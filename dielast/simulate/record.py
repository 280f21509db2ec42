"""Where results are kept: the stepper's dense output at the times that are asked for."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from dielast.mechanics.chain import Chain
from dielast.mechanics.course import Course
from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.symmetric import Films
from dielast.mechanics.watch import Watch
from dielast.numerics.columns import Cases, Flags, Floats, paired
from dielast.numerics.stride import Stride
from dielast.simulate.electrical import EXTRA, ElectricMeter
from dielast.simulate.wanted import Wanted

ROWS = 6
DIGITS = 1e-8  # of a time; no table tells rows apart that are closer
ROWS_AT_A_LOOK = np.arange(8)  # after the next one: a step often passes several
AFTER = 1e-13  # of the duration of a piece: a row so soon after another shows what has jumped


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Films at output times (cases, rows) in s: `values` (6 + exposures + electrical ones, cases, rows), NaN for what was never
    reached, and x (2, n, cases, rows) if it was asked for. Below the first six rows are `exposures` rows of what adds up over time
    in films that are watched, and those of `electrical.EXTRA`, if they were asked for.
    """

    time: Floats
    values: Floats
    internal: Floats | None = None
    exposures: int = 0

    @property
    def stretch(self) -> Floats:
        """Of axes 1 and 2, (2, cases, rows)."""
        return np.asarray(np.exp(0.5 * self.values[:2]))

    @property
    def nominal_stress(self) -> Floats:
        """Mechanical, of axes 1 and 2, (2, cases, rows) in Pa."""
        return self.values[2:4]

    @property
    def field(self) -> Floats:
        """The nominal field V/L_3 (cases, rows) in V/m."""
        return np.asarray(self.values[4])

    @property
    def determinant(self) -> Floats:
        """That of pull-in (cases, rows), of films that are watched."""
        return np.asarray(self.values[5])

    @property
    def exposed(self) -> Floats:
        """What adds up over time (exposures, cases, rows)."""
        return self.values[ROWS : ROWS + self.exposures]

    @property
    def electrical(self) -> Floats:
        """What is electrical, (6, cases, rows), or no rows."""
        return self.values[ROWS + self.exposures :]


@dataclass(slots=True, eq=False)
class Recorder:
    """Writes Lambda and nominal stress of both axes, the nominal field, and with a `watch` the determinant of the tangent, and on
    request x. Observes the stepper; between pieces of load, `begin` is called. What is never reached stays NaN.
    """

    wanted: Wanted
    cases: int
    springs: int
    watch: Watch | None = None
    electric: ElectricMeter | None = None
    _times: list[Floats] = field(default_factory=list)
    _values: list[Floats] = field(default_factory=list)
    _internal: list[Floats] = field(default_factory=list)
    _relative: Floats = field(init=False)
    _next: Cases = field(init=False)
    _moved: Floats = field(init=False)
    """How long the load took to come to where it is, and what has passed since then, in s (cases,)."""

    def __post_init__(self) -> None:
        self._moved = np.full(self.cases, np.inf)

    @property
    def exposures(self) -> int:
        """How many things add up over time."""
        return 0 if self.watch is None else len(self.watch.exposures)

    def begin(
        self,
        course: Course,
        start: Floats,
        alive: Flags,
        jumped: Flags,
        system: Films,
        state: Floats,
        last: bool,
    ) -> None:
        """A piece of load begins at `start` (cases,) in s for the cases that are `alive`, some of which have `jumped` to it."""
        times = self.wanted.times
        if times is None:
            relative = self._rows(course, start, jumped)
            self._times.append(start[:, None] + relative)
        else:
            relative = self._within(times, start, course.duration, last)
        if times is None or not self._values:
            rows = ROWS + self.exposures + (0 if self.electric is None else len(EXTRA))
            self._values.append(np.full((rows, *relative.shape), np.nan))
            if self.wanted.internal:
                self._internal.append(np.full((2, self.springs, *relative.shape), np.nan))
        self._relative = relative if alive.all() else np.where(alive[:, None], relative, np.nan)
        after = self._relative > 0
        self._next = np.where(after.any(axis=1), np.argmax(after, axis=1), relative.shape[1])
        case, row = (paired(part) for part in np.nonzero(self._relative == 0))
        exposed = None if self.watch is None else self.watch.exposed(case)
        self._write(system, state[:, case], case, case, row, np.zeros(case.size), np.zeros(case.size), exposed)
        if self.electric is not None:
            self.electric.begin(start, course.start[ELECTRIC])
            if case.size:
                self._values[-1][-len(EXTRA) :, case, row] = self.electric.now(system.take(case), state[:, case], case)

    def _rows(self, course: Course, start: Floats, jumped: Flags) -> Floats:
        """Times (cases, k) of a piece since it began that suit its load; NaN is no time."""
        kept = self.wanted.kept(course.cycles)
        rows = course.rows(self.wanted.points_per_decade, kept, np.where(jumped, 0.0, self._moved))
        lasts = course.duration
        moving = np.any(course.start != course.end, axis=0) | (course.cycles > 0)
        self._moved = np.where(moving, lasts, np.where(jumped, 0.0, self._moved) + lasts)
        if rows.shape[1] == 1:
            return rows
        # what the load begins with, where that is not the last row of the piece before
        begins = jumped | (not self._times)
        rows = np.where((rows == 0) & ~begins[:, None], np.nan, rows)
        if not isinstance(course, Chain):  # whose points are asked for, however close
            rows = np.where((rows > 0) & (rows < np.minimum(DIGITS * start, lasts)[:, None]), np.nan, rows)
        if self.watch is not None and np.isfinite(rise := course.rises(kept)).any():
            # there the clock of the pull-in time scale starts anew, and the determinant jumps
            rise = np.where(rise < lasts[:, None], rise, np.nan)
            rows = np.concatenate((rows, np.where(rise > 0, rise, np.nan), rise + AFTER * lasts[:, None]), axis=1)
        # what is no time comes first, so that every case ends in the last column
        rows = np.sort(np.where(np.isfinite(rows), rows, -1.0), axis=1)
        rows = np.sort(np.where(np.diff(rows, axis=1, prepend=-1.0) > 0, rows, -1.0), axis=1)
        rows = rows[:, rows.shape[1] - int((rows >= 0).sum(axis=1).max()) :]
        return np.where(rows >= 0, rows, np.nan)

    def __call__(self, stride: Stride) -> None:
        """Write what lies within the step."""
        pooled, rows = self._due(stride)
        if pooled.size:
            pooled, rows = paired(pooled), paired(rows)
            case = stride.cases[pooled]
            moment = self._relative[case, rows] - stride.begin[pooled]
            assert isinstance(stride.system, Films)
            whole = self.watch is not None or self.wanted.internal
            part = slice(None) if whole else slice(stride.system.border, None)
            fraction = np.minimum((moment - stride.time[pooled]) / stride.step[pooled], 1.0)
            state = stride.dense(part, pooled, fraction)
            exposed = None if self.watch is None else self.watch.exposed_along(stride, pooled, fraction)
            self._write(stride.system, state, pooled, case, rows, moment, stride.begin[pooled], exposed)
            if self.electric is not None:
                self._values[-1][-len(EXTRA) :, case, rows] = self.electric.at(stride, pooled, moment)
        if self.electric is not None:
            done = np.zeros_like(stride.accepted) if self.watch is None else self.watch.done[stride.cases]
            self.electric.follow(stride, done)

    def _due(self, stride: Stride) -> tuple[Cases, Cases]:
        """Columns and rows (k,) of the output times within the step."""
        columns, size = np.flatnonzero(stride.accepted), self._relative.shape[1]
        due = [(columns[:0], columns[:0])]
        while columns.size:
            case = stride.cases[columns]
            rows = self._next[case, None] + ROWS_AT_A_LOOK
            within = (rows < size) & (self._relative[case[:, None], np.minimum(rows, size - 1)] <= stride.elapsed[columns, None])
            passed = np.count_nonzero(within, axis=1)
            due.append((np.repeat(columns, passed), rows[within]))
            self._next[case] += passed
            columns = columns[passed == ROWS_AT_A_LOOK.size]
        first, second = zip(*due, strict=True)
        return np.concatenate(first), np.concatenate(second)

    def _write(
        self,
        system: Films,
        state: Floats,
        pooled: Cases,
        case: Cases,
        row: Cases,
        moment: Floats,
        begin: Floats,
        exposed: Floats | None,
    ) -> None:
        """Write states (rows, k) of columns `pooled` of the system at times (k,) since a span began, `begin` (k,) since the piece
        did, and what has added up, `exposed` (exposures, k), of films that are watched.
        """
        if not case.size:
            return
        driven = system.driven(moment, state, pooled)
        log_squared, nominal = system.membrane(state, driven)
        self._values[-1][:5, case, row] = np.concatenate((log_squared, nominal, driven[2:]))
        if self.watch is not None:
            seen = self.watch.moment(system.take(pooled), case, begin, moment, state)
            self._values[-1][5, case, row] = self.watch.stability(seen).determinant
            self._values[-1][ROWS : ROWS + self.exposures, case, row] = exposed
        if self.wanted.internal:
            self._internal[-1][:, :, case, row] = system.internal(state)

    def collect(self) -> Record:
        """The record of all pieces."""
        time = np.concatenate(self._times, axis=1) if self.wanted.times is None else self.wanted.times
        internal = np.concatenate(self._internal, axis=3) if self.wanted.internal else None
        return Record(time, np.concatenate(self._values, axis=2), internal, self.exposures)

    @staticmethod
    def _within(times: Floats, start: Floats, duration: Floats, last: bool) -> Floats:
        """Those of the times that lie in a piece, counted from its start; the start itself belongs to the piece before."""
        begin, end = start[:, None], (start + duration)[:, None]
        slack = 1e-12 * end if last else 0.0
        relative = np.clip(times - begin, 0.0, duration[:, None])
        return np.where(((times > begin) | ((times == 0) & (begin == 0))) & (times <= end + slack), relative, np.nan)


def ending(record: Record, reached: Floats, at_end: Floats) -> Record:
    """The record up to `reached` (cases,), whose last row is what held there, `at_end` (6, cases), NaN for a case that has its last
    row already; it has as many rows as the record has.

    That comes in the place of the first output that was not reached, or of one at the same time.
    """
    time, values = record.time.copy(), record.values.copy()
    case = np.flatnonzero(np.isfinite(at_end[0]))
    written = np.isfinite(values[0, case])
    rows = np.where(written.any(axis=1), time.shape[1] - np.argmax(written[:, ::-1], axis=1), 0)
    before = time[case, np.maximum(rows - 1, 0)]
    column = np.where((rows > 0) & (before >= reached[case] * (1 - 1e-12)), rows - 1, np.minimum(rows, time.shape[1] - 1))
    time[case, column], values[:, case, column] = reached[case], at_end[:, case]
    return replace(record, time=time, values=values)
