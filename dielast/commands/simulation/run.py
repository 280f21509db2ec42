"""Run the cases of a recipe together, for all commands that simulate histories."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from dielast.commands.simulation.cases import (
    SimulationBatch,
    axes_of,
    case_columns,
    compare_headline,
    divided,
    failures,
    matches,
    one_or_all,
    read_materials,
    result_columns,
    temperature_of,
)
from dielast.commands.simulation.memory_needed import check_series
from dielast.commands.simulation.result import CaseResult, SolvedCase, with_axes, with_noise
from dielast.commands.simulation.solver_steps import in_recipe_terms, joined, solver_steps
from dielast.io.files import Inputs
from dielast.io.table import Table, case_table
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution

Figures = dict[str, Callable[[], Any]]


class Simulation(ABC):
    """The parts of a simulation that depend on the command."""

    measured: str
    """Default column of the figure."""
    width: int
    """Numbers in a row of the table."""
    time_scale = "log"

    check: Callable[..., None]
    """Takes the arguments of the library's function; raises `InputError` for what the material does not allow, without solving."""

    @abstractmethod
    def solver(self, recipes: Sequence[Any], thickness_factor: Floats) -> partial[Any]:
        """The library's function with the arguments that are particular to this command, from recipes of one shape;
        `thickness_factor` (cases,) is a factor on the thickness of each film.
        """

    @abstractmethod
    def result(self, recipe: Any, materials: Sequence[Material]) -> partial[CaseResult]:
        """A function that makes the result of a case from a history and a row of it."""

    @abstractmethod
    def alike(self, recipe: Any) -> Hashable:
        """A value that cases must share to be solved together, besides steps of one shape and one output."""

    @abstractmethod
    def warn(self, cases: Sequence[SolvedCase]) -> None:
        """Warn of cases that look like a mistake."""

    @abstractmethod
    def headline(self, cases: Sequence[Case[Any]], results: Sequence[CaseResult]) -> dict[str, dict[str, Any]]:
        """The headline numbers by section of the summary."""

    def extras(
        self, cases: Sequence[Case[Any]], materials: Sequence[Material], results: Sequence[CaseResult]
    ) -> tuple[dict[str, Table], Figures]:
        """Further tables by file name, and further figures by name."""
        return {}, {}

    def batches(
        self, cases: Sequence[Case[Any]], materials: Sequence[Material], inputs: Inputs, thickness_factor: Floats | None = None
    ) -> list[SimulationBatch]:
        """The cases in batches of those that can be solved together."""
        factor = np.ones(len(cases)) if thickness_factor is None else thickness_factor
        # a case is repeated in the list for each draw; its steps are read once
        steps = {id(case): solver_steps(case.recipe, inputs) for case in {id(case): case for case in cases}.values()}
        histories = [steps[id(case)] for case in cases]
        groups: dict[Hashable, list[int]] = {}
        for index, (case, entries) in enumerate(zip(cases, histories, strict=True)):
            output, shape = case.recipe.output, tuple(entry.shape for entry in entries)
            times = None if output.times is None else tuple(output.times)
            rows = (times, output.points_per_decade, output.cycles, case.recipe.solver.rtol)
            groups.setdefault((self.alike(case.recipe), rows, shape), []).append(index)
        batches = []
        for members in groups.values():
            origin = [entry.origin for entry in histories[members[0]]]
            for part in divided(members, materials):
                recipes, used = [cases[index].recipe for index in part], [materials[index] for index in part]
                output = recipes[0].output
                simulate = partial(
                    self.solver(recipes, factor[part]),
                    one_or_all(used),
                    [joined(step, recipes[0]) for step in zip(*(histories[index] for index in part), strict=True)],
                    temperature=np.array(list(map(temperature_of, recipes, used))),
                    times=output.times,
                    points_per_decade=output.points_per_decade,
                    rtol=recipes[0].solver.rtol,
                    cycles=output.cycles,
                )
                terms = partial(in_recipe_terms, origin=origin, members=part, cases=len(steps))
                batches.append(SimulationBatch(part, simulate, self.result(recipes[0], used), terms))
        return batches


def report_of(simulation: Simulation, cases: Sequence[Case[Any]], inputs: Inputs, execution: Execution) -> Report:
    """Simulate every case, report."""
    recipes, materials = [case.recipe for case in cases], read_materials(cases, inputs)
    kind = recipes[0].kind
    check_series(cases, simulation.width, inputs, execution.jobs)

    def batches(cases: Sequence[Case[Any]], materials: Sequence[Material], factor: Floats | None = None) -> list[SimulationBatch]:
        return simulation.batches(cases, materials, inputs, factor)

    samples: Sequence[Sample | None] = [None] * len(cases)
    if any(recipe.uncertainty is not None for recipe in recipes):
        from dielast.commands.simulation.uncertainty import samples_of, typical_materials

        samples = samples_of(cases, materials, inputs)
        materials = typical_materials(materials, samples)
    clean = solve_batches(batches(cases, materials), execution)
    histories = [solver_steps(recipe, inputs) for recipe in recipes]
    simulation.warn(list(map(SolvedCase, recipes, materials, histories, clean)))
    results = [with_noise(result, recipe, case) for case, (result, recipe) in enumerate(zip(clean, recipes, strict=True))]
    columns = [with_axes(result.columns, recipe) for result, recipe in zip(results, recipes, strict=True)]
    cycling = {case: result.cycles for case, result in enumerate(results) if result.cycles is not None}
    intervals: dict[str, dict[str, Any]] = {}
    if any(recipe.uncertainty is not None for recipe in recipes):
        from dielast.commands.simulation.bounds import bounded_cases
        from dielast.commands.simulation.uncertainty import uncertainty_headline

        results = bounded_cases(batches, cases, samples, results, execution)
        intervals = uncertainty_headline([recipe.uncertainty for recipe in recipes], samples)
    tables: dict[str, Table] = {}
    sections: dict[str, dict[str, Any]] = {}
    figures: Figures = {}
    if any(getattr(recipe, "sensitivity", False) for recipe in recipes):
        from dielast.commands.simulation.sensitivity import case_sensitivities, sensitivity_outputs

        sensitivities = case_sensitivities(batches, cases, materials, samples, results, execution)
        tables, sections, figures = sensitivity_outputs(sensitivities, cases, materials)

    def at_times(case: int, times: Floats) -> Mapping[str, Floats]:
        output = recipes[case].output.model_copy(update={"times": times.tolist()})
        timed = Case(recipes[case].model_copy(update={"output": output}))
        return with_axes(solve_batches(batches([timed], [materials[case]]))[0].columns, timed.recipe)

    matched = matches(recipes[0], columns, inputs, at_times)
    axes = axes_of(cases, columns[0], simulation.measured, simulation.time_scale)

    def figure() -> Any:
        from dielast.commands.simulation.pictures import picture

        return picture(cases, materials, results, columns, matched, axes)

    more_tables, more_figures = simulation.extras(cases, materials, results)
    tables = {f"{kind}.csv": result_columns(results), **more_tables, **tables, "cases.csv": case_columns(cases)}
    if cycling:
        tables["cycles.csv"] = case_table(cycling)
    sections = simulation.headline(cases, results) | sections
    if matched:
        sections["compare"] = compare_headline(matched)
    return Report(tables, sections | intervals, figure, failures=failures(results), figures=more_figures | figures)
