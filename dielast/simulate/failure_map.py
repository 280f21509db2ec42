"""Failure maps: the life of prestretched films under constant voltage, over voltage, prestretch and temperature.

Films are prestretched and relaxed once for each prestretch and temperature, and then simulated under all voltages. A map is
planned, solved in chunks of independent cells, and assembled; no result depends on the division into chunks.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.base.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.material.argument_types import checked, real_number
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.numerics.arrays import Cases, Floats, Texts
from dielast.numerics.integrate import Status
from dielast.simulate.events import NONE
from dielast.simulate.film_grid import axis_of, lay_out
from dielast.simulate.film_setup import Film
from dielast.simulate.history import REASONS
from dielast.simulate.map_plan import MapPlan, SolvedCells, column_of, solve_cells
from dielast.simulate.options import Failure, Options, Solver
from dielast.simulate.quantities import CELLS, lasting


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FailureMap(TabularResult):
    """Times in s, arrays (temperatures, prestretches, voltages), NaN where an event does not happen within the `horizon` or is
    unknown.

    `times` are those of the first events by name, such as breakdown or pull-in, and `time_to_failure` is the earliest of them.
    `failure_mode` is the name of that event, "none", or "unfinished" where the numerics gave up before a failure; `outcome` is
    "completed", or the reason why the numerics gave up. `temperature` (temperatures,) is in degC, `prestretch` (prestretches, 2),
    `voltage` (voltages,) in V, `breakdown_field` (prestretches,) in V/m, infinite where none is known.

    For films with a passive part, the axis of prestretches is that of all pairs of a prestretch and an `electrode_share`
    (prestretches,), the share varying fastest. These, and films of which an axis is clamped, lose tension at
    `time_to_loss_of_tension`; later times hold only for films that do not wrinkle.

    `relative_stretch` is relative to the prestretch, at the times `stretch_at` in s, by the names of these times: arrays
    (1, temperatures, prestretches, voltages), or (2, ...) if the axes of films differ; NaN where the film failed earlier.
    """

    temperature: Floats
    prestretch: Floats
    voltage: Floats
    horizon: float
    breakdown_field: Floats
    times: Mapping[str, Floats]
    time_to_failure: Floats
    failure_mode: Texts
    outcome: Texts
    electrode_share: Floats | None = None
    time_to_loss_of_tension: Floats | None = None
    stretch_at: Mapping[str, float] = field(default_factory=dict)
    relative_stretch: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def time_to_breakdown(self) -> Floats:
        """The time at which the true field reaches the breakdown field, in s; NaN where no breakdown field is known."""
        return self.times["breakdown"]

    @property
    def time_to_pull_in(self) -> Floats:
        """The time at which the film ceases to be in stable equilibrium, in s."""
        return self.times["pull-in"]

    def columns(self) -> Table:
        """The table, one row per cell: temperatures, then prestretches, then voltages (fastest)."""
        slack = self.time_to_loss_of_tension
        return [
            *failure_cells(self),
            *(Column(column_of(name), "s", time.ravel()) for name, time in self.times.items()),
            *([] if slack is None else [Column(column_of(LossOfTension.name), "s", slack.ravel())]),
            Column("time_to_failure", "s", self.time_to_failure.ravel()),
            Column("failure_mode", None, self.failure_mode.ravel().tolist()),
            *(
                Column(f"relative_stretch_{axis} after {name}", "1", along.ravel())
                for name, stretch in self.relative_stretch.items()
                for axis, along in enumerate(stretch, start=1)
            ),
            *(Column(quantity.name, quantity.unit, np.ravel(np.asarray(quantity.of(self), dtype=float))) for quantity in CELLS),
        ]

    @property
    def completed(self) -> bool:
        """Whether the numerics completed every cell."""
        return bool(np.all(self.outcome == "completed"))


def failure_cells(result: FailureMap) -> Table:
    """The columns of a map's table that identify the film and the voltage of each row."""
    t, p, v = (index.ravel() for index in np.indices(result.failure_mode.shape))
    return [
        Column("temperature", "degC", result.temperature[t]),
        Column("prestretch_1", "1", result.prestretch[p, 0]),
        Column("prestretch_2", "1", result.prestretch[p, 1]),
        *(() if result.electrode_share is None else [Column("electrode_share", "1", result.electrode_share[p])]),
        Column("voltage", "V", result.voltage[v]),
    ]


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class HeldVoltages(Options):
    """What each film of a map is asked for: its life under every constant voltage of `values` (nv,) in V, which is reached within
    `ramp` s, or at once, and held up to the `horizon` in s; and its relative stretch at the times `stretch_at` in s, a list or a
    mapping from names to times.
    """

    values: ArrayLike
    horizon: float
    ramp: float = 0.0
    stretch_at: Mapping[str, float] | ArrayLike = ()


def failure_map(
    material: Material,
    film: Film,
    voltages: HeldVoltages,
    *,
    failure: Failure = Failure(),
    solver: Solver = Solver(),
) -> FailureMap:
    """Times to breakdown and to pull-in of films under constant voltages.

    The prestretch of the `film` is a list (np,), equibiaxial, or pairs (np, 2); its temperature (nt,) and electrode share are
    numbers, or further axes of the map. A breakdown field is one number, one per prestretch, or a law. Both times are located where
    both events happen. `plan_failure_map` takes draws, and `solve_map` says how far it is.

    The equations are those of Sec. 3 of DOI 10.1115/1.4030850. Raises `InputError` for invalid arguments.
    """
    return solve_map(plan_failure_map(material, film, voltages, failure=failure, solver=solver))[0]


