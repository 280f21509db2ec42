"""Where results are kept: the stepper's dense output at the times that are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, shown
from dielast.mechanics.course import Chain, Course
from dielast.mechanics.load import Piece, Waveform, of_case
from dielast.mechanics.span import Floats
from dielast.mechanics.symmetric import Films
from dielast.numerics.integrate import Cases, Stride

if TYPE_CHECKING:
    from dielast.mechanics.events import Watch

ROWS = 6
DIGITS = 1e-8  # of a time; no table tells rows apart that are closer
AFTER = 1e-13  # of the duration of a piece: a row so soon after another shows what has jumped
KEPT_WHOLE = 100  # cycles of a step up to which all are kept in full, unless it is stated which


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """What a history is to leave behind: rows at `times` (cases, k) in s, or at those that suit each piece of load, with so many
    `points_per_decade`, and in full for the `cycles` of a waveform, counted from 1; with `internal`, x of all springs.
    """

    times: Floats | None = None
    points_per_decade: int = 30
    cycles: str | tuple[int, ...] | None = None
    internal: bool = False

    def take(self, cases: Cases) -> Wanted:
        """The same of some of the cases."""
        return self if self.times is None else replace(self, times=self.times[cases])

    def kept(self, cycles: int) -> Cases:
        """The cycles kept in full, counted from 0: by default all if they are few, or else 1, 2, 5, 10, 20 and so on, and the
        last.
        """
        if self.cycles == "all" or (self.cycles is None and cycles <= KEPT_WHOLE):
            return np.arange(cycles)
        if self.cycles == "last":
            return np.array([cycles - 1])
        some = self.cycles
        if some is None or isinstance(some, str):
            some = (*(digit * 10**power for power in range(len(str(cycles))) for digit in (1, 2, 5)), cycles)
        return np.unique([cycle - 1 for cycle in some if cycle <= cycles]).astype(np.intp)


@dataclass(slots=True, eq=False)
class Recorder:
    """Writes Lambda and nominal stress of both axes, the nominal field, and with a `watch` the determinant of the tangent, and on
    request x. Observes the stepper; between pieces of load, `begin` is called. What is never reached stays NaN.
    """

    wanted: Wanted
    cases: int
    springs: int
    watch: Watch | None = None
    _times: list[Floats] = field(default_factory=list)
    _values: list[Floats] = field(default_factory=list)
    _internal: list[Floats] = field(default_factory=list)
    _relative: Floats = field(init=False)
    _next: Cases = field(init=False)
    _moved: Floats = field(init=False)
    """How long the load took to come to where it is, and what has passed since then, in s (cases,)."""

    def __post_init__(self) -> None:
        self._moved = np.full(self.cases, np.inf)

    def begin(
        self,
        course: Course,
        start: Floats,
        alive: NDArray[np.bool_],
        jumped: NDArray[np.bool_],
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
            self._values.append(np.full((ROWS, *relative.shape), np.nan))
            if self.wanted.internal:
                self._internal.append(np.full((2, self.springs, *relative.shape), np.nan))
        self._relative = relative if alive.all() else np.where(alive[:, None], relative, np.nan)
        after = self._relative > 0
        self._next = np.where(after.any(axis=1), np.argmax(after, axis=1), relative.shape[1])
        case, row = np.nonzero(self._relative == 0)
        self._write(system, state[:, case], case, case, row, np.zeros(case.size), np.zeros(case.size))

    def _rows(self, course: Course, start: Floats, jumped: NDArray[np.bool_]) -> Floats:
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
        columns = np.flatnonzero(stride.accepted)
        case, end = stride.cases[columns], (stride.begin + stride.until)[columns]
        row, last = self._next[case], self._relative.shape[1] - 1
        found: list[tuple[Cases, Cases]] = []
        while (due := (row <= last) & (self._relative[case, np.minimum(row, last)] <= end)).any():
            columns, case, row, end = columns[due], case[due], row[due], end[due]
            found.append((columns, row))
            row = row + 1
            self._next[case] = row
        if found:
            pooled, rows = (np.concatenate(parts) for parts in zip(*found, strict=True))
            case = stride.cases[pooled]
            moment = self._relative[case, rows] - stride.begin[pooled]
            assert isinstance(stride.system, Films)
            whole = self.watch is not None or self.wanted.internal
            part = slice(None) if whole else slice(stride.system.border, None)
            state = stride.dense(part, pooled, (moment - stride.time[pooled]) / stride.step[pooled])
            self._write(stride.system, state, pooled, case, rows, moment, stride.begin[pooled])

    def _write(self, system: Films, state: Floats, pooled: Cases, case: Cases, row: Cases, moment: Floats, begin: Floats) -> None:
        """Write states (rows, k) of columns `pooled` of the system at times (k,) since a span began, `begin` (k,) since the piece
        did.
        """
        if not case.size:
            return
        if case.size == 1:  # numbers in a lone column round differently
            pooled, case, row = (np.repeat(part, 2) for part in (pooled, case, row))
            state, moment, begin = (np.repeat(part, 2, axis=-1) for part in (state, moment, begin))
        some = system.take(pooled)
        driven = some.load.value(moment)
        log_squared, nominal = some.membrane(state, driven)
        values = self._values[-1]
        values[:2, case, row], values[2:4, case, row], values[4, case, row] = log_squared, nominal, driven[2]
        if self.watch is not None:
            values[5, case, row] = self.watch.stability(some, case, begin, moment, state).determinant
        if self.wanted.internal:
            self._internal[-1][:, :, case, row] = some.internal(state)

    def collect(self) -> tuple[Floats, Floats, Floats | None]:
        """Times (cases, k), values (6, cases, k) and x (2, n, cases, k) or None of all pieces."""
        time = np.concatenate(self._times, axis=1) if self.wanted.times is None else self.wanted.times
        internal = np.concatenate(self._internal, axis=3) if self.wanted.internal else None
        return time, np.concatenate(self._values, axis=2), internal

    @staticmethod
    def _within(times: Floats, start: Floats, duration: Floats, last: bool) -> Floats:
        """Those of the times that lie in a piece, counted from its start; the start itself belongs to the piece before."""
        begin, end = start[:, None], (start + duration)[:, None]
        slack = 1e-12 * end if last else 0.0
        relative = np.clip(times - begin, 0.0, duration[:, None])
        return np.where(((times > begin) | ((times == 0) & (begin == 0))) & (times <= end + slack), relative, np.nan)


def given_times(times: object, cases: int) -> Floats:
    """Output times as an array (cases, k); `InputError` unless they are finite, not negative and never fall."""
    array = np.atleast_2d(np.asarray(times, dtype=float))
    if array.ndim != 2 or array.shape[0] not in (1, cases) or not array.size:
        raise InputError(f"one list for all cases, or one for each of {cases} cases, is needed", argument="times")
    if not np.all(np.isfinite(array)) or np.any(array < 0):
        raise InputError("output times must be finite and not negative", argument="times")
    if np.any(np.diff(array, axis=1) < 0):
        raise InputError("output times must ascend", argument="times")
    return np.ascontiguousarray(np.broadcast_to(array, (cases, array.shape[1])))


def kept_cycles(cycles: object) -> str | tuple[int, ...] | None:
    """Which cycles to keep in full, "all", "last" or their numbers from 1; `InputError` for anything else."""
    if cycles is None or (isinstance(cycles, str) and cycles in ("all", "last")):
        return cycles
    numbers = [cycles] if isinstance(cycles, int) else list(cycles) if isinstance(cycles, Sequence) else []
    if (
        not numbers
        or isinstance(cycles, str)
        or any(isinstance(one, bool) or not isinstance(one, int) or one < 1 for one in numbers)
    ):
        raise InputError(f'{shown(cycles)}: "all", "last" or a list of their numbers from 1 is needed', argument="cycles")
    return tuple(numbers)


def check_cycles(cycles: str | tuple[int, ...] | None, pieces: Sequence[Piece]) -> None:
    """`InputError` for a cycle that no waveform of the pieces has."""
    most = max((piece.path.cycles for piece in pieces if isinstance(piece.path, Waveform)), default=0)
    if isinstance(cycles, tuple) and most and max(cycles) > most:
        raise InputError(f"{max(cycles)}: there {'is only 1' if most == 1 else f'are only {most}'} of them", argument="cycles")


def check_end(times: Floats | None, end: Floats, what: str) -> None:
    """`InputError` if output times (cases, k) lie after the `end` (cases,) of `what`."""
    if times is not None and np.any(late := times[:, -1] > end * (1 + 1e-12)):
        case = int(np.argmax(late))
        late_by = f"{times[case, -1]:g} s lies after the end of the {what} at {end[case]:g} s"
        raise InputError(late_by, argument="times", case=of_case(case, end.size))


def ending(time: Floats, values: Floats, reached: Floats, at_end: Floats) -> tuple[Floats, Floats]:
    """Output times (cases, k) and values (rows, cases, k) up to `reached` (cases,) whose last is what held there, `at_end` (rows,
    cases), NaN for a case that has its last row already.

    That comes in the place of the first output that was not reached, or of one at the same time.
    """
    time, values = time.copy(), values.copy()
    case = np.flatnonzero(np.isfinite(at_end[0]))
    written = np.isfinite(values[0, case])
    rows = np.where(written.any(axis=1), time.shape[1] - np.argmax(written[:, ::-1], axis=1), 0)
    before = time[case, np.maximum(rows - 1, 0)]
    column = np.where((rows > 0) & (before >= reached[case] * (1 - 1e-12)), rows - 1, np.minimum(rows, time.shape[1] - 1))
    time[case, column], values[:, case, column] = reached[case], at_end[:, case]
    return time, values
