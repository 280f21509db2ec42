"""Measured points beside a simulated curve, and how far apart they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, warn
from dielast.files import Inputs
from dielast.measured import MeasuredTable, read_measured
from dielast.plausible import doubt_measured_stretch
from dielast.recipe.simulation import Comparison
from dielast.table import split_header
from dielast.units import FIELD, LENGTH, NUMBER, STRESS, TIME, VOLTAGE

Array = NDArray[np.float64]
DIMENSIONS = {dimension.unit: dimension for dimension in (TIME, STRESS, VOLTAGE, FIELD, LENGTH, NUMBER)}


Fine = Callable[[Array | None], Mapping[str, Array]]
"""A case's columns at these times in s, or without times closely enough to draw straight lines between them."""


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Measured points `x`, `y` (n,) of one case in SI, and the `model` (n,) at the same x, NaN where it does not reach."""

    label: str
    case: int
    headers: tuple[str, str]
    x: Array
    y: Array
    model: Array

    @property
    def used(self) -> int:
        """How many of the points the model reaches: those that the misfit is about."""
        return int(np.count_nonzero(np.isfinite(self.model)))

    @property
    def rms_error(self) -> float:
        """Root mean square of model - y, in the unit of y."""
        return float(np.sqrt(np.nanmean((self.model - self.y) ** 2)))

    @property
    def rms_relative_error(self) -> float:
        """The same over the root mean square of y."""
        reached = np.isfinite(self.model)
        level = float(np.sqrt(np.mean(self.y[reached] ** 2)))
        return self.rms_error / level if level > 0 else np.nan


def match(comparison: Comparison, columns: Mapping[str, Array], inputs: Inputs, fine: Fine, key: str = "compare[0]") -> Match:
    """The measured points of `comparison`, the recipe's `key`, beside its case, whose result has the `columns` (times,) by header.

    The model is evaluated anew where it was measured, so that the misfit does not depend on the rows of the table.

    Raises `InputError` if columns are missing, if the simulation reaches none of the points, or if x runs to and fro.
    """
    for axis, header in (("x", comparison.x), ("y", comparison.y)):
        if header not in columns:
            raise InputError(f'{key}.{axis}: "{header}" is no column of the result; there are {", ".join(columns)}')
    x, y = read_points(comparison, inputs)
    found = fine(measured_times(x) if comparison.x == "time [s]" else None)
    model = _interpolate(comparison, x, found[comparison.x], found[comparison.y])
    missed = int(np.count_nonzero(np.isnan(model)))
    if missed == x.size:
        raise InputError(
            f"{comparison.file}: the simulation reaches none of the {x.size} points, {comparison.x} from {x.min():g} to {x.max():g}"
        )
    if missed:
        warn(f"{comparison.file}: the simulation does not reach {missed} of {x.size} points; they are left out of the misfit")
    return Match(comparison.label or _label(comparison), comparison.case, (comparison.x, comparison.y), x, y, model)


def read_points(comparison: Comparison, inputs: Inputs) -> tuple[Array, Array]:
    """The measured x and y (n,) of a comparison in SI; raises `InputError` naming file and line, column or what `where` misses."""
    table = read_measured(inputs.read(comparison.file), comparison.file, comparison.text_format(), comparison.units)
    rows = _rows(table, comparison)
    found = []
    for role, header, own in (("x", comparison.x, comparison.x_column), ("y", comparison.y, comparison.y_column)):
        name, unit = split_header(header)
        found.append(table.column(own or name, role, DIMENSIONS.get(unit or "1", NUMBER), rows))
        if "stretch" in name:
            doubt_measured_stretch(table.names[table.find(own or name, role)], found[-1], comparison.file)
    return found[0], found[1]


def _label(comparison: Comparison) -> str:
    chosen = ", ".join(f"{name} {value}" for name, value in comparison.where.items())
    return f"measured, {Path(comparison.file).name}" + (f", {chosen}" if chosen else "")


def measured_times(x: Array) -> Array:
    """The times that a simulation can be asked for."""
    return np.unique(x[x >= 0])


def _rows(table: MeasuredTable, comparison: Comparison) -> NDArray[np.bool_]:
    """The rows that `where` selects."""
    keep = np.ones(table.lines.size, dtype=bool)
    for name, value in comparison.where.items():
        keep &= table.equals(name, value)
    if not keep.any():
        raise InputError(
            f"{comparison.file}: no row has {', '.join(f'{name} = {value}' for name, value in comparison.where.items())}"
        )
    return keep


def _interpolate(comparison: Comparison, x: Array, model_x: Array, model_y: Array) -> Array:
    """`model_y` at `x`, NaN outside; a model that turns back once, as in loading and unloading, is matched branch by branch."""
    if not model_x.size:
        return np.full(x.size, np.nan)
    turns, own_turns = _turns(model_x), _turns(x)
    if turns > 1 or own_turns > turns:
        which = "the simulation" if turns > 1 else f"{comparison.file}: the measured x"
        advice = "choose one curve (where)" if not comparison.where else "choose one curve (by more columns in where)"
        if comparison.x != "time [s]":
            advice += ", or compare over time"
        raise InputError(f"{which} runs to and fro {max(turns, own_turns)} times: {advice}")
    if not turns:
        return _one_way(x, model_x, model_y)
    rising = model_x[int(np.argmax(np.abs(model_x - model_x[0])))] > model_x[0]
    turn, own = (int(np.argmax(values) if rising else np.argmin(values)) for values in (model_x, x))
    first = _one_way(x[: own + 1], model_x[: turn + 1], model_y[: turn + 1])
    return np.concatenate([first, _one_way(x[own + 1 :], model_x[turn:], model_y[turn:])])


def _turns(x: Array) -> int:
    """How often x turns back by more than noise, 2 % of its range."""
    least = 0.02 * float(np.ptp(x))
    count, direction, extreme = 0, 0, float(x[0])
    for value in x.tolist():
        if direction * (value - extreme) > 0 or (direction == 0 and abs(value - extreme) > least):
            direction, extreme = direction or int(np.sign(value - extreme)), value
        elif direction * (extreme - value) > least:
            count, direction, extreme = count + 1, -direction, value
    return count


def _one_way(x: Array, model_x: Array, model_y: Array) -> Array:
    order = np.argsort(model_x, kind="stable")
    return np.interp(x, model_x[order], model_y[order], left=np.nan, right=np.nan)
