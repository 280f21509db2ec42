"""Comparisons of a recipe: measured points beside a simulated curve, with their misfit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dielast.base import units
from dielast.base.errors import InputError, reached_by, warn
from dielast.commands.simulation.cases import one_or_list
from dielast.commands.simulation.recipe import MEASURED_AS, CompareSection, SimulationRecipe
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs
from dielast.io.table import split_header
from dielast.io.text_table import MeasuredTable, read_measured
from dielast.material.checks import warn_of_measured_stretch
from dielast.numerics.arrays import Flags, Floats, rms
from dielast.numerics.robust import extremes
from dielast.readings.columns_recipe import Specimen
from dielast.readings.quantities import KNOWN_AS, check_area_strain, read_as, read_extent, role_in
from dielast.recipe.cases import Case

FINE = 4000  # points along a history for a comparison over another quantity than time
_MECHANICAL = units.TIME, units.STRESS, units.LENGTH, units.NUMBER, units.ENERGY_DENSITY
_ELECTRICAL = units.VOLTAGE, units.FIELD, units.CHARGE, units.CHARGE_DENSITY, units.CHARGE_RATE, units.CHARGE_DENSITY_RATE
_CAPACITIVE = units.CAPACITANCE, units.CAPACITANCE_DENSITY
DIMENSIONS = {dimension.unit: dimension for dimension in (*_MECHANICAL, *_ELECTRICAL, *_CAPACITIVE)}
# columns of the result -> quantities of a testing machine that give them
QUANTITIES = {"time [s]": "time", "stretch_1 [1]": "stretch", "nominal_stress_1 [Pa]": "stress"}
# and what a testing machine may have measured instead
MACHINE = {"stretch": ("extension", units.LENGTH), "stress": ("force", units.FORCE)}

LENGTHWAYS = "stretch_1", "stretch_2", "relative_stretch_1", "relative_stretch_2"
AREA_STRAIN = "area_strain [1]"

Fine = Callable[[Floats | None], Mapping[str, Floats]]
"""The columns of a case at these times in s; without times, dense enough for linear interpolation."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Measured points `x`, `y` (n,) of one case in SI, and the `model` (n,) at the same x, NaN outside the simulation."""

    label: str
    case: int
    headers: tuple[str, str]
    x: Floats
    y: Floats
    model: Floats

    @property
    def reached(self) -> Flags:
        """The points (n,) that the model reaches and the misfit includes."""
        return np.isfinite(self.model)

    @property
    def rms_error(self) -> float:
        """Root mean square of model - y, in the unit of y."""
        return rms((self.model - self.y)[self.reached])

    @property
    def rms_relative_error(self) -> float:
        """`rms_error` over the root mean square of y."""
        level = rms(self.y[self.reached])
        return self.rms_error / level if level > 0 else np.nan


def matches(
    recipe: SimulationRecipe,
    columns: Sequence[Mapping[str, Floats]],
    inputs: Inputs,
    simulate: Callable[[int, Floats], Mapping[str, Floats]],
    ends: Sequence[float],
) -> list[Match]:
    """The measured points of every comparison with the model, which `simulate` evaluates at their times; `ends` are the times in s
    at which the cases ended.
    """

    def model(case: int, measured: Floats | None) -> Mapping[str, Floats]:
        rows, end = columns[case]["time [s]"], ends[case]
        times = np.union1d(rows, np.linspace(0.0, end, FINE)) if measured is None else measured[measured <= end]
        return simulate(case, times) if times.size else {header: np.zeros(0) for header in columns[case]}

    matched = []
    for index, comparison in enumerate(recipe.compare):
        case, specimen = comparison.case, getattr(recipe, "specimen", None)
        matched.append(match(comparison, columns[case], inputs, partial(model, case), f"compare[{index}]", specimen))
    return matched


