"""The dielectric laws, and leakage: the current through a film under a field, which discharges it."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.base.registry import Registry
from dielast.base.units import PERMITTIVITY, TEMPERATURE, ZERO_CELSIUS
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.law import Constant, DielectricLaw as DielectricLaw, LogRatio, check_table
from dielast.numerics.arrays import Cases, Floats

VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018


@dataclass(frozen=True, slots=True)
class ConstantPermittivity(DielectricLaw):
    """One `permittivity` in F/m at all temperatures and stretches; a `relative_permittivity` is converted to it."""

    permittivity: float = 0.0
    relative_permittivity: float | None = None

    name: ClassVar = "constant"
    title: ClassVar = "constant permittivity"
    constants: ClassVar[tuple[Constant, ...]] = (
        Constant("permittivity", "Absolute permittivity of the ideal dielectric.", PERMITTIVITY, above=0.0, left_out=0.0),
        Constant("relative_permittivity", "Permittivity over that of vacuum; instead of permittivity.", at_least=1.0, needed=False),
    )

    def __post_init__(self) -> None:
        if self.relative_permittivity is not None:
            if self.permittivity:
                raise InputError("state permittivity or relative_permittivity, not both")
            object.__setattr__(self, "permittivity", self.relative_permittivity * VACUUM_PERMITTIVITY)
            object.__setattr__(self, "relative_permittivity", None)

    def brief(self) -> float | None:
        """The number; None if it is 0, which means that none is stated."""
        return self.permittivity or None

    def at(self, temperature: ArrayLike) -> Floats:
        """The permittivity."""
        return np.full(np.shape(temperature), self.permittivity)


@dataclass(frozen=True, slots=True)
class LinearPermittivity(ConstantPermittivity):
    """eps = eps_0 [1 + c (lambda_1 + lambda_2 - 2)] with eps_0 = `permittivity` in F/m, or a `relative_permittivity`, and
    c = `stretch_coefficient` (Zhao and Suo, J. Appl. Phys. 104 (2008) 123530; about -0.05 for VHB 4910).
    """

    stretch_coefficient: float = 0.0

    name: ClassVar = "linear"
    title: ClassVar = "permittivity linear in stretch"
    depends_on_stretch: ClassVar = True
    constants: ClassVar[tuple[Constant, ...]] = (
        *ConstantPermittivity.constants,
        Constant("stretch_coefficient", "linear: c in permittivity [1 + c (l1 + l2 - 2)]; about -0.05 for VHB."),
    )

    def __post_init__(self) -> None:
        ConstantPermittivity.__post_init__(self)
        if not self.permittivity:
            raise InputError("a permittivity linear in stretch needs permittivity or relative_permittivity, that at stretch 1")
        if not np.isfinite(self.stretch_coefficient):
            raise InputError(f"{self.stretch_coefficient:g}: a finite number is needed", argument="stretch_coefficient")

    def brief(self) -> Self:  # type: ignore[override]
        """The law itself."""
        return self

    def log_ratio(self, log_squared_stretch: Floats) -> LogRatio:
        """ln r with r = 1 + c (l1 + l2 - 2): dr/dLambda_i = c l_i/2, d2r/dLambda_i^2 = c l_i/4."""
        first, second = np.exp(0.5 * log_squared_stretch)
        ratio = 1 + self.stretch_coefficient * (first + second - 2)
        one, two = (0.5 * self.stretch_coefficient / ratio) * first, (0.5 * self.stretch_coefficient / ratio) * second
        with np.errstate(invalid="ignore", divide="ignore"):
            logarithm = np.log(ratio)
        return logarithm, np.stack((one, two)), np.stack((one * (0.5 - one), -one * two, two * (0.5 - two)))


ROUNDING = 1e-9  # of a temperature in kelvin: a rounded temperature still lies within the table


@dataclass(frozen=True, slots=True)
class PermittivityTable(DielectricLaw):
    """`relative_permittivity` at ascending temperatures in degC, with linear interpolation; `InputError` outside of them.

    All values are at one frequency, of the order of one over the duration of a simulation: the model has no dielectric relaxation.
    """

    temperature: tuple[float, ...]
    relative_permittivity: tuple[float, ...]

    name: ClassVar = "table"
    title: ClassVar = "permittivity table"
    constants: ClassVar = (
        Constant(
            "temperature", "table: temperatures, ascending, one for each permittivity.", TEMPERATURE, above=-ZERO_CELSIUS, many=True
        ),
        Constant(
            "relative_permittivity",
            "table: values at the temperatures, with linear interpolation, all measured at one frequency as low as in the "
            "simulation.",
            at_least=1.0,
            many=True,
        ),
    )

    def __post_init__(self) -> None:
        check_table(self.title, ("temperatures", self.temperature), ("relative permittivities", self.relative_permittivity))
        if not np.all(np.isfinite(self.temperature)) or not all(1 <= value < np.inf for value in self.relative_permittivity):
            raise InputError("temperatures must be finite, and every relative permittivity at least 1")

    def at(self, temperature: ArrayLike) -> Floats:
        """The permittivity, with linear interpolation."""
        values = np.asarray(temperature, dtype=float)
        low, high = self.temperature[0], self.temperature[-1]
        slack = ROUNDING * (values + ZERO_CELSIUS)
        outside = (values < low - slack) | (values > high + slack)
        if np.any(outside):
            first = float(values[outside].flat[0])
            stated = f"{low:g} degC only" if low == high else f"{low:g} to {high:g} degC"
            raise InputError(
                f"{first:g} degC is outside the permittivity table, which is for {stated}: state a permittivity for {first:g} degC "
                "in [dielectric] of the material file",
                argument="temperature",
            )
        return np.asarray(VACUUM_PERMITTIVITY * np.interp(values, self.temperature, self.relative_permittivity))

    def typical(self, temperature: float) -> Floats:
        """The permittivities of the table."""
        return VACUUM_PERMITTIVITY * np.array(self.relative_permittivity)


DIELECTRICS: Registry[type[DielectricLaw]] = Registry(
    "dielectric law",
    ConstantPermittivity,
    LinearPermittivity,
    PermittivityTable,
    group="dielast.dielectric",
    base=DielectricLaw,
)


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Leakage(Result):
    """The true current density j = sigma_0 exp(|E|/E_c) E in A/m^2 of a true field E in V/m: a `conductivity` sigma_0 in S/m that
    grows by a factor e in every `field` E_c in V/m; by default it is constant, Ohm's law. Both are one number, or one for each
    case.

    This is how leakage through VHB is commonly fitted (Foo, Cai, Koh, Bauer and Suo, J. Appl. Phys. 111 (2012) 034102).
    Raises `InputError` for a conductivity that is negative or a field that is not positive.
    """

    conductivity: ArrayLike = 0.0
    field: ArrayLike = np.inf

    def __post_init__(self) -> None:
        conductivity, field = (np.asarray(value, dtype=float) for value in (self.conductivity, self.field))
        if not np.all(np.isfinite(conductivity) & (conductivity >= 0)):
            worst = float(np.min(conductivity))
            raise InputError(f"conductivity {worst:g} S/m: a finite number of at least 0 is needed", argument="leakage")
        if not np.all(field > 0):
            worst = float(np.min(field))
            raise InputError(f"field {worst:g} V/m: a positive number is needed; leave it out for Ohm's law", argument="leakage")

    def varied(self) -> list[ArrayLike]:
        """The constants that may be arrays (cases,)."""
        return [self.conductivity, self.field]

    def take(self, cases: Cases) -> Self:
        """The leakage of some of the cases."""
        return type(self)(np.asarray(self.conductivity)[cases], np.asarray(self.field)[cases])

    def current_density(self, true_field: Floats) -> Floats:
        """j in A/m^2, with its sign, at a true field in V/m."""
        return np.asarray(self.conductivity * np.exp(np.abs(true_field) / self.field) * true_field)

    def slope(self, true_field: Floats) -> Floats:
        """dj/dE in S/m."""
        share = np.abs(true_field) / self.field
        return np.asarray(self.conductivity * np.exp(share) * (1 + share))
