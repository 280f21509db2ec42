"""`sensitivity = true`: what drives the life of films, with its table, figure, summary and warning."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError, warn
from dielast.commands.simulation.bounds import draws_of
from dielast.commands.simulation.cases import Batches
from dielast.commands.simulation.result import CaseResult, SolvedCase
from dielast.io.table import Column, Table, joined
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.mechanics.cases import of_case
from dielast.mechanics.criteria import named
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.sharing.study import Draws, Study
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


def case_sensitivities(batches: Batches, cases: Sequence[SolvedCase], study: Study) -> list[Sensitivity]:
    """The sensitivity of the time to the first failure, of the cases whose recipe states it."""
    varied: dict[int, Variation] = {}
    further: list[Draws[Floats]] = []
    for number, case in enumerate(cases):
        if case.recipe.sensitivity:
            variation = varied[number] = variation_of(case.material, case.sample, case.recipe)
            # a run that only gives a life needs one row
            brief = replace(case.result, columns={"time [s]": np.zeros(1)})
            key = SENSITIVITY if case.sample is None else "uncertainty"
            parts = draws_of(batches, case, variation.sample, brief, key, of_case(number, len(cases)))
            further.append(Draws(len(further), parts, _lives))
    lives = study.batches(further, "further runs")
    films = [[Column("case", None, np.array([number]))] for number in varied]
    return [sensitivity_of(*found) for found in zip(varied.values(), lives, films, strict=True)]


def _lives(runs: Sequence[CaseResult]) -> Floats:
    """The times (runs, 1) in s of the first failures, NaN without one."""
    events = [[event.time for event in run.events or () if named(event.name).is_failure] for run in runs]
    return np.array([[min(times, default=np.nan)] for times in events])


def sensitivity_outputs(
    results: Sequence[Sensitivity], cases: Sequence[Case[Any]], materials: Sequence[Material]
) -> tuple[dict[str, Table], dict[str, dict[str, Any]], dict[str, Callable[[], Any]]]:
    """Table, section of the summary and figure of sensitivities of one kind. Warns of films that have draws without a time to
    failure.
    """
    whole = joined([result.columns() for result in results])
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
