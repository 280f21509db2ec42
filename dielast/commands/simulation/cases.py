"""Cases of simulations: batches, materials, tables, axes of the figure."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dielast.base.errors import InputError, Mistakes, Problem, Where, and_more, as_toml, in_a_draw, placed, reached_by
from dielast.commands.simulation.recipe import SimulationRecipe
from dielast.commands.simulation.result import CaseResult, StatedCase
from dielast.commands.simulation.step_recipe import HistoryStep
from dielast.handover.changed_material import parse_changed_material
from dielast.io.files import Inputs
from dielast.io.spool import Spool
from dielast.io.table import Column, Table, split_header, stacked_table
from dielast.material.checks import warn_of_material
from dielast.material.material import Material
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.simulate.events import Event
from dielast.simulate.history import History
from dielast.simulate.output import KEPT_WHOLE
from dielast.simulate.quantities import FILMS, TESTS

PART = 2**14  # branches in a batch, over all points of all cases: about what advances together, so that smaller batches are slower


@dataclass(frozen=True, slots=True, eq=False)
class SimulationBatch:
    """Cases with histories of one shape: `prepare` checks the arguments of their simulation and returns a function that simulates
    them, `result` makes a result from the history and a row of it, and `in_recipe_terms` translates a problem of the solver into
    one of the recipe.
    """

    members: Sequence[int]
    prepare: partial[Callable[[], Any]]
    result: partial[CaseResult]
    in_recipe_terms: partial[Problem]
    place: Where | None = None
    """Where the draws are requested, if the cases are draws of one."""

    def solve(self) -> list[CaseResult]:
        """The result of each member."""
        with nullcontext() if self.place is None else in_a_draw(**self.place), placed(self.in_recipe_terms):
            history = self.prepare()()
        return [self.result(history, row) for row in range(len(self.members))]

    def check(self) -> None:
        """Raise the `InputError` of a simulation that is refused before anything is solved."""
        with placed(self.in_recipe_terms):
            self.prepare()


Batches = Callable[[Sequence[StatedCase], Floats], Sequence[SimulationBatch]]
"""Divides cases into batches, each case with a factor (cases,) on the thickness."""


@reached_by("material")
def material_of(case: Case[Any], inputs: Inputs) -> Material:
    """The material of a case: that of its file, with the changes that the case states."""
    name = case.recipe.material
    return parse_changed_material(inputs.read(name), name, case.of_material, case.origin)


def material_key(case: Case[Any]) -> str:
    """A value that is equal for cases with the same material."""
    return f"{case.recipe.material}\n{as_toml(case.of_material)}"


def read_materials(cases: Sequence[Case[SimulationRecipe]], inputs: Inputs) -> list[Material]:
    """The materials of the cases; a material that several cases share is read once."""
    first = {material_key(case): case for case in reversed(cases)}
    wrong = Mistakes()
    read = {key: wrong.tried(partial(material_of, case, inputs)) for key, case in reversed(first.items())}
    wrong.refuse()
    materials = {key: material for key, material in read.items() if material is not None}
    for material in materials.values():
        warn_of_material(material)
    return [materials[material_key(case)] for case in cases]


def together(branches: int, points: int = 1) -> int:
    """How many cases with so many points and branches are solved together."""
    return max(PART // max(points * branches, 1), 1)


def divided(members: Sequence[int], materials: Sequence[Material], points: int = 1) -> list[list[int]]:
    """The members, each with so many points, in parts of about equal work, small enough for even shares of processes."""
    size = together(max(materials[index].spectrum.relaxation_time.size for index in members), points)
    return [list(members[first : first + size]) for first in range(0, len(members), size)]


def one_or_all(materials: Sequence[Material]) -> Material | list[Material]:
    """One material if all cases share it, which is faster than an array of materials."""
    return materials[0] if all(material is materials[0] for material in materials) else list(materials)


def result_columns(results: Sequence[CaseResult]) -> Table:
    """The table of all cases, one below the other."""
    unwritten = {quantity.header for quantity in (*FILMS, *TESTS) if not quantity.written}
    headers = [header for header in results[0].columns if header not in unwritten]
    cases = {number: result.columns for number, result in enumerate(results)}
    return stacked_table(cases, headers, [result.temperature for result in results])


def with_all_columns(results: list[CaseResult], spool: Spool) -> list[CaseResult]:
    """The results with the same columns; one that a case lacks, such as the damage of a film without [damage], is empty. The
    `spool` holds the new ones.
    """
    headers = dict.fromkeys(header for headers in dict.fromkeys(tuple(result.columns) for result in results) for header in headers)
    for number, result in enumerate(results):
        if len(result.columns) < len(headers):
            empty = np.full(result.columns["time [s]"].size, np.nan)
            whole = {header: result.columns.get(header, empty) for header in headers}
            results[number] = replace(result, columns=whole).put(spool)
    return results


def case_result(
    history: History,
    row: int,
    columns: Mapping[str, Floats],
    material: Material,
    pulled: bool,
    events: Sequence[Event] | None = None,
) -> CaseResult:
    """The result of one case of a history; `pulled` says whether a load can stretch the film without limit."""
    outcome, failure = history.outcome[row], None
    if not outcome.completed:
        # the case ended after its load was applied
        flows = pulled and material.equilibrium_modulus == 0 and outcome.time > 0
        more = ": without an equilibrium modulus the film flows without limit" if flows else ""
        failure = replace(outcome, reason=outcome.reason + more)
    cycles = None if history.cycles is None else history.cycles.case(row)
    return CaseResult(float(history.temperature[row]), columns, failure, cycles, events)


def failures(results: Sequence[CaseResult]) -> list[str]:
    """A line for each reason why cases were not finished, about the first of these cases."""
    lost = [(case, result.failure) for case, result in enumerate(results) if result.failure is not None]
    return first_of_each(
        [(loss.reason, f"case {case}: given up at {loss.time:.6g} s: {loss.reason}") for case, loss in lost], "cases"
    )


def first_of_each(lines: Sequence[tuple[str, str]], what: str) -> list[str]:
    """The first line for each reason, of (reason, line), with the number of the other lines; `what` is the plural of a case."""
    count = Counter(reason for reason, _ in lines)
    first = dict(reversed(lines))
    named = {2: what.removesuffix("s")}  # the singular, for one other line
    return [first[reason] + and_more(many - 1, named.get(many, what)) for reason, many in count.items()]


def check_cycles(cases: Sequence[Case[SimulationRecipe]]) -> None:
    """Raise `InputError` if `output.cycles` is stated and no case has a waveform."""
    stated = any(case.recipe.output.cycles is not None for case in cases)
    steps: Iterable[HistoryStep] = (step for case in cases for step in getattr(case.recipe, "step", ()))
    repeats = any(getattr(case.recipe, "repeat", None) is not None for case in cases)
    if stated and not repeats and all(step.waveform is None for step in steps):
        raise InputError("has no effect without a waveform in [[step]]: leave it out", key="output.cycles")


def many_cycles(results: Sequence[CaseResult]) -> bool:
    """Whether there are so many cycles that the summary, and the figure, show them by their numbers."""
    counts = [0 if result.cycles is None else result.cycles["cycle"].size for result in results]
    return min(counts) > 0 and max(counts) > KEPT_WHOLE


def states_axes(recipe: SimulationRecipe) -> bool:
    """Whether the recipe states what the figure shows."""
    return bool(recipe.compare or recipe.output.times is not None or any((recipe.plot.x, recipe.plot.y, recipe.plot.join)))


def quantity_of_cycles(results: Sequence[CaseResult], measured: str) -> str:
    """The column whose lowest and highest values cycles have: `measured`, or the nominal stress where stretches are prescribed."""
    return "nominal_stress_1 [Pa]" if "lowest [Pa]" in (results[0].cycles or ()) else measured


def cycle_headline(results: Sequence[CaseResult], measured: str) -> dict[str, dict[str, Any]]:
    """The numbers of cycles, and all that `cycles.csv` tells of the first and the last one."""
    tables = [result.cycles for result in results if result.cycles is not None]
    numbers: dict[str, Any] = {
        "cycles": one_or_list([table["cycle"].size for table in tables]),
        "of": split_header(quantity_of_cycles(results, measured))[0],
    }
    for header in list(tables[0])[1:]:
        name, unit = split_header(header)
        suffix = "" if unit in (None, "1") else f"_{str(unit).replace('/', '_per_').replace('^', '')}"
        ends = [[float(table[header][place]) for table in tables] for place in (0, -1)]
        if np.isfinite(ends).any():
            first, last = map(one_or_list, ends)
            numbers |= {f"first_{name}{suffix}": first, f"last_{name}{suffix}": last}
    return {"cycles": numbers}


def one_or_list(values: Sequence[float | int]) -> Any:
    """Headline values of the cases: a number for one case, else a list."""
    plain = [value if isinstance(value, int) else float(value) for value in values]
    return plain[0] if len(plain) == 1 else plain


def last(values: Floats) -> float:
    """The last value of a case; NaN for a case without a result."""
    return float(values[-1]) if values.size else np.nan


def axes_of(
    cases: Sequence[Case[SimulationRecipe]], columns: Mapping[str, Floats], measured: str, time_scale: str = "log"
) -> tuple[str, str, tuple[str, str]]:
    """Columns for x (or a swept key) and y of the figure, and their scales; the default of y is `measured`.

    `columns` are those of the first case. A history that continues after a hold is not drawn over log time, which would compress
    its later steps into a line.
    """
    recipe, swept = cases[0].recipe, cases[0].settings
    x, y = recipe.plot.x or "time [s]", recipe.plot.y or measured
    if recipe.compare and recipe.plot.x is None and recipe.plot.y is None:
        x, y = recipe.compare[0].x, recipe.compare[0].y
    for header in (x, y):
        if header not in columns and not (header == x and header in swept):
            raise InputError(f'"{header}" is no column of the result; there are {", ".join(columns)}', key="plot")
    if x != "time [s]" or _goes_on(recipe):
        time_scale = "linear"
    return x, y, (recipe.plot.x_scale or time_scale, recipe.plot.y_scale)


def _goes_on(recipe: SimulationRecipe) -> bool:
    """Whether the load changes after a hold or after the first target, or is cyclic."""
    steps: Sequence[HistoryStep] = getattr(recipe, "step", ())
    targets = [step for step in steps if step.aim() is not None]
    cycles = any(getattr(step, "waveform", None) is not None for step in steps)
    return len(targets) > 1 or cycles or any(step.hold is not None for step in steps[:-1])


def case_columns(cases: Sequence[Case[SimulationRecipe]]) -> list[Column]:
    """The table of cases: their numbers and swept values, in SI if all values of a key are quantities of one dimension."""
    columns = [Column("case", None, np.arange(len(cases)))]
    for key in cases[0].settings:
        values = [case.settings[key] for case in cases]
        quantities = cases[0].on_one_scale(key, values)
        if quantities is None:
            columns.append(Column(key, None, [_spelled(value) for value in values]))
        else:
            columns.append(Column(key, quantities[1], np.array(quantities[0])))
    return columns


def _spelled(value: Any) -> str:
    """A value of the recipe as in TOML, text without quotes, and an absolute path without its folders."""
    if isinstance(value, str):
        return Path(value).name if Path(value).is_absolute() else value
    return as_toml(value)
