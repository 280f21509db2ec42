"""What `dielast validate` reads for a simulation: the material with its draws, tables of steps, measured points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from dielast.commands.command import Reading
from dielast.commands.simulation.cases import check_case
from dielast.commands.simulation.compare import read_points
from dielast.commands.simulation.history import solver_steps
from dielast.commands.simulation.recipe import SimulationRecipe
from dielast.commands.simulation.uncertainty import sample_of
from dielast.errors import InputError
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.recipe.base import RecipeBase
from dielast.recipe.cases import Case


def material_readings(recipe: Any, inputs: Inputs) -> Iterator[Reading]:
    """The material and its draws."""
    yield "material", recipe.material, lambda: parse_material(inputs.read(recipe.material), recipe.material)
    if recipe.uncertainty is not None:
        yield "uncertainty", (recipe.material, recipe.uncertainty), lambda: _read_draws(recipe, inputs)


def simulation_readings(cases: Sequence[Case[SimulationRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case."""
    for case in cases:
        recipe: Any = case.recipe
        yield from material_readings(recipe, inputs)
        for index, step in enumerate(recipe.step):
            if step.table is not None:
                alone: RecipeBase = recipe.model_copy(update={"step": [step], "load": None})
                yield f"step[{index}].table", step, partial(solver_steps, alone, inputs)
        specimen = getattr(recipe, "specimen", None)
        for index, comparison in enumerate(recipe.compare):
            yield f"compare[{index}].file", (comparison, specimen), partial(read_points, comparison, inputs, specimen)
    for index, comparison in enumerate(cases[0].recipe.compare):
        yield "", (index, comparison), partial(check_case, index, comparison, len(cases))


def _read_draws(recipe: Any, inputs: Inputs) -> None:
    """The draws of the material; a mistake in the material itself is stated with the material's key."""
    try:
        material = parse_material(inputs.read(recipe.material), recipe.material)
    except InputError:
        return
    sample_of(recipe.material, material, recipe.uncertainty, inputs)
