"""Measured points beside a simulated curve, and how far apart they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, warn
from dielast.files import Inputs
from dielast.measured import MeasuredTable, read_measured
from dielast.recipe.simulation import Comparison
from dielast.table import split_header
from dielast.units import FIELD, LENGTH, NUMBER, STRESS, TIME, VOLTAGE

Array = NDArray[np.float64]
DIMENSIONS = {dimension.unit: dimension for dimension in (TIME, STRESS, VOLTAGE, FIELD, LENGTH, NUMBER)}


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Measured points `x`, `y` (n,) of one case in SI, and the `model` (n,) at the same x, NaN where it does not reach."""

    label: str
    case: int
    x: Array
    y: Array
    model: Array

    @property
    def rms_error(self) -> float:
        """Root mean square of model - y, in the unit of y."""
        return float(np.sqrt(np.nanmean((self.model - self.y) ** 2)))

    @property
    def rms_relative_error(self) -> float:
        """The same over the root mean square of y."""
        reached = np.isfinite(self.model)
        return self.rms_error / float(np.sqrt(np.mean(self.y[reached] ** 2)))


def match(comparison: Comparison, columns: Mapping[str, Array], inputs: Inputs) -> Match:
    """The measured points of `comparison` beside the result's `columns` (times,) by header, those of its case.

    Raises `InputError` if columns are missing, if the simulation reaches none of the points, or if x runs to and fro.
    """
    for header in (comparison.x, comparison.y):
        if header not in columns:
            raise InputError(f'compare: "{header}" is no column of the result; there are {", ".join(columns)}')
    table = read_measured(inputs.read(comparison.file), comparison.file, comparison.text_format(), comparison.units)
    rows = _rows(table, comparison)
    x, y = (
        table.column(own or split_header(header)[0], role, DIMENSIONS[split_header(header)[1] or "1"], rows)
        for role, header, own in (("x", comparison.x, comparison.x_column), ("y", comparison.y, comparison.y_column))
    )
    model = _interpolate(x, columns[comparison.x], columns[comparison.y], logarithmic=comparison.x == "time [s]")
    missed = int(np.count_nonzero(np.isnan(model)))
    if missed == x.size:
        raise InputError(
            f"{comparison.file}: the simulation reaches none of the {x.size} points, {comparison.x} from {x.min():g} to {x.max():g}"
        )
    if missed:
        warn(f"{comparison.file}: the simulation does not reach {missed} of {x.size} points; they are left out of the misfit")
    return Match(comparison.label or f"measured, {comparison.file}", comparison.case, x, y, model)


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


def _interpolate(x: Array, model_x: Array, model_y: Array, logarithmic: bool) -> Array:
    """`model_y` at `x`, NaN outside; a model that turns back once, as in loading and unloading, is matched branch by branch."""
    if logarithmic:
        # equal ratios of time are equal distances; time 0 is out of reach
        positive = model_x > 0
        model_x, model_y = np.log(model_x[positive]), model_y[positive]
        x = np.log(np.where(x > 0, x, np.nan))
    direction = np.sign(np.diff(model_x))
    turns = np.flatnonzero(np.diff(direction[direction != 0]))
    if turns.size > 1:
        raise InputError("compare: x runs to and fro more than once; compare over time")
    if not turns.size:
        return _one_way(x, model_x, model_y)
    turn, own = (int(np.argmax(values) if direction[direction != 0][0] > 0 else np.argmin(values)) for values in (model_x, x))
    first = _one_way(x[: own + 1], model_x[: turn + 1], model_y[: turn + 1])
    return np.concatenate([first, _one_way(x[own + 1 :], model_x[turn:], model_y[turn:])])


def _one_way(x: Array, model_x: Array, model_y: Array) -> Array:
    order = np.argsort(model_x, kind="stable")
    return np.interp(x, model_x[order], model_y[order], left=np.nan, right=np.nan)
