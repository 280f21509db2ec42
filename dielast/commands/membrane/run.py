"""`relax` and `creep`: membranes under prescribed stretch, force or stress, with noise on the measured quantity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dielast.commands.membrane.recipe import Recipe
from dielast.commands.simulation.cases import case_result, last, one_or_list
from dielast.commands.simulation.checks import warn_of_membranes
from dielast.commands.simulation.result import CaseResult
from dielast.commands.simulation.run import Simulation, report_of
from dielast.io.files import Inputs
from dielast.material.material import Material
from dielast.mechanics.load import Step
from dielast.numerics.arrays import Floats
from dielast.numerics.random_streams import stream
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.execution import Execution
from dielast.simulate.membrane import MembraneHistory, simulate

MEASURED = {"relax": "nominal_stress_1 [Pa]", "creep": "stretch_1 [1]"}


def run(cases: Sequence[Case[Recipe]], inputs: Inputs, execution: Execution) -> Report:
    """Simulate every case, report."""
    return report_of(Membranes(cases[0].recipe), cases, inputs, execution)


class Membranes(Simulation):
    """Simulations of `relax` or `creep`."""

    width = 10
    step = Step

    def __init__(self, recipe: Recipe) -> None:
        self.kind, self.measured = recipe.kind, MEASURED[recipe.kind]

    def solver(self, recipes: Sequence[Recipe], thickness_factor: Floats) -> partial[Any]:
        """The simulation in the mode of the recipes; the thickness has no effect."""
        return partial(simulate, mode=recipes[0].mode)

    def result(self, cases: Sequence[Case[Recipe]], recipe: Recipe, materials: Sequence[Material]) -> partial[CaseResult]:
        """The table of all cases, with the relaxation modulus if any case has one."""
        uniaxial = recipe.mode == "uniaxial"
        with_modulus = self.kind == "relax" and any(case.recipe.mode == "uniaxial" for case in cases)
        return partial(_case, materials=materials, creeping=self.kind == "creep", with_modulus=with_modulus, uniaxial=uniaxial)

    def alike(self, recipe: Recipe) -> str:
        """The mode, which cases that are solved together share."""
        return recipe.mode

    warn = staticmethod(warn_of_membranes)

    def as_written(self, result: CaseResult, recipe: Recipe, case: int) -> CaseResult:
        """The columns with noise."""
        return _with_noise(result, recipe, case)

    def headline(self, cases: Sequence[Case[Recipe]], results: Sequence[CaseResult]) -> dict[str, dict[str, Any]]:
        """Peak and last value of the measured quantity in each case."""
        name, unit = self.measured.rstrip("]").split(" [")
        suffix = "" if unit == "1" else f"_{unit}"
        series = [result.columns[self.measured] for result in results]
        rest = 0.0 if self.kind == "relax" else 1.0  # value before loading
        return {
            self.kind: {
                "cases": len(results),
                f"peak_{name}{suffix}": one_or_list([_farthest(values, rest) for values in series]),
                f"final_{name}{suffix}": one_or_list([last(values) for values in series]),
            }
        }


def _farthest(values: Floats, rest: float) -> float:
    """The value farthest from that at `rest`; NaN for a case that has no result."""
    return float(values[np.argmax(np.abs(values - rest))]) if values.size else np.nan


def _case(
    history: MembraneHistory, row: int, *, materials: Sequence[Material], creeping: bool, with_modulus: bool, uniaxial: bool
) -> CaseResult:
    columns = history.case(row)
    if with_modulus:
        modulus = history.relaxation_modulus[row][np.isfinite(history.stretch_1[row])]
        columns["relaxation_modulus [Pa]"] = np.where(np.isfinite(modulus) & uniaxial, modulus, np.nan)
    return case_result(history, row, columns, materials[row], creeping)


def _with_noise(result: CaseResult, recipe: Recipe, case: int) -> CaseResult:
    """Relative Gaussian noise on the measured quantity: the stress in relaxation, the elongation (stretch - 1) in creep."""
    if not recipe.output.noise:
        return result
    # a stream for each case, so that the noise does not depend on the number of cases
    random = stream(recipe.output.seed, "noise", case)
    columns = dict(result.columns)
    for axis in (1, 2):
        factor = 1 + recipe.output.noise * random.standard_normal(columns["time [s]"].size)
        nominal, stretch = columns[f"nominal_stress_{axis} [Pa]"], columns[f"stretch_{axis} [1]"]
        if recipe.kind == "relax":
            nominal = nominal * factor
        else:
            stretch = 1 + (stretch - 1) * factor
        columns[f"nominal_stress_{axis} [Pa]"] = nominal
        columns[f"stretch_{axis} [1]"] = stretch
        columns[f"true_stress_{axis} [Pa]"] = nominal * stretch
        if axis == 1 and "relaxation_modulus [Pa]" in columns:
            columns["relaxation_modulus [Pa]"] = columns["relaxation_modulus [Pa]"] * factor
    return replace(result, columns=columns)
