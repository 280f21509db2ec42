"""What `dielast validate` reads for `lifetime`: the material and the table of specimens."""

from collections.abc import Iterator, Sequence
from functools import partial

from dielast.commands.lifetime.recipe import LifetimeRecipe
from dielast.commands.lifetime.table import read_specimens
from dielast.errors import InputError, without_warnings
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[LifetimeRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The material, then the specimens."""
    recipe = cases[0].recipe
    yield "material", recipe.material, lambda: parse_material(inputs.read(recipe.material), recipe.material)
    yield "data.file", recipe.data, partial(_specimens, recipe, inputs)


def _specimens(recipe: LifetimeRecipe, inputs: Inputs) -> None:
    """The specimens; a mistake in the material is stated by its reading."""
    try:
        with without_warnings():
            material = parse_material(inputs.read(recipe.material), recipe.material)
    except InputError:
        return
    read_specimens(recipe, material, inputs)
