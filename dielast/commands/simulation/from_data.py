"""Tables of testing machines, and how recipes for given files name their columns."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, as_toml
from dielast.readings.named import celsius, levels_of, temperatures_in_names
from dielast.readings.seen import SeenColumn, SeenFile
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
