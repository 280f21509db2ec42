"""The parameters of a calibration with bounds and priors, and the materials with their values.

A parameter is fitted in a coordinate: its logarithm if it can only be positive, else its value over a scale.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from dielast.base.errors import InputError, Mistakes, Problem, similar
from dielast.calibration.bounds import Bound, bounds_about, bounds_apart, bounds_between
from dielast.calibration.experiment import Experiment
from dielast.calibration.voltage import UNITS, Conditions, VoltageTest
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.material import SCALE, Material, Numbers, constants_of, material_of, numbers_of
from dielast.numerics.arrays import Floats

TINY = 1e-3  # of the start: replaces a modulus of 0 in a draw, which has no logarithm
NARROW = 1e-3  # standard deviation added to each coordinate, as draws may share one value
SPRING_KEYS = {"equilibrium": ("shear_modulus",), "nonequilibrium": ("shear_modulus", "relaxation_time", SCALE)}
"""Keys of the sections of springs that are no constants of the shape of a spring law."""
_KEY = re.compile(r"(?P<section>[a-z]+)\.(?P<key>[A-Za-z0-9_]+)(\[(?P<index>\d+)\])?")


@checked
@dataclass(frozen=True, slots=True)
class Free(Result):
    """Bounds of a parameter, and a `prior` value with its `relative` standard deviation, in SI.

    `start` is where a fit begins, by default the prior or the value of the material. `draws` of the material, such as those from a
    master curve, are a joint prior of all parameters that state them.
    """

    min: float | None = None
    max: float | None = None
    start: float | None = None
    prior: float | None = None
    relative: float | None = None
    draws: Sequence[Material] = ()


@dataclass(frozen=True, slots=True)
class Parameter(Result):
    """One free number, at `section`, `key` and, in a list, `index`; `start`, `lower` and `upper` in SI."""

    section: str
    key: str
    index: int | None
    unit: str
    start: float
    lower: float
    upper: float
    scale: float | None
    """Unit of the coordinate; None: the coordinate is the logarithm."""
    prior: float | None = None
    relative: float | None = None
    default_bounds: tuple[str, str] = ("", "")
    """What the lower and the upper bound are by default, in words; "" for a bound that was stated."""
    possible: float | None = None
    """The least value of a material that is stable at all stretches, None if there is none."""
    of_test: bool = False
    """Whether this is no constant of the material, but an unknown condition `key` of the test called `section`."""

    @property
    def name(self) -> str:
        """The path in a material file, or the test with its condition."""
        if self.of_test:
            return f"{self.section}: {self.key}"
        return f"{self.section}.{self.key}" + ("" if self.index is None else f"[{self.index}]")

    @property
    def of_shape(self) -> bool:
        """Whether this is a constant of a spring law, beside its modulus."""
        return self.section in SPRING_KEYS and self.key not in SPRING_KEYS[self.section]

    def coordinate(self, value: Floats | float) -> Floats:
        """The coordinate of values in SI (...)."""
        return np.asarray(np.log(value) if self.scale is None else np.asarray(value) / self.scale)

    def value(self, coordinate: Floats | float) -> Floats:
        """The values in SI of coordinates (...)."""
        return np.asarray(np.exp(coordinate) if self.scale is None else np.asarray(coordinate) * self.scale)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ParameterSpace(Result):
    """The free `parameters` of a `material`; `precision` (p, p) and `centre` (p,) are a Gaussian prior in the coordinates."""

    material: Material
    parameters: tuple[Parameter, ...]
    centre: Floats
    precision: Floats

    def __len__(self) -> int:
        return len(self.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters by their paths in a material file."""
        return tuple(parameter.name for parameter in self.parameters)

    def coordinates(self, values: Sequence[float] | Floats) -> Floats:
        """Coordinates (p,) of values in SI."""
        return np.array([float(parameter.coordinate(value)) for parameter, value in zip(self.parameters, values, strict=True)])

    def values(self, coordinates: Floats) -> Floats:
        """Values (..., p) in SI of coordinates (..., p)."""
        return np.stack([parameter.value(coordinates[..., k]) for k, parameter in enumerate(self.parameters)], axis=-1)

    @property
    def start(self) -> Floats:
        """The coordinates (p,) of the start."""
        return self.coordinates([parameter.start for parameter in self.parameters])

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The lowest and the highest coordinates, each (p,)."""
        return self.coordinates([parameter.lower for parameter in self.parameters]), self.coordinates(
            [parameter.upper for parameter in self.parameters]
        )

    def conditions(self, coordinates: Floats) -> Conditions:
        """The unknown conditions of tests at coordinates (k, p)."""
        return {
            (parameter.section, parameter.key): parameter.value(coordinates[:, k])
            for k, parameter in enumerate(self.parameters)
            if parameter.of_test
        }

    def materials(self, coordinates: Floats) -> list[Material | None]:
        """The materials at coordinates (k, p); None if a law refuses its constants."""
        free = {"equilibrium", "nonequilibrium", *(parameter.section for parameter in self.parameters if not parameter.of_test)}
        base = {section: numbers for section, numbers in numbers_of(self.material).items() if section in free}
        return [self._material(base, row) for row in self.values(coordinates).tolist()]

    def _material(self, base: Numbers, values: Sequence[float]) -> Material | None:
        numbers = {
            section: {key: list(v) if isinstance(v, list) else v for key, v in constants.items()}
            for section, constants in base.items()
        }
        for parameter, value in zip(self.parameters, values, strict=True):
            if parameter.of_test:
                continue
            if parameter.index is None:
                numbers[parameter.section][parameter.key] = value
            else:
                numbers[parameter.section][parameter.key][parameter.index] = value
        try:
            return material_of(self.material, numbers)
        except InputError:
            return None


def parameter_space(material: Material, free: Mapping[str, Free]) -> ParameterSpace:
    """The space of the parameters that are `free`, by path in a material file; in a list, all entries are free.

    Raises `InputError`, with the path as its key, for a constant that the material does not have and for contradictory bounds.
    """
    if not free:
        raise InputError("nothing is free: state the constants to fit", argument="free")
    wrong = Mistakes()
    parameters = [one for path in free for one in wrong.tried(partial(_parameters, material, path, free)) or ()]
    names = [parameter.name for parameter in parameters]
    wrong += [Problem("is free twice", key=name) for name in dict.fromkeys(names) if names.count(name) > 1]
    if f"nonequilibrium.{SCALE}" in free and any(path.startswith("nonequilibrium.shear_modulus") for path in free):
        both = "a factor on all moduli and single moduli are free: free one of the two"
        wrong.append(Problem(both, key=f"nonequilibrium.{SCALE}"))
    wrong.refuse()
    centre, precision = np.zeros(len(parameters)), np.zeros(len(parameters))
    for k, parameter in enumerate(parameters):
        if parameter.prior is not None and parameter.relative is not None:
            width = parameter.relative if parameter.scale is None else parameter.relative * abs(parameter.prior) / parameter.scale
            centre[k], precision[k] = float(parameter.coordinate(parameter.prior)), 1 / width**2
    whole = np.diag(precision)
    # a parameter is free by its own path, or by that of the list that contains it
    stated = [free.get(parameter.name) or free[f"{parameter.section}.{parameter.key}"] for parameter in parameters]
    drawn = [k for k, known in enumerate(stated) if known.draws]
    if drawn:
        members = next(known.draws for known in free.values() if known.draws)
        centre[drawn], whole[np.ix_(drawn, drawn)] = _moments(members, [parameters[k] for k in drawn])
    return ParameterSpace(material, tuple(parameters), centre, whole)


def with_conditions(space: ParameterSpace, tests: Sequence[Experiment]) -> ParameterSpace:
    """The space with the conditions of tests that are not known, each with a uniform prior in its logarithm."""
    more = tuple(
        Parameter(test.name, key, None, UNITS[key], float(np.sqrt(low * high)), low, high, None, of_test=True)
        for test in tests
        if isinstance(test, VoltageTest)
        for key, (low, high) in test.unknown.items()
    )
    size = len(space) + len(more)
    precision, centre = np.zeros((size, size)), np.zeros(size)
    precision[: len(space), : len(space)], centre[: len(space)] = space.precision, space.centre
    return ParameterSpace(space.material, (*space.parameters, *more), centre, precision)


def _parameters(material: Material, path: str, free: Mapping[str, Free]) -> list[Parameter]:
    """The parameter that a path leads to, or those of a list."""
    numbers, kinds, known = numbers_of(material), constants_of(material), free[path]
    law = material.equilibrium_law
    # in place of these constants, such as Yeoh's C10, the numbers of a material have the shear modulus
    replaced = [("equilibrium", constant.file_key) for constant in law.constants if law.takes_modulus and not constant.needed]
    match = _KEY.fullmatch(path)
    section, key = (match["section"], match["key"]) if match else ("", "")
    if (section, key) in replaced:
        raise InputError(f"free equilibrium.shear_modulus instead: {law.name} is stated by it or by {key}", key=path)
    if key not in kinds.get(section, {}):
        there = {name: [each for each in group if (name, each) not in replaced] for name, group in kinds.items()}
        near = similar(key, there.get(section, []))
        of = [section] if section in there else list(there)
        listed = ", ".join(f"{name}.{each}" for name in of for each in there[name])
        instead = f': did you mean "{section}.{near}"?' if near else f"; there are {listed}"
        raise InputError(f"the material has no such constant{instead}", key=path)
    kind, value = kinds[section][key], numbers[section].get(key)
    size = _size(material, section, kind)
    if not isinstance(value, list):
        return [_parameter(section, key, None, kind, known, value, size, path)]
    index = None if match is None or match["index"] is None else int(match["index"])
    if index is not None and index >= len(value):
        raise InputError(f"there are {len(value)} entries, counted from 0", key=path)
    found = []
    for k, each in enumerate(value):
        if index in (None, k):
            usual = None
            if key in ("relaxation_time", "alpha") and known.min is None and known.max is None:
                starts = _starts(section, key, value, free)
                if key == "alpha":
                    usual = bounds_apart(starts, k, max(abs(starts[k]), size), path)
                else:
                    usual = bounds_between(starts, value, k, path)
            found.append(_parameter(section, key, k, kind, known, each, size, path, usual))
    return found


def _moments(members: Sequence[Material], parameters: Sequence[Parameter]) -> tuple[Floats, Floats]:
    """Mean (k,) and precision (k, k) of the coordinates of the parameters in draws of a material.

    Correlations from few draws are partly random: they are shrunk (Ledoit and Wolf 2004, DOI 10.1016/S0047-259X(03)00096-4) by the
    ratio of parameters to draws.
    """
    values = []
    for member in members:
        numbers = numbers_of(member)
        values.append([_number(numbers, parameter) for parameter in parameters])
    least = [TINY * abs(parameter.start) if parameter.scale is None else -np.inf for parameter in parameters]
    table = np.maximum(np.array(values, dtype=float), least)
    coordinates = np.stack([parameter.coordinate(column) for parameter, column in zip(parameters, table.T, strict=True)], axis=1)
    covariance = np.atleast_2d(np.cov(coordinates.T))
    variance = np.diag(covariance) + NARROW**2
    share = min(len(parameters) / len(members), 1.0)
    shrunk = (1 - share) * covariance + np.diag(variance - (1 - share) * np.diag(covariance))
    return np.asarray(coordinates.mean(axis=0)), np.asarray(np.linalg.inv(shrunk), dtype=float)


def _number(numbers: Numbers, parameter: Parameter) -> float:
    stated = numbers[parameter.section][parameter.key]
    return float(stated if parameter.index is None else stated[parameter.index])


def _starts(section: str, key: str, values: Sequence[float], free: Mapping[str, Free]) -> list[float]:
    """Where the fit of each entry of a list begins: at its start or prior, else at the value of the material."""
    starts, path = [], f"{section}.{key}"
    for k, value in enumerate(values):
        known = free.get(f"{path}[{k}]") or free.get(path) or Free()
        starts.append(next((stated for stated in (known.start, known.prior) if stated is not None), value))
    return starts


def _size(material: Material, section: str, kind: Constant) -> float:
    """The scale of a number of either sign: the modulus of the spring for a stress, 1 for a bare number."""
    if kind.unit != "Pa":
        return 1.0
    if section == "equilibrium":
        return material.equilibrium_modulus or 1.0
    return material.nonequilibrium_law.initial_modulus() or 1.0


def _parameter(
    section: str,
    key: str,
    index: int | None,
    kind: Constant,
    known: Free,
    value: float | None,
    size: float,
    path: str,
    usual: tuple[Bound, Bound] | None = None,
) -> Parameter:
    """A parameter with its bounds, those not stated being the `usual` ones; `value` is that of the material, `size` the scale of a
    number of either sign.
    """
    start = known.start if known.start is not None else known.prior if known.prior is not None else value
    if start is None or not np.isfinite(start) or (kind.is_positive and start <= 0):
        if known.min is None or known.max is None:
            raise InputError("the material states no value to start from: state start, or min and max", key=path)
        start = float(np.sqrt(known.min * known.max)) if kind.is_positive and known.min > 0 else 0.5 * (known.min + known.max)
    scale = None if kind.is_positive else max(abs(start), size)
    if kind.at_least is not None and kind.at_most is not None:
        usual = (kind.at_least, "the least possible"), (kind.at_most, "the largest possible")
    bounds = [
        default if stated is None else (stated, "")
        for stated, default in zip((known.min, known.max), usual or bounds_about(start, scale), strict=True)
    ]
    if kind.possible is not None and known.min is None:
        bounds[0] = max(bounds[0], (kind.possible, f"{kind.possible:g}, below which no material is stable at all stretches"))
    (lower, _), (upper, _) = bounds

    def shown(number: float) -> str:
        return f"{number:g}" + ("" if kind.unit == "1" else f" {kind.unit}")

    for name, bound in (("min", lower), ("max", upper)):
        if kind.at_most is not None and not kind.is_allowed(bound):
            raise InputError(f"{name} = {shown(bound)}: a number {kind.bounds} is needed", key=path)
    if scale is None and lower <= 0:
        raise InputError(f"min = {shown(lower)}: a number above 0 is needed, as the constant must be positive", key=path)
    if lower >= upper:
        raise InputError(f"min = {shown(lower)} is not below max = {shown(upper)}", key=path)
    for name, number in (("start", known.start), ("prior", known.prior)):
        if number is not None and not lower <= number <= upper:
            raise InputError(f"{name} = {shown(number)} is not between min = {shown(lower)} and max = {shown(upper)}", key=path)
    if (known.prior is None) != (known.relative is None):
        raise InputError("prior and relative go together: the expected value and its relative standard deviation", key=path)
    first = float(np.clip(start, lower, upper))
    words = bounds[0][1], bounds[1][1]
    return Parameter(section, key, index, kind.unit, first, lower, upper, scale, known.prior, known.relative, words, kind.possible)
