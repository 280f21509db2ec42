"""The plan of a failure map: relaxed films, their voltages, and the cells, which are independent of each other."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from dielast.io.result import Result
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Cases, Floats, Texts
from dielast.simulate.events import first_of, name_of_first
from dielast.simulate.film_grid import FilmGrid

CHUNK = 2048  # cells


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MapPlan(Result):
    """All data for the solution of any cell of a map: the films of the `grid`, for each `temperature` (nt,) those of all
    `prestretch` (np, 2) and `electrode_share` (np,), under every `voltage` (nv,).

    Cells are numbered through groups, films and voltages, the voltages varying fastest.
    """

    grid: FilmGrid
    temperature: Floats
    prestretch: Floats
    voltage: Floats
    ramp: float
    horizon: float
    electrode_share: Floats | None = None
    stretch_at: Mapping[str, float] = field(default_factory=dict)
    """Times in s at which stretches are requested, by their names in tables."""

    def relaxed(self) -> Self:
        """The plan with prestretched and relaxed films; raises `NumericsError` if the prestretch of a film cannot be computed."""
        return replace(self, grid=self.grid.relaxed())

    @property
    def breakdown_field(self) -> Floats:
        """The breakdown field (np,) in V/m, infinite where none is known."""
        return self.grid.breakdown_field[: len(self.prestretch)]

    @property
    def watched(self) -> tuple[str, ...]:
        """The names of the criteria to evaluate: the failures, and loss of tension unless both axes are under a dead load."""
        held = any(control is not Control.STRESS for control in self.grid.controls)
        return (*self.grid.failures, LossOfTension.name) if held else self.grid.failures

    @property
    def cells(self) -> int:
        """The number of cells, including those of the draws."""
        return (1 + self.grid.draws) * self.grid.breakdown_field.size * self.voltage.size

    def chunks(self, size: int = CHUNK) -> list[tuple[int, int]]:
        """First cell and end of each chunk; a chunk lies within one group."""
        return self.grid.chunks(size, self.voltage.size)


@dataclass(frozen=True, slots=True, eq=False)
class SolvedCells:
    """Results of a chunk of cells: `times` (cells,) in s by the name of the event, NaN where it did not happen; the name `mode`
    (cells,) of the first failure or "none"; `Status`; and relative stretches (2, requested times, cells), NaN where a film failed
    earlier.
    """

    times: Mapping[str, Floats]
    mode: Texts
    status: Cases
    stretched: Floats = field(default_factory=lambda: np.zeros((2, 0, 0)))


def column_of(name: str) -> str:
    """The name of the column with the time of this event."""
    return f"time_to_{name.replace('-', '_')}"


def solve_cells(plan: MapPlan, first: int, end: int) -> SolvedCells:
    """Solve the cells from `first` up to, not including, `end`: a chunk of the plan, or a part of one."""
    group, cells = plan.grid.cells_of(first, end, plan.voltage.size)
    column, volt = np.divmod(cells, plan.voltage.size)
    lives = group.lives(
        column,
        plan.voltage[volt],
        horizon=plan.horizon,
        ramp=plan.ramp,
        watched=plan.watched,
        until=plan.grid.failures,
        times=list(plan.stretch_at.values()),
    )
    times = {name: first_of(lives.happened, [name]).time for name in plan.watched}
    mode = name_of_first(lives.happened, plan.grid.failures).astype(str)
    return SolvedCells(times, mode, lives.status, lives.stretched)
