"""The folder that `mastercurve` writes, with the draws of the master curve, as `spectrum` reads it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, in_keys, located
from dielast.io.files import Inputs, exists, resolve
from dielast.io.manifest import check_whole
from dielast.io.table import finite_columns, number_columns
from dielast.io.toml import parse_toml
from dielast.material.measurement_kind import KINDS, MeasurementKind
from dielast.material.modulus import CONSTANT_MODULUS, EntropicModulus, ModulusLaw
from dielast.material.shift import SHIFTS, ShiftLaw

DRAWS, LAWS, CURVES = "draws.csv", "draw-laws.csv", "draw-curves.csv"


@dataclass(frozen=True, slots=True, eq=False)
class ReadDraws:
    """Draws of a master curve as read: `number` (draws,), their smooth curves, `ordinates` (draws, c, k) over one `abscissa` (k,),
    and their shift laws.
    """

    number: NDArray[np.int64]
    abscissa: NDArray[np.float64]
    ordinates: NDArray[np.float64]
    shifts: tuple[ShiftLaw, ...]


@dataclass(frozen=True, slots=True, eq=False)
class ReducedCurve:
    """A master curve to be fitted: its `kind`, the shift law, and `columns` (n,) with the abscissa first.

    Young's relaxation modulus (Pa) or tensile creep compliance (1/Pa) over reduced time (s), or Young's storage and loss modulus
    over reduced angular frequency (rad/s). `measured_temperature` (degC) is the range with known shift factors, None if there is
    none. `data` is the section of the summary on an instrument's export. `scaling`: how moduli change with temperature, from the
    vertical shift. `draws` of the curve are None if there are none.
    """

    kind: MeasurementKind
    columns: tuple[NDArray[np.float64], ...]
    shift: ShiftLaw
    measured_temperature: tuple[float, float] | None = None
    data: Mapping[str, Any] | None = None
    scaling: ModulusLaw = CONSTANT_MODULUS
    draws: ReadDraws | None = None


def read_master_curve(folder: str, inputs: Inputs) -> ReducedCurve:
    """The master curve in a folder that `mastercurve` wrote; raises `InputError` if it is not one."""
    name = f"{folder}/summary.toml"
    if not exists(resolve(inputs.folder, name)):
        raise InputError("no such file: mastercurve must be a folder that dielast mastercurve wrote", file=name)
    summary = parse_toml(inputs.read(name), name)
    if summary.get("kind") != "mastercurve":
        raise InputError(f'kind: "{summary.get("kind")}": a folder written by mastercurve is needed', file=name)
    try:
        measurement = summary.get("data", {}).get("measurement", "relaxation")
        if measurement not in KINDS:
            raise ValueError(f'[data] measurement is "{measurement}"')
        law, scaling = _shift_law(summary, folder, inputs), _scaling(summary["shift"], name)
        undetermined = [float(value) for value in summary.get("data", {}).get("undetermined_temperatures_degC", [])]
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{error}: a folder written by mastercurve is needed", file=name) from None
    name, kind = f"{folder}/mastercurve.csv", KINDS[measurement]
    headers = [f"{column} [{unit}]" for column, unit in (kind.reduced_abscissa, *kind.ordinates)]
    temperature, *columns = finite_columns(
        _read_file(summary, folder, "mastercurve.csv", inputs), name, ["temperature [degC]", *headers]
    )
    if not temperature.size:
        raise InputError("no rows: a folder written by mastercurve is needed", file=name)
    known = temperature[~np.any(np.isclose(temperature[:, None], undetermined, rtol=1e-6), axis=1)]
    measured = (float(known.min()), float(known.max())) if known.size else None
    draws = _draws(summary, folder, law, kind, inputs) if "uncertainty" in summary else None
    return ReducedCurve(kind, tuple(columns), law, measured, scaling=scaling, draws=draws)


def _read_file(summary: Mapping[str, Any], folder: str, file: str, inputs: Inputs) -> bytes:
    """A file beside the summary; raises `InputError` if it is not the one that its run wrote."""
    content = inputs.read(f"{folder}/{file}")
    check_whole(folder, summary, {file: content})
    return content


def _scaling(shift: Mapping[str, Any], source: str) -> ModulusLaw:
    """How moduli change with temperature: a vertical shift by density and temperature is that of entropic springs."""
    if shift.get("vertical") != "density-temperature":
        return CONSTANT_MODULUS
    with located(file=source, key="shift.thermal_expansion"):
        return EntropicModulus.from_summary(shift)


def _shift_law(summary: Mapping[str, Any], folder: str, inputs: Inputs) -> ShiftLaw:
    shift = summary["shift"]
    constants = [value for value in shift.values() if isinstance(value, float)]
    if not all(map(math.isfinite, constants)):
        raise ValueError("[shift] has a constant that is not finite")
    reference = float(shift["reference_temperature_degC"])

    def measured() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        name = f"{folder}/shift-factors.csv"
        content = _read_file(summary, folder, "shift-factors.csv", inputs)
        (temperature,) = finite_columns(content, name, ["temperature [degC]"])
        (factor,) = number_columns(content, name, ["log10_shift_factor [1]"])  # empty where the data do not determine it
        return temperature, factor

    if shift["law"] not in SHIFTS:
        raise ValueError(f'[shift] law is "{shift["law"]}"')
    law = SHIFTS[shift["law"]]
    keys = {constant.name: f"shift.{key}" for key, constant in law.summary_names().items()}
    with located(file=f"{folder}/summary.toml"), in_keys(keys):
        read = law.from_summary(reference, shift, measured)
        for constant in law.summary_names().values():
            value = getattr(read, constant.name)
            if not constant.is_allowed(value):  # no material file may state it
                raise InputError(
                    f"{value:g}: a number {constant.bounds} is needed; the shift factors are those of a material that relaxes more "
                    "slowly at higher temperatures: correct the temperatures of the tests, or take "
                    'shift.law = "table" in mastercurve',
                    argument=constant.name,
                )
        return read


def _draws(summary: Mapping[str, Any], folder: str, law: ShiftLaw, kind: MeasurementKind, inputs: Inputs) -> ReadDraws:
    """The draws of the master curve of this `kind`, which has this shift `law`."""
    name, headers = f"{folder}/{LAWS}", law.drawn_headers()
    number, *constants = finite_columns(_read_file(summary, folder, LAWS, inputs), name, ["draw", *headers])
    for row in np.flatnonzero(number != np.floor(number))[:1]:
        raise InputError(f'column "draw": {number[row]:g} is not a whole number', file=name, row=row + 2)
    rows = np.array(constants).reshape(len(headers), number.size).T
    if number.size < 2:
        raise InputError(f"{number.size} draws: at least 2 are needed", file=name)
    shifts = []
    for row, constants_of_draw in enumerate(rows.tolist()):
        with located(file=name, row=row + 2):
            shifts.append(law.redrawn(constants_of_draw))
    name = f"{folder}/{CURVES}"
    abscissa, unit = kind.reduced_abscissa
    headers = [f"{abscissa} [{unit}]", *(f"{ordinate}_{int(k)} [{unit}]" for ordinate, unit in kind.ordinates for k in number)]
    columns = finite_columns(_read_file(summary, folder, CURVES, inputs), name, headers, positive=True)
    first, values = columns[0], columns[1:].reshape(len(kind.ordinates), number.size, -1)
    for row in np.flatnonzero(np.diff(first) <= 0)[:1]:
        raise InputError(f'column "{headers[0]}": {first[row + 1]:g} is not above {first[row]:g}', file=name, row=row + 3)
    if not first.size:
        raise InputError("no rows: a folder written by mastercurve is needed", file=name)
    return ReadDraws(number.astype(np.int64), first, np.moveaxis(values, 1, 0), tuple(shifts))
