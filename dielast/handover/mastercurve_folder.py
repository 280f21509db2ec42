"""Curves as `spectrum` reads them: a folder that `mastercurve` wrote, a test at one temperature, a master curve from elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, warn
from dielast.io.files import Inputs
from dielast.io.table import number_columns
from dielast.material.measurement_kind import KINDS, MeasurementKind
from dielast.material.shift import SHIFTS, NoShift, ShiftLaw
from dielast.readings.curve_recipe import CurveData
from dielast.recipe.toml import parse_toml

Array = NDArray[np.float64]
NO_SCATTER = 1.25  # times as large a value at the same time is no scatter of one test


@dataclass(frozen=True, slots=True, eq=False)
class ReducedCurve:
    """A master curve to be fitted: its `kind`, the shift law, and `columns` (n,) with the abscissa first.

    Young's relaxation modulus (Pa) or tensile creep compliance (1/Pa) over reduced time (s), or Young's storage and loss modulus
    over reduced angular frequency (rad/s). `measured_temperature` (degC) is the range it was measured in, if that is known, `data`
    what the summary says of an instrument's export.
    """

    kind: MeasurementKind
    columns: tuple[Array, ...]
    shift: ShiftLaw
    measured_temperature: tuple[float, float] | None = None
    data: Mapping[str, Any] | None = None


def read_master_curve(folder: str, inputs: Inputs) -> ReducedCurve:
    """The master curve in a folder that `mastercurve` wrote; raises `InputError` if it is not one."""
    name = f"{folder}/summary.toml"
    summary = parse_toml(inputs.read(name), name)
    if summary.get("kind") != "mastercurve":
        raise InputError(f'{name}: kind: "{summary.get("kind")}": a folder written by mastercurve is needed')
    try:
        measurement = summary.get("data", {}).get("measurement", "relaxation")
        if measurement not in KINDS:
            raise ValueError(f'[data] measurement is "{measurement}"')
        law = _shift_law(summary, folder, inputs)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{folder}/summary.toml: {error}: a folder written by mastercurve is needed") from None
    name, kind = f"{folder}/mastercurve.csv", KINDS[measurement]
    headers = [f"{column} [{unit}]" for column, unit in (kind.reduced_abscissa, *kind.ordinates)]
    temperature, *columns = number_columns(inputs.read(name), name, ["temperature [degC]", *headers])
    for row in np.flatnonzero(~np.all(np.isfinite([temperature, *columns]), axis=0))[:1]:
        raise InputError(f"{name}: row {row + 2}: an empty cell")
    if not temperature.size:
        raise InputError(f"{name}: no rows: a folder written by mastercurve is needed")
    return ReducedCurve(kind, tuple(columns), law, (float(temperature.min()), float(temperature.max())))


def _shift_law(summary: Mapping[str, Any], folder: str, inputs: Inputs) -> ShiftLaw:
    shift = summary["shift"]
    constants = [value for value in shift.values() if isinstance(value, float)]
    if not all(map(math.isfinite, constants)):
        raise ValueError("[shift] has a constant that is not finite")
    reference = float(shift["reference_temperature_degC"])

    def measured() -> tuple[Array, Array]:
        name = f"{folder}/shift-factors.csv"
        temperature, factor = number_columns(inputs.read(name), name, ["temperature [degC]", "log10_shift_factor [1]"])
        for row in np.flatnonzero(~np.isfinite(temperature))[:1]:
            raise InputError(f'{name}: row {row + 2}: column "temperature [degC]": a number is needed')
        return temperature, factor

    if shift["law"] not in SHIFTS:
        raise ValueError(f'[shift] law is "{shift["law"]}"')
    return SHIFTS[shift["law"]].from_summary(reference, shift, measured)


def read_curve(data: CurveData | None, inputs: Inputs) -> ReducedCurve:
    """A test at one temperature, or a master curve from elsewhere, without a shift law; all runs of it together.

    Raises `InputError` naming file and line, column or step, or if there are several temperatures.
    """
    from dielast.readings.isotherms import WIDEST
    from dielast.readings.read import read_all  # which no master curve's folder needs
    from dielast.readings.steps import TABLE

    assert data is not None
    reading = read_all(data, inputs)
    temperature = [one.temperature for one in reading.measurements]
    if max(temperature) - min(temperature) > data.temperature_tolerance:
        found = f"there are tests from {min(temperature):g} to {max(temperature):g} degC"
        raise InputError(f'{data.file}: {found}, and a spectrum is made of one temperature: "dielast mastercurve" joins several')
    measured, stated = round(math.fsum(temperature) / len(temperature), 6), data.reference_temperature
    if stated is not None and abs(measured - stated) > WIDEST * data.temperature_tolerance:
        raise InputError(
            f"{data.file}: the test was at {measured:g} degC, but reference_temperature is {stated:g} degC: leave one out"
        )
    columns = _positive(np.concatenate([one.columns for one in reading.measurements], axis=1), data.file)
    _warn_of_several(columns, data.file)
    at = measured if stated is None else stated
    exported = set(reading.formats) != {TABLE}  # of a plain table the recipe says it all
    read = {**reading.summary, "temperature_degC": at, "points": int(columns.shape[1])} if exported else None
    return ReducedCurve(reading.kind, tuple(columns), NoShift(at), data=read)


def _warn_of_several(columns: Array, source: str) -> None:
    """Warn of other values at the same times or frequencies: of several tests, perhaps, that are taken for one."""
    order = np.argsort(columns[0], kind="stable")
    x, y = columns[0, order], np.log(columns[1, order])
    starts = np.flatnonzero(np.append(True, np.diff(x) > 0))
    apart = np.exp(np.maximum.reduceat(y, starts) - np.minimum.reduceat(y, starts))
    if np.any(far := apart > NO_SCATTER):
        found = f"{np.count_nonzero(far)} times or frequencies stand there again with values up to {apart.max():.3g} times as large"
        warn(f"{source}: {found}: are these several tests? Leave the rows of one in the file")


def _positive(columns: Array, source: str) -> Array:
    """The points whose ordinates are all positive; of the others, as a noise floor gives them, few enough, it warns."""
    below = np.any(columns[1:] <= 0, axis=0)
    if np.any(below):
        warn(f"{source}: {np.count_nonzero(below)} of {below.size} points are zero or negative (noise floor) and left out")
    return columns[:, ~below]
