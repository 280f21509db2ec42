"""A table of permittivities over temperature."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.material.dielectric.constant import VACUUM_PERMITTIVITY
from dielast.material.law import Constant, DielectricLaw, check_table
from dielast.numerics.arrays import Floats
from dielast.units import TEMPERATURE, ZERO_CELSIUS

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
