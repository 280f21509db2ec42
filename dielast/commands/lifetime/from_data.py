"""The recipe of `lifetime` for a given table of specimens."""

from dielast.base.errors import InputError
from dielast.commands.lifetime.recipe import QUANTITIES, TEXTS
from dielast.commands.simulation.from_data import MATERIAL, state_columns, temperature_of
from dielast.readings.seen import Given
from dielast.readings.stated import state_sheet, without_unit
from dielast.recipe.lines import FILL, RecipeLines


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe; raises `InputError` for files that are no table of failures."""
    if len(given.names) > 1:
        raise InputError(f"{len(given.names)} files are given, but the specimens of lifetime are one table")
    (seen,) = given.seen
    columns = {} if seen.is_export else seen.first.columns((*QUANTITIES, *TEXTS))
    if not {"voltage", "recipe"} & columns.keys():
        there = ", ".join(f'"{name}"' for name in seen.first.table.names)
        raise InputError(f"no column of a voltage was recognised; there are {there}", file=seen.name)
    recipe = RecipeLines(kind, "Measured failures, and what has not failed yet -> breakdown or damage of the material.")
    recipe.key("material", "example:vhb4905.toml", MATERIAL)
    if "temperature" not in columns:
        recipe.key("temperature", *temperature_of(seen, columns))
    recipe.section("[film]", "the films and their treatment before the voltage")
    recipe.key("thickness", FILL, 'undeformed, such as "0.5 mm"' + ("; of rows without one" if "thickness" in columns else ""))
    if "prestretch" not in columns:
        recipe.key("prestretch", FILL, "no column states it; 1 is none")
    recipe.key("relax", FILL, "time at the prestretch before the voltage comes on")
    recipe.key("boundary", FILL, "frame | strip | dead-load | clamped")
    recipe.option("electrode_share = 0.0525", "of the film, needed with frame and strip")
    recipe.section("[data]")
    recipe.key("file", seen.name, f"{seen.first.table.lines.size} specimens")
    state_sheet(recipe, seen)
    needed = [] if {"time", "ramp"} & columns.keys() else ["time"]
    state_columns(recipe, seen, columns, needed)
    if unknown := without_unit(columns):
        recipe.key("units", dict.fromkeys(unknown, FILL), "the headers state no unit that fits")
    recipe.section("[fit]")
    recipe.key("laws", ["inverse-power", "table"], "table | power (breakdown), inverse-power | eyring (damage)")
    recipe.key("scatter", "weibull", "weibull | normal (of a breakdown field)")
    recipe.doubts += [f"{seen.name}: {text}" for text in seen.first.contradictions()]
    return recipe
