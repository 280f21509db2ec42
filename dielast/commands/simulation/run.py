"""Run the cases of a recipe together, for all commands that simulate histories."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from dielast.base.errors import Mistakes
from dielast.commands.simulation.cases import (
    SimulationBatch,
    axes_of,
    case_columns,
    check_cycles,
    cycle_headline,
    divided,
    failures,
    many_cycles,
    one_or_all,
    read_materials,
    result_columns,
    states_axes,
    together,
    with_all_columns,
)
from dielast.commands.simulation.recipe import SimulationRecipe
from dielast.commands.simulation.result import CaseResult, SolvedCase, StatedCase, held, with_noise
from dielast.commands.simulation.solver_steps import in_recipe_terms, solver_steps
from dielast.commands.simulation.timed_steps import joined
from dielast.io.files import Inputs
from dielast.io.spool import IN_MEMORY, Spool
from dielast.io.table import Table, case_table
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.mechanics.line import EVEN_ROWS, HOLD_DECADES, JUMP_DECADES, RAMP_DECADES
from dielast.mechanics.piece import rows_after_turn
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import MOST_WRONG_CASES, Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution
from dielast.sharing.memory import check_memory
from dielast.sharing.study import Study
from dielast.simulate.output import Output

if TYPE_CHECKING:
    from dielast.commands.simulation.compare import Match

Figures = dict[str, Callable[[], Any]]
NUMBER = 8  # bytes
# as measured: copies of each number of a table while its case is solved, and afterwards until it is written; and bytes of a case
COPIES, HELD, CASE = 4.5, 1.2, 8192


class Simulation(ABC):
    """The parts of a simulation that depend on the command."""

    measured: str
    """Default column of the figure."""
    time_scale = "log"

    @abstractmethod
    def prepare(self, cases: Sequence[StatedCase], thickness_factor: Floats, steps: Sequence[Any]) -> partial[Any]:
        """The library's function that prepares a simulation of cases of one shape, with all arguments but the material;
        `thickness_factor` (cases,) is a factor on the thickness of each film.
        """

    @abstractmethod
    def result(self, recipe: Any, materials: Sequence[Material]) -> partial[CaseResult]:
        """A function that makes the result of a case from a history and a row of it."""

    @abstractmethod
    def alike(self, recipe: Any) -> Hashable:
        """A value that cases must share to be solved together, besides steps of one shape and one output."""

    def points(self, recipe: Any) -> int:
        """About how many points the solver follows in a case."""
        return 1

    @abstractmethod
    def warn_before(self, cases: Sequence[StatedCase]) -> None:
        """Warn of cases that look like a mistake, before they are solved."""

    @abstractmethod
    def warn(self, cases: Sequence[SolvedCase]) -> None:
        """Warn of cases whose results look like a mistake, or ask too much of their material."""

    @abstractmethod
    def headline(self, cases: Sequence[Case[Any]], results: Sequence[CaseResult]) -> dict[str, dict[str, Any]]:
        """The headline numbers by section of the summary."""

    def extras(
        self, cases: Sequence[Case[Any]], stated: Sequence[StatedCase], results: Sequence[CaseResult]
    ) -> tuple[dict[str, Table], Figures]:
        """Further tables by file name, and further figures by name."""
        return {}, {}

    def batches(
        self, cases: Sequence[StatedCase], thickness_factor: Floats | None = None, *, alone: Sequence[int] = ()
    ) -> list[SimulationBatch]:
        """The cases in batches of those that can be solved together; or these cases `alone`, each in its own batch."""
        factor = np.ones(len(cases)) if thickness_factor is None else thickness_factor
        different = len({id(case.steps) for case in cases})  # the draws of a case share its steps
        groups: dict[Hashable, list[int]] = {}
        for index, case in enumerate(cases):
            output, shape = case.recipe.output, tuple(timed.shape for timed in case.steps)
            times = None if output.times is None else tuple(output.times)
            rows = (times, output.points_per_decade, output.cycles, case.recipe.solver.rtol)
            groups.setdefault((self.alike(case.recipe), rows, shape), []).append(index)
        batches = []
        for members in [[index] for index in alone] or groups.values():
            origin = [timed.number for timed in cases[members[0]].steps]
            for part in divided(members, [case.material for case in cases], self.points(cases[members[0]].recipe)):
                together = [cases[index] for index in part]
                recipes, materials = [case.recipe for case in together], [case.material for case in together]
                steps = [joined(steps) for steps in zip(*([timed.step for timed in case.steps] for case in together), strict=True)]
                prepare = partial(self.prepare(together, factor[part], steps), material=one_or_all(materials))
                terms = partial(in_recipe_terms, origin=origin, members=part, cases=different)
                batches.append(SimulationBatch(part, prepare, self.result(recipes[0], materials), terms))
        return batches

    def solve(self, cases: Sequence[StatedCase]) -> list[CaseResult]:
        """The results of a few cases, at once and in this process."""
        return Study().batches(self.batches(cases))


@dataclass(frozen=True, slots=True, eq=False)
class PreparedCases:
    """Cases that are ready to be solved: their `stated` data, and the batches of the cases without scatter."""

    stated: Sequence[StatedCase]
    batches: Sequence[SimulationBatch]

    @classmethod
    def of(cls, simulation: Simulation, cases: Sequence[Case[Any]], inputs: Inputs, jobs: int = 1) -> Self:
        """Read what the cases name and check everything that can be known before anything is solved.

        Warns of what looks like a mistake. Raises `InputError` with the mistakes of all cases, and `NumericsError` if memory is
        short.
        """
        wrong = Mistakes()
        known = wrong.tried(partial(_materials, cases, inputs, jobs))
        steps = [wrong.tried(partial(solver_steps, case.recipe, inputs)) for case in cases]
        wrong.tried(partial(check_cycles, cases))
        if comparisons := cases[0].recipe.compare:
            from dielast.commands.simulation.compare import check_comparison

            for index, comparison in enumerate(comparisons):
                wrong.tried(partial(check_comparison, index, comparison, cases, inputs))
        if known is None or None in steps:
            wrong.refuse()
        stated = [
            StatedCase(case.recipe, material, timed, sample)
            for case, (material, sample), timed in zip(cases, known or (), steps, strict=True)
            if timed is not None
        ]
        batches = simulation.batches(stated)
        for batch in batches:
            found = len(wrong)
            wrong.tried(batch.check)
            if len(batch.members) > 1 and any(problem.case is not None for problem in wrong[found:]):
                of_cases = Mistakes()
                for alone in simulation.batches(stated, alone=batch.members[:MOST_WRONG_CASES]):
                    of_cases.tried(alone.check)
                wrong[found:found] = of_cases
        wrong.refuse()
        simulation.warn_before(stated)
        return cls(stated, batches)


def _materials(cases: Sequence[Case[Any]], inputs: Inputs, jobs: int) -> list[tuple[Material, Sample | None]]:
    """The material of each case, and its draws; `NumericsError` if the tables of the cases do not fit in memory."""
    materials = read_materials(cases, inputs)
    branches = max(material.spectrum.relaxation_time.size for material in materials)
    check_series(cases, 2 + len(cases[0].recipe.provided()), inputs, jobs * together(branches), jobs)
    samples: Sequence[Sample | None] = [None] * len(cases)
    if any(case.recipe.uncertainty is not None for case in cases):
        from dielast.commands.simulation.uncertainty import samples_of, typical_materials

        samples = samples_of(cases, materials, inputs)
        materials = typical_materials(materials, samples)
    return list(zip(materials, samples, strict=True))


def report_of(simulation: Simulation, cases: Sequence[Case[Any]], inputs: Inputs, execution: Execution) -> RunReport:
    """Simulate every case, report."""
    prepared, recipes = PreparedCases.of(simulation, cases, inputs, execution.jobs), [case.recipe for case in cases]
    spool = Spool()
    study = Study.of(cases, inputs, execution, partial(held, spool))
    kind, materials = recipes[0].kind, [case.material for case in prepared.stated]
    solved = [
        SolvedCase(case.recipe, case.material, case.steps, case.sample, result)
        for case, result in zip(prepared.stated, with_all_columns(study.batches(prepared.batches), spool), strict=True)
    ]
    simulation.warn(solved)
    solved = [
        replace(case, result=with_noise(case.result, case.recipe, number).put(spool)) if case.recipe.output.noise else case
        for number, case in enumerate(solved)
    ]
    results = [case.result for case in solved]
    columns = [case.result.columns for case in solved]
    cycling = {case: result.cycles for case, result in enumerate(results) if result.cycles is not None}
    intervals: dict[str, dict[str, Any]] = {}
    if any(recipe.uncertainty is not None for recipe in recipes):
        from dielast.commands.simulation.bounds import bounded_cases
        from dielast.commands.simulation.uncertainty import uncertainty_headline

        results = bounded_cases(simulation.batches, solved, study)
        solved = [replace(case, result=result) for case, result in zip(solved, results, strict=True)]
        intervals = uncertainty_headline([recipe.uncertainty for recipe in recipes], [case.sample for case in solved])
    tables: dict[str, Table] = {}
    sections: dict[str, dict[str, Any]] = {}
    figures: Figures = {}
    if any(getattr(recipe, "sensitivity", False) for recipe in recipes):
        from dielast.commands.simulation.sensitivity import case_sensitivities, sensitivity_outputs

        sensitivities = case_sensitivities(simulation.batches, solved, study)
        tables, sections, figures = sensitivity_outputs(sensitivities, cases, materials)

    matched: Sequence[Match] = []
    compared: dict[str, dict[str, Any]] = {}
    if recipes[0].compare:
        from dielast.commands.simulation.compare import compare_headline, matches

        def at_times(case: int, times: Floats) -> Mapping[str, Floats]:
            return simulation.solve([replace(prepared.stated[case], recipe=recipes[case].at_times(times))])[0].columns

        ends = [case.result.end(case.steps.end) for case in solved]
        matched = matches(recipes[0], columns, inputs, at_times, ends)
        compared = {"compare": compare_headline(matched)}
    axes = axes_of(cases, columns[0], simulation.measured, simulation.time_scale)

    many = many_cycles(results)

    def figure() -> Any:
        from dielast.commands.simulation.pictures import picture, picture_of_cycles

        if many and not states_axes(recipes[0]):
            return picture_of_cycles(cases, solved, simulation.measured)
        return picture(cases, solved, columns, matched, axes)

    more_tables, more_figures = simulation.extras(cases, prepared.stated, results)
    tables = {f"{kind}.csv": result_columns(results), **more_tables, **tables, "cases.csv": case_columns(cases)}
    if cycling:
        tables["cycles.csv"] = case_table(cycling)
    sections = simulation.headline(cases, results) | (cycle_headline(results, simulation.measured) if many else {}) | sections
    return RunReport(tables, sections | compared | intervals, figure, failures=failures(results), figures=more_figures | figures)


def check_series(cases: Sequence[Case[Any]], columns: int, inputs: Inputs, solving: int, jobs: int) -> None:
    """Raise `NumericsError` if tables of so many `columns` do not fit in memory, with so many cases `solving` at a time, and
    the draws of `jobs` cases.
    """
    points: dict[str, int] = {}
    rows = [_rows(case.recipe, inputs, points) for case in cases]
    draws = [0 if case.recipe.uncertainty is None else case.recipe.uncertainty.draws for case in cases]
    drawn = sorted((count * many for count, many in zip(rows, draws, strict=True)), reverse=True)[:jobs]
    solved = sum(sorted(rows, reverse=True)[:solving])
    # what is solved lies in a file beyond a limit
    held = min(HELD * (sum(rows) - solved), IN_MEMORY / (NUMBER * columns))
    numbers = held + COPIES * (solved + sum(drawn))
    what = f"{len(cases)} case{'s' * (len(cases) > 1)} of {max(rows)} rows{f', each drawn {max(draws)} times,' * any(draws)}"
    cycling = any(getattr(step, "waveform", None) is not None for case in cases for step in case.recipe.step)
    keys = f"output.points_per_decade{', output.cycles' * cycling} or output.times"
    fewer = [f"rows ({keys})", *["cases"] * (len(cases) > 1), *["draws"] * any(draws)]
    check_memory(NUMBER * columns * numbers + CASE * len(cases), what, f"state fewer {' or '.join(fewer)}")


def _rows(recipe: SimulationRecipe, inputs: Inputs, points: dict[str, int]) -> int:
    """Estimated number of rows in the table of a case; `points` are the numbers of points of the tables that have been read.

    A specimen may go slack and taut in each step that unloads it and in each cycle; how often it does in a table is not known.
    """
    if recipe.output.times is not None:
        return len(recipe.output.times)
    count, jumped = 0, False
    slack = getattr(recipe, "slack", "pushes") != "pushes" and getattr(recipe, "mode", None) != "equibiaxial"
    turned, present = 2 * rows_after_turn(recipe.output.points_per_decade).size * slack, 1.0
    for step in getattr(recipe, "step", ()):
        at_once = step.hold is None and step.table is None and not step.duration and getattr(step, "rate", None) is None
        decades = JUMP_DECADES if jumped else HOLD_DECADES
        if step.hold is None:
            decades = JUMP_DECADES if "voltage" in type(step).model_fields else RAMP_DECADES
        count += 1 if at_once else decades * recipe.output.points_per_decade + EVEN_ROWS
        if (aim := step.aim()) is not None:
            count += turned * (aim.value < present)
            present = aim.value
        jumped = at_once
        if step.table is not None:
            if step.table not in points:
                points[step.table] = inputs.read(step.table).count(b"\n")
            count += points[step.table]
        elif getattr(step, "waveform", None) is not None:
            cycles = step.cycles or 1
            # a row of cycles.csv takes about as much
            count += (2 * EVEN_ROWS + turned) * Output(cycles=recipe.output.cycles).kept(cycles).size + cycles
    return count
