"""The task that a recipe of `calibrate` states: its tests, its materials and their free constants."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from dielast.base.errors import InputError, Mistakes, warn
from dielast.calibration.experiment import Experiment, MeasuredTest
from dielast.calibration.parameters import Free
from dielast.calibration.spring_pairs import reach_of, trial
from dielast.calibration.voltage import VoltageTest
from dielast.commands.calibrate.freedom import free_of
from dielast.commands.calibrate.recipe import CalibrateRecipe
from dielast.commands.calibrate.tests import read_tests
from dielast.commands.calibrate.voltage_tests import predicted_test
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.material.checks import FAINTEST, LOOKS_LIKE_KELVIN, STRONGEST, warn_of_field, warn_of_temperature
from dielast.material.material import Material
from dielast.material.use_checks import warn_of_no_shift


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationTask:
    """What a recipe states: tests to fit and to predict, materials by file, and their free constants by file."""

    tests: list[Experiment]
    predicted: list[Experiment]
    materials: dict[str, Material]
    free: dict[str, dict[str, Free]]
    asked: VoltageTest | None = None
    """The prediction that is asked for, None for the usual one."""


def read_task(recipe: CalibrateRecipe, inputs: Inputs) -> CalibrationTask:
    """Read all files that a recipe names; raises `InputError` with a line for every mistake."""
    wrong, materials = Mistakes(), dict[str, Material]()
    for name in recipe.started_from:
        if material := wrong.tried(partial(_read_material, name, inputs)):
            materials[name] = material
    at = next((material.reference_temperature for material in materials.values()), 20.0)
    fixed = [] if recipe.frees_shift else list(materials.values())
    tests = wrong.tried(partial(read_tests, recipe.test, inputs, at, "test", fixed)) or []
    further = wrong.tried(partial(read_tests, recipe.validate_, inputs, at, "validate")) or []
    # without its material a free constant cannot be checked
    free = wrong.tried(partial(free_of, recipe.free, materials, inputs)) if len(materials) == len(recipe.started_from) else None
    asked = None
    if recipe.prediction is not None:
        mean = float(np.mean([test.temperature for test in tests] or [at]))
        asked = wrong.tried(partial(predicted_test, recipe.prediction, mean))
    wrong.refuse()
    assert free is not None
    if recipe.springs is not None:
        tried = [
            (
                f"{' + '.join(pair)}{'' if len(materials) == 1 else f' ({name})'}",
                trial(material, pair, free[name], reach_of(tests, material)),
            )
            for name, material in materials.items()
            for pair in recipe.springs.try_
        ]
        materials, free = {name: each.material for name, each in tried}, {name: dict(each.free) for name, each in tried}
    return CalibrationTask(tests, further, materials, free, asked)


def check_conditions(task: CalibrationTask) -> None:
    """Warn of temperatures and voltages of tests that look as if they were in another unit.

    Raises `InputError` for a test under voltage of a material without a permittivity.
    """
    every = (*task.tests, *task.predicted)
    electric = [test for test in every if isinstance(test, VoltageTest) or (isinstance(test, MeasuredTest) and test.nominal_field)]
    for name, material in task.materials.items():
        if electric and not material.permittivity:
            needed = f"test {electric[0].name} is under voltage: state [dielectric] permittivity"
            raise InputError(needed, file=name)
        if task.asked is not None and not material.permittivity:
            raise InputError("prediction is of a film under voltage: state [dielectric] permittivity", file=name)
    temperature = np.array([test.temperature for test in (*task.tests, *task.predicted)])
    hot = temperature > LOOKS_LIKE_KELVIN
    warn_of_temperature(temperature[hot] if hot.any() else temperature, "tests are at")
    for material in task.materials.values():
        warn_of_no_shift(material, temperature)
    warn_of_copies(task)
    fields = np.array([test.nominal_field for test in electric])
    known = [material.breakdown.typical_fields() for material in task.materials.values() if material.breakdown is not None]
    # if no breakdown field is known, the plausible value closest to the field
    warn_of_field(fields, np.max(np.concatenate(known)) if known else np.clip(np.abs(fields), FAINTEST, STRONGEST))


def warn_of_copies(task: CalibrationTask) -> None:
    """Warn of tests with the same points as a fitted test: they count twice, or validate nothing."""
    fitted = [test for test in task.tests if isinstance(test, MeasuredTest)]
    for k, test in enumerate([*fitted, *(test for test in task.predicted if isinstance(test, MeasuredTest))]):
        first = next((each for each in fitted[:k] if _same_points(test, each)), None)
        if first is not None:
            where, so = ("", "is fitted twice") if k < len(fitted) else (" under [[validate]]", "validates nothing")
            warn(f"test {test.name}{where} has the points of test {first.name}: it {so}")


def _same_points(one: MeasuredTest, other: MeasuredTest) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("time", "stretch", "stress"))


def _read_material(name: str, inputs: Inputs) -> Material:
    return parse_material(inputs.read(name), name)
