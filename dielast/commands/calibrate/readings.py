"""What `dielast validate` reads for `calibrate`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from dielast.commands.calibrate.freedom import free_of
from dielast.commands.calibrate.recipe import CalibrateRecipe, TestData
from dielast.commands.calibrate.simulated import recipe_tests
from dielast.commands.calibrate.task import check_conditions, read_task
from dielast.commands.calibrate.tests import check_temperature, read_test
from dielast.errors import InputError, NumericsError, without_warnings
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[CalibrateRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The materials, their free constants, every test, and the conditions of all tests together."""
    recipe = cases[0].recipe
    for name in recipe.started_from:
        key = "material" if recipe.material is not None else "materials"
        yield key, name, partial(_material, name, inputs)
    yield "", recipe.free, partial(_free, recipe, inputs)
    for key, tests in (("test", recipe.test), ("validate", recipe.validate_)):
        for index, test in enumerate(tests):
            if test.recipe is not None:
                yield f"{key}[{index}].recipe", test, partial(recipe_tests, test.recipe, inputs, test.recipe, test.recipe)
            else:
                yield f"{key}[{index}].file", test, partial(read_test, test, inputs, 20.0, str(test.file))
                if key == "test" and test.temperature is not None and not recipe.frees_shift:
                    yield (
                        f"{key}[{index}].temperature",
                        (test, index),
                        partial(_temperature, recipe, test, test.temperature, inputs),
                    )
    yield "", recipe, partial(_conditions, recipe, inputs)


def _material(name: str, inputs: Inputs) -> object:
    return parse_material(inputs.read(name), name)


def _temperature(recipe: CalibrateRecipe, test: TestData, temperature: float, inputs: Inputs) -> None:
    """Whether the shift laws hold at the `temperature` in degC of a test; a mistake in a material file is stated with its key."""
    try:
        materials = [parse_material(inputs.read(name), name) for name in recipe.started_from]
    except InputError:
        return
    check_temperature(test, temperature, materials)


def _free(recipe: CalibrateRecipe, inputs: Inputs) -> None:
    """The free constants; a mistake in a material file is stated with the key that names the file."""
    try:
        materials = {name: parse_material(inputs.read(name), name) for name in recipe.started_from}
    except InputError:
        return
    free_of(recipe.free, materials, inputs)


def _conditions(recipe: CalibrateRecipe, inputs: Inputs) -> None:
    """The temperatures and voltages of the tests, if the inputs can be read; their own mistakes and warnings are stated before."""
    try:
        with without_warnings():
            task = read_task(recipe, inputs)
    except (InputError, NumericsError):
        return
    check_conditions(task)
