"""What `dielast validate` reads for `calibrate`, each file once."""

from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial

from dielast.base.errors import InputError, NumericsError, without_warnings
from dielast.calibration.experiment import Experiment
from dielast.commands.calibrate.freedom import free_of
from dielast.commands.calibrate.recipe import CalibrateRecipe, TestData
from dielast.commands.calibrate.simulated import recipe_tests
from dielast.commands.calibrate.task import CalibrationTask, check_conditions
from dielast.commands.calibrate.tests import check_temperature, named, read_test
from dielast.commands.calibrate.voltage_tests import predicted_test
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.material.material import Material
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case

ROOM = 20.0  # degC, of a test without a temperature if no material can be read


def readings(cases: Sequence[Case[CalibrateRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The materials, their free constants, every test, and the conditions of all tests together."""
    recipe = cases[0].recipe

    @cache
    def material(name: str) -> Material:
        return parse_material(inputs.read(name), name)

    def materials() -> dict[str, Material] | None:
        """All materials; None if one has a mistake, which is stated with the key that names its file."""
        try:
            with without_warnings():
                return {name: material(name) for name in recipe.started_from}
        except InputError:
            return None

    def free() -> None:
        if (known := materials()) is not None:
            free_of(recipe.free, known, inputs)

    def holds(test: TestData, temperature: float) -> None:
        check_temperature(test, temperature, list((materials() or {}).values()))

    @cache
    def fitted_or_predicted(key: str, index: int) -> list[Experiment]:
        tests = recipe.test if key == "test" else recipe.validate_
        test, name = tests[index], named(tests)[index]
        at = next((known.reference_temperature for known in (materials() or {}).values()), ROOM)
        if test.recipe is not None:
            return list(recipe_tests(test.recipe, inputs, name, test.specimen_id or name, at))
        return [read_test(test, inputs, at, name, f"{key}[{index}]")]

    for name in recipe.started_from:
        yield "materials" if recipe.start is None else "material", name, partial(material, name)
    yield "", recipe.free, free
    for key, tests in (("test", recipe.test), ("validate", recipe.validate_)):
        for index, test in enumerate(tests):
            named_by = "file" if test.recipe is None else "recipe"
            yield f"{key}[{index}].{named_by}", test, partial(fitted_or_predicted, key, index)
            if key == "test" and test.temperature is not None and not recipe.frees_shift:
                yield f"{key}[{index}].temperature", (test, index), partial(holds, test, test.temperature)
    if recipe.prediction is not None:
        yield "", recipe.prediction, partial(predicted_test, recipe.prediction, ROOM)
    yield "", recipe, partial(_conditions, recipe, materials, fitted_or_predicted)


def _conditions(
    recipe: CalibrateRecipe,
    materials: Callable[[], dict[str, Material] | None],
    tests_of: Callable[[str, int], list[Experiment]],
) -> None:
    """The temperatures and voltages of all tests, if the inputs can be read; mistakes in them are stated before."""
    known = materials()
    try:
        with without_warnings():
            fitted, predicted = (
                [test for index in range(count) for test in tests_of(key, index)]
                for key, count in (("test", len(recipe.test)), ("validate", len(recipe.validate_)))
            )
            asked = None if recipe.prediction is None else predicted_test(recipe.prediction, ROOM)
    except (InputError, NumericsError):
        return
    if known is not None:
        check_conditions(CalibrationTask(fitted, predicted, known, {}, asked))
