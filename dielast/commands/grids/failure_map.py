"""`failure-map`: time to failure over voltage, prestretch and temperature."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from dielast.base.errors import placed
from dielast.commands.grids.films import PreparedGrid, in_words, planned, sample_for, warn_of_failures, warn_of_map
from dielast.commands.grids.recipe import FailureMapRecipe
from dielast.commands.simulation.cases import first_of_each, material_of
from dielast.commands.simulation.recipe import KEYS
from dielast.io.files import Inputs
from dielast.io.table import Table
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution
from dielast.sharing.study import Study, Work
from dielast.simulate.failure_map import FailureMap, HeldVoltages, assembled, plan_failure_map
from dielast.simulate.lifetime import LifetimeLines, fit_lifetime
from dielast.simulate.map_plan import MapPlan, solve_cells

CHUNK = 1024  # cells, about a second of work: little is lost by an interrupt, and the shares of processes are even


def prepared(cases: Sequence[Case[FailureMapRecipe]], inputs: Inputs) -> PreparedGrid[MapPlan]:
    """The map, read, checked and warned of, but not solved. Raises `InputError`, and `NumericsError` if memory is short."""
    recipe, material = cases[0].recipe, material_of(cases[0], inputs)
    sample, variation = sample_for(cases[0], material, inputs), None
    if recipe.sensitivity:
        from dielast.commands.simulation.sensitivity import variation_of

        variation = variation_of(material, sample, recipe)
    axis, keys = recipe.voltage, KEYS if recipe.uncertainty is not None else KEYS | {"sample": "sensitivity"}
    voltage = np.array(axis.values) if axis.values else np.linspace(axis.start or 0.0, axis.to or 0.0, axis.points or 1)
    stretch_at = {} if recipe.stretch is None else dict(recipe.stretch.at)
    plan = partial(plan_failure_map, voltages=HeldVoltages(voltage, recipe.horizon, axis.ramp, stretch_at))
    films = sample if variation is None else variation.sample
    stated, in_recipe_terms = planned(plan, recipe, material, films, keys, voltages=voltage.size)
    warn_of_map(recipe, material, stated)
    return PreparedGrid(material, sample, stated, in_recipe_terms, variation)


def run(cases: Sequence[Case[FailureMapRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Plan the map, solve its cells, report."""
    recipe, ready = cases[0].recipe, prepared(cases, inputs)
    material, sample, variation, stated = ready.material, ready.sample, ready.variation, recipe.uncertainty
    with placed(ready.in_recipe_terms):
        plan = ready.plan.relaxed()
    solved = Study.of(cases, inputs, execution).solve(Work(solve_cells, "cells"), plan, plan.chunks(CHUNK))
    result, *every = assembled(plan, solved)
    drawn = every[: 0 if sample is None else len(sample)]
    intervals = None if stated is None or sample is None else stated.intervals(sample.laws)
    warn_of_failures(recipe, material, result)
    lines = fit_lifetime(result)

    def figure() -> Any:
        from dielast.commands.simulation.bounds import map_bounds
        from dielast.commands.simulation.naming import titled
        from dielast.commands.simulation.uncertainty import interval_label
        from dielast.plots.failure_map import plot_failure_map

        bounds = None if intervals is None else map_bounds(drawn, intervals)["time_to_failure"]
        return plot_failure_map(result, lines, titled(recipe.title, cases, [material]), bounds, interval_label([recipe]))

    def operating_map() -> Any:
        from dielast.commands.simulation.naming import titled
        from dielast.plots.operating_map import plot_operating_map

        return plot_operating_map(result, titled(recipe.title, cases, [material]))

    tables: dict[str, Table] = {"failure-map.csv": result.columns(), "fit.csv": lines.columns()}
    sections = headline(result, lines)
    figures: dict[str, Callable[[], Any]] = {"operating-map": operating_map} if result.relative_stretch else {}
    if intervals is not None:
        from dielast.commands.simulation.bounds import bounded_line_columns, bounded_map_columns, map_bounds, warn_of_lives_outside
        from dielast.commands.simulation.uncertainty import uncertainty_headline

        warn_of_lives_outside(result, map_bounds(drawn, intervals)["time_to_failure"])
        tables["failure-map.csv"] = bounded_map_columns(tables["failure-map.csv"], drawn, intervals)
        tables["fit.csv"] = bounded_line_columns(tables["fit.csv"], [fit_lifetime(draw) for draw in drawn], intervals)
        sections |= uncertainty_headline([stated], [sample])
    if variation is not None:
        from dielast.commands.simulation.sensitivity import sensitivity_outputs
        from dielast.simulate.sensitivity import sensitivity_of_map

        more = sensitivity_outputs([sensitivity_of_map(variation, result, every)], cases, [material])
        tables, sections, figures = tables | more[0], sections | more[1], figures | more[2]
    return RunReport(tables, sections, figure, failures=failures(result), figures=figures)


def failures(result: FailureMap) -> list[str]:
    """A line for each reason why cells were not finished, about the first of these cells."""
    lines = []
    for i, j, k in np.argwhere(result.outcome != "completed"):
        reason, film = str(result.outcome[i, j, k]), in_words(result, float(result.temperature[i]), j)
        lines.append((reason, f"{film}, {result.voltage[k]:g} V: given up: {reason}"))
    return first_of_each(lines, "cells")


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
