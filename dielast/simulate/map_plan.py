"""The plan of a failure map: relaxed films, their voltages, and the cells of which any can be solved without the others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dielast.io.result import Result
from dielast.mechanics.criteria import CRITERIA
from dielast.mechanics.criteria.criterion import WatchedFilms
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.line import Ramp
from dielast.mechanics.span import Controls
from dielast.mechanics.stability import TimeScale
from dielast.mechanics.watch import Watch
from dielast.numerics.columns import Cases, Floats, paired
from dielast.simulate.events import first_of
from dielast.simulate.film import Film
from dielast.simulate.follow import follow
from dielast.simulate.setup import Setup

CHUNK = 2048  # cells


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Relaxed films (one for each column) that run together: `films` says which of the map's each is, temperatures times
    prestretches, and then those of each draw. `rtol` is how exactly they are solved.
    """

    film: Film
    films: Cases
    watched: WatchedFilms
    thickness: Floats
    rtol: float


def groups_of(setup: Setup, timescale: TimeScale, first: int, rtol: float) -> tuple[Group, ...]:
    """The films of a setup, numbered from `first`, watched for a pull-in time scale."""
    groups = []
    for columns in setup.groups():
        films = np.flatnonzero(np.bincount(columns))  # np.unique would load numpy.ma, which takes its time
        film = setup.film(columns, rtol)
        groups.append(Group(film, first + films, setup.watched(film, columns, timescale), setup.thickness[films], rtol))
    return tuple(groups)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MapPlan(Result):
    """All that is needed to solve any cell of a map, and the names of the `failures` that it is about; cells are numbered through
    groups, films and voltages, the last running fastest.
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

    @property
    def watched(self) -> tuple[str, ...]:
        """The names of all that is looked for: the failures, and the loss of tension of passive parts."""
        return self.failures if self.electrode_share is None else (*self.failures, LossOfTension.name)

    @property
    def cells(self) -> int:
        """Number of cells, those of the draws too."""
        return (1 + self.draws) * self.temperature.size * len(self.prestretch) * self.voltage.size

    def chunks(self, size: int = CHUNK) -> list[tuple[int, int]]:
        """First cell and end of each chunk; no chunk spans two groups."""
        result, first = [], 0
        for group in self.groups:
            end = first + group.films.size * self.voltage.size
            result += [(start, min(start + size, end)) for start in range(first, end, size)]
            first = end
        return result


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """What became of the cells from `first` on: `times` in s (cells,) by the name of what happened, NaN where it did not, and
    their `Status`.
    """

    first: int
    times: Mapping[str, Floats]
    status: Cases


def column_of(name: str) -> str:
    """What the time to a failure of this name is called in tables."""
    return f"time_to_{name.replace('-', '_')}"


def solve_cells(plan: MapPlan, first: int, end: int) -> Cells:
    """Solve the cells from `first` up to `end`, one of the plan's chunks or a part of one."""
    begin = 0
    for group in plan.groups:
        if first < begin + group.films.size * plan.voltage.size:
            break
        begin += group.films.size * plan.voltage.size
    count = end - first
    column, volt = np.divmod(paired(np.arange(first - begin, end - begin)), plan.voltage.size)
    film, field = group.film.take(column), plan.voltage[volt] / group.thickness[column]
    watched_for = [criterion for criterion in CRITERIA if criterion.name in plan.watched]
    watch = Watch(group.watched.take(column), watched_for, plan.failures)
    pieces = [Ramp(plan.controls, (None, None, field), np.full(field.size, plan.ramp))]
    if plan.horizon > plan.ramp:
        pieces.append(Ramp(plan.controls, (None, None, None), np.full(field.size, plan.horizon - plan.ramp)))
    status = follow(film, pieces, rtol=group.rtol, watch=watch).status
    times = {name: first_of(watch.happened, [name]).time[:count] for name in plan.watched}
    return Cells(first, times, status[:count])
