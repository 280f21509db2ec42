"""`failure-map`: time to failure over voltage, prestretch and temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.commands.failure_map.recipe import FailureMapRecipe, VoltageAxis
from dielast.commands.failure_map.resume import fingerprint, solve
from dielast.commands.simulation.cases import first_of_each, material_of
from dielast.commands.simulation.grid_checks import warn_of_failures, warn_of_map
from dielast.commands.simulation.memory_needed import check_cells
from dielast.commands.simulation.recipe import KEYS
from dielast.errors import Problem, placed
from dielast.handover.breakdown_section import breakdown
from dielast.io.files import Inputs
from dielast.material.material import Material
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.execution import Execution
from dielast.simulate.failure_map import FailureMap, assembled, plan_failure_map
from dielast.simulate.lifetime import LifetimeLines, fit_lifetime
from dielast.simulate.map_plan import MapPlan

if TYPE_CHECKING:
    from dielast.material.scatter import Sample


def run(cases: Sequence[Case[FailureMapRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Plan the map, solve its cells, report."""
    recipe = cases[0].recipe
    material, wanted = material_of(cases[0], inputs), recipe.uncertainty
    sample = None
    if wanted is not None:
        from dielast.commands.simulation.uncertainty import sample_of

        sample = sample_of(cases[0], material, inputs)
    temperatures = recipe.temperature or [material.reference_temperature]
    films = len(temperatures) * len(recipe.film.prestretch) * len(recipe.film.shares or (1,))
    variation = None
    if recipe.sensitivity:
        from dielast.commands.simulation.sensitivity import variation_of

        variation = variation_of(material, sample, wanted)
    solved = sample if variation is None else variation.sample
    check_cells(films * voltages(recipe.voltage).size, 0 if solved is None else len(solved))
    plan = _plan(recipe, material, solved)
    warn_of_map(recipe, material, plan)
    result, *every = assembled(plan, solve(plan, fingerprint(cases[0], inputs), execution))
    drawn = every[: 0 if sample is None else len(sample)]
    warn_of_failures(recipe, material, result)
    lines = fit_lifetime(result)

    def figure() -> Any:
        from dielast.commands.simulation.bounds import map_bounds
        from dielast.commands.simulation.naming import titled
        from dielast.commands.simulation.uncertainty import interval_label
        from dielast.plots.failure_map import plot_failure_map

        bounds = None if wanted is None else map_bounds(drawn, wanted.level)["time_to_failure"]
        title = titled(recipe.title, cases, [material])
        return plot_failure_map(result, lines, title, bounds, interval_label([recipe]))

    def operating_map() -> Any:
        from dielast.commands.simulation.naming import titled
        from dielast.plots.operating_map import plot_operating_map

        return plot_operating_map(result, titled(recipe.title, cases, [material]))

    unfinished = np.argwhere(result.outcome != "completed")
    failures = [
        (
            str(result.outcome[i, j, k]),
            f"{result.temperature[i]:g} degC, prestretch {result.prestretch[j][0]:g}, {_share(result, j)}{result.voltage[k]:g} V: "
            f"given up: {result.outcome[i, j, k]}",
        )
        for i, j, k in unfinished
    ]
    cells, fits = result.columns(), lines.columns()
    sections = headline(result, lines)
    if wanted is not None:
        from dielast.commands.simulation.bounds import bounded_line_columns, bounded_map_columns
        from dielast.commands.simulation.uncertainty import uncertainty_headline

        cells = bounded_map_columns(cells, drawn, wanted.level)
        fits = bounded_line_columns(fits, [fit_lifetime(each) for each in drawn], wanted.level)
        sections |= uncertainty_headline([wanted], [sample])
    tables = {"failure-map.csv": cells, "fit.csv": fits}
    figures: dict[str, Any] = {"operating-map": operating_map} if result.relative_stretch else {}
    if variation is not None:
        from dielast.commands.simulation.sensitivity import sensitivity_outputs
        from dielast.simulate.sensitivity import sensitivity_of_map

        more = sensitivity_outputs([sensitivity_of_map(variation, result, every)], cases, [material])
        tables, sections, figures = tables | more[0], sections | more[1], figures | more[2]
    lost = first_of_each(failures, "cells")
    return Report(tables, sections, figure, failures=lost, figures=figures)


def _plan(recipe: FailureMapRecipe, material: Material, sample: Sample | None) -> MapPlan:
    """The map of the recipe; errors name the keys of the recipe."""
    films, temperatures = recipe.film.prestretch, recipe.temperature or [material.reference_temperature]
    keys = KEYS if recipe.uncertainty is not None else KEYS | {"sample": "sensitivity"}
    shares = len(recipe.film.shares or (1,))
    with placed(partial(_in_recipe_terms, films=len(films), shares=shares, temperatures=temperatures, keys=keys)):
        return plan_failure_map(
            material,
            voltage=voltages(recipe.voltage),
            horizon=recipe.horizon,
            temperature=np.array(temperatures),
            ramp=recipe.voltage.ramp,
            breakdown_field=breakdown(recipe.breakdown),
            pull_in_timescale=recipe.pull_in.criterion,
            stretch_at={} if recipe.stretch is None else dict(recipe.stretch.at),
            rtol=recipe.solver.rtol,
            sample=sample,
            drawn_rtol=recipe.solver.rtol if "rtol" in recipe.solver.model_fields_set or recipe.uncertainty is None else None,
            **recipe.film.setup(recipe.solver.mesh_rtol),
        )


def _share(result: FailureMap, film: int) -> str:
    """The electrode share of a film, for an error."""
    return "" if result.electrode_share is None else f"electrode share {result.electrode_share[film]:g}, "


def _in_recipe_terms(problem: Problem, films: int, shares: int, temperatures: Sequence[float], keys: Mapping[str, str]) -> Problem:
    """A problem of the solver, whose cases are the films at one temperature after the other, with the key of the recipe."""
    if problem.case is None or problem.argument != "prestretch":
        return replace(problem, case=None).in_keys(keys)
    temperature, film = divmod(problem.case // shares, films)
    at = f"{temperatures[temperature]:g} degC: " if len(temperatures) > 1 else ""
    return Problem(at + problem.text, key=f"film.prestretch[{film}]")


def voltages(axis: VoltageAxis) -> np.ndarray:
    """The voltages of the map, in V."""
    if axis.values is not None:
        return np.array(axis.values)
    return np.linspace(axis.start or 0.0, axis.to or 0.0, axis.points or 1)


def headline(result: FailureMap, lines: LifetimeLines) -> dict[str, dict[str, Any]]:
    """The numbers of cells by mode of failure, and the misfit of the lifetime lines."""
    modes = result.failure_mode
    failed = result.time_to_failure[np.isfinite(result.time_to_failure)]
    fitted = [line.r_squared for line in lines if np.isfinite(line.r_squared)]
    return {
        "map": {
            "cells": int(modes.size),
            **{name.replace("-", "_"): int(np.count_nonzero(modes == name)) for name in (*result.times, "none", "unfinished")},
            "given_up": int(np.count_nonzero(result.outcome != "completed")),
            "shortest_time_to_failure_s": float(failed.min()) if failed.size else None,
            "longest_time_to_failure_s": float(failed.max()) if failed.size else None,
        },
        "fit": {
            "lines": len(lines),
            "least_r_squared": min(fitted) if fitted else None,
            "not_drawn": lines.not_drawn() or None,
        },
    }