def check_comparison(index: int, comparison: CompareSection, cases: Sequence[Case[SimulationRecipe]], inputs: Inputs) -> None:
    """Raise `InputError` for measured points of the comparison `index` of the recipe that cannot be read, that belong to no case,
    or that come after the last step of their case.
    """
    if comparison.case >= len(cases):
        numbered = f"cases are numbered from 0, and the last is {len(cases) - 1}"
        raise InputError(f"{comparison.case}: {numbered}", key=f"compare[{index}].case")
    recipe: Any = cases[comparison.case].recipe
    with reached_by(f"compare[{index}].file"):
        time, _ = read_points(comparison, inputs, getattr(cases[0].recipe, "specimen", None))
        if comparison.x != "time [s]":
            return
        try:
            end = solver_steps(recipe, inputs).end
        except InputError:
            return  # a mistake in a table of load is reported where the table is read
        if time.min() > end:
            late = f"the steps end at {end:g} s, before the first of the {time.size} points at {time.min():g} s"
            raise InputError(f"{late}: is their time in another unit?", file=comparison.file)


def compare_headline(matched: Sequence[Match]) -> dict[str, Any]:
    """The comparisons: column, case, misfit in its SI unit, and the number of points that it includes."""
    used = [int(np.count_nonzero(entry.reached)) for entry in matched]
    left_out = [entry.x.size - count for entry, count in zip(matched, used, strict=True)]
    compared = [entry.headers[1] for entry in matched]
    return {
        "y": compared[0] if len(compared) == 1 else compared,
        "case": one_or_list([entry.case for entry in matched]),
        "points": one_or_list(used),
        **({"points_left_out": one_or_list(left_out)} if any(left_out) else {}),
        "rms_error": one_or_list([entry.rms_error for entry in matched]),
        "rms_relative_error": one_or_list([entry.rms_relative_error for entry in matched]),
    }


def match(
    comparison: CompareSection,
    columns: Mapping[str, Floats],
    inputs: Inputs,
    fine: Fine,
    key: str = "compare[0]",
    specimen: Specimen | None = None,
) -> Match:
    """The measured points of `comparison`, at the `key` of the recipe, with the model of its case, whose `columns` (times,) are by
    header.

    `specimen` is that of the recipe, for a comparison that states none.

    The model is evaluated at the measured points, so that the misfit does not depend on the rows of the table.

    Raises `InputError` if columns are missing, if the simulation reaches no point, or if x reverses more than once.
    """
    for axis, header in (("x", comparison.x), ("y", comparison.y)):
        if header not in columns:
            raise InputError(f'"{header}" is no column of the result; there are {", ".join(columns)}', key=f"{key}.{axis}")
    x, y = read_points(comparison, inputs, specimen)
    simulated = fine(np.unique(x[x >= 0]) if comparison.x == "time [s]" else None)
    model = interpolated(comparison, x, simulated[comparison.x], simulated[comparison.y])
    missed = int(np.count_nonzero(np.isnan(model)))
    if missed == x.size:
        raise InputError(
            f"the simulation reaches none of the {x.size} points, {comparison.x} from {x.min():g} to {x.max():g}",
            file=comparison.file,
        )
    if missed:
        warn(f"the simulation does not reach {missed} of {x.size} points; they are left out of the misfit", file=comparison.file)
    return Match(comparison.label or _label(comparison), comparison.case, (comparison.x, comparison.y), x, y, model)


