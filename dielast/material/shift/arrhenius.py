"""Arrhenius' law."""

from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, warn
from dielast.base.units import GAS_CONSTANT as GAS_CONSTANT, MOLAR_ENERGY, ZERO_CELSIUS
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.shift.law import FittedLaw, MovedLaw, ShiftLaw, fit_factor, slower_when_hot
from dielast.numerics.arrays import Floats

BARRIERS = 5e3, 2e6  # J/mol, plausible activation energies: from the rotation of a methyl group to a glass transition

Celsius = TypeVar("Celsius", float, Floats)


def kelvin(temperature: Celsius) -> Celsius:
    """Temperatures in degC on the absolute scale, in K."""
    return temperature + ZERO_CELSIUS


@checked
@dataclass(frozen=True, slots=True)
class Arrhenius(ShiftLaw):
    """ln a = E_a / R (1/T - 1/T_ref) with T in kelvin; `activation_energy` E_a in J/mol, `reference_temperature` in degC.

    Raises `InputError` for temperatures at or below absolute zero.
    """

    reference_temperature: float
    activation_energy: float

    name: ClassVar = "arrhenius"
    title: ClassVar = "Arrhenius"
    constants: ClassVar = (Constant("activation_energy", "Activation energy of the Arrhenius law.", MOLAR_ENERGY),)

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        """log10 a(T); raises `InputError` at or below absolute zero."""
        absolute = kelvin(np.asarray(temperature, dtype=float))
        if np.any(absolute <= 0):
            raise InputError(
                f"{float(np.min(absolute)) - ZERO_CELSIUS:g} degC is at or below absolute zero", argument="temperature"
            )
        inverse = 1 / absolute - 1 / kelvin(self.reference_temperature)
        return np.asarray(self.activation_energy / GAS_CONSTANT * inverse / np.log(10))

    def label(self) -> str:
        """The law with the activation energy in kJ/mol, for a legend."""
        return f"Arrhenius, $E_a$ = {self.activation_energy / 1e3:.4g} kJ/mol"

    def warning(self) -> str:
        """A warning if the activation energy is not that of a polymer."""
        if self.activation_energy < 0:
            stated = f"an activation energy of {self.activation_energy / 1e3:g} kJ/mol"
            return slower_when_hot(stated, "should its sign be positive?")
        if BARRIERS[0] <= self.activation_energy <= BARRIERS[1]:
            return ""
        usual = f"polymers have {BARRIERS[0] / 1e3:g} to {BARRIERS[1] / 1e3:g} kJ/mol"
        return f"an activation energy of {self.activation_energy / 1e3:g} kJ/mol, but {usual}: is it in another unit?"

    @classmethod
    def fit(cls, base: float, distance: Floats, log10_shift: Floats, whiten: Floats) -> FittedLaw:
        """Fit the activation energy; log10 a is linear in it."""
        unit = cls(base, 1.0)
        energy, moments, response, misfit = fit_factor(whiten, unit.log10_shift_factor(base + distance), log10_shift)
        if energy <= 0:
            warn(f"the activation energy comes out as {energy:.3g} J/mol: relaxation gets slower with temperature")

        def about(move: float) -> MovedLaw:
            rise = float(unit.log10_shift_factor(base + move))
            return MovedLaw(cls(base + move, energy), np.eye(1), energy * rise, np.array([rise]), np.zeros(0))

        return FittedLaw(about, moments, response, misfit)
