"""Recipes of relax, creep and actuate as tests, with their measured points in `[[compare]]`."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError, listed, located, warn
from dielast.calibration.experiment import SimulatedExperiment, answers_of
from dielast.calibration.laboratory import RTOL
from dielast.commands.registry import read_cases
from dielast.commands.simulation.cases import material_of
from dielast.commands.simulation.compare import interpolated, read_points
from dielast.commands.simulation.recipe import CompareSection
from dielast.commands.simulation.result import CaseResult, StatedCase
from dielast.commands.simulation.run import Simulation
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.commands.simulation.timed_steps import TimedStep, TimedSteps
from dielast.io.files import Inputs, resolve
from dielast.io.table import split_header
from dielast.material.material import Material
from dielast.mechanics.load import ChargeStep, Track, VoltageStep, Waveform
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case

FINE = 400  # times of a history
KINDS = ("relax", "creep", "actuate")


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedTest(SimulatedExperiment):
    """One `[[compare]]` of a `recipe`, whose case is simulated through the `steps`."""

    recipe: Any
    steps: TimedSteps
    simulation: Simulation
    comparison: CompareSection
    x: Floats | None
    """The measured values (n,) of another quantity than time or a prescribed voltage; None: points are compared at their times."""

    def answers(self, materials: Sequence[Material | None]) -> Floats:
        """The simulated values (materials, n) less `rest`, NaN if the simulation of a material ends earlier."""
        return answers_of(self._solve, materials, self.time.size)

    def reach(self, material: Material) -> tuple[str, float]:
        """The mode of loading, and the largest I1 of a material until the last point."""
        (result,) = self._results([material])
        until = np.asarray(result.columns["time [s]"]) <= self.time[-1]
        first, second = (np.asarray(result.columns[f"stretch_{axis} [1]"])[until] for axis in (1, 2))
        invariant = float(np.max(first**2 + second**2 + (first * second) ** -2.0, initial=3.0))
        alike = "equibiaxial" if np.allclose(first, second) else "biaxial"
        return str(getattr(self.recipe, "mode", alike)), invariant

    def _solve(self, materials: Sequence[Material]) -> list[Floats]:
        """The simulated values (n,) of each material less `rest`, NaN after the end of its simulation."""
        tables = [result.columns for result in self._results(materials)]
        if self.x is None:
            return [self._at_times(table["time [s]"], table[self.header]) for table in tables]
        over = self.comparison.x
        return [interpolated(self.comparison, self.x, table[over], table[self.header]) - self.rest for table in tables]

    def _results(self, materials: Sequence[Material]) -> list[CaseResult]:
        """The result of the simulation of each material."""
        return self.simulation.solve([StatedCase(self.recipe, material, self.steps, None) for material in materials])

    def _at_times(self, time: Floats, values: Floats) -> Floats:
        """The values (n,) less `rest` at the times of the test, NaN outside."""
        if not time.size:
            return np.full(self.time.size, np.nan)
        return np.interp(self.time, time, values, left=np.nan, right=np.nan) - self.rest


def recipe_tests(name: str, inputs: Inputs, called: str, specimen: str, temperature: float) -> list[SimulatedTest]:
    """The tests that a recipe holds, one for each `[[compare]]`; `temperature` in degC is that of a recipe that states none.

    Raises `InputError` for a recipe without measured points.
    """
    content, path = inputs.read(name), resolve(inputs.folder, name)
    cases = read_cases(path, content=content)
    kind = cases[0].recipe.kind
    if kind not in KINDS:
        raise InputError(f'"{kind}": a recipe of {listed(KINDS)} is needed', key="kind", file=name)
    comparisons = cases[0].recipe.compare
    if not comparisons:
        raise InputError("[[compare]] with the measured points is needed", file=name)
    inputs, tests = Inputs(path.parent), []
    for index, comparison in enumerate(comparisons):
        if comparison.case >= len(cases):
            raise InputError(
                f"{comparison.case}: cases are numbered from 0 to {len(cases) - 1}", key=f"compare[{index}].case", file=name
            )
        recipe = cases[comparison.case].recipe
        at = temperature if recipe.temperature is None else float(recipe.temperature)
        with located(file=name):
            steps = solver_steps(recipe, inputs)
            over, values = read_points(comparison, inputs, getattr(recipe, "specimen", None))
            time, x = over, None
            if comparison.x != "time [s]":
                history = prescribed(recipe, steps, comparison.x)
                if history is None:
                    x, history = (
                        over,
                        _of_its_material(cases[comparison.case], comparison, steps, inputs, at, f"compare[{index}].x"),
                    )
                time = interpolated(comparison, over, history[1], history[0])
        reached = np.isfinite(time)
        if lost := int(np.count_nonzero(~reached)):
            warn(f"{comparison.file}: {lost} of {time.size} points are beyond the {comparison.x} of the simulation: left out")
        time, values, x = time[reached], values[reached], None if x is None else x[reached]
        if x is None:
            order = np.argsort(time, kind="stable")
            time, first = np.unique(time[order], return_index=True)
            values = values[order][first]
        if time.size < 3:
            raise InputError(f"at least 3 points are needed, not {time.size}", key=f"compare[{index}].file", file=name)
        header, (column, unit) = comparison.y, split_header(comparison.y)
        wanted = time[time >= 0] if x is None else _evenly(steps)
        if x is None:
            steps = _until(float(time[-1]), steps)
        # as accurate as tests with a prescribed stretch
        coarse = {} if "rtol" in recipe.solver.model_fields_set else {"rtol": max(RTOL, recipe.solver.rtol)}
        solver = recipe.solver.model_copy(update=coarse)
        simulated = _followed(recipe, wanted, at, solver=solver)
        rest = _rest(recipe, column)
        label = called if len(comparisons) == 1 else f"{called}, {comparison.label or os.path.basename(comparison.file)}"
        tests.append(
            SimulatedTest(
                label,
                specimen,
                time,
                values - rest,
                rest,
                unit or "1",
                at,
                header,
                simulated,
                steps,
                _simulation(recipe),
                comparison,
                x,
            )
        )
    return tests


def _rest(recipe: Any, column: str) -> float:
    """The value of a column before the load: of a film, at its prestretch."""
    if "stretch" not in column:
        return 0.0
    first, second = recipe.film.prestretch if recipe.kind == "actuate" else (1.0, 1.0)
    at_prestretch = {"stretch_1": first, "stretch_2": second, "thickness_stretch": 1 / (first * second)}
    return float(at_prestretch.get(column, 1.0))


def prescribed(recipe: Any, steps: Sequence[TimedStep], header: str) -> tuple[Floats, Floats] | None:
    """Times in s and values at the corners of a quantity that the steps prescribe along straight lines; None for others."""
    source = getattr(recipe, "source", None)
    if header != "voltage [V]" or getattr(recipe, "control", "") != "voltage" or (source is not None and source.resistance > 0):
        return None
    time, value = [0.0], [0.0]
    for timed in steps:
        if isinstance(timed.step.target, Waveform):
            return None
        for reached, lasts in timed.corners:
            time.append(time[-1] + lasts)
            value.append(reached)
    return np.array(time), np.array(value)


def _until(end: float, steps: TimedSteps) -> TimedSteps:
    """The steps up to the time `end` in s: a film that pulls in later would be followed in ever smaller steps."""
    begun = [timed for timed in steps if timed.begin < end or timed is steps[0]]
    last = begun[-1]
    if last.begin < end < last.end and isinstance(last.step, VoltageStep | ChargeStep):
        target, lasts = last.step.target, end - last.begin
        if target is None or not isinstance(target, Waveform | Track):
            reached = None if target is None else last.before + (last.after - last.before) * lasts / last.lasts
            stated: dict[str, Any] = {last.step.QUANTITY: reached}
            begun[-1] = replace(last, step=type(last.step)(**stated, duration=lasts))
    return replace(steps, steps=begun)


def _of_its_material(
    case: Case[Any], comparison: CompareSection, steps: TimedSteps, inputs: Inputs, temperature: float, key: str
) -> tuple[Floats, Floats]:
    """Times in s and values of the quantity x of a comparison, for the material that its recipe names."""
    stated = _followed(case.recipe, _evenly(steps), temperature)
    table = _simulation(stated).solve([StatedCase(stated, material_of(case, inputs), steps, None)])[0].columns
    for header in (comparison.x, comparison.y):
        if header not in table:
            raise InputError(f'"{header}" is no column of the result; there are {", ".join(table)}', key=key)
    return table["time [s]"], table[comparison.x]


def _evenly(steps: TimedSteps) -> Floats:
    """Times in s of a history for points over a quantity that the material determines."""
    return np.linspace(0.0, steps[-1].end, FINE + 1)[1:]


def _followed(recipe: Any, times: Floats, temperature: float, **changes: Any) -> Any:
    """The recipe at these times in s and a temperature in degC; a film goes on after its failure."""
    if recipe.kind == "actuate":
        changes["stop"] = recipe.stop.model_copy(update={"at": "end"})
    return recipe.at_times(times, temperature=temperature, **changes)


def _simulation(recipe: Any) -> Simulation:
    if recipe.kind == "actuate":
        from dielast.commands.actuate.run import ActuateSimulation

        return ActuateSimulation([recipe])
    from dielast.commands.membrane.run import Membranes

    return Membranes([recipe])