def read_points(comparison: CompareSection, inputs: Inputs, specimen: Specimen | None = None) -> tuple[Floats, Floats]:
    """The measured x and y (n,) of a comparison in SI: extension and force as stretch and nominal stress, with the specimen of the
    comparison or else `specimen`.

    Raises `InputError` naming the file and the line, the column or the values of `where`.
    """
    table = read_measured(inputs.read(comparison.file), comparison.file, comparison.text_format(), comparison.units)
    # of measured photographs those without the electrode have no numbers, and those of doubt none to rely on
    of_photographs = all(map(table.has, ("state", "centre_x", "relative_stretch_1")))
    where = {"state": "ok", **comparison.where} if of_photographs else comparison.where
    rows, specimen = table.rows_where(where), comparison.specimen or specimen

    def values_of(axis: str, header: str, column: str | None) -> Floats:
        name, unit = split_header(header)
        quantity = QUANTITIES.get(header)
        chosen: str | int = column or name
        if quantity == "time" and column is None:
            chosen = comparison.columns.time or name
        elif quantity in MACHINE:
            stated = bool(MEASURED_AS[header] & comparison.columns.by_role.keys())
            if stated or (column is None and not table.has(name) and any(map(table.has, KNOWN_AS[quantity]))):
                role, chosen = role_in(table, quantity, comparison.columns)
            else:
                # the unit tells an extension from a stretch, and a force from a stress
                stated_unit = table.units[_place(table, chosen, axis, column)] or (table.stated_units or {}).get(axis)
                raw, dimension = MACHINE[quantity]
                role = raw if stated_unit is not None and units.kind_of(stated_unit) is dimension else quantity
            if role != quantity:
                return read_as(table, role, chosen, specimen, rows, axis)
        place = _place(table, chosen, axis, column)
        dimension = DIMENSIONS.get(unit or "1", units.NUMBER)
        if header == AREA_STRAIN:
            lengths = f'compare it with "{LENGTHWAYS[2]} [1]"'
            return read_extent(table, place, header, dimension, rows, of_length=lengths, key=axis)
        if name not in LENGTHWAYS:
            return table.column(place + 1, axis, dimension, rows)
        areas = f'compare it with "{AREA_STRAIN}", which is A/A0 - 1'
        values = read_extent(table, place, header, dimension, rows, of_area=areas, key=axis)
        warn_of_measured_stretch(table.names[place], values, comparison.file)
        return values

    x = values_of("x", comparison.x, comparison.x_column)
    y = values_of("y", comparison.y, comparison.y_column)
    if comparison.y == AREA_STRAIN and split_header(comparison.x)[0] == "voltage":
        strain = _place(table, comparison.y_column or split_header(AREA_STRAIN)[0], "y", comparison.y_column)
        check_area_strain(x, y, table.names[strain], comparison.file)
    return x, y


def _place(table: MeasuredTable, chosen: str | int, axis: str, column: str | None) -> int:
    """The index of the `chosen` column; if a recipe states no `column` for the axis, a missing one names the key that does."""
    try:
        return table.find(chosen, axis)
    except InputError as error:
        raise (error if column is not None else error.adding(f": state {axis}_column")) from None


def _label(comparison: CompareSection) -> str:
    chosen = ", ".join(f"{name} {value}" for name, value in comparison.where.items())
    return f"measured, {Path(comparison.file).name}" + (f", {chosen}" if chosen else "")


def interpolated(comparison: CompareSection, x: Floats, model_x: Floats, model_y: Floats) -> Floats:
    """`model_y` at `x`, NaN outside; a model that reverses once, as in loading and unloading, is matched branch by branch."""
    if not model_x.size:
        return np.full(x.size, np.nan)
    turns, measured_turns = _turns(model_x), _turns(x)
    if turns > 1 or measured_turns > turns:
        which, file = ("the simulation", None) if turns > 1 else ("the measured x", comparison.file)
        advice = "choose one curve (where)" if not comparison.where else "choose one curve (by more columns in where)"
        if comparison.x != "time [s]":
            advice += ", or compare over time"
        raise InputError(f"{which} reverses {max(turns, measured_turns)} times: {advice}", file=file)
    if not turns:
        return _one_way(x, model_x, model_y)
    rising = model_x[int(np.argmax(np.abs(model_x - model_x[0])))] > model_x[0]
    turn, measured_turn = (int(np.argmax(values) if rising else np.argmin(values)) for values in (model_x, x))
    first = _one_way(x[: measured_turn + 1], model_x[: turn + 1], model_y[: turn + 1])
    return np.concatenate([first, _one_way(x[measured_turn + 1 :], model_x[turn:], model_y[turn:])])


def _turns(x: Floats) -> int:
    """Number of reversals of x by more than noise, 2 % of its range."""
    return len(extremes(x, 0.02 * float(np.ptp(x)))) - 1


def _one_way(x: Floats, model_x: Floats, model_y: Floats) -> Floats:
    order = np.argsort(model_x, kind="stable")
    return np.interp(x, model_x[order], model_y[order], left=np.nan, right=np.nan)
