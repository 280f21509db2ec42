"""Time-temperature shift laws: how far a temperature stretches every relaxation time.

The shift factor is a(T) = tau(T) / tau(T_ref), so cold means slow: log10 a > 0 below the reference temperature, < 0 above it, and
reduced time is t / a(T). Temperatures are in degC; only differences enter, except in Arrhenius' law, which converts to kelvin.
A new law is a new frozen dataclass here with `reference_temperature` and `log10_shift_factor`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError
from dielast.io.result import Result
from dielast.units import ZERO_CELSIUS

GAS_CONSTANT = 8.314462618  # J/(mol K), CODATA 2018


class ShiftLaw(Protocol):
    """What every shift law offers."""

    @property
    def reference_temperature(self) -> float:
        """Temperature in degC at which log10 a = 0."""

    def log10_shift_factor(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """log10 a(T) for temperatures in degC, of the same shape."""


@dataclass(frozen=True, slots=True)
class WLF:
    """Williams-Landel-Ferry: log10 a = -C1 (T - T_ref) / (C2 + T - T_ref), Eq. 11 of DOI 10.1115/1.4030850.

    `C1` is dimensionless (decimal logarithm), `C2` in K. At the pole, T = T_ref - C2, the material would never relax.
    """

    reference_temperature: float
    C1: float
    C2: float

    def log10_shift_factor(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """log10 a(T); raises `InputError` at or below the pole."""
        distance = np.asarray(temperature, dtype=float) - self.reference_temperature
        if np.any(self.C2 + distance <= 0):
            coldest = self.reference_temperature + float(np.min(distance))
            pole = self.reference_temperature - self.C2
            where = f"{pole:g} degC, where the WLF law has its pole: C2 = {self.C2:g} K below {self.reference_temperature:g} degC"
            if self.reference_temperature > 200:  # where hardly anybody refers to
                where += f", which if it were kelvin would be {self.reference_temperature - ZERO_CELSIUS:g} degC"
            raise InputError(f"{coldest:g} degC is at or below {where}", argument="temperature")
        return np.asarray(-self.C1 * distance / (self.C2 + distance))


@dataclass(frozen=True, slots=True)
class Arrhenius:
    """Arrhenius: ln a = E_a / R (1/T - 1/T_ref) with T in kelvin; `activation_energy` E_a in J/mol."""

    reference_temperature: float
    activation_energy: float

    def log10_shift_factor(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """log10 a(T); raises `InputError` at or below absolute zero."""
        kelvin = np.asarray(temperature, dtype=float) + ZERO_CELSIUS
        if np.any(kelvin <= 0):
            raise InputError(f"{float(np.min(kelvin)) - ZERO_CELSIUS:g} degC is at or below absolute zero", argument="temperature")
        inverse = 1 / kelvin - 1 / (self.reference_temperature + ZERO_CELSIUS)
        return np.asarray(self.activation_energy / GAS_CONSTANT * inverse / np.log(10))


@dataclass(frozen=True, slots=True, repr=False)
class ShiftTable(Result):
    """Measured shift factors, interpolated linearly in log10 a over T; `InputError` outside the measured range.

    `temperature` in degC, ascending, and `log10_shift` have the same length.
    """

    reference_temperature: float
    temperature: tuple[float, ...]
    log10_shift: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.temperature:
            raise InputError("a shift table needs at least one temperature and its shift factor")
        if len(self.temperature) != len(self.log10_shift):
            raise InputError(
                f"{len(self.temperature)} temperatures but {len(self.log10_shift)} shift factors: one for each is needed"
            )
        if not np.all(np.diff(self.temperature) > 0):
            raise InputError("the temperatures of a shift table must ascend")

    def log10_shift_factor(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """log10 a(T), shifted so that it is zero at the reference temperature."""
        wanted = np.asarray(temperature, dtype=float)
        low, high = self.temperature[0], self.temperature[-1]
        outside = (wanted < low) | (wanted > high)
        if np.any(outside):
            first = float(np.atleast_1d(wanted[outside])[0])
            raise InputError(f"{first:g} degC is outside the shift table's {low:g} to {high:g} degC", argument="temperature")
        origin = np.interp(self.reference_temperature, self.temperature, self.log10_shift)
        return np.asarray(np.interp(wanted, self.temperature, self.log10_shift) - origin)


@dataclass(frozen=True, slots=True)
class NoShift:
    """Relaxation times that no temperature changes."""

    reference_temperature: float

    def log10_shift_factor(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Zero at every temperature."""
        return np.zeros(np.shape(temperature))
