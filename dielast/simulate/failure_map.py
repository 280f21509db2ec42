"""Failure maps: how long prestretched films live under constant voltage, over voltage, prestretch and temperature.

Each prestretch is stretched and relaxed once at each temperature; its films then live through all voltages. A map is planned,
solved in chunks of cells that know nothing of each other, and assembled; no result depends on how the cells are cut into chunks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError, in_a_draw
from dielast.io.result import Result, TabularResult
from dielast.io.table import Column, Table
from dielast.material.material import Breakdown, Material
from dielast.material.springs import Floats
from dielast.mechanics.events import Kind, Watch
from dielast.mechanics.load import Piece
from dielast.mechanics.span import Control
from dielast.mechanics.stability import ONE_PERCENT, TimeScale
from dielast.numerics.integrate import Status
from dielast.simulate.film import Film, programme
from dielast.simulate.follow import REASONS
from dielast.simulate.setup import Setup, set_up

if TYPE_CHECKING:
    from dielast.material.scatter import Sample

CHUNK = 2048  # cells
DRAWN_RTOL = 5e-4  # of draws, unless it is stated: their times are then exact to 0.1 %, commonly far less than they differ by


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FailureMap(TabularResult):
    """Times in s, arrays (temperatures, prestretches, voltages), NaN where it does not happen within the `horizon` or is not known.

    `failure_mode` is breakdown, pull-in, none, or unfinished where the numerics gave up before the film failed; `outcome` is
    completed, or says why the numerics gave up. `prestretch` is of shape (prestretches, 2), `breakdown_field` (prestretches,) in
    V/m.
    """

    temperature: Floats
    prestretch: Floats
    voltage: Floats
    horizon: float
    breakdown_field: Floats
    time_to_breakdown: Floats
    time_to_pull_in: Floats
    time_to_failure: Floats
    failure_mode: NDArray[np.str_]
    outcome: NDArray[np.str_]

    def columns(self) -> Table:
        """One row for each cell: temperatures, then prestretches, then voltages."""
        t, p, v = (index.ravel() for index in np.indices(self.failure_mode.shape))
        return [
            Column("temperature", "degC", self.temperature[t]),
            Column("prestretch_1", "1", self.prestretch[p, 0]),
            Column("prestretch_2", "1", self.prestretch[p, 1]),
            Column("voltage", "V", self.voltage[v]),
            Column("time_to_breakdown", "s", self.time_to_breakdown.ravel()),
            Column("time_to_pull_in", "s", self.time_to_pull_in.ravel()),
            Column("time_to_failure", "s", self.time_to_failure.ravel()),
            Column("failure_mode", None, self.failure_mode.ravel().tolist()),
        ]

    @property
    def completed(self) -> bool:
        """Whether the numerics got through in every cell."""
        return bool(np.all(self.outcome == "completed"))


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Relaxed films (one for each column) that run together: `films` says which of the map's each is, temperatures times
    prestretches, and then those of each draw. `rtol` is how exactly they are solved.
    """

    film: Film
    films: NDArray[np.intp]
    breakdown_field: Floats
    thickness: Floats
    rtol: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MapPlan(Result):
    """All that is needed to solve any cell of a map; cells are numbered through groups, films and voltages, the last running
    fastest.
    """

    temperature: Floats
    prestretch: Floats
    voltage: Floats
    ramp: float
    horizon: float
    breakdown_field: Floats
    controls: tuple[Control, Control]
    timescale: TimeScale
    groups: tuple[Group, ...]
    draws: int = 0

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
    """What became of some cells: times in s (cells,), NaN where an event did not happen, and their `Status`."""

    first: int
    time_to_breakdown: Floats
    time_to_pull_in: Floats
    status: NDArray[np.intp]


