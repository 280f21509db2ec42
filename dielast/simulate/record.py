"""Films at output times, of a whole history: the result of a `Recorder`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dielast.numerics.arrays import Cases, Floats

FIELD, DETERMINANT, ROWS = 4, 5, 6  # rows of `Record.values`, after Lambda and nominal stress of both axes; and their number
ELECTRICAL = ("charge", "source", "current", "work", "leaked", "lost", "mechanical", "stored")
"""Further rows, if charge, current and energies are requested."""
DIGITS = 1e-8  # relative distance of times below which the rows of a table cannot be told apart


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Films at output times `time` (cases, rows) in s.

    `values` (6 + exposures + electrical rows, cases, rows) are Lambda (2), total nominal stress (2), field and determinant,
    then the `exposures` of films with a watch, then the rows of `ELECTRICAL` if requested; NaN for times that a film does not
    reach. `internal` is x (2, n, cases, rows) if requested.
    """

    time: Floats
    values: Floats
    internal: Floats | None = None
    exposures: int = 0

    @property
    def stretch(self) -> Floats:
        """The stretches of axes 1 and 2, (2, cases, rows)."""
        return np.asarray(np.exp(0.5 * self.values[:2]))

    @property
    def nominal_stress(self) -> Floats:
        """The total nominal stresses, Maxwell stress included, of axes 1 and 2, (2, cases, rows) in Pa."""
        return self.values[2:4]

    @property
    def field(self) -> Floats:
        """The nominal field V/L_3 (cases, rows) in V/m."""
        return np.asarray(self.values[FIELD])

    @property
    def determinant(self) -> Floats:
        """The determinant of pull-in (cases, rows), of films with a watch."""
        return np.asarray(self.values[DETERMINANT])

    @property
    def exposed(self) -> Floats:
        """The exposures (exposures, cases, rows)."""
        return self.values[ROWS : ROWS + self.exposures]

    @property
    def electrical(self) -> Floats:
        """The rows of `ELECTRICAL`, (8, cases, rows), or no rows."""
        return self.values[ROWS + self.exposures :]


def with_further(record: Record, case: Cases, time: Floats, further_values: Floats, further_internal: Floats | None) -> Record:
    """The record with further rows (k,) in their places, of cases (k,) at times (k,) in s, with values (rows, k) and, if requested,
    x (2, n, k); those beside another row are left out.
    """
    (number, at), first = np.unique(np.stack((case, time)), axis=1, return_index=True)
    number = number.astype(np.intp)
    before = np.searchsorted(number, np.arange(record.time.shape[0] + 1))
    place = number, record.time.shape[1] + np.arange(number.size) - before[number]
    room = (0, 0), (0, int(np.diff(before).max()))
    times = np.pad(record.time, room, constant_values=np.nan)
    values = np.pad(record.values, ((0, 0), *room), constant_values=np.nan)
    times[place], values[:, *place] = at, further_values[:, first]
    order = _in_time(times)
    sorted_times, further = np.take_along_axis(times, order, axis=1), order >= record.time.shape[1]
    others = np.where(further, np.nan, sorted_times)
    last = np.fmax.accumulate(others, axis=1)
    following = np.fmin.accumulate(others[:, ::-1], axis=1)[:, ::-1]
    doubled = further & (np.fmin(sorted_times - last, following - sorted_times) <= DIGITS * sorted_times)
    # what is left out comes first, like all NaN, and in no column where all cases leave something out
    kept = _in_time(np.where(doubled, np.nan, sorted_times))
    kept = kept[:, int(np.min(np.sum(doubled | np.isnan(sorted_times), axis=1))) :]
    order, sorted_times, doubled = (np.take_along_axis(part, kept, axis=1) for part in (order, sorted_times, doubled))
    sorted_times[doubled] = np.nan
    values = np.take_along_axis(values, order[None], axis=2)
    values[:, doubled] = np.nan
    internal = record.internal
    if internal is not None and further_internal is not None:
        internal = np.pad(internal, ((0, 0), (0, 0), *room), constant_values=np.nan)
        internal[:, :, *place] = further_internal[..., first]
        internal = np.take_along_axis(internal, order[None, None], axis=3)
    return replace(record, time=sorted_times, values=values, internal=internal)


def _in_time(times: Floats) -> Cases:
    """The order (cases, rows) of the times (cases, rows) of each case, NaN first."""
    return np.argsort(np.where(np.isfinite(times), times, -1.0), axis=1, kind="stable")


def ending(record: Record, reached: Floats, at_end: Floats) -> Record:
    """The record up to the time `reached` (cases,), with the values `at_end` (rows, cases) as last row of each case.

    A case whose `at_end` is NaN is unchanged. The row replaces the first output that was not reached, or an output at the same
    time; the number of rows stays the same.
    """
    time, values = record.time.copy(), record.values.copy()
    case = np.flatnonzero(np.isfinite(at_end[0]))
    written = np.isfinite(values[0, case])
    rows = np.where(written.any(axis=1), time.shape[1] - np.argmax(written[:, ::-1], axis=1), 0)
    before = time[case, np.maximum(rows - 1, 0)]
    column = np.where((rows > 0) & (before >= reached[case] * (1 - 1e-12)), rows - 1, np.minimum(rows, time.shape[1] - 1))
    time[case, column], values[:, case, column] = reached[case], at_end[:, case]
    return replace(record, time=time, values=values)
