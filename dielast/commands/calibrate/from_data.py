"""The recipe of `calibrate` for given tables."""

from collections.abc import Mapping

import numpy as np

from dielast.commands.simulation.from_data import (
    MACHINE,
    STRESSES,
    STRETCHES,
    curves,
    machine_columns,
    of,
    of_curve,
    state_columns,
    temperature_of,
)
from dielast.readings.seen import Given, SeenColumn, SeenFile
from dielast.readings.stated import specimen_of, without_unit
from dielast.recipe.lines import FILL, RecipeLines


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe, with a test for each table, or for each curve of a table; raises `InputError` for files that are none."""
    recipe = RecipeLines(kind, "Tests of a testing machine -> a material with intervals.")
    recipe.key("material", "example:tensile/start.toml", "to start from; or your own")
    for seen in given.seen:
        columns = machine_columns(seen, ("rate", "label"))
        for label in curves(seen, columns) or (None,):
            _state_test(recipe, seen, columns, label)
        recipe.doubts += [f"{seen.name}: {text}" for text in seen.first.contradictions()]
    recipe.section("[free]", "the constants to fit, by path in the material file")
    recipe.key("equilibrium.shear_modulus", {})
    recipe.key("nonequilibrium.scale", {}, "one factor on all branches")
    return recipe


def _state_test(recipe: RecipeLines, seen: SeenFile, columns: Mapping[str, SeenColumn], label: str | None) -> None:
    table = seen.first
    chosen = np.ones(table.table.lines.size, dtype=bool)
    recipe.section("[[test]]")
    recipe.key("file", seen.name, f"{chosen.size} rows" if label is None else "")
    if label is not None:
        where, chosen = of_curve(seen, columns["label"], label)
        recipe.key("where", where, f"{np.count_nonzero(chosen)} rows")
    used = {role: columns[role] for role in MACHINE if role in columns}
    needed = [*([] if of(used, STRETCHES) else ["stretch"]), *([] if of(used, STRESSES) else ["stress"])]
    timed = "time" in used
    if not timed and "rate" not in columns:
        needed.insert(0, "time")
    state_columns(recipe, seen, used, needed)
    if unknown := without_unit(used):
        recipe.key("units", dict.fromkeys(unknown, FILL), "the headers state no unit that fits")
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