def failure_map(
    material: Material,
    *,
    voltage: ArrayLike,
    prestretch: ArrayLike,
    thickness: float,
    horizon: float,
    temperature: ArrayLike | None = None,
    prestretch_rate: float | None = None,
    relax: float = 0.0,
    ramp: float = 0.0,
    boundary: str | tuple[str, str] = "dead-load",
    breakdown_field: ArrayLike | Breakdown | None = None,
    pull_in_timescale: TimeScale = ONE_PERCENT,
    rtol: float = 1e-6,
    progress: Callable[[int, int], None] | None = None,
) -> FailureMap:
    """Times to breakdown and to pull-in within `horizon` s of films under each `voltage` (nv,) in V, reached within `ramp` s or at
    once.

    `prestretch` (np,) is equibiaxial, or (np, 2); `temperature` (nt,) in degC, the reference temperature by default;
    `breakdown_field` in V/m, one or one for each prestretch, or over prestretch, the material's by default; the rest as in
    `actuate`. Both times are found where both happen. `progress` is called with the numbers of cells solved and of all cells.
    Raises `InputError` for anything wrong with the arguments.
    """
    plan = plan_failure_map(
        material,
        voltage=voltage,
        prestretch=prestretch,
        thickness=thickness,
        horizon=horizon,
        temperature=temperature,
        prestretch_rate=prestretch_rate,
        relax=relax,
        ramp=ramp,
        boundary=boundary,
        breakdown_field=breakdown_field,
        pull_in_timescale=pull_in_timescale,
        rtol=rtol,
    )
    return solve_map(plan, progress)[0]


def solve_map(plan: MapPlan, progress: Callable[[int, int], None] | None = None) -> list[FailureMap]:
    """The planned map, and then that of each draw; `progress` as in `failure_map`."""
    solved = []
    for first, end in plan.chunks():
        solved.append(solve_cells(plan, first, end))
        if progress is not None:
            progress(end, plan.cells)
    return assemble_all(plan, solved)


def plan_failure_map(
    material: Material,
    *,
    voltage: ArrayLike,
    prestretch: ArrayLike,
    thickness: float,
    horizon: float,
    temperature: ArrayLike | None = None,
    prestretch_rate: float | None = None,
    relax: float = 0.0,
    ramp: float = 0.0,
    boundary: str | tuple[str, str] = "dead-load",
    breakdown_field: ArrayLike | Breakdown | None = None,
    pull_in_timescale: TimeScale = ONE_PERCENT,
    rtol: float = 1e-6,
    sample: Sample | None = None,
    drawn_rtol: float | None = None,
) -> MapPlan:
    """Check the arguments of `failure_map`, and stretch and relax its films; with a `sample`, also those of all its draws, solved
    to `drawn_rtol`, by default a loose one.
    """
    volts = _axis(voltage, "voltage")
    if not np.all(volts >= 0):
        raise InputError(f"{volts.min():g} V: it must not be negative", argument="voltage")
    pairs = np.asarray(prestretch, dtype=float)
    pairs = np.stack((pairs, pairs), axis=-1) if pairs.ndim < 2 else pairs
    pairs = pairs.reshape(-1, 2) if pairs.shape[-1] == 2 else pairs
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not pairs.size:
        raise InputError("the prestretches of a map must be a list of numbers or of pairs, and not empty", argument="prestretch")
    temperatures = _axis(material.reference_temperature if temperature is None else temperature, "temperature")
    if not (np.isfinite(horizon) and horizon > 0):
        raise InputError(f"{horizon:g} s: it must be positive", argument="horizon")
    if not 0 <= ramp <= horizon:
        raise InputError(f"{ramp:g} s: it must lie between 0 and the horizon of {horizon:g} s", argument="ramp")
    films = temperatures.size * len(pairs)
    if breakdown_field is not None and not isinstance(breakdown_field, Breakdown):
        given = np.asarray(breakdown_field, dtype=float).reshape(-1)
        if given.size not in (1, len(pairs)):
            raise InputError(
                f"{given.size} fields for {len(pairs)} prestretches: one, or one for each is needed", argument="breakdown_field"
            )
        breakdown_field = np.tile(np.broadcast_to(given, (len(pairs),)), temperatures.size)

    def films_of(materials: Sequence[Material], field: Floats | Breakdown | None, thick: ArrayLike, tolerance: float) -> Setup:
        """The map's films of each material, one material after the other."""
        return set_up(
            [each for each in materials for _ in range(films)] if len(materials) > 1 else materials,
            (np.tile(pairs[:, 0], temperatures.size * len(materials)), np.tile(pairs[:, 1], temperatures.size * len(materials))),
            spanning=(),
            thickness=thick,
            prestretch_rate=prestretch_rate,
            relax=relax,
            boundary=boundary,
            temperature=np.tile(np.repeat(temperatures, len(pairs)), len(materials)),
            breakdown_field=field,
            breakdown_needed=True,
            rtol=tolerance,
        )

    setup = films_of([material], breakdown_field, thickness, rtol)
    groups = _groups(setup, 0, rtol)
    if sample is not None:
        field = None if breakdown_field is None else np.tile(setup.breakdown_field, len(sample))
        tolerance, thick = drawn_rtol or max(rtol, DRAWN_RTOL), thickness * np.repeat(sample.thickness_factor, films)
        with in_a_draw(argument="sample"):
            drawn = films_of(sample.materials, field, thick, tolerance)
            scaled = drawn.breakdown_field * np.repeat(sample.breakdown_factor, films)
            groups += _groups(replace(drawn, breakdown_field=scaled), films, tolerance)
    return MapPlan(
        temperatures,
        pairs,
        volts,
        ramp,
        horizon,
        setup.breakdown_field[: len(pairs)],
        setup.controls,
        pull_in_timescale,
        groups,
        0 if sample is None else len(sample),
    )


