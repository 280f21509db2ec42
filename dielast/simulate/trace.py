"""A film's voltage programme at output times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError
from dielast.events import Films, Watch
from dielast.gent import Cases, Floats
from dielast.integrate import Stride
from dielast.load import Piece, of_case
from dielast.point import Points
from dielast.simulate.output import Output

ROWS = 6


@dataclass(frozen=True, slots=True, eq=False)
class PieceTrace:
    """Writes what holds at `relative` times (cases, times) since a piece of load began into `values` (6, cases, times): Lambda and
    nominal stress of both axes, the nominal field, and the determinant of the tangent. Observes the stepper.
    """

    relative: Floats
    values: Floats
    watch: Watch

    def start(self, system: Films, state: Floats, alive: NDArray[np.bool_]) -> None:
        """Write what holds when the piece begins."""
        case, column = np.nonzero((self.relative == 0) & alive[:, None])
        if case.size:
            self._write(system, state[:, case], case, case, column)

    def __call__(self, stride: Stride) -> None:
        """Write what lies within the step."""
        columns = np.flatnonzero(stride.accepted)
        wanted = self.relative[stride.cases[columns]]
        row, column = np.nonzero((wanted > stride.time[columns, None]) & (wanted <= stride.until[columns, None]))
        if row.size:
            pooled = columns[row]
            case = stride.cases[pooled]
            state = stride.dense(slice(None), pooled, (self.relative[case, column] - stride.time[pooled]) / stride.step[pooled])
            assert isinstance(stride.system, Films)
            self._write(stride.system, state, pooled, case, column)

    def _write(self, system: Films, state: Floats, pooled: Cases, case: Cases, column: Cases) -> None:
        """Write states (rows, k) of columns `pooled` of the system."""
        if case.size == 1:  # numbers in a lone column round differently
            state, pooled, case, column = (
                np.repeat(state, 2, axis=1),
                np.repeat(pooled, 2),
                np.repeat(case, 2),
                np.repeat(column, 2),
            )
        some, moment = system.take(pooled), self.relative[case, column]
        driven = some.load.value(moment)
        log_squared, nominal = some.membrane(state, driven)
        determinant = self.watch.stability(some, case, moment, state).determinant
        self.values[:, case, column] = np.concatenate((log_squared, nominal, driven[2:], determinant[None]))


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Output times of a whole programme: `time` (cases, k) in s, and for each piece the times since it began, NaN for what lies
    elsewhere.

    Given times are columns that all pieces share; otherwise each piece has columns of its own.
    """

    time: Floats
    relative: tuple[Floats, ...]
    shared: bool

    @classmethod
    def over(cls, pieces: Sequence[Piece], points: Points, times: Floats | None, points_per_decade: int) -> Grid:
        """At given `times` (cases, k), or logarithmically within each piece. `InputError` for times after the end."""
        output = Output(points, times, points_per_decade, False)
        start, field, relative = np.zeros(points.rate.shape[1]), np.zeros(points.rate.shape[1]), []
        for index, piece in enumerate(pieces):
            end, duration = piece.resolve(np.stack((start, start, field)))
            moving = bool(np.any(end[2] != field))
            relative.append(output.recorder(start, duration, moving, last=index == len(pieces) - 1).relative)
            start, field = start + duration, end[2]
        if times is not None and np.any(times[:, -1] > start * (1 + 1e-12)):
            case = int(np.argmax(times[:, -1] > start * (1 + 1e-12)))
            late = f"{of_case(case, start.size)}output time {times[case, -1]:g} s"
            raise InputError(f"{late} lies after the end of the programme at {start[case]:g} s")
        return cls(output.collect()[0], tuple(relative), times is not None)

    def take(self, cases: NDArray[np.intp]) -> Grid:
        """The same for some of the cases."""
        return Grid(self.time[cases], tuple(relative[cases] for relative in self.relative), self.shared)


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Values (6, cases, k) on a grid, filled as a programme goes on."""

    values: Floats
    pieces: tuple[PieceTrace, ...]

    @classmethod
    def on(cls, grid: Grid, watch: Watch) -> Trace:
        """Nothing written yet."""
        values = np.full((ROWS, *grid.time.shape), np.nan)
        ends = np.cumsum([relative.shape[1] for relative in grid.relative])
        parts = [values] * len(ends) if grid.shared else np.split(values, ends[:-1], axis=2)
        return cls(
            values, tuple(PieceTrace(relative.copy(), part, watch) for relative, part in zip(grid.relative, parts, strict=True))
        )
