"""Where results are kept: the stepper's dense output at the times that are asked for."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dielast.errors import InputError
from dielast.gent import Floats
from dielast.integrate import Stride
from dielast.point import LoadedPoints, Points
from dielast.symmetric import SymmetricPoints

RAMP_DECADES = 3  # of output before the end of a ramp
HOLD_DECADES = 6  # of output before the end of a hold


@dataclass(frozen=True, slots=True, eq=False)
class Condition:
    """Where all cases stand: x (2, n, cases), Lambda and nominal stress (2, cases), nominal field and time (cases,), and the
    `next_step` (cases,) in s that the stepper would take if all went on smoothly, 0 where nothing is known of it.
    """

    internal: Floats
    log_squared_stretch: Floats
    nominal_stress: Floats
    field: Floats
    time: Floats
    next_step: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Recorder:
    """Writes what holds at `relative` times (cases, times) since a piece of load began into `border` (4, cases, times), Lambda
    above nominal stress, and x into `internal` (2, n, cases, times) unless that is None. NaN is no time. Observes the stepper.
    """

    relative: Floats
    border: Floats
    internal: Floats | None

    def start(self, condition: Condition) -> None:
        """Write what holds when the piece begins."""
        case, column = np.nonzero(self.relative == 0)
        self.border[:2, case, column] = condition.log_squared_stretch[:, case]
        self.border[2:, case, column] = condition.nominal_stress[:, case]
        if self.internal is not None:
            self.internal[:, :, case, column] = condition.internal[:, :, case]

    def __call__(self, stride: Stride) -> None:
        """Write what lies within the step."""
        columns = np.flatnonzero(stride.accepted)
        wanted = self.relative[stride.cases[columns]]
        row, column = np.nonzero((wanted > stride.time[columns, None]) & (wanted <= stride.until[columns, None]))
        if not row.size:
            return
        moment, pooled = wanted[row, column], columns[row]
        system, case = stride.system, stride.cases[pooled]
        assert isinstance(system, LoadedPoints | SymmetricPoints)
        rows = slice(system.border, None) if self.internal is None else slice(None)
        state = stride.dense(rows, pooled, (moment - stride.time[pooled]) / stride.step[pooled])
        log_squared, nominal = system.membrane(state, system.load.take(pooled).value(moment))
        self.border[:2, case, column] = log_squared
        self.border[2:, case, column] = nominal
        if self.internal is not None:
            self.internal[:, :, case, column] = np.moveaxis(system.internal(state), 2, -1)


@dataclass(slots=True, eq=False)
class Output:
    """What a history leaves behind: at given `times` (cases, k) in s, or logarithmically spaced within each piece."""

    points: Points
    times: Floats | None
    points_per_decade: int
    with_internal: bool
    _recorders: list[Recorder] = field(default_factory=list)
    _starts: list[Floats] = field(default_factory=list)

    def recorder(self, start: Floats, duration: Floats, moving: bool, last: bool) -> Recorder:
        """A recorder for the piece that lasts from `start` for `duration` (cases,); `moving` if it is not a hold."""
        if self.times is None:
            relative = duration[:, None] * self._fractions(duration, moving)
            self._starts.append(start)
        else:
            relative = self._within(self.times, start, duration, last)
        if self.times is None or not self._recorders:
            border = np.full((4, *relative.shape), np.nan)
            shape = (2, *self.points.rate.shape, relative.shape[1])
            recorder = Recorder(relative, border, np.full(shape, np.nan) if self.with_internal else None)
        else:
            recorder = Recorder(relative, self._recorders[0].border, self._recorders[0].internal)
        self._recorders.append(recorder)
        return recorder

    def collect(self) -> tuple[Floats, Floats, Floats | None]:
        """Times (cases, k), border (4, cases, k) and x (2, n, cases, k) or None of all pieces."""
        first = self._recorders[0]
        if self.times is not None:
            return self.times, first.border, first.internal
        time = np.concatenate([s[:, None] + r.relative for s, r in zip(self._starts, self._recorders, strict=True)], axis=1)
        border = np.concatenate([recorder.border for recorder in self._recorders], axis=2)
        if first.internal is None:
            return time, border, None
        return time, border, np.concatenate([r.internal for r in self._recorders if r.internal is not None], axis=3)

    def _fractions(self, duration: Floats, moving: bool) -> Floats:
        """Output times as fractions of the duration: the same for all cases, and for a case alone as among others."""
        if not np.any(duration > 0):
            return np.zeros(1)
        decades = RAMP_DECADES if moving else HOLD_DECADES
        return np.logspace(-decades, 0, decades * self.points_per_decade + 1)

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
        raise InputError(f"output times must be one list for all or one for each of {cases} cases")
    if not np.all(np.isfinite(array)) or np.any(array < 0):
        raise InputError("output times must be finite and not negative")
    if np.any(np.diff(array, axis=1) < 0):
        raise InputError("output times must ascend")
    return np.ascontiguousarray(np.broadcast_to(array, (cases, array.shape[1])))


def ending(time: Floats, values: Floats, reached: Floats, at_end: Floats) -> tuple[Floats, Floats]:
    """Output times (cases, k) and values (rows, cases, k) up to `reached` (cases,) whose last is what held there, `at_end` (rows,
    cases), NaN for a case that has its last row already.

    That comes in the place of the first output that was not reached, or of one at the same time.
    """
    time, values = time.copy(), values.copy()
    case = np.flatnonzero(np.isfinite(at_end[0]))
    rows = np.sum(np.isfinite(values[0, case]), axis=1)
    before = time[case, np.maximum(rows - 1, 0)]
    column = np.where((rows > 0) & (before >= reached[case] * (1 - 1e-12)), rows - 1, np.minimum(rows, time.shape[1] - 1))
    time[case, column], values[:, case, column] = reached[case], at_end[:, case]
    return time, values