def _groups(setup: Setup, first: int, rtol: float) -> tuple[Group, ...]:
    """The films of a setup, numbered from `first`."""
    groups = []
    for columns in setup.groups():
        own = np.flatnonzero(np.bincount(columns))  # np.unique would load numpy.ma, which takes its time
        groups.append(Group(setup.film(columns, rtol), first + own, setup.breakdown_field[own], setup.thickness[own], rtol))
    return tuple(groups)


def solve_cells(plan: MapPlan, first: int, end: int) -> Cells:
    """Solve the cells from `first` up to `end`, one of the plan's chunks or a part of one."""
    begin = 0
    for group in plan.groups:
        if first < begin + group.films.size * plan.voltage.size:
            break
        begin += group.films.size * plan.voltage.size
    count = end - first
    # numbers in a lone column round differently
    column, volt = np.divmod(np.resize(np.arange(first - begin, end - begin), max(2, count)), plan.voltage.size)
    field = plan.voltage[volt] / group.thickness[column]
    both = (Kind.BREAKDOWN, Kind.PULL_IN)
    watch = Watch(plan.controls, group.breakdown_field[column], plan.timescale, both, tension=False)
    pieces = [Piece(plan.controls, (None, None, field), np.full(field.size, plan.ramp))]
    if plan.horizon > plan.ramp:
        pieces.append(Piece(plan.controls, (None, None, None), np.full(field.size, plan.horizon - plan.ramp)))
    status = programme(group.film.take(column), pieces, watch, rtol=group.rtol)[1]
    times = watch.happened.time[:, :count]
    return Cells(first, times[Kind.BREAKDOWN], times[Kind.PULL_IN], status[:count])


def assemble(plan: MapPlan, solved: Sequence[Cells]) -> FailureMap:
    """The map from all of its cells, in any order, without its draws."""
    return assemble_all(plan, solved)[0]


def assemble_all(plan: MapPlan, solved: Sequence[Cells]) -> list[FailureMap]:
    """The map, and then that of each draw."""
    ordered = sorted(solved, key=lambda cells: cells.first)
    films = np.concatenate([group.films for group in plan.groups])
    shape = (1 + plan.draws, plan.temperature.size, len(plan.prestretch), plan.voltage.size)

    def grid(parts: list[NDArray[np.float64]] | list[NDArray[np.intp]]) -> Floats:
        rows = np.concatenate(parts).reshape(films.size, plan.voltage.size)
        result = np.empty(rows.shape)
        result[films] = rows
        return result.reshape(shape)

    breakdown, pull_in = grid([c.time_to_breakdown for c in ordered]), grid([c.time_to_pull_in for c in ordered])
    status = grid([c.status for c in ordered]).astype(int)
    return [_map(plan, *parts) for parts in zip(breakdown, pull_in, status, strict=True)]


def _map(plan: MapPlan, breakdown: Floats, pull_in: Floats, status: NDArray[np.intp]) -> FailureMap:
    failure = np.fmin(breakdown, pull_in)
    gave_up = ~np.isin(status, (Status.COMPLETED, Status.STOPPED))
    mode = np.select([breakdown == failure, pull_in == failure, gave_up], ["breakdown", "pull-in", "unfinished"], default="none")
    outcome = np.full(status.shape, "completed", dtype=object)
    for state in sorted(set(status[gave_up].tolist())):
        outcome[status == state] = REASONS[Status(state)]
    return FailureMap(
        plan.temperature,
        plan.prestretch,
        plan.voltage,
        plan.horizon,
        plan.breakdown_field,
        breakdown,
        pull_in,
        failure,
        mode,
        outcome.astype(str),
    )


def _axis(values: ArrayLike, name: str) -> Floats:
    """A grid's axis."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    if array.ndim != 1 or not array.size:
        raise InputError(f"the {name} axis of a map must be a list of numbers, and not empty", argument=name)
    if not np.all(np.isfinite(array)):
        raise InputError("every value must be finite", argument=name)
    return array
