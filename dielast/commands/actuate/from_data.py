"""The recipe of `actuate` for given tables."""

import re

from dielast.commands.simulation.from_data import MATERIAL, state_film, state_table, temperature_of
from dielast.readings.seen import Given, SeenFile
from dielast.readings.stated import state_sheet, state_units
from dielast.recipe.lines import FILL, RecipeLines

_RESULTS = {
    "relative_stretch_1 [1]": r"relative[ _]stretch[ _]1",
    "area_strain [1]": r"area[ _]?strain|area[ _]ratio|A\s*/\s*A_?0",
    "stretch_1 [1]": r"stretch([ _]1)?|stretch ratio|lambda|λ",
    "true_field [V/m]": r"true[ _]field",
}
"""Columns of the result, and the names under which tables of measured points have them."""


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe that follows the voltage of the first table, if it has times, and compares with all of them."""
    recipe = RecipeLines(kind, "A measured history of voltage -> stretch of a prestretched film, with the measured points.")
    first = given.seen[0]
    columns = first.first.columns(("time", "voltage", "temperature"))
    compared = [(seen, found) for seen in given.seen if (found := _result(seen)) is not None]
    actuated = any(header != "stretch_1 [1]" for _, (header, _) in compared)
    if first.is_export or ("voltage" not in columns and not actuated):
        raise first.unrecognised("a voltage or of an actuated stretch")
    recipe.key("material", "example:vhb4905.toml", MATERIAL)
    recipe.key("temperature", *temperature_of(first, columns))
    state_film(recipe)
    recipe.section("[[step]]")
    if {"time", "voltage"} <= columns.keys():
        state_table(recipe, first, {role: columns[role] for role in ("time", "voltage")})
    else:
        recipe.key("voltage", FILL, "to reach; the table has no times with voltages")
        recipe.key("rate", FILL)
    for seen, (header, name) in compared:
        of_axis = seen.first.columns(("time", "voltage"))
        x = "time" if "time" in of_axis else "voltage" if "voltage" in of_axis else None
        recipe.section("[[compare]]")
        recipe.key("file", seen.name)
        state_sheet(recipe, seen)
        recipe.key(
            "x", {"time": "time [s]", "voltage": "voltage [V]", None: FILL}[x], "" if x else "time or voltage, and its x_column"
        )
        recipe.key("y", header)
        if x is not None:
            column = of_axis[x]
            recipe.key("x_column", seen.first.table.names[column.place], f"by {column.reason}")
            state_units(recipe, {"x": column})
        recipe.key("y_column", name, "by its name")
    return recipe


def _result(seen: SeenFile) -> tuple[str, str] | None:
    """The column of the result that a table holds measured points of, and what the table calls it."""
    for header, names in _RESULTS.items():
        for name, spelled in zip(seen.first.table.names, seen.first.table.headers, strict=True):
            if re.fullmatch(names, spelled.spelled.strip() or name) or re.fullmatch(names, name.strip()):
                return header, name
    return None
