"""The recipe of `calibrate` for given tables."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.calibration.voltage import QUANTITIES
from dielast.commands.simulation.from_data import (
    MACHINE,
    curves,
    machine_columns,
    of_curve,
    temperature_of,
)
from dielast.readings.columns_recipe import STRAINS, STRESSES, first_role
from dielast.readings.seen import Given, SeenColumn, SeenFile
from dielast.readings.stated import specimen_of, state_columns, state_sheet, state_units
from dielast.recipe.lines import FILL, RecipeLines


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe, with a test for each table, or for each curve of a table; raises `InputError` for files that are none."""
    recipe = RecipeLines(kind, "Tests of a testing machine, or of actuated films -> a material with intervals.")
    recipe.key("material", "example:tensile/start.toml", "to start from; or your own")
    for seen in given.seen:
        columns = _actuated(seen)
        state = _state_film if columns else _state_test
        columns = columns or machine_columns(seen, ("rate", "label"))
        for label in curves(seen, columns) or (None,):
            state(recipe, seen, columns, label)
        recipe.doubts += seen.doubts
    recipe.section("[free]", "the constants to fit, by path in the material file")
    recipe.key("equilibrium.shear_modulus", {})
    recipe.key("nonequilibrium.scale", {}, "one factor on all branches")
    return recipe


def _actuated(seen: SeenFile) -> dict[str, SeenColumn]:
    """The columns of a table of voltage and stretch of an actuated film; none for another table.

    Raises `InputError` for stretches over time: what the voltage did meanwhile is stated in a recipe of actuate.
    """
    found = seen.first.columns(("time", "voltage", *QUANTITIES, *STRESSES, "temperature", "label"))
    measure = first_role(QUANTITIES, found)
    if seen.is_export or "voltage" not in found or measure is None or first_role(STRESSES, found):
        return {}
    if "time" in found:
        wrong = "voltage and stretch over time: dielast new actuate takes it, and calibrate that recipe ([[test]] recipe)"
        raise InputError(wrong, file=seen.name)
    return {role: found[role] for role in ("voltage", measure, "temperature", "label") if role in found}


def _state_file(recipe: RecipeLines, seen: SeenFile, columns: Mapping[str, SeenColumn], label: str | None) -> NDArray[np.bool_]:
    """Begin a test: the file, and the rows of the curve with a label, which are returned (mask)."""
    chosen = np.ones(seen.first.table.lines.size, dtype=bool)
    recipe.section("[[test]]")
    recipe.key("file", seen.name, f"{chosen.size} rows" if label is None else "")
    state_sheet(recipe, seen)
    if label is not None:
        where, chosen = of_curve(seen, columns["label"], label)
        recipe.key("where", where, f"{np.count_nonzero(chosen)} rows")
    return chosen


def _state_film(recipe: RecipeLines, seen: SeenFile, columns: Mapping[str, SeenColumn], label: str | None) -> None:
    chosen = _state_file(recipe, seen, columns, label)
    used = {role: columns[role] for role in ("voltage", *QUANTITIES) if role in columns}
    state_columns(recipe, seen.first, used)
    state_units(recipe, used)
    film = dict.fromkeys(("thickness", "prestretch", "relax", "boundary"), FILL)
    recipe.key("film", film, "as [film] of actuate; boundary: frame | strip, which need electrode_share, dead-load | clamped")
    recipe.key("ramp", FILL, 'of the voltage, such as "100 V/s"; unknown between two: ["10 V/s", "1 kV/s"]')
    recipe.key("temperature", *temperature_of(seen, columns, chosen))


def _state_test(recipe: RecipeLines, seen: SeenFile, columns: Mapping[str, SeenColumn], label: str | None) -> None:
    table, chosen = seen.first, _state_file(recipe, seen, columns, label)
    used = {role: columns[role] for role in MACHINE if role in columns}
    needed = [*([] if first_role(STRAINS, used) else ["stretch"]), *([] if first_role(STRESSES, used) else ["stress"])]
    timed = "time" in used
    if not timed and "rate" not in columns:
        needed.insert(0, "time")
    state_columns(recipe, table, used, needed)
    state_units(recipe, used)
    if not timed and "rate" in columns:
        column = columns["rate"]
        cells = set(np.array(table.table.cells[column.place])[chosen].tolist())
        number = cells.pop().replace(",", ".") if len(cells) == 1 else ""
        recipe.key("rate", f"{number} {column.unit or FILL}".strip(), f'from the column "{column.name}"; the table has no times')
    stated = specimen_of(table, list(used))
    if stated is not None:
        recipe.key("specimen", *stated)
    recipe.key("temperature", *temperature_of(seen, columns, chosen))
    recipe.option('mode = "equibiaxial"', "CHECK: uniaxial is the default; or pure-shear")
