"""`relax` and `creep`: membranes under prescribed stretch, force or stress."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dielast.commands.membrane.recipe import Recipe
from dielast.commands.simulation.cases import case_result, last, one_or_list
from dielast.commands.simulation.checks import warn_of_membranes, warn_of_tests
from dielast.commands.simulation.result import CaseResult, StatedCase
from dielast.commands.simulation.run import Figures, PreparedCases, Simulation, report_of
from dielast.io.files import Inputs
from dielast.io.table import Column, Table, split_header
from dielast.material.material import Material
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution
from dielast.simulate.membrane import MembraneHistory, prepare
from dielast.simulate.options import Solver
from dielast.simulate.output import Output

MEASURED = {"relax": "nominal_stress_1 [Pa]", "creep": "stretch_1 [1]"}


def run(cases: Sequence[Case[Recipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Simulate every case, report."""
    return report_of(Membranes([case.recipe for case in cases]), cases, inputs, execution)


def prepared(cases: Sequence[Case[Recipe]], inputs: Inputs) -> PreparedCases:
    """The cases, read and checked, but not solved."""
    return PreparedCases.of(Membranes([case.recipe for case in cases]), cases, inputs)


class Membranes(Simulation):
    """Simulations of `relax` or `creep`."""

    warn_before = staticmethod(warn_of_tests)
    warn = staticmethod(warn_of_membranes)

    def __init__(self, recipes: Sequence[Recipe]) -> None:
        self.kind, self.measured = recipes[0].kind, MEASURED[recipes[0].kind]

    def prepare(self, cases: Sequence[StatedCase], thickness_factor: Floats, steps: Sequence[Any]) -> partial[Any]:
        """The simulation in the mode of the recipes; the thickness has no effect."""
        recipe, temperature = cases[0].recipe, np.array([case.temperature for case in cases])
        output = Output(recipe.output.times, recipe.output.points_per_decade, recipe.output.cycles)
        return partial(
            prepare,
            steps=steps,
            mode=recipe.mode,
            temperature=temperature,
            output=output,
            solver=Solver(recipe.solver.rtol),
            slack=getattr(recipe, "slack", None),
        )

    def result(self, recipe: Recipe, materials: Sequence[Material]) -> partial[CaseResult]:
        """The result of a case."""
        return partial(_case, materials=materials, creeping=self.kind == "creep")

    def alike(self, recipe: Recipe) -> tuple[str, str | None]:
        """The mode and what slack specimens do, which cases that are solved together share."""
        return recipe.mode, getattr(recipe, "slack", None)

    def extras(
        self, cases: Sequence[Case[Any]], stated: Sequence[StatedCase], results: Sequence[CaseResult]
    ) -> tuple[dict[str, Table], Figures]:
        """The times at which specimens go slack and taut, where any does."""
        rows = [(case, event) for case, result in enumerate(results) for event in result.slack]
        if not rows:
            return {}, {}
        table = [
            Column("case", None, np.array([case for case, _ in rows])),
            Column("event", None, [event.event for _, event in rows]),
            Column("time", "s", np.array([event.time for _, event in rows])),
            Column("stretch_1", "1", np.array([event.stretch for _, event in rows])),
        ]
        return {"events.csv": table}, {}

    def headline(self, cases: Sequence[Case[Recipe]], results: Sequence[CaseResult]) -> dict[str, dict[str, Any]]:
        """Peak and last value of the measured quantity in each case."""
        name, unit = split_header(self.measured)
        suffix = "" if unit == "1" else f"_{unit}"
        series = [result.columns[self.measured] for result in results]
        rest = 0.0 if self.kind == "relax" else 1.0  # value before loading
        peaks = [float(values[np.argmax(np.abs(values - rest))]) if values.size else np.nan for values in series]
        where = {"peak_of": "the rows at output.times"} if any(case.recipe.output.times is not None for case in cases) else {}
        events = {"slack_events": one_or_list([len(result.slack) for result in results])} if any(r.slack for r in results) else {}
        return {
            self.kind: {
                "cases": len(results),
                f"peak_{name}{suffix}": one_or_list(peaks),
                **where,
                f"final_{name}{suffix}": one_or_list([last(values) for values in series]),
                **events,
            }
        }


def _case(history: MembraneHistory, row: int, *, materials: Sequence[Material], creeping: bool) -> CaseResult:
    result = case_result(history, row, history.case(row), materials[row], creeping)
    return replace(result, slack=history.slack_events[row])
