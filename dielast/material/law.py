"""Bases of the laws of a material (for springs and shifts in their packages), with constants in units.

A law is a frozen dataclass whose methods hold all that is particular to it, so that no other module depends on its type. To add a
law, write its class and register it in the registry of its family.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.base.units import AREA, GAS_CONSTANT, MOLAR_ENERGY, ZERO_CELSIUS, Dimension
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True)
class Constant:
    """One constant of a law: the attribute `name` of the law, and its form in files.

    `dimension` is None for a bare number. `above`, `at_least` and `at_most` are bounds of its values. `many`: a list of numbers.
    `key` is its key in a material file, by default the name. A file may leave out a constant with a default, `left_out`, or one
    that is not `needed`. Values below `possible` are of no material that is stable at all stretches.
    """

    name: str
    description: str
    dimension: Dimension | None = None
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    many: bool = False
    key: str = ""
    left_out: Any = None
    needed: bool = True
    possible: float | None = None

    @property
    def file_key(self) -> str:
        """The key in a material file."""
        return self.key or self.name

    @property
    def is_needed(self) -> bool:
        """Whether a file must state it."""
        return self.needed and self.left_out is None

    @property
    def unit(self) -> str:
        """The unit of its value; "1" for a bare number."""
        return "1" if self.dimension is None else self.dimension.unit

    @property
    def is_positive(self) -> bool:
        """Whether its bounds exclude negative values but no large ones, so that it has a logarithm."""
        return self.at_most is None and any(bound is not None and bound >= 0 for bound in (self.above, self.at_least))

    @property
    def suffix(self) -> str:
        """The unit as the ending of a name in a summary, such as `_J_per_mol`."""
        return "" if self.unit == "1" else "_" + self.unit.replace("/", "_per_")

    @property
    def bounds(self) -> str:
        """The bounds of its value in words, such as "above 0"."""
        bounds = {"above": self.above, "of at least": self.at_least, "of at most": self.at_most}
        return " and ".join(f"{words} {bound:g}" for words, bound in bounds.items() if bound is not None)

    def is_allowed(self, value: float) -> bool:
        """Whether a value lies within the bounds."""
        from_below = (self.above is None or value > self.above) and (self.at_least is None or value >= self.at_least)
        return from_below and (self.at_most is None or value <= self.at_most)

    def value(self, stated: Any) -> Any:
        """The attribute of a law from the stated value: None, a number, or several, as laws that share the key may take several."""
        if stated is None:
            return self.left_out
        if self.many:
            return tuple(stated) if isinstance(stated, Sequence) else (stated,)
        if not isinstance(stated, tuple):
            return stated
        if len(stated) > 1:
            raise InputError(f"{self.file_key}: one value is needed, not {len(stated)}")
        return stated[0]

    def stated(self, value: Any) -> Any:
        """The value for a material file, with 9 significant digits."""
        if self.many:
            return [replace(self, many=False).stated(entry) for entry in value]
        return float(f"{value:.9g}") if self.dimension is None else f"{value:.9g} {self.unit}"


class Law:
    """Base of every law.

    `name` is used in files, `title` in sentences ("the WLF law").
    """

    __slots__ = ()
    name: ClassVar[str]
    title: ClassVar[str]
    constants: ClassVar[tuple[Constant, ...]] = ()

    @classmethod
    def file_keys(cls) -> tuple[str, ...]:
        """The keys of the constants in a material file."""
        return tuple(constant.file_key for constant in cls.constants)

    def values(self) -> dict[str, Any]:
        """The values of the dataclass fields by name, without those that the law computes."""
        return {field.name: getattr(self, field.name) for field in fields(self) if field.init}  # type: ignore[arg-type]

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """The law with other values of the stated fields."""
        return replace(self, **values)  # type: ignore[type-var]

    def check_constants(self) -> None:
        """`InputError` for a constant that is one number, but not a finite one within its bounds."""
        for constant in self.constants:
            value = getattr(self, constant.name)
            if np.ndim(value) == 0 and value is not None and not (np.isfinite(value) and constant.is_allowed(value)):
                needed = "a positive number" if constant.above is not None else "a number of at least 0"
                raise InputError(f"{value:g}: {needed} is needed", argument=constant.name)

    def numbers(self) -> dict[str, Any]:
        """The constants in SI by their keys in a material file, each a number or a list; without those that have no value."""
        values = [(constant, getattr(self, constant.name)) for constant in self.constants]
        return {named.file_key: list(value) if named.many else value for named, value in values if value is not None}

    def stated(self) -> dict[str, Any]:
        """The constants by their keys in a material file, without those that have their default."""
        values = [(constant, getattr(self, constant.name)) for constant in self.constants]
        return {named.file_key: named.stated(value) for named, value in values if named.is_needed or value != named.left_out}

    @classmethod
    def arguments(cls, stated: Mapping[str, Any]) -> dict[str, Any]:
        """Arguments of the class from values (SI) by their keys in a material file.

        Raises `InputError` for a constant that is missing, and for a key that is not a constant of this law.
        """
        named = {key for key, value in stated.items() if value is not None}
        needed = {constant.file_key for constant in cls.constants if constant.is_needed}
        if needed - named:
            raise InputError(f'law "{cls.name}" needs {" and ".join(sorted(needed - named))}')
        if others := named.difference(cls.file_keys()):
            raise InputError(f'law "{cls.name}" does not take {" and ".join(sorted(others))}')
        return {constant.name: constant.value(stated.get(constant.file_key)) for constant in cls.constants}


SHAPE = Constant(
    "shape", "Shape of the Weibull distribution from film to film. Default: no scatter is stated.", above=0.0, needed=False
)
RELATIVE = Constant(
    "relative",
    "Standard deviation of the breakdown field from film to film over its mean, of a normal distribution; instead of shape.",
    above=0.0,
    needed=False,
)
REFERENCE_AREA = Constant(
    "reference_area",
    "With shape: area of the electrodes, on the undeformed film, for which the constants hold. The weakest spot of a larger one is "
    "weaker.",
    AREA,
    above=0.0,
    needed=False,
)
FIELD_SCATTER = (SHAPE, RELATIVE, REFERENCE_AREA)
"""Constants of the scatter of a breakdown field, whose stated value is the scale, or the mean."""

OF_DAMAGE = (
    SHAPE,
    REFERENCE_AREA,
    Constant(
        "activation_energy",
        "Activation energy of the life; the constants hold at the reference temperature of the material. Default: lives do not "
        "depend on temperature, but by the stretch of the film.",
        MOLAR_ENERGY,
        needed=False,
    ),
)
"""Constants that all damage laws have."""


class ModulusLaw(Law):
    """Base of the laws of moduli over temperature; a law defines `factor`."""

    __slots__ = ()
    depends_on_temperature: ClassVar[bool] = True

    def factor(self, temperature: ArrayLike, reference_temperature: float) -> Floats:
        """Modulus over that at `reference_temperature`, at temperatures (any shape), all in degC; `InputError` for a temperature
        at which the law does not hold.
        """
        raise NotImplementedError


LogRatio = tuple[Floats, Floats, Floats]
"""ln(eps/eps_0), its derivatives (2, ...) and its second derivatives 11, 12, 22 (3, ...), see `DielectricLaw.log_ratio`."""


class DielectricLaw(Law):
    """Base of the dielectric laws; a law defines `at`, and `log_ratio` if the permittivity depends on stretch."""

    __slots__ = ()
    depends_on_stretch: ClassVar[bool] = False

    def brief(self) -> float | Self | None:
        """The shortest form that `Material` takes: a number in F/m for a constant permittivity, None for none."""
        return self

    def at(self, temperature: ArrayLike) -> Floats:
        """The permittivity in F/m of the undeformed film at temperatures in degC, of the same shape; raises `InputError` for a
        temperature at which it is unknown.
        """
        raise NotImplementedError

    def typical(self, temperature: float) -> Floats:
        """Permittivities in F/m (any shape), to check the constants; `temperature` is the reference temperature in degC."""
        return self.at(temperature)

    def log_ratio(self, log_squared_stretch: Floats) -> LogRatio:
        """ln(eps/eps_0), with eps_0 that of the undeformed film, and its derivatives in Lambda_i = 2 ln lambda_i, at Lambda (2,
        ...).

        It must be symmetric in the axes. It is not finite where the law gives no positive permittivity.
        """
        shape = np.shape(log_squared_stretch)[1:]
        return np.zeros(shape), np.zeros((2, *shape)), np.zeros((3, *shape))


class BreakdownLaw(Law):
    """Base of the breakdown laws; a law defines `at` and `scaled`, and with `follows_film` also `of_film`.

    Its fields `shape`, `relative` and `reference_area`, None if not stated, are its scatter from film to film.
    """

    __slots__ = ()
    shape: float | Floats | None = None
    relative: float | Floats | None = None
    reference_area: float | Floats | None = None

    def check_constants(self) -> None:
        """`InputError` also for two laws of scatter, or a standard deviation of 100 %."""
        Law.check_constants(self)
        if self.shape is not None and self.relative is not None:
            raise InputError("shape (of a Weibull distribution) and relative (of a normal one) are both stated: remove one of them")
        if self.relative is not None and np.ndim(self.relative) == 0 and self.relative >= 1:
            raise InputError("a relative standard deviation below 1 is needed", argument="relative")

    follows_film: ClassVar[bool] = False
    """Whether the field depends on the present stretch and thickness: the law is then evaluated at all times, else once, at the
    prestretch. The constants of such a law are numbers, and it must also take arrays of them.
    """

    def at(self, prestretch: ArrayLike) -> Floats:
        """The field in V/m at equibiaxial prestretches of any shape; for unequal ones, pass the square root of their product."""
        raise NotImplementedError

    def of_film(self, stretch: ArrayLike, thickness: ArrayLike) -> Floats:
        """The field in V/m of films at a `stretch` sqrt(l1 l2) and a present `thickness` in m, of any shape."""
        return self.at(stretch)

    def scaled(self, factor: float) -> Self:
        """The law for a breakdown field `factor` times as large, at every prestretch."""
        raise NotImplementedError

    def outside(self, prestretch: float) -> str:
        """For a warning of a prestretch outside the range of the law: the field that is taken, and how to state another; empty for
        a prestretch within the range.
        """
        return ""

    def typical_fields(self) -> Floats:
        """Fields (k,) in V/m, to check whether they are those of films."""
        return np.atleast_1d(self.at(1.0))


class DamageLaw(Law):
    """Base of the damage laws; a law defines `rate` and `scaled`, and `lasting` if its life is not in proportion to a `time`.

    Its constants are numbers, and it must also take arrays of them. Its fields `shape` and `reference_area`, None if not stated,
    are the scatter of the damage at failure; with an `activation_energy` in J/mol, lives follow Arrhenius' law.
    """

    __slots__ = ()
    shape: float | Floats | None = None
    reference_area: float | Floats | None = None
    activation_energy: float | Floats | None = None

    def __post_init__(self) -> None:
        self.check_constants()

    def at(self, temperature: float, reference_temperature: float) -> Self:
        """The law at a temperature in degC; its constants hold at the reference temperature."""
        if self.activation_energy is None:
            return self
        inverse = 1 / (temperature + ZERO_CELSIUS) - 1 / (reference_temperature + ZERO_CELSIUS)
        return self.lasting(float(np.exp(self.activation_energy / GAS_CONSTANT * inverse)))

    def rate(self, field: ArrayLike) -> Floats:
        """dD/dt in 1/s at the magnitude of the true field in V/m, of any shape; the film fails where the integral D reaches 1."""
        raise NotImplementedError

    def lasting(self, factor: float) -> Self:
        """The law of a film that fails at `factor` times the damage."""
        return self.with_values({"time": factor * self.values()["time"]})

    def scaled(self, factor: float) -> Self:
        """The law of a film that withstands a field `factor` times as large for the same damage."""
        raise NotImplementedError


class FlowLaw(Law):
    """Base of the flow laws; a law that `depends_on_stress` defines `activation`.

    A branch of modulus mu and relaxation time tau, the latter at small stress, flows in proportion to a(s)/tau, with s = mu
    sqrt(p^2 - p q + q^2) the equivalent (von Mises) stress of its true stresses mu p and mu q. Flow must grow with stress.
    The constants of a law are numbers, and it must also take arrays of them.
    """

    __slots__ = ()
    depends_on_stress: ClassVar[bool] = True

    def activation(self, squared_stress: Floats) -> tuple[Floats, Floats]:
        """a, 1 at no stress, and its derivative in s^2, in 1/Pa^2, at s^2 in Pa^2, of any shape."""
        raise NotImplementedError


def check_table(table: str, points: tuple[str, Sequence[float]], values: tuple[str, Sequence[float]]) -> None:
    """`InputError` unless a `table` has one value at each of its ascending points; `points` and `values` begin with names."""
    (at, places), (what, numbers) = points, values
    if not places and not numbers:
        raise InputError(f"a {table} needs at least one entry")
    if len(places) != len(numbers):
        raise InputError(f"a {table} has {len(places)} {at} but {len(numbers)} {what}: one for each is needed")
    if any(not later > earlier for earlier, later in pairwise(places)):
        raise InputError(f"the {at} of a {table} must ascend")
