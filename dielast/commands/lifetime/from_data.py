"""The recipe of `lifetime` for a given table of specimens."""

from dielast.base.errors import InputError
from dielast.commands.lifetime.recipe import QUANTITIES, TEXTS
from dielast.commands.simulation.from_data import MATERIAL, state_film, temperature_of
from dielast.readings.seen import Given
from dielast.readings.stated import state_columns, state_sheet, state_units
from dielast.recipe.lines import RecipeLines


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe; raises `InputError` for files that are no table of failures."""
    if len(given.names) > 1:
        raise InputError(f"{len(given.names)} files are given, but the specimens of lifetime are one table")
    (seen,) = given.seen
    columns = {} if seen.is_export else seen.first.columns((*QUANTITIES, *TEXTS))
    if not {"voltage", "recipe"} & columns.keys():
        raise seen.unrecognised("a voltage")
    recipe = RecipeLines(kind, "Measured failures, and what has not failed yet -> breakdown or damage of the material.")
    recipe.key("material", "example:vhb4905.toml", MATERIAL)
    if "temperature" not in columns:
        recipe.key("temperature", *temperature_of(seen, columns))
    state_film(recipe, columns)
    recipe.section("[data]")
    recipe.key("file", seen.name, f"{seen.first.table.lines.size} specimens")
    state_sheet(recipe, seen)
    state_columns(recipe, seen.first, columns, [] if {"time", "ramp"} & columns.keys() else ["time"])
    state_units(recipe, columns)
    recipe.section("[fit]")
    recipe.key("laws", ["inverse-power", "table"], "table | power (breakdown), inverse-power | eyring (damage)")
    recipe.key("scatter", "weibull", "weibull | normal (of a breakdown field)")
    recipe.doubts += seen.doubts
    return recipe
