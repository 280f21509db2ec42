"""Recipes of `relax` and `creep` that follow the first of given tables and compare with all of them."""

from __future__ import annotations

import numpy as np

from dielast.base.errors import InputError
from dielast.commands.simulation.from_data import (
    MATERIAL,
    curves,
    machine_columns,
    of_curve,
    state_table,
    temperature_of,
)
from dielast.readings.columns_recipe import STRAINS, STRESSES, first_role
from dielast.readings.seen import Given
from dielast.readings.stated import specimen_of, state_columns, state_sheet, state_units
from dielast.recipe.lines import FILL, RecipeLines


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe of `relax` or `creep` that follows the first table and compares with all of them."""
    recipe = RecipeLines(kind, "A measured history -> what a material makes of it, with the measured points.")
    first = given.seen[0]
    columns = machine_columns(first, ("label",))
    labels, chosen, rows = curves(first, columns), dict[str, float | str](), np.ones(first.first.table.lines.size, dtype=bool)
    if labels:
        chosen, rows = of_curve(first, columns["label"], labels[0])
    load, response = (first_role(STRAINS, columns), first_role(STRESSES, columns))[:: 1 if kind == "relax" else -1]
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
        state_table(recipe, first, {role: columns[role] for role in ("time", load)})
    elif load in ("stretch", "strain"):
        numbers = first.first.numbers(columns[load])
        peak = FILL if numbers is None else float(f"{np.nanmax(numbers[rows]) + (load == 'strain'):.6g}")
        recipe.key("stretch", peak, "the largest of the table")
        recipe.key("rate", FILL, "the table has no times")
    else:
        recipe.key(control, FILL, f"no column of a {control} and of times was recognised" if load is None else "to reach")
        recipe.key("rate", FILL)
    x, y = "time" if "time" in columns else load, response
    if x is None or y is None:
        return recipe
    for seen in given.seen:
        compared = machine_columns(seen, ("label",))
        if not {x, y} <= compared.keys():
            raise InputError(f"the column of the {y} or of the {x} is missing, which {first.name} has", file=seen.name)
        recipe.section("[[compare]]")
        recipe.key("file", seen.name)
        state_sheet(recipe, seen)
        if chosen:
            recipe.key("where", chosen, f"the first of {len(labels)} curves")
        recipe.key("x", "time [s]" if x == "time" else "stretch_1 [1]" if kind == "relax" else "nominal_stress_1 [Pa]")
        recipe.key("y", "nominal_stress_1 [Pa]" if kind == "relax" else "stretch_1 [1]")
        state_columns(recipe, seen.first, {x: compared[x], y: compared[y]})
        state_units(recipe, {"x": compared[x], "y": compared[y]})
        recipe.doubts += seen.doubts
    return recipe
