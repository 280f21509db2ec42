"""What the runs of a map and of a design share: draws, the places of errors, and warnings of films that look like a mistake."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import prod
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

from dielast.base.errors import Problem, placed, warn
from dielast.commands.grids.recipe import DesignRecipe, FailureMapRecipe, GridFilm
from dielast.commands.simulation.checks import AT_ONCE, prestretching, warn_of_no_breakdown, warn_of_setups
from dielast.handover.law_section import breakdown
from dielast.io.files import Inputs
from dielast.material.checks import USUAL, warn_of_field, warn_of_material
from dielast.material.material import Material
from dielast.material.use_checks import Pace, fastest_branch, warn_of_lasting, warn_of_paces, warn_of_stretches, warn_of_use
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.sharing.memory import check_memory

if TYPE_CHECKING:
    from dielast.material.scatter import Sample
    from dielast.simulate.design import Design
    from dielast.simulate.failure_map import FailureMap
    from dielast.simulate.map_plan import MapPlan
    from dielast.simulate.sensitivity import Variation

Plan = TypeVar("Plan")
CELL = 200  # bytes of a cell of a map in each draw: three times, mode and outcome, with intermediate arrays


def sample_for(case: Case[Any], material: Material, inputs: Inputs) -> Sample | None:
    """The draws of the material and the films; None without `[uncertainty]`."""
    if case.recipe.uncertainty is None:
        return None
    from dielast.commands.simulation.uncertainty import sample_of

    return sample_of(case, material, inputs)


@dataclass(frozen=True, slots=True, eq=False)
class PreparedGrid(Generic[Plan]):
    """A map or a design that is ready to be solved: its material, the draws of `[uncertainty]`, the plan with films that are not
    relaxed, what puts problems of its films in terms of the recipe, and the variation of `sensitivity`.
    """

    material: Material
    sample: Sample | None
    plan: Plan
    in_recipe_terms: partial[Problem]
    variation: Variation | None = None


def planned(
    plan: Callable[..., Plan],
    recipe: FailureMapRecipe | DesignRecipe,
    material: Material,
    sample: Sample | None,
    keys: Mapping[str, str],
    *,
    targets: int = 1,
    voltages: int = 1,
) -> tuple[Plan, partial[Problem]]:
    """The `plan` of the films of a recipe, each with so many `targets` and `voltages`, which are not relaxed; and what puts
    problems of films in terms of the recipe, with the `keys` of arguments. Raises `InputError` with keys of the recipe, and
    `NumericsError` if memory is short.
    """
    temperatures = recipe.temperature or [material.reference_temperature]
    thicknesses, pairs, shares = recipe.film.sizes
    grid = (len(temperatures), thicknesses, pairs, shares * targets)
    check_cells(prod(grid) * voltages, 0 if sample is None else len(sample))
    in_recipe_terms = partial(_in_grid_terms, sizes=grid, temperatures=temperatures, keys=keys)
    with placed(in_recipe_terms):
        return plan(material, recipe.film.at(temperatures), **recipe.solving(sample)), in_recipe_terms


def check_cells(cells: int, draws: int) -> None:
    """Raise `NumericsError` if the times of so many `cells` of a map, and of each of its `draws`, do not fit in memory."""
    what = f"{cells} cells{f' of {draws} draws each' if draws else ''}"
    check_memory(float(CELL) * cells * (1 + draws), what, "state fewer voltages, prestretches, temperatures or draws")


def _in_grid_terms(problem: Problem, sizes: Sequence[int], temperatures: Sequence[float], keys: Mapping[str, str]) -> Problem:
    """A problem of the solver, whose cases are the films of the grid, with the key of the recipe. `sizes` are the numbers of
    temperatures, thicknesses, prestretches, and of the films that have these in common.
    """
    if problem.case is None or problem.argument != "prestretch":
        return replace(problem, case=None).in_keys(keys)
    temperature, _, pair, _ = (int(index) for index in np.unravel_index(problem.case, sizes))
    at = f"{temperatures[temperature]:g} degC: " if len(temperatures) > 1 else ""
    return Problem(at + problem.text, key=f"film.prestretch[{pair}]")


def in_words(result: Design | FailureMap, temperature: float, pair: int) -> str:
    """A film at a temperature in degC with one of the prestretches of the result, as messages name it."""
    first, second = result.prestretch[pair].tolist()
    text = f"{temperature:g} degC, prestretch {first:g}" + (f" x {second:g}" if second != first else "")
    return text if result.electrode_share is None else f"{text}, electrode share {result.electrode_share[pair]:g}"


def warn_of_map(recipe: FailureMapRecipe, material: Material, plan: MapPlan) -> None:
    """Warn of a map that looks as if something were in another unit, or that its material was not measured for."""
    warn_of_grid(recipe, material, plan.temperature, plan.breakdown_field)
    area = plan.prestretch[:, 0] * plan.prestretch[:, 1]
    if np.isfinite(plan.breakdown_field).any():
        warn_of_field(plan.voltage[-1] * area / recipe.film.thickness, plan.breakdown_field)


def warn_of_grid(recipe: FailureMapRecipe | DesignRecipe, material: Material, temperature: Floats, field: Floats) -> None:
    """Warn of films of a grid, at temperatures in degC and with breakdown fields (films,) in V/m, that look as if something were in
    another unit, or that their material was not measured for.
    """
    warn_of_material(material)
    warn_of_use(material, temperature)
    USUAL["breakdown field"].warn(field[np.isfinite(field)])
    warn_of_no_breakdown(np.isfinite(field).tolist(), [material])
    film, limit = recipe.film, breakdown(recipe.breakdown) or material.breakdown
    pairs = len(film.prestretch)
    warn_of_setups(film.prestretch, [film.boundary] * pairs, film.thickness, [limit] * pairs)
    for pair in film.prestretch:
        warn_of_stretches(material, np.array(pair)[:, None], "equibiaxial" if pair[0] == pair[1] else None)


def warn_of_design(recipe: DesignRecipe, material: Material, result: Design) -> None:
    """Warn of goals, prestretches and lives that are shorter than the material's fastest branch."""
    for reason, count in result.out_of_reach.items():
        warn(f"{count} of {result.target.size} films: out of reach: {reason}")
    paces = []
    for temperature in sorted(set(result.temperature.tolist())):
        life = float(np.nanmin(result.time_to_failure[result.temperature == temperature], initial=np.inf))
        fastest = fastest_branch(material, temperature)
        paces += _paces(recipe.film, temperature, fastest, {"a film fails after": life, "the goal is at": result.at})
    warn_of_paces(paces)
    warn_of_lasting(material, result.temperature, np.fmax(result.time_to_failure, result.at))


