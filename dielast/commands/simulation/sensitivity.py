"""`sensitivity = true`: what drives the life of films, with its table, figure, summary and warning."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.commands.simulation.bounds import drawn_case
from dielast.commands.simulation.cases import Batches
from dielast.commands.simulation.result import CaseResult, SolvedCase
from dielast.errors import InputError, in_a_draw, warn
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.mechanics.cases import of_case
from dielast.mechanics.criteria import named
from dielast.recipe.cases import Case
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution
from dielast.simulate.sensitivity import LifeShares, Sensitivity, Variation, sensitivity_of, variation_for

SENSITIVITY = "sensitivity"


def variation_of(material: Material, sample: Sample | None, recipe: Any) -> Variation:
    """The films to solve for a `recipe` of films: with draws, exchanges of sources between them; else the material with one
    constant changed at a time.
    """
    seed = 1 if recipe.uncertainty is None else recipe.uncertainty.seed
    has_breakdown = recipe.breakdown is not None or material.breakdown is not None
    try:
        return variation_for(material, sample, seed, has_breakdown=has_breakdown)
    except InputError as error:
        raise error.changed(lambda problem: problem.in_keys({"sample": SENSITIVITY})) from None


def case_sensitivities(batches: Batches, cases: Sequence[SolvedCase], execution: Execution) -> list[Sensitivity]:
    """The sensitivity of the time to the first failure, of the cases whose recipe states it."""
    sensitivities: list[Sensitivity] = []
    for number, case in enumerate(cases):
        if not case.recipe.sensitivity:
            continue
        variation = variation_of(case.material, case.sample, case.recipe)
        # a run that only gives a life needs one row
        brief = replace(case.result, columns={"time [s]": np.zeros(1)})
        with in_a_draw(key=SENSITIVITY if case.sample is None else "uncertainty", case=of_case(number, len(cases))):
            parts = batches(drawn_case(case, variation.sample, brief), variation.sample.thickness_factor)
            runs = solve_batches(parts, execution, "further runs")
        life = np.array([[_life(run)] for run in runs])
        sensitivities.append(sensitivity_of(variation, life, [Column("case", None, np.array([number]))]))
    return sensitivities


def _life(result: CaseResult) -> float:
    """The time in s of the first failure, NaN without one."""
    times: list[Any] = [event.time for event in result.events or () if named(event.name).is_failure]
    return min(times, default=np.nan)


def sensitivity_outputs(
    results: Sequence[Sensitivity], cases: Sequence[Case[Any]], materials: Sequence[Material]
) -> tuple[dict[str, Table], dict[str, dict[str, Any]], dict[str, Callable[[], Any]]]:
    """Table, section of the summary and figure of sensitivities of one kind. Warns of films that have draws without a time to
    failure.
    """
    tables = [result.columns() for result in results]
    whole = [
        Column(first.name, first.unit, _one_below_the_other([table[place].values for table in tables]))
        for place, first in enumerate(tables[0])
    ]
    what = "cases" if results[0].films[0].name == "case" else "cells"
    films, left_out = sum(len(result.films[0].values) for result in results), sum(result.left_out for result in results)
    if left_out:
        runs = "draws" if isinstance(results[0], LifeShares) else "changes"
        none = f"{left_out} of {films} {what} have no sensitivity: some of their {runs} survive, fail at once, or were not finished"
        warn(f"{none}; state a longer time or a higher voltage", key=SENSITIVITY)

    def figure() -> Any:
        from dielast.commands.simulation.naming import labels, titled
        from dielast.plots.sensitivity import plot_sensitivity

        return plot_sensitivity(results, titled(cases[0].recipe.title, cases, materials), labels(cases, materials))

    return {f"{SENSITIVITY}.csv": whole}, {SENSITIVITY: {what: films, "left_out": left_out}}, {SENSITIVITY: figure}


def _one_below_the_other(values: Sequence[Any]) -> Any:
    return np.concatenate(values) if isinstance(values[0], np.ndarray) else [text for part in values for text in part]
