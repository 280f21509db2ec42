"""Columns of lengths and of areas of an actuated film, as their headers say and as their numbers say."""

import re

import numpy as np

from dielast.base.errors import InputError
from dielast.base.units import NUMBER, Dimension
from dielast.io.text_table import MeasuredTable
from dielast.numerics.arrays import Flags, Floats

_AREA_RATIO = re.compile(r"A\s*/\s*A_?[0₀]|area[ _](?:ratio|stretch).*", re.IGNORECASE)
_AREA_STRAIN = re.compile(r"are(?:a|al)[ _]+(?:actuation[ _]+)?strain.*", re.IGNORECASE)
_LENGTH = re.compile(
    r"(?P<one>[LDR])\s*/\s*(?P=one)_?[0₀].*"
    r"|(?:(?:linear|relative|radial)[ _]?)?(?:stretch|lambda|λ)(?:[ _]?[12xyr])?(?:\s*[\[(].*)?"
    r"|(?:linear|radial)[ _]?(?:actuation[ _])?strain.*",
    re.IGNORECASE,
)


def read_extent(
    table: MeasuredTable,
    place: int,
    role: str,
    dimension: Dimension,
    rows: Flags,
    *,
    of_area: str = "",
    of_length: str = "",
    key: str | None = None,
) -> Floats:
    """The column at index `place` for a `role` that is an area strain, or a length over a length, shape (rows,).

    One of `of_area` and `of_length` says what to write for a column of the other kind: the former for a role that is a length, the
    latter for an area strain, which a column of A/A0 gives as well. `key` is the role under which the recipe states the unit of the
    column. Raises `InputError` with the file if the header says that the column is of the other kind.
    """
    found = table.headers[place]
    spelled = found.spelled.strip() or found.text
    ratio = any(map(_AREA_RATIO.fullmatch, (spelled, found.name)))
    areal, lengthways = ratio or bool(_AREA_STRAIN.fullmatch(spelled)), bool(_LENGTH.fullmatch(spelled))
    if of_area and areal:
        raise table.error(f'column "{spelled}" holds areas, and {role} is a length over a length: {of_area}')
    if of_length and lengthways:
        raise table.error(f'column "{spelled}" holds lengths, and {role} is A/A0 - 1, with the areas A: {of_length}')
    values = table.column(place + 1, key or role, NUMBER if ratio else dimension, rows)
    return values - 1 if ratio and of_length else values


def check_area_strain(voltage: Floats, strain: Floats, name: str, file: str) -> None:
    """Raise `InputError` with the file if area strains (rows,), in a column of this name, are ratios: nearer to 1 than to 0 both at
    the lowest of the voltages (rows,) and at 0 V, to where they lead.

    Small strains grow with the square of the voltage (Pelrine, Kornbluh and Joseph, Sensors and Actuators A 64 (1998) 77), so that
    a line over the square leads to the strain at 0 V. Without voltages below a third of the largest it would lead too far: a large
    strain may then be real.
    """
    size = np.abs(voltage)
    if not strain.size or not size.min() < size.max() / 3:
        return
    begins = float(strain[size.argmin()])
    # strains that rise steeply and level off lead to a line above all of them
    if min(begins, np.polyfit((size / size.max()) ** 2, strain, 1)[1]) > 0.5:
        wrong = f'column "{name}" is {begins:g} at the lowest voltage, and an area strain A/A0 - 1 begins near 0'
        raise InputError(f'{wrong}: call a column of ratios "A/A0"', file=file)
