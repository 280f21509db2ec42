"""Extension and force on a specimen, as a testing machine measures them, converted to strain, stretch and nominal stress."""

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, as_toml, located
from dielast.base.units import FORCE, LARGEST, LENGTH, MASS, STIFFNESS, STRAIN, STRESS, TORQUE, kind_of
from dielast.io.text_table import MeasuredTable
from dielast.material.checks import USUAL
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
    """The role in which a table holds a `quantity`, "stretch" or "stress", and its column.

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
        there = ", ".join(f'"{name}"' for name in table.names)
        keys = f"columns.{', columns.'.join(roles[:-1])} or columns.{roles[-1]}"
        raise table.error(f"no column is called {', '.join(roles[:-1])} or {roles[-1]}; there are {there}: state {keys}")
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
