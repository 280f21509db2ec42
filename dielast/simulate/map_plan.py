"""The plan of a failure map: relaxed films, their voltages, and the cells, which are independent of each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from dielast.io.result import Result
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.span import Controls
from dielast.numerics.columns import Cases, Floats
from dielast.simulate.film_grid import Group
from dielast.simulate.history import first_of
from dielast.simulate.lives import live

CHUNK = 2048  # cells


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MapPlan(Result):
    """All data for the solution of any cell of a map, and the names of its `failures`.

    Cells are numbered through groups, films and voltages, the voltages varying fastest.
    """

    temperature: Floats
    prestretch: Floats
    voltage: Floats
    ramp: float
    horizon: float
    breakdown_field: Floats
    controls: Controls
    groups: tuple[Group, ...]
    failures: tuple[str, ...]
    draws: int = 0
    electrode_share: Floats | None = None
    stretch_at: Mapping[str, float] = field(default_factory=dict)
    """Times in s at which stretches are requested, by their names in tables."""

    @property
    def watched(self) -> tuple[str, ...]:
        """The names of the criteria to evaluate: the failures, and the loss of tension of passive parts."""
        return self.failures if self.electrode_share is None else (*self.failures, LossOfTension.name)

    @property
    def cells(self) -> int:
        """The number of cells, including those of the draws."""
        return (1 + self.draws) * self.temperature.size * len(self.prestretch) * self.voltage.size

    def chunks(self, size: int = CHUNK) -> list[tuple[int, int]]:
        """First cell and end of each chunk; a chunk lies within one group."""
        result, first = [], 0
        for group in self.groups:
            end = first + group.films.size * self.voltage.size
            result += [(start, min(start + size, end)) for start in range(first, end, size)]
            first = end
        return result


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Results of the cells from `first` on: `times` (cells,) in s by the name of the event, NaN where it did not happen; `Status`;
    and relative stretches (2, requested times, cells), NaN where a film failed earlier.
    """

    first: int
    times: Mapping[str, Floats]
    status: Cases
    stretched: Floats = field(default_factory=lambda: np.zeros((2, 0, 0)))


def column_of(name: str) -> str:
    """The name of the column with the time of this event."""
    return f"time_to_{name.replace('-', '_')}"


def solve_cells(plan: MapPlan, first: int, end: int) -> Cells:
    """Solve the cells from `first` up to, not including, `end`: a chunk of the plan, or a part of one."""
    begin = 0
    for group in plan.groups:
        if first < begin + group.films.size * plan.voltage.size:
            break
        begin += group.films.size * plan.voltage.size
    column, volt = np.divmod(np.arange(first - begin, end - begin), plan.voltage.size)
    lives = live(
        group,
        column,
        plan.voltage[volt],
        plan.controls,
        horizon=plan.horizon,
        ramp=plan.ramp,
        watched=plan.watched,
        until=plan.failures,
        times=list(plan.stretch_at.values()),
    )
    times = {name: first_of(lives.happened, [name]).time for name in plan.watched}
    return Cells(first, times, lives.status, lives.stretched)
