"""Tables of testing machines, and how recipes for given files name their columns."""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.readings.columns_recipe import STRAINS, STRESSES
from dielast.readings.named import celsius, levels_of, temperatures_in_names
from dielast.readings.seen import SeenColumn, SeenFile
from dielast.readings.stated import state_columns, state_sheet, without_unit
from dielast.recipe.lines import FILL, RecipeLines

MACHINE = ("time", *STRAINS, *STRESSES)
_MOST = 100  # curves that are told apart in a table
MATERIAL = "your own: written by dielast spectrum or calibrate"


def machine_columns(seen: SeenFile, more: Iterable[str] = ()) -> dict[str, SeenColumn]:
    """The columns of a testing machine's table by role: time, one for the stretch, one for the stress, and the `more` roles.

    Raises `InputError` if it has neither stretch nor stress.
    """
    if seen.is_export or seen.first.levels:
        raise InputError("a table of a testing machine is needed: time, stretch or extension, stress or force", file=seen.name)
    found = seen.first.columns([*MACHINE, "temperature", *more])
    for roles in (STRAINS, STRESSES):
        for role in [role for role in roles if role in found][1:]:
            del found[role]
    if not found.keys() & {*STRAINS, *STRESSES}:
        raise seen.unrecognised("a stretch, strain, extension, stress or force")
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


def state_film(recipe: RecipeLines, columns: Collection[str] = ()) -> None:
    """State the section `[film]`, without what `columns` of these roles state of each film."""
    recipe.section("[film]", "the film, and its treatment before the voltage")
    recipe.key("thickness", FILL, 'undeformed, such as "0.5 mm"' + ("; of rows without one" if "thickness" in columns else ""))
    if "prestretch" not in columns:
        recipe.key("prestretch", FILL, "equibiaxial, or [3.0, 1.0]; 1 is none")
    recipe.key("relax", FILL, "time at the prestretch before the voltage comes on")
    recipe.key("boundary", FILL, "frame | strip | dead-load | clamped")
    recipe.option("electrode_share = 0.0525", "of the film, needed with frame and strip")


def state_table(recipe: RecipeLines, seen: SeenFile, used: Mapping[str, SeenColumn]) -> None:
    """State a step that follows the columns `used` of a table."""
    recipe.key("table", seen.name, f"{seen.first.table.lines.size} rows")
    state_sheet(recipe, seen)
    state_columns(recipe, seen.first, used)
    if unknown := without_unit(used):
        units = ", ".join(f"of {role}" for role in unknown)
        recipe.key("hold", FILL, f"no key of a step states the unit {units}: write it into the header, and delete this line")


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
