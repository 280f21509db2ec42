"""Master curves as `spectrum` reads them: a folder that `mastercurve` wrote, or a table from elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.spectrum import Test
from dielast.errors import InputError
from dielast.files import Inputs
from dielast.measured import MeasuredTable, read_measured
from dielast.plausible import doubt_tension
from dielast.recipe.measurements import MECHANICAL
from dielast.recipe.spectrum import ROLES, CurveData
from dielast.recipe.toml import parse_toml
from dielast.shift import WLF, Arrhenius, NoShift, ShiftLaw, ShiftTable
from dielast.table import number_columns

Array = NDArray[np.float64]

# the columns of mastercurve.csv that are fitted, the abscissa first
FITTED: dict[str, list[str]] = {
    "relaxation": ["reduced_time [s]", "relaxation_modulus [Pa]"],
    "oscillation": ["reduced_angular_frequency [rad/s]", "storage_modulus [Pa]", "loss_modulus [Pa]"],
    "creep": ["reduced_time [s]", "creep_compliance [1/Pa]"],
}


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A master curve to be fitted: its `test`, the shift law, and `columns` (n,) with the abscissa first.

    Young's relaxation modulus (Pa) or tensile creep compliance (1/Pa) over reduced time (s), or Young's storage and loss modulus
    over reduced angular frequency (rad/s). `measured_temperature` (degC) is the range it was measured in, if that is known.
    """

    test: Test
    columns: tuple[Array, ...]
    shift: ShiftLaw
    measured_temperature: tuple[float, float] | None = None


def read_master_curve(folder: str, inputs: Inputs) -> Curve:
    """The master curve in a folder that `mastercurve` wrote; raises `InputError` if it is not one."""
    name = f"{folder}/summary.toml"
    summary = parse_toml(inputs.read(name), name)
    if summary.get("kind") != "mastercurve":
        raise InputError(f'{name}: kind: "{summary.get("kind")}": a folder written by mastercurve is needed')
    try:
        test = summary.get("data", {}).get("measurement", "relaxation")
        if test not in FITTED:
            raise ValueError(f'[data] measurement is "{test}"')
        law = _shift_law(summary, folder, inputs)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{folder}/summary.toml: {error}: a folder written by mastercurve is needed") from None
    name = f"{folder}/mastercurve.csv"
    temperature, *columns = number_columns(inputs.read(name), name, ["temperature [degC]", *FITTED[test]])
    for row in np.flatnonzero(~np.all(np.isfinite([temperature, *columns]), axis=0))[:1]:
        raise InputError(f"{name}: row {row + 2}: an empty cell")
    if not temperature.size:
        raise InputError(f"{name}: no rows: a folder written by mastercurve is needed")
    return Curve(test, tuple(columns), law, (float(temperature.min()), float(temperature.max())))


def _shift_law(summary: Mapping[str, Any], folder: str, inputs: Inputs) -> ShiftLaw:
    shift = summary["shift"]
    constants = [value for value in shift.values() if isinstance(value, float)]
    if not all(map(math.isfinite, constants)):
        raise ValueError("[shift] has a constant that is not finite")
    reference = float(shift["reference_temperature_degC"])
    if shift["law"] == "wlf":
        return WLF(reference, float(shift["C1"]), float(shift["C2_K"]))
    if shift["law"] == "arrhenius":
        return Arrhenius(reference, float(shift["activation_energy_J_per_mol"]))
    name = f"{folder}/shift-factors.csv"
    temperature, factor = number_columns(inputs.read(name), name, ["temperature [degC]", "log10_shift_factor [1]"])
    for row in np.flatnonzero(~np.isfinite(temperature))[:1]:
        raise InputError(f'{name}: row {row + 2}: column "temperature [degC]": a number is needed')
    known = dict(zip(temperature.tolist(), factor.tolist(), strict=True)) | {reference: 0.0}
    rows = sorted((own, value) for own, value in known.items() if math.isfinite(value))
    return ShiftTable(reference, *zip(*rows, strict=True))


def read_curve(data: CurveData | None, inputs: Inputs) -> Curve:
    """A master curve from elsewhere, without a shift law; raises `InputError` naming file and line or column."""
    assert data is not None
    table = read_measured(inputs.read(data.file), data.file, data.text_format(), data.units)
    youngs = 3.0 if data.test == "shear" else 1.0
    if "test" not in data.model_fields_set:
        named = [(role, getattr(data.columns, role, None)) for role in MECHANICAL]
        doubt_tension([table.names[table.find(column, role)] for role, column in named if column is not None], data.file)
    columns, shift = data.columns, NoShift(data.reference_temperature)
    if columns.measurement == "oscillation":
        hertz = columns.frequency is not None
        frequency = _column(table, data, "frequency") * 2 * math.pi if hertz else _column(table, data, "angular_frequency")
        storage = _column(table, data, "storage")
        loss = _column(table, data, "loss") if columns.tan_delta is None else storage * _column(table, data, "tan_delta")
        return Curve("oscillation", (frequency, storage * youngs, loss * youngs), shift)
    time = _column(table, data, "time")
    if columns.measurement == "creep":
        return Curve("creep", (time, _column(table, data, "compliance") / youngs), shift)
    return Curve("relaxation", (time, _column(table, data, "modulus") * youngs), shift)


def _column(table: MeasuredTable, data: CurveData, role: str) -> Array:
    """A column in its role's unit, by default called by the role."""
    return table.column(getattr(data.columns, role) or role, role, ROLES[role])