def solve_map(plan: MapPlan, progress: Callable[[int, int], None] | None = None) -> list[FailureMap]:
    """The planned map, followed by the maps of all draws, each with shape (nt, np, nv). `progress` is called with the number of
    solved cells and that of all cells.
    """
    plan, solved = plan.relaxed(), []
    for first, end in plan.chunks():
        solved.append(solve_cells(plan, first, end))
        if progress is not None:
            progress(end, plan.cells)
    return assembled(plan, solved)


def plan_failure_map(
    material: Material,
    film: Film,
    voltages: HeldVoltages,
    *,
    failure: Failure = Failure(),
    solver: Solver = Solver(),
    sample: Sample | None = None,
) -> MapPlan:
    """Check the arguments of `failure_map`, and lay out its films; with a `sample`, also those of its draws.

    `MapPlan.relaxed` prestretches and relaxes them. Raises `InputError` as `failure_map` does.
    """
    volts, horizon, ramp = axis_of(voltages.values, "voltage"), voltages.horizon, voltages.ramp
    if not np.all(volts >= 0):
        raise InputError(f"{volts.min():g} V: it must not be negative", argument="voltage")
    if not 0 < horizon < np.inf:
        raise InputError(f"{horizon:g} s: it must be positive", argument="horizon")
    if not 0 <= ramp <= horizon:
        raise InputError(f"{ramp:g} s: it must lie between 0 and the horizon of {horizon:g} s", argument="ramp")
    stretch_times = _stretch_times(voltages.stretch_at, horizon)
    film = replace(film, thickness=real_number(film.thickness, "thickness"))
    grid = lay_out(material, film, failure=failure, solver=solver, sample=sample)
    temperatures = axis_of(material.reference_temperature if film.temperature is None else film.temperature, "temperature")
    films = slice(grid.temperature.size // temperatures.size)
    share = None if grid.electrode_share is None else grid.electrode_share[films]
    return MapPlan(grid, temperatures, grid.prestretch[films], volts, ramp, horizon, share, stretch_times)


def _stretch_times(stretch_at: Mapping[str, float] | ArrayLike, horizon: float) -> dict[str, float]:
    """The times in s by their names; `InputError` for a time that is negative or beyond the horizon."""
    named = stretch_at if isinstance(stretch_at, Mapping) else {lasting(time): time for time in np.ravel(stretch_at).tolist()}
    for time in named.values():
        if not 0 <= time <= horizon:
            text = f"{time:g} s: it must lie between 0 and the horizon of {horizon:g} s"
            raise InputError(text, argument="stretch_at")
    return {str(name): float(time) for name, time in named.items()}


def assembled(plan: MapPlan, solved: Sequence[SolvedCells]) -> list[FailureMap]:
    """The map from its solved cells, chunk by chunk in their order, followed by the map of each draw, in which cells of films that
    the draw lacks are unfinished.
    """
    films = np.concatenate([group.films for group in plan.grid.groups])
    shape = 1 + plan.grid.draws, plan.temperature.size, len(plan.prestretch), plan.voltage.size

    def whole(parts: Sequence[NDArray[Any]], lacking: Any = np.nan) -> NDArray[Any]:
        """The values (..., cells) of all parts on the grid, (..., 1 + draws, nt, np, nv)."""
        values = np.concatenate(parts, axis=-1)
        rows = np.full((*values.shape[:-1], plan.cells // plan.voltage.size, plan.voltage.size), lacking, dtype=values.dtype)
        rows[..., films, :] = values.reshape(*values.shape[:-1], films.size, plan.voltage.size)
        return rows.reshape(*values.shape[:-1], *shape)

    times = {name: whole([cells.times[name] for cells in solved]) for name in solved[0].times}
    mode, status = whole([cells.mode for cells in solved], NONE), whole([cells.status for cells in solved], Status.NO_START)
    stretched = whole([cells.stretched for cells in solved])
    return [
        _map(plan, {name: time[draw] for name, time in times.items()}, mode[draw], status[draw], stretched[:, :, draw])
        for draw in range(1 + plan.grid.draws)
    ]


def _map(plan: MapPlan, times: Mapping[str, Floats], mode: Texts, status: Cases, stretched: Floats) -> FailureMap:
    """A map from times by event, the `mode` of the first failure and `Status`, all (nt, np, nv), and relative stretches (2,
    requested times, nt, np, nv).
    """
    slack = times.get(LossOfTension.name)
    times = {name: times[name] for name in plan.grid.failures}
    failure = np.fmin.reduce(list(times.values()))
    gave_up = ~np.isin(status, (Status.COMPLETED, Status.STOPPED))
    mode = np.where((mode == NONE) & gave_up, "unfinished", mode)
    outcome = np.full(status.shape, "completed", dtype=object)
    for state in sorted(set(status[gave_up].tolist())):
        outcome[status == state] = REASONS[Status(state)]
    controls = plan.grid.controls
    alike = controls[0] is controls[1] and bool(np.all(plan.prestretch[:, 0] == plan.prestretch[:, 1]))
    # a map follows films beyond their first failure; stretches after it are not reported
    relative_stretch = {
        name: np.where(failure < at, np.nan, stretched[: 1 if alike else 2, index])
        for index, (name, at) in enumerate(plan.stretch_at.items())
    }
    ends = plan.temperature, plan.prestretch, plan.voltage, plan.horizon, plan.breakdown_field
    ended = times, failure, mode, outcome.astype(str)
    return FailureMap(*ends, *ended, plan.electrode_share, slack, plan.stretch_at, relative_stretch)
