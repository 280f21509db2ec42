"""Films of a grid, of a map or a design, that are legal but look like a mistake: warnings from recipes, plans and results."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dielast.commands.simulation.checks import AT_ONCE, prestretching, warn_of_no_breakdown, warn_of_setups
from dielast.errors import warn
from dielast.handover.law_section import breakdown
from dielast.material.checks import warn_of_breakdown, warn_of_field, warn_of_material
from dielast.material.material import Material
from dielast.material.use_checks import Pace, fastest_branch, warn_of_lasting, warn_of_paces, warn_of_stretches, warn_of_use
from dielast.numerics.arrays import Floats

if TYPE_CHECKING:
    from dielast.commands.design.recipe import DesignRecipe
    from dielast.commands.failure_map.recipe import FailureMapRecipe
    from dielast.simulate.design import Design
    from dielast.simulate.failure_map import FailureMap
    from dielast.simulate.map_plan import MapPlan


def warn_of_map(recipe: FailureMapRecipe, material: Material, plan: MapPlan) -> None:
    """Warn of a map that looks as if something were in another unit, or that its material was not measured for."""
    warn_of_grid(recipe, material, plan.temperature, plan.breakdown_field, recipe.horizon)
    area = plan.prestretch[:, 0] * plan.prestretch[:, 1]
    if np.isfinite(plan.breakdown_field).any():
        warn_of_field(plan.voltage[-1] * area / recipe.film.thickness, plan.breakdown_field)


def warn_of_grid(
    recipe: FailureMapRecipe | DesignRecipe, material: Material, temperature: Floats, field: Floats, horizon: float
) -> None:
    """Warn of films of a grid, at temperatures in degC and with breakdown fields (films,) in V/m, up to a horizon in s, that look
    as if something were in another unit, or that their material was not measured for.
    """
    warn_of_material(material)
    warn_of_use(material, temperature)
    warn_of_lasting(material, temperature, np.full(len(temperature), horizon))
    warn_of_breakdown(field[np.isfinite(field)])
    warn_of_no_breakdown(np.isfinite(field).tolist(), [material])
    film, limit = recipe.film, breakdown(recipe.breakdown) or material.breakdown
    pairs = len(film.prestretch)
    warn_of_setups(film.prestretch, [film.boundary] * pairs, film.thickness, [limit] * pairs)
    for pair in film.prestretch:
        mode = "equibiaxial" if pair[0] == pair[1] else None
        warn_of_stretches(material, np.array(pair)[:, None], mode)


def warn_of_design(recipe: DesignRecipe, material: Material, result: Design) -> None:
    """Warn of goals, prestretches and lives that are shorter than the material's fastest branch."""
    for reason, count in result.out_of_reach.items():
        warn(f"{count} of {result.target.size} films: out of reach: {reason}")
    film, paces = recipe.film, []
    for temperature in sorted(set(result.temperature.tolist())):
        fastest = fastest_branch(material, temperature)
        time = result.time_to_failure[result.temperature == temperature]
        if np.any(time < fastest):
            paces.append(Pace("a film fails after", float(np.nanmin(time)), fastest, temperature))
        paces.append(Pace("the goal is at", result.at, fastest, temperature))
        took = min(prestretching(pair, film.prestretch_rate, film.relax) for pair in film.prestretch)
        paces.append(Pace("prestretch and relaxation take", took, fastest, temperature))
    warn_of_paces(paces)


def warn_of_failures(recipe: FailureMapRecipe, material: Material, result: FailureMap) -> None:
    """Warn of cells that fail before the material's fastest branch moves, or that break down at once."""
    area = result.prestretch[:, 0] * result.prestretch[:, 1]
    field = result.voltage * area[:, None] / recipe.film.thickness
    beyond = (result.time_to_failure == 0) & (field >= result.breakdown_field[:, None])
    if broken := int(np.count_nonzero(beyond & (result.time_to_breakdown == 0))):
        share = f"{broken} of {result.failure_mode.size} cells"
        warn(f"{share} break down {AT_ONCE}: they are beyond the breakdown field from the start")
    if (slack := result.time_to_loss_of_tension) is not None:
        # survivors that go slack do so before the horizon
        early = int(np.count_nonzero((slack < result.time_to_failure) | (np.isfinite(slack) & np.isnan(result.time_to_failure))))
        if early:
            what = f"{early} of {slack.size} cells: the film around the electrode goes slack before it fails"
            warn(f"{what}, and would wrinkle: times after that are of a film that does not")
    scale, by_share = recipe.pull_in.timescale
    film, paces = recipe.film, []
    for index, temperature in enumerate(result.temperature.tolist()):
        fastest = fastest_branch(material, temperature)
        # a disturbance watched for longer than the fastest branch takes does not depend on that branch
        slow = (result.failure_mode[index] == "pull-in") & (not by_share and scale >= fastest)
        time = np.where(beyond[index] | slow, np.nan, result.time_to_failure[index])
        if early := int(np.count_nonzero(time < fastest)):
            what = f"{early} of {time.size} cells fail too early for the spectrum, the first after"
            paces.append(Pace(what, float(np.nanmin(time)), fastest, temperature))
        paces.append(Pace("the horizon is", recipe.horizon, fastest, temperature))
        took = min(prestretching(pair, film.prestretch_rate, film.relax) for pair in film.prestretch)
        paces.append(Pace("prestretch and relaxation take", took, fastest, temperature))
    warn_of_paces(paces)
