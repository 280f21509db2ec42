"""The draws of a master curve, in the folder that `mastercurve` wrote."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, located
from dielast.handover.mastercurve_folder import ReducedCurve
from dielast.handover.tables import finite_columns
from dielast.io.files import Inputs
from dielast.io.toml import parse_toml
from dielast.material.shift import ShiftLaw
from dielast.numerics.arrays import Floats as Array

DRAWS, LAWS, CURVES = "draws.csv", "draw-laws.csv", "draw-curves.csv"


@dataclass(frozen=True, slots=True, eq=False)
class ReadDraws:
    """Draws of a master curve as read: `number` (draws,), their smooth curves, `ordinates` (draws, c, k) over one `abscissa` (k,),
    and their shift laws.
    """

    number: NDArray[np.int64]
    abscissa: Array
    ordinates: Array
    shifts: tuple[ShiftLaw, ...]


def read_curve_draws(folder: str, curve: ReducedCurve, inputs: Inputs) -> ReadDraws | None:
    """The draws in the folder of the master curve `curve`; None if its summary has no section on uncertainty."""
    name = f"{folder}/summary.toml"
    if "uncertainty" not in parse_toml(inputs.read(name), name):
        return None
    name = f"{folder}/{LAWS}"
    headers = curve.shift.drawn_headers()
    number, *constants = finite_columns(inputs.read(name), name, ["draw", *headers])
    for row in np.flatnonzero(number != np.floor(number))[:1]:
        raise InputError(f'column "draw": {number[row]:g} is not a whole number', file=name, row=row + 2)
    rows = np.array(constants).reshape(len(headers), number.size).T
    if number.size < 2:
        raise InputError(f"{number.size} draws: at least 2 are needed", file=name)
    shifts = []
    for row, constants_of_draw in enumerate(rows.tolist()):
        with located(file=name, row=row + 2):
            shifts.append(curve.shift.redrawn(constants_of_draw))
    name = f"{folder}/{CURVES}"
    abscissa, unit = curve.kind.reduced_abscissa
    headers = [
        f"{abscissa} [{unit}]",
        *(f"{ordinate}_{int(k)} [{unit}]" for ordinate, unit in curve.kind.ordinates for k in number),
    ]
    columns = finite_columns(inputs.read(name), name, headers, positive=True)
    first, values = columns[0], columns[1:].reshape(len(curve.kind.ordinates), number.size, -1)
    for row in np.flatnonzero(np.diff(first) <= 0)[:1]:
        raise InputError(f'column "{headers[0]}": {first[row + 1]:g} is not above {first[row]:g}', file=name, row=row + 3)
    if not first.size:
        raise InputError("no rows: a folder written by mastercurve is needed", file=name)
    return ReadDraws(number.astype(np.int64), first, np.moveaxis(values, 1, 0), tuple(shifts))
