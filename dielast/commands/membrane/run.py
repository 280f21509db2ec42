"""`relax` and `creep`: the cases of a recipe run together; tables, noise, comparison with measured points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dielast.commands.simulation.cases import (
    CaseResult,
    SimulationBatch,
    axes_of,
    batches_of,
    case_columns,
    compare_headline,
    cycle_columns,
    cycles_of,
    each,
    failures,
    given_up,
    last,
    matches,
    one_or_all,
    read_materials,
    result_columns,
    temperature_of,
)
from dielast.commands.simulation.checks import warn_of_membranes
from dielast.commands.simulation.history import Entry, Recipe, joined, solver_steps
from dielast.commands.simulation.memory import check_series
from dielast.io.files import Inputs
from dielast.material.material import Material
from dielast.numerics.random_streams import stream
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution
from dielast.simulate.membrane import MembraneHistory, simulate

if TYPE_CHECKING:
    from dielast.commands.simulation.compare import Match

Array = NDArray[np.float64]
MEASURED = {"relax": "nominal_stress_1 [Pa]", "creep": "stretch_1 [1]"}
REST = {"relax": 0.0, "creep": 1.0}  # what is measured of a film that was never loaded


def run(cases: Sequence[Case[Recipe]], inputs: Inputs, execution: Execution) -> Report:
    """Simulate every case, report."""
    recipe = cases[0].recipe
    kind = recipe.kind
    materials = read_materials(cases, inputs)
    check_series(cases, 10, inputs, execution.jobs)
    clean = solve_batches(membrane_batches(cases, materials, inputs), execution)
    warn_of_membranes(cases, materials, clean, [solver_steps(case.recipe, inputs) for case in cases])
    results = [_with_noise(result, case.recipe, index) for index, (result, case) in enumerate(zip(clean, cases, strict=True))]
    columns = [result.columns for result in results]

    def again(case: int, times: Array) -> Mapping[str, Array]:
        one = cases[case].recipe
        output = one.output.model_copy(update={"times": times.tolist()})
        repeated = Case(one.model_copy(update={"output": output}))
        return solve_batches(membrane_batches([repeated], [materials[case]], inputs))[0].columns

    told: Sequence[CaseResult] = results
    intervals: dict[str, dict[str, Any]] = {}
    if any(case.recipe.uncertainty is not None for case in cases):
        from dielast.commands.simulation.bounds import bounded_cases
        from dielast.commands.simulation.uncertainty import samples_of, uncertainty_headline

        samples = samples_of(cases, materials, inputs)
        told = bounded_cases(cases, samples, results, lambda own, drawn: membrane_batches(own, drawn, inputs), execution)
        intervals = uncertainty_headline([case.recipe.uncertainty for case in cases], samples)
    found = matches(recipe, columns, inputs, again)
    x, y, scales = axes_of(cases, columns[0], MEASURED[kind])

    def figure() -> Any:
        from dielast.commands.simulation.bounds import band
        from dielast.commands.simulation.pictures import picture
        from dielast.commands.simulation.uncertainty import interval_label

        called = interval_label([case.recipe for case in cases])
        bands = [band(one.columns, "time [s]" if x in cases[0].settings else x, y) for one in told]
        return picture(cases, materials, columns, found, (x, y, scales), bands, called)

    tables = {f"{kind}.csv": result_columns(told), "cases.csv": case_columns(cases)}
    if (cycling := cycle_columns(results)) is not None:
        tables["cycles.csv"] = cycling
    return Report(tables, headline(kind, results, found) | intervals, figure, failures=failures(results))


def headline(kind: str, results: Sequence[CaseResult], found: Sequence[Match]) -> dict[str, dict[str, Any]]:
    """Peak and last value of the measured quantity in each case, and the misfit of each comparison."""
    name, unit = MEASURED[kind].rstrip("]").split(" [")
    suffix = "" if unit == "1" else f"_{unit}"
    series = [result.columns[MEASURED[kind]] for result in results]

    sections: dict[str, dict[str, Any]] = {
        kind: {
            "cases": len(results),
            f"peak_{name}{suffix}": each([_farthest(values, REST[kind]) for values in series]),
            f"final_{name}{suffix}": each([last(values) for values in series]),
        }
    }
    if found:
        sections["compare"] = compare_headline(found)
    return sections


def _farthest(values: Array, rest: float) -> float:
    """The value farthest from that at `rest`; NaN for a case that never began."""
    return float(values[np.argmax(np.abs(values - rest))]) if values.size else np.nan


def membrane_batches(
    cases: Sequence[Case[Recipe]], materials: Sequence[Material], inputs: Inputs
) -> list[SimulationBatch[CaseResult]]:
    """The cases in batches of those with histories of one shape."""
    kind = cases[0].recipe.kind
    with_modulus = kind == "relax" and any(case.recipe.mode == "uniaxial" for case in cases)

    def batch(members: Sequence[int], entries: Sequence[Sequence[Entry]]) -> tuple[partial[Any], partial[CaseResult]]:
        recipe, used = cases[members[0]].recipe, [materials[index] for index in members]
        run = partial(
            simulate,
            one_or_all(used),
            [joined(step) for step in entries],
            mode=recipe.mode,
            temperature=np.array([temperature_of(cases[index].recipe, materials[index]) for index in members]),
            times=recipe.output.times,
            points_per_decade=recipe.output.points_per_decade,
            rtol=recipe.solver.rtol,
            cycles=recipe.output.cycles,
        )
        uniaxial = recipe.mode == "uniaxial"
        return run, partial(_case, materials=used, creeping=kind == "creep", with_modulus=with_modulus, uniaxial=uniaxial)

    return batches_of(cases, materials, lambda recipe: solver_steps(recipe, inputs), lambda recipe: recipe.mode, batch)


def _case(
    history: MembraneHistory, row: int, *, materials: Sequence[Material], creeping: bool, with_modulus: bool, uniaxial: bool
) -> CaseResult:
    columns = history.case(row)
    if with_modulus:
        modulus = history.relaxation_modulus[row][np.isfinite(history.stretch_1[row])]
        columns["relaxation_modulus [Pa]"] = np.where(np.isfinite(modulus) & uniaxial, modulus, np.nan)
    failure = given_up(history.outcome[row], materials[row], creeping)
    return CaseResult(float(history.temperature[row]), columns, failure, cycles_of(history.cycles, row))


def _with_noise(result: CaseResult, recipe: Recipe, case: int) -> CaseResult:
    """Relative Gaussian noise on what the test measures: the stress in relaxation, the elongation (stretch - 1) in creep."""
    if not recipe.output.noise:
        return result
    # a stream for each case, so that no case depends on how many there are
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
