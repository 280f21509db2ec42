"""Recipes of `relax`, `creep` and `actuate` that follow given tables and compare with them, and the tables of testing machines."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, as_toml
from dielast.readings.named import celsius, levels_of, temperatures_in_names
from dielast.readings.seen import Given, SeenColumn, SeenFile
from dielast.readings.stated import specimen_of, without_unit
from dielast.recipe.lines import FILL, RecipeLines

STRETCHES, STRESSES = ("stretch", "strain", "extension"), ("stress", "force")
MACHINE = ("time", *STRETCHES, *STRESSES)
_MOST = 100  # curves that are told apart in a table
MATERIAL = "your own: written by dielast spectrum or calibrate"


def machine_columns(seen: SeenFile, more: Iterable[str] = ()) -> dict[str, SeenColumn]:
    """The columns of a testing machine's table by role: time, one for the stretch, one for the stress, and the `more` roles.

    Raises `InputError` if it has neither stretch nor stress.
    """
    if seen.is_export or seen.first.levels:
        raise InputError("a table of a testing machine is needed: time, stretch or extension, stress or force", file=seen.name)
    found = seen.first.columns([*MACHINE, "temperature", *more])
    for roles in (STRETCHES, STRESSES):
        for role in [role for role in roles if role in found][1:]:
            del found[role]
    if not found.keys() & {*STRETCHES, *STRESSES}:
        there = ", ".join(f'"{name}"' for name in seen.first.table.names)
        raise InputError(
            f"no column of a stretch, strain, extension, stress or force was recognised; there are {there}", file=seen.name
        )
    return found


def curves(seen: SeenFile, columns: Mapping[str, SeenColumn]) -> list[str]:
    """The labels of the curves of a table, in their order; none for a table that is one curve."""
    labels = list(dict.fromkeys(seen.first.table.cells[columns["label"].place])) if "label" in columns else []
    return labels if 1 < len(labels) <= _MOST else []


def of_curve(seen: SeenFile, column: SeenColumn, label: str) -> tuple[dict[str, float | str], NDArray[np.bool_]]:
    """The key `where` for the curve of a table with a `label`, and its rows (mask)."""
    rows = np.array([cell == label for cell in seen.first.table.cells[column.place]])
    number = float(seen.first.raw(column.place)[rows][0])
    value = label if not np.isfinite(number) else int(number) if number.is_integer() else number
    return {str(seen.first.table.names[column.place]): value}, rows


def of(found: Mapping[str, Any], roles: Iterable[str]) -> str | None:
    """The first of the `roles` that was found."""
    return next((role for role in roles if role in found), None)


def state_columns(recipe: RecipeLines, seen: SeenFile, used: Mapping[str, SeenColumn], needed: Iterable[str] = ()) -> None:
    """Write the key `columns`, with the roles that are `needed` and were not recognised to be filled in."""
    missing = {role: FILL for role in needed if role not in used}
    by_unit = [f"{role} by {column.reason}" for role, column in used.items() if column.reason != "its name"]
    left = seen.first.unnamed(used.values())
    others = f"not used: {', '.join(map(as_toml, left[:8]))}" if left else ""
    comment = "; ".join(filter(None, ["by their names" if not by_unit else "", *by_unit, others]))
    recipe.key("columns", missing | {role: column.name for role, column in used.items()}, comment)


def temperature_of(seen: SeenFile, columns: Mapping[str, SeenColumn], rows: Any = slice(None)) -> tuple[str, str]:
    """The temperature of a table, or of some of its rows, with its unit or `FILL`, and a comment."""
    column = columns.get("temperature")
    if column is not None:
        numbers = seen.first.numbers(column)
        if numbers is None:
            cells = set(np.array(seen.first.table.cells[column.place])[rows].tolist())
            number = cells.pop().replace(",", ".") if len(cells) == 1 else ""
            return f"{number} {FILL}".strip(), f'the column "{column.name}" states no unit'
        levels = levels_of(numbers[rows])
        if len(levels) == 1:
            return f"{levels[0]:g} degC", f'from the column "{column.name}"'
        return FILL, f'the column "{column.name}" holds several temperatures'
    named = temperatures_in_names([Path(seen.name).name])
    if named is not None:
        quantity = named.quantities[0]
        return (f"{quantity} {FILL}", named.doubt) if named.doubt else (f"{celsius(quantity):g} degC", "from the name of the file")
    return FILL, "of the test; neither a column nor the name of the file states it with its unit"


def follow(kind: str, given: Given) -> RecipeLines:
    """The recipe of `relax` or `creep` that follows the first table and compares with all of them."""
    recipe = RecipeLines(kind, "A measured history -> what a material makes of it, with the measured points.")
    first = given.seen[0]
    columns = machine_columns(first, ("label",))
    labels, chosen, rows = curves(first, columns), dict[str, float | str](), np.ones(first.first.table.lines.size, dtype=bool)
    if labels:
        chosen, rows = of_curve(first, columns["label"], labels[0])
    load, response = (of(columns, STRETCHES), of(columns, STRESSES))[:: 1 if kind == "relax" else -1]
    recipe.key("material", "example:vhb4905.toml", MATERIAL)
    recipe.key("temperature", *temperature_of(first, columns, rows))
    recipe.option('mode = "equibiaxial"', "CHECK: uniaxial is the default; or pure-shear")
    stated = specimen_of(first.first, [role for role in (load, response) if role])
    if stated is not None:
        recipe.section("[specimen]", stated[1])
        for name, value in stated[0].items():
            recipe.key(name, value)
    recipe.section("[[step]]")
    control = "stretch" if kind == "relax" else "stress"
    if load is not None and "time" in columns:
        if labels:
            raise InputError(f"{len(labels)} curves, and a step follows one: dielast calibrate takes them", file=first.name)
        recipe.key("table", first.name, f"{first.first.table.lines.size} rows")
        state_columns(recipe, first, {role: columns[role] for role in ("time", load)})
        if unknown := without_unit({role: columns[role] for role in ("time", load)}):
            units = ", ".join(f"of {role}" for role in unknown)
            recipe.key("hold", FILL, f"no key of a step states the unit {units}: write it into the header, and delete this line")
    elif load in ("stretch", "strain"):
        numbers = first.first.numbers(columns[load])
        peak = FILL if numbers is None else float(f"{np.nanmax(numbers[rows]) + (load == 'strain'):.6g}")
        recipe.key("stretch", peak, "the largest of the table")
        recipe.key("rate", FILL, "the table has no times")
    else:
        recipe.key(control, FILL, f"no column of a {control} and of times was recognised" if load is None else "to reach")
        recipe.key("rate", FILL)
    if response is None:
        return recipe
    over_time = "time" in columns
    for seen in given.seen:
        compared = machine_columns(seen, ("label",))
        x, y = ("time" if over_time else of(compared, (load or "stretch",))), of(compared, (response,))
        if x is None or y is None:
            raise InputError(
                f"the column of the {response} or of what it is over is missing, which {first.name} has", file=seen.name
            )
        recipe.section("[[compare]]")
        recipe.key("file", seen.name)
        if chosen:
            recipe.key("where", chosen, f"the first of {len(labels)} curves")
        recipe.key("x", "time [s]" if over_time else "stretch_1 [1]" if kind == "relax" else "nominal_stress_1 [Pa]")
        recipe.key("y", "nominal_stress_1 [Pa]" if kind == "relax" else "stretch_1 [1]")
        state_columns(recipe, seen, {x: compared[x], y: compared[y]})
        axes = {"x": compared[x], "y": compared[y]}
        if unknown := [axis for axis, column in axes.items() if without_unit({column.role: column})]:
            recipe.key("units", dict.fromkeys(unknown, FILL), "the headers state no unit that fits")
        recipe.doubts += [f"{seen.name}: {text}" for text in seen.first.contradictions()]
    return recipe
