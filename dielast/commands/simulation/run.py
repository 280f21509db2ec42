"""Run the cases of a recipe together, for all commands that simulate histories."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.commands.simulation.cases import (
    SimulationBatch,
    axes_of,
    case_columns,
    compare_headline,
    cycle_columns,
    divided,
    failures,
    matches,
    one_or_all,
    read_materials,
    result_columns,
    temperature_of,
)
from dielast.commands.simulation.memory_needed import check_series
from dielast.commands.simulation.result import CaseResult
from dielast.commands.simulation.solver_steps import Entry, in_recipe_terms, joined, solver_steps
from dielast.io.files import Inputs
from dielast.io.table import Table
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.mechanics.load import ElectricalStep, Step
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution

if TYPE_CHECKING:
    from dielast.commands.simulation.pictures import FilmEvent

Columns = Mapping[str, Floats]
Known = tuple[Case[Any], Material, Sample | None, CaseResult]
"""A case, its material, its draws or None, and its result."""
Solve = Callable[[Case[Any], Sequence[Material], Floats], list[CaseResult]]
"""Solves a case for several materials, with a factor (materials,) on the thickness."""


class Simulation(ABC):
    """The parts of a simulation that depend on the command."""

    measured: str
    """Default column of the figure."""
    width: int
    """Numbers in a row of the table."""
    time_scale = "log"

    step: type[Step] | type[ElectricalStep]
    """Type of a step of the solver."""

    @abstractmethod
    def solver(self, recipes: Sequence[Any], thickness_factor: Floats) -> partial[Any]:
        """The library's function with the arguments that are particular to this command, from recipes of one shape;
        `thickness_factor` (cases,) is a factor on the thickness of each film.
        """

    @abstractmethod
    def result(self, cases: Sequence[Case[Any]], recipe: Any, materials: Sequence[Material]) -> partial[CaseResult]:
        """A function that makes the result of a case from a history and a row of it, for recipes such as that of `cases`."""

    @abstractmethod
    def alike(self, recipe: Any) -> Hashable:
        """A value that cases must share to be solved together, besides steps of one shape and one output."""

    @abstractmethod
    def warn(
        self,
        cases: Sequence[Case[Any]],
        materials: Sequence[Material],
        results: Sequence[CaseResult],
        histories: Sequence[Sequence[Entry]],
    ) -> None:
        """Warn of cases that look like a mistake."""

    @abstractmethod
    def headline(self, cases: Sequence[Case[Any]], results: Sequence[CaseResult]) -> dict[str, dict[str, Any]]:
        """The headline numbers by section of the summary."""

    def batches(
        self, cases: Sequence[Case[Any]], materials: Sequence[Material], inputs: Inputs, thickness_factor: Floats | None = None
    ) -> list[SimulationBatch]:
        """The cases in batches of those that can be solved together."""
        factor = np.ones(len(cases)) if thickness_factor is None else thickness_factor
        # a case is repeated in the list for each draw; its steps are read once
        known = {id(case): solver_steps(case.recipe, inputs) for case in {id(case): case for case in cases}.values()}
        programmes = [known[id(case)] for case in cases]
        groups: dict[Hashable, list[int]] = {}
        for index, (case, entries) in enumerate(zip(cases, programmes, strict=True)):
            output, shape = case.recipe.output, tuple(entry.shape for entry in entries)
            times = None if output.times is None else tuple(output.times)
            asked = (times, output.points_per_decade, output.cycles, case.recipe.solver.rtol)
            groups.setdefault((self.alike(case.recipe), asked, shape), []).append(index)
        batches = []
        for members in groups.values():
            origin = [entry.origin for entry in programmes[members[0]]]
            for part in divided(members, materials):
                recipes, used = [cases[index].recipe for index in part], [materials[index] for index in part]
                output = recipes[0].output
                simulate = partial(
                    self.solver(recipes, factor[part]),
                    one_or_all(used),
                    [joined(step, self.step_of(recipes[0])) for step in zip(*(programmes[index] for index in part), strict=True)],
                    temperature=np.array(list(map(temperature_of, recipes, used))),
                    times=output.times,
                    points_per_decade=output.points_per_decade,
                    rtol=recipes[0].solver.rtol,
                    cycles=output.cycles,
                )
                terms = partial(in_recipe_terms, origin=origin, members=part, cases=len(known))
                batches.append(SimulationBatch(part, simulate, self.result(cases, recipes[0], used), terms))
        return batches

    def step_of(self, recipe: Any) -> type[Step] | type[ElectricalStep]:
        """The steps of a recipe for the solver."""
        return self.step

    def as_written(self, result: CaseResult, recipe: Any, case: int) -> CaseResult:
        """The columns of a case for the tables."""
        return result

    def seen(self, recipe: Any, columns: Columns) -> Columns:
        """The columns of a case for comparisons and figures."""
        return columns

    def drawn(self, case: Case[Any], sample: Sample, result: CaseResult) -> tuple[Case[Any], Sequence[Material]]:
        """The case that all draws solve, and the materials of the draws."""
        return case, sample.materials

    def analysed(self, known: Sequence[Known], solve: Solve) -> list[CaseResult]:
        """The results, completed by further runs of the cases."""
        return [result for _, _, _, result in known]

    def tables(self, recipe: Any, results: Sequence[CaseResult]) -> dict[str, Table]:
        """Further tables by file name."""
        return {}

    def figures(
        self, cases: Sequence[Case[Any]], materials: Sequence[Material], results: Sequence[CaseResult]
    ) -> dict[str, Callable[[], Any]]:
        """Further figures by name."""
        return {}

    def marks(self, recipe: Any, result: CaseResult, seen: Columns, x: str, y: str) -> list[FilmEvent]:
        """The events of a case in the figure."""
        return []


def report_of(simulation: Simulation, cases: Sequence[Case[Any]], inputs: Inputs, execution: Execution) -> Report:
    """Simulate every case, report."""
    recipe, materials = cases[0].recipe, read_materials(cases, inputs)
    check_series(cases, simulation.width, inputs, execution.jobs)
    clean = solve_batches(simulation.batches(cases, materials, inputs), execution)
    simulation.warn(cases, materials, clean, [solver_steps(case.recipe, inputs) for case in cases])
    results = [
        simulation.as_written(result, case.recipe, index) for index, (result, case) in enumerate(zip(clean, cases, strict=True))
    ]
    seen = [simulation.seen(case.recipe, result.columns) for case, result in zip(cases, results, strict=True)]

    def again(case: int, times: Floats) -> Columns:
        one = cases[case].recipe
        asked = Case(one.model_copy(update={"output": one.output.model_copy(update={"times": times.tolist()})}))
        return simulation.seen(one, solve_batches(simulation.batches([asked], [materials[case]], inputs))[0].columns)

    def draws(case: Case[Any], sample: Sample, result: CaseResult) -> list[SimulationBatch]:
        one, drawn = simulation.drawn(case, sample, result)
        return simulation.batches([one] * len(sample), drawn, inputs, sample.thickness_factor)

    written: Sequence[CaseResult] = results
    intervals: dict[str, dict[str, Any]] = {}
    samples: Sequence[Sample | None] = [None] * len(cases)
    if any(case.recipe.uncertainty is not None for case in cases):
        from dielast.commands.simulation.bounds import bounded_cases
        from dielast.commands.simulation.uncertainty import samples_of, uncertainty_headline

        samples = samples_of(cases, materials, inputs)
        written = bounded_cases(cases, samples, results, draws, execution)
        intervals = uncertainty_headline([case.recipe.uncertainty for case in cases], samples)

    def further(case: Case[Any], drawn: Sequence[Material], factor: Floats) -> list[CaseResult]:
        return solve_batches(simulation.batches([case] * len(drawn), drawn, inputs, factor), execution, "further runs")

    written = simulation.analysed(list(zip(cases, materials, samples, written, strict=True)), further)
    matched = matches(recipe, seen, inputs, again)
    x, y, scales = axes_of(cases, seen[0], simulation.measured, simulation.time_scale)

    def figure() -> Any:
        from dielast.commands.simulation.bounds import band
        from dielast.commands.simulation.pictures import picture
        from dielast.commands.simulation.uncertainty import interval_label

        across = "time [s]" if x in cases[0].settings else x
        shown = zip(cases, results, seen, strict=True)
        marks = [simulation.marks(case.recipe, result, columns, across, y) for case, result, columns in shown]
        bands = [band(one.columns, across, y) for one in written]
        spans = (
            [event.span for one in written for event in one.bounded_events if event.event is not None] if x == "time [s]" else ()
        )
        called = interval_label([case.recipe for case in cases])
        return picture(cases, materials, seen, matched, (x, y, scales), bands, called, marks, spans)

    tables = (
        {f"{recipe.kind}.csv": result_columns(written)} | simulation.tables(recipe, written) | {"cases.csv": case_columns(cases)}
    )
    if (cycling := cycle_columns(results)) is not None:
        tables["cycles.csv"] = cycling
    sections = simulation.headline(cases, written)
    if matched:
        sections["compare"] = compare_headline(matched)
    more = simulation.figures(cases, materials, written)
    return Report(tables, sections | intervals, figure, failures=failures(results), figures=more)
