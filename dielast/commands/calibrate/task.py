"""The task that a recipe of `calibrate` states: its tests, its materials, and their free constants as the library takes them, with
values in the unit of each constant, and keys of the recipe in errors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from dielast.base.errors import InputError, Mistakes, Problem, quoted, reached_by, shown, warn
from dielast.base.units import parse
from dielast.calibration.experiment import Experiment, MeasuredTest
from dielast.calibration.parameters import Free, ParameterSpace, parameter_space
from dielast.calibration.spring_pairs import reach_of, trial
from dielast.calibration.voltage import VoltageTest
from dielast.commands.calibrate.recipe import CalibrateRecipe, FreeValue
from dielast.commands.calibrate.tests import read_tests
from dielast.commands.calibrate.voltage_tests import predicted_test
from dielast.handover.material_draws import read_draws_beside
from dielast.handover.material_file import parse_material
from dielast.io.files import Inputs
from dielast.material.checks import FAINTEST, LOOKS_LIKE_KELVIN, STRONGEST, UNSEEN, warn_of_field, warn_of_temperature
from dielast.material.material import Material, constants_of
from dielast.material.use_checks import warn_of_no_shift
from dielast.recipe.cases import Case

FEWEST_DRAWS = 10  # for a standard deviation


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationTask:
    """What a recipe states: tests to fit and to predict, materials by file, and their free constants by file."""

    tests: list[Experiment]
    predicted: list[Experiment]
    materials: dict[str, Material]
    free: dict[str, dict[str, Free]]
    asked: VoltageTest | None = None
    """The prediction that is asked for, None for the usual one."""


def prepared(cases: Sequence[Case[CalibrateRecipe]], inputs: Inputs) -> CalibrationTask:
    """The task of a recipe, read, checked and warned of; raises `InputError` with a line for every mistake."""
    task = _read_task(cases[0].recipe, inputs)
    _check_conditions(task)
    return task


def _read_task(recipe: CalibrateRecipe, inputs: Inputs) -> CalibrationTask:
    wrong, materials = Mistakes(), dict[str, Material]()
    key = "materials" if recipe.start is None else "material"
    for name in recipe.started_from:
        if material := wrong.tried(partial(_read_material, name, key, inputs)):
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
        tried = {
            f"{' + '.join(pair)}{'' if len(materials) == 1 else f' ({name})'}": trial(
                material, pair, free[name], reach_of(tests, material)
            )
            for name, material in materials.items()
            for pair in recipe.springs.try_
        }
        materials = {name: material for name, (material, _) in tried.items()}
        free = {name: constants for name, (_, constants) in tried.items()}
    return CalibrationTask(tests, further, materials, free, asked)


def _check_conditions(task: CalibrationTask) -> None:
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
    _warn_of_copies(task)
    pulled = np.array([test.nominal_field for test in electric if isinstance(test, MeasuredTest)])
    known = [material.breakdown.typical_fields() for material in task.materials.values() if material.breakdown is not None]
    # if no breakdown field is known, the plausible value closest to the field
    warn_of_field(pulled, np.max(np.concatenate(known)) if known else np.clip(np.abs(pulled), FAINTEST, STRONGEST))
    for test in electric:
        if isinstance(test, VoltageTest):
            _check_field(test, next(iter(task.materials.values())))


def _check_field(test: VoltageTest, material: Material) -> None:
    """Warn of a film that a voltage far too low or far too high is said to have extended, for the modulus of a material at that
    time: half-way, in the logarithm, between the right voltage and one that is wrong by a factor of a thousand.
    """
    assert material.dielectric is not None
    field = test.nominal_field * test.reach(material)[1] / 2  # nearly l1 l2, unless one stretch is far larger than the other
    stress = float(material.dielectric.typical(material.reference_temperature).flat[0]) * field**2
    modulus = float(material.spectrum.relaxation_modulus(test.time[-1], material.equilibrium_modulus))
    extended = max(float(np.ptp(test.wanted)), UNSEEN)
    ratio = stress / (modulus * extended)
    if not 1e-3 < ratio < 1e3:
        so = f"the electrostatic stress is {stress:.2g} Pa, with a shear modulus of {modulus:.2g} Pa and a strain of {extended:.2g}"
        warn(f"test {test.name}: at {test.voltage[-1]:g} V {so}: is the voltage, or film.thickness, in a wrong unit?")


def _warn_of_copies(task: CalibrationTask) -> None:
    """Warn of tests with the same points as a fitted test: they count twice, or validate nothing."""
    fitted = [test for test in task.tests if isinstance(test, MeasuredTest)]
    for k, test in enumerate([*fitted, *(test for test in task.predicted if isinstance(test, MeasuredTest))]):
        first = next((each for each in fitted[:k] if _same_points(test, each)), None)
        if first is not None:
            where, so = ("", "is fitted twice") if k < len(fitted) else (" under [[validate]]", "validates nothing")
            warn(f"test {test.name}{where} has the points of test {first.name}: it {so}")


def _read_material(name: str, key: str, inputs: Inputs) -> Material:
    with reached_by(key):
        return parse_material(inputs.read(name), name)


def _same_points(one: MeasuredTest, other: MeasuredTest) -> bool:
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("time", "stretch", "stress"))


def free_of(free: Mapping[str, FreeValue], materials: Mapping[str, Material], inputs: Inputs) -> dict[str, dict[str, Free]]:
    """The free constants of each material, by its file: those keys of `[free]` that the material has.

    A prior from draws reads the draws of the material.

    Raises `InputError` with a line for every key that no material has, and for every wrong value or bound.
    """
    wrong, found = Mistakes(), dict[str, dict[str, Free]]()
    for path, stated in free.items():
        having = {name: material for name, material in materials.items() if _has(material, path)}
        if not having:
            wrong.tried(partial(_placed, next(iter(materials.values())), {path: Free()}))
        for name, material in having.items():
            value = wrong.tried(partial(_converted, stated, path, name, material, inputs))
            if value is not None:
                found.setdefault(name, {})[path] = value
    for name, material in materials.items():
        if name in found:
            wrong.tried(partial(_placed, material, found[name]))
        elif not wrong:
            wrong.append(Problem(f"nothing of {name} is free", key="free"))
    wrong.sort(
        key=lambda problem: next((k for k, path in enumerate(free) if (problem.key or "").startswith(_key(path))), len(free))
    )
    wrong.refuse()
    for section in ("equilibrium", "nonequilibrium"):
        if any(path.startswith(f"{section}.") for path in free):
            for name, own in found.items():
                branches = section == "equilibrium" or len(materials[name].spectrum)
                if branches and not any(path.startswith(f"{section}.") for path in own):
                    keys = ", ".join(f"{section}.{key}" for key in constants_of(materials[name])[section])
                    warn(
                        f"nothing of [{section}] of {name} is free, unlike that of other materials: its constants are {keys}",
                        key="free",
                    )
    return found


def _placed(material: Material, free: Mapping[str, Free]) -> ParameterSpace:
    """The parameters; errors name the keys of the recipe."""
    try:
        return parameter_space(material, free)
    except InputError as error:
        raise error.changed(lambda problem: Problem(problem.text, key=_key(problem.key))) from None


def _key(path: str | None) -> str:
    return "free" if path is None else f"free.{quoted(path)}"


def _has(material: Material, path: str) -> bool:
    section, _, key = path.partition(".")
    return key.partition("[")[0] in constants_of(material).get(section, {})


def _converted(stated: FreeValue, path: str, name: str, material: Material, inputs: Inputs) -> Free:
    """Bounds and prior in SI."""
    if stated.prior == "draws":
        if stated.relative is not None:
            raise InputError(
                'prior = "draws" takes the standard deviation from the draws: leave relative out', key=f"{_key(path)}.relative"
            )
        members = read_draws_beside(inputs, name, material)
        if len(members) < FEWEST_DRAWS:
            few = f"{name} has {len(members)} draws, at least {FEWEST_DRAWS} are needed"
            raise InputError(f"{few}: mastercurve with [uncertainty] and spectrum make them", key=f"{_key(path)}.prior")
        stated, drawn = stated.model_copy(update={"prior": None}), members
    else:
        drawn = ()
    section, _, key = path.partition(".")
    kind = constants_of(material)[section][key.partition("[")[0]]

    def number(name: str) -> float | None:
        """The value, in SI."""
        value: Any = getattr(stated, name)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            needed = 'a number, or text with a unit such as "26 kPa", is needed'
            raise InputError(f"{shown(value)}: {needed}", key=f"{_key(path)}.{name}")
        try:
            if kind.dimension is not None:
                return parse(value, kind.dimension)
        except InputError as error:
            raise InputError(str(error), key=f"{_key(path)}.{name}") from None
        if isinstance(value, str):
            raise InputError(f"{shown(value)}: a bare number is needed", key=f"{_key(path)}.{name}")
        return float(value)

    wrong = Mistakes()
    least, most, start, prior = (wrong.tried(partial(number, name)) for name in ("min", "max", "start", "prior"))
    wrong.refuse()
    return Free(least, most, start, prior, stated.relative, drawn)