def warn_of_failures(recipe: FailureMapRecipe, material: Material, result: FailureMap) -> None:
    """Warn of cells that fail before the material's fastest branch moves, or that break down at once."""
    area = result.prestretch[:, 0] * result.prestretch[:, 1]
    field = result.voltage * area[:, None] / recipe.film.thickness
    beyond = (result.time_to_failure == 0) & (field >= result.breakdown_field[:, None])
    if broken := int(np.count_nonzero(beyond & (result.failure_mode == "breakdown"))):
        share = f"{broken} of {result.failure_mode.size} cells"
        warn(f"{share} break down {AT_ONCE}: they are beyond the breakdown field from the start")
    if (slack := result.time_to_loss_of_tension) is not None:
        # survivors that go slack do so before the horizon
        early = int(np.count_nonzero((slack < result.time_to_failure) | (np.isfinite(slack) & np.isnan(result.time_to_failure))))
        if early:
            film = "film" if result.electrode_share is None else "film around the electrode"
            what = f"{early} of {slack.size} cells: the {film} goes slack before it fails"
            warn(f"{what}, and would wrinkle: times after that are of a film that does not")
    scale, by_share = recipe.pull_in.timescale
    paces = []
    for index, temperature in enumerate(result.temperature.tolist()):
        fastest = fastest_branch(material, temperature)
        # a disturbance watched for longer than the fastest branch takes does not depend on that branch
        slow = (result.failure_mode[index] == "pull-in") & (not by_share and scale >= fastest)
        time = np.where(beyond[index] | slow, np.nan, result.time_to_failure[index])
        failing = f"{np.count_nonzero(time < fastest)} of {time.size} cells fail too early for the spectrum, the first after"
        processes = {failing: float(np.nanmin(time, initial=np.inf)), "the horizon is": recipe.horizon}
        paces += _paces(recipe.film, temperature, fastest, processes)
    warn_of_paces(paces)
    survived = np.any(np.isnan(result.time_to_failure), axis=(1, 2))
    lives = np.nanmax(result.time_to_failure, axis=(1, 2), initial=0.0)
    warn_of_lasting(material, result.temperature, np.where(survived, recipe.horizon, lives))


def _paces(film: GridFilm, temperature: float, fastest: float, processes: Mapping[str, float]) -> list[Pace]:
    """The processes with their durations in s, and the prestretch."""
    took = min(prestretching(pair, film.prestretch_rate, film.relax) for pair in film.prestretch)
    durations = {**processes, "prestretch and relaxation take": took}
    return [Pace(what, lasting, fastest, temperature) for what, lasting in durations.items()]
