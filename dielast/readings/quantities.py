"""Columns read as what they mean: extension and force on a specimen as strain, stretch and nominal stress, and lengths and areas
of an actuated film, as their headers and their numbers say.
"""

import re

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, as_toml, listed, located
from dielast.base.units import FORCE, LARGEST, LENGTH, MASS, NUMBER, STIFFNESS, STRAIN, STRESS, TORQUE, Dimension, kind_of
from dielast.io.text_table import MeasuredTable
from dielast.material.checks import USUAL
from dielast.numerics.arrays import Flags, Floats
from dielast.readings.columns_recipe import GAUGE, ROLES, SECTION, MachineColumns, Specimen, unmeasured


def strain_of(extension: NDArray[np.float64], specimen: Specimen | None) -> NDArray[np.float64]:
    """Nominal strain (n,) from an extension (n,) in m, by the gauge length; raises `InputError` if that is not stated."""
    if specimen is None or specimen.gauge_length is None:
        raise InputError(str(unmeasured(("extension",), specimen)))
    with located(argument="specimen"):
        USUAL["gauge length"].warn(specimen.gauge_length)
    return extension / specimen.gauge_length


def nominal_stress(force: NDArray[np.float64], specimen: Specimen | None) -> NDArray[np.float64]:
    """Nominal stress (n,) in Pa from a force (n,) in N, by the undeformed section; raises `InputError` if that is not stated."""
    if specimen is None or specimen.area is None:
        raise InputError(str(unmeasured(("force",), specimen)))
    with located(argument="specimen"):
        for usual, length in (("width", specimen.width), ("specimen", specimen.thickness)):
            USUAL[usual].warn([] if length is None else [length])
    return force / specimen.area


def role_in(table: MeasuredTable, quantity: str, columns: MachineColumns | None) -> tuple[str, str | int]:
    """The role in which a table holds a `quantity`, one of `KNOWN_AS`, and its column.

    The column is that which `columns` of the recipe name, or the first with a usual name. Raises `InputError` with the file if
    there is none, or if `columns` name several.
    """
    role_of = KNOWN_AS[quantity]
    by_role = {} if columns is None else columns.by_role
    stated = [role for role in dict.fromkeys(role_of.values()) if role in by_role]
    if len(stated) > 1:
        raise table.error(f"columns.{' and columns.'.join(stated)} are the same quantity: one of them is needed")
    if stated:
        return stated[0], by_role[stated[0]]
    name = next((name for name in role_of if table.has(name)), None)
    if name is None:
        roles = list(dict.fromkeys(role_of.values()))
        keys = listed(f"columns.{role}" for role in roles)
        raise table.error(f"no column is called {listed(roles)}; there are {table.quoted_names}: state {keys}")
    return role_of[name], name


def read_as(
    table: MeasuredTable,
    role: str,
    column: str | int,
    specimen: Specimen | None,
    rows: NDArray[np.bool_] | None = None,
    key: str | None = None,
) -> NDArray[np.float64]:
    """The stretch (1) or nominal stress (Pa) from a `column` of a `role`, such as an extension, shape (rows,).

    `key` is the role under which the recipe states the unit of the column. Raises `InputError` with the file for a wrong unit, or
    if the specimen lacks what the role needs.
    """
    if lacking := unmeasured((role,), specimen):
        raise table.error(f'column "{table.names[table.find(column, role)]}": {lacking}')
    table = table if rows is None else table.only(rows)
    values = table.column(column, key or role, ROLES[role])
    with np.errstate(over="ignore"):
        if role in ("strain", "extension"):
            values = 1 + (strain_of(values, specimen) if role == "extension" else values)
        elif role == "force":
            values = nominal_stress(values, specimen)
    for row in np.flatnonzero(~(np.abs(values) <= LARGEST))[:1]:
        raise table.error(f"the {role} is too large a number for its specimen", row)
    return values


# the role of a column by its name: names that users choose, then those in results of dielast
KNOWN_AS = {
    "stretch": {name: name for name in ("stretch", "strain", "extension")} | {"stretch_1": "stretch"},
    "stress": {"force": "force", "stress": "stress", "nominal_stress": "stress", "nominal_stress_1": "stress"},
    "actuation": {f"{name}{axis}": name for name in ("stretch", "relative_stretch", "area_strain") for axis in ("", "_1")},
}


def mistaken(table: MeasuredTable, column: str | int, role: str) -> str | None:
    """What to write instead if the unit of a column is clearly that of another quantity than its `role`, such as a force for a
    stress; None if the unit does not show it.
    """
    try:
        index = table.find(column, role)
    except InputError:
        return None
    unit = table.units[index] or (table.stated_units or {}).get(role)
    kind = kind_of(unit) if unit is not None else None
    if kind is None:
        return None
    instead = _INSTEAD.get((role, kind.unit))
    if instead is None:
        return None
    article = "an" if role == "extension" else "a"
    return f'column "{table.names[index]}" [{unit}] is {kind.name}, not {article} {role}: {instead.format(column=as_toml(column))}'


def _columns(role: str, needed: str) -> str:
    return f"state columns.{role} = {{column}} instead, and specimen = {{{{ {needed} }}}}"


_BY_GEOMETRY = "export the stress, or a modulus, which takes the geometry that the rheometer knows"
_INSTEAD: dict[tuple[str, str], str] = {
    ("stress", FORCE.unit): _columns("force", SECTION),
    ("strain", LENGTH.unit): _columns("extension", GAUGE),
    ("force", STRESS.unit): "state columns.stress = {column} instead",
    ("extension", STRAIN.unit): "state columns.strain = {column} instead",
    ("modulus", FORCE.unit): f"with a strain, {_columns('force', SECTION)}",
    ("stress", TORQUE.unit): _BY_GEOMETRY,
    ("force", TORQUE.unit): _BY_GEOMETRY,
    ("modulus", TORQUE.unit): _BY_GEOMETRY,
    ("modulus", STIFFNESS.unit): "state columns.extension and columns.force, and the specimen",
    ("stress", MASS.unit): "a force is needed, mass times 9.81 m/s^2",
    ("force", MASS.unit): "a force in N is needed, mass times 9.81 m/s^2 (or is it kgf?)",
}


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
