"""Laws that dielast does not have, as a user of the library would add them: one of each family."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.units import FIELD, PERMITTIVITY, STRESS, Dimension
from dielast.material.breakdown import BREAKDOWNS, BreakdownLaw
from dielast.material.dielectric import DIELECTRICS, DielectricLaw
from dielast.material.flow import FLOWS
from dielast.material.law import Constant, FlowLaw
from dielast.material.shift import SHIFTS, ShiftLaw
from dielast.material.shift.law import FittedLaw, MovedLaw, fit_factor
from dielast.material.springs import SPRINGS, SpringLaw
from dielast.numerics.arrays import Floats

MATERIAL = """\
name = "toy"
reference_temperature = "20 degC"
[equilibrium]
law = "varga"
shear_modulus = "26 kPa"
share = 0.4
[nonequilibrium]
law = "varga"
share = 0.7
relaxation_time_s = [100.0, 1.0]
shear_modulus_Pa = [20000.0, 90000.0]
[shift]
law = "linear"
slope = "0.05 /K"
[dielectric]
law = "cooling"
permittivity = "4e-11 F/m"
loss = 0.02
[breakdown]
law = "power-of-prestretch"
field = "20 MV/m"
"""
"""A material file with a law of each family but flow."""


@dataclass(frozen=True, slots=True, eq=False)
class Varga(SpringLaw):
    """W = 2 s (l1 + l2 + l3 - 3) + (1 - s) (I1 - 3)/2 with s = `share`: no function of I1 alone."""

    share: float | Floats

    name: ClassVar = "varga"
    title: ClassVar = "Varga"
    constants: ClassVar = (Constant("share", "Of Varga.", at_least=0.0),)

    def stress(self, squared_stretch: Floats) -> Floats:
        third = 1 / (squared_stretch[0] * squared_stretch[1])
        varga = 2 * (np.sqrt(squared_stretch) - np.sqrt(third))
        return np.asarray(self.share * varga + (1 - self.share) * (squared_stretch - third))

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        third = 1 / (squared_stretch[0] * squared_stretch[1])
        (l1, l2), l3 = np.sqrt(squared_stretch), np.sqrt(third)
        varga = np.stack((l1 + l3, l3, l2 + l3))
        gaussian = np.stack((squared_stretch[0] + third, third, squared_stretch[1] + third))
        return self.stress(squared_stretch), np.asarray(self.share * varga + (1 - self.share) * gaussian)

    def energy(self, squared_stretch: Floats) -> Floats:
        third = 1 / (squared_stretch[0] * squared_stretch[1])
        varga = 2 * (np.sqrt(squared_stretch).sum(axis=0) + np.sqrt(third) - 3)
        return np.asarray(self.share * varga + (1 - self.share) * 0.5 * (squared_stretch.sum(axis=0) + third - 3))


@dataclass(frozen=True, slots=True)
class Linear(ShiftLaw):
    """log10 a = -slope (T - T_ref)."""

    reference_temperature: float
    slope: float

    name: ClassVar = "linear"
    title: ClassVar = "linear"
    constants: ClassVar = (Constant("slope", "Of linear.", Dimension("a slope", "1/K", "0.1 /K"), above=0.0),)

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        return np.asarray(-self.slope * (np.asarray(temperature, dtype=float) - self.reference_temperature))

    def label(self) -> str:
        return f"linear, {self.slope:.4g} /K"

    @classmethod
    def fit(cls, base: float, distance: Floats, wanted: Floats, whiten: Floats) -> FittedLaw:
        slope, moments, response, misfit = fit_factor(whiten, -distance, wanted)

        def about(move: float) -> MovedLaw:
            return MovedLaw(cls(base + move, slope), np.eye(1), -slope * move, np.array([-move]), np.zeros(0))

        return FittedLaw(about, moments, response, misfit)


@dataclass(frozen=True, slots=True)
class Power(BreakdownLaw):
    """E_EB = `field` prestretch^`exponent`."""

    field: float
    exponent: float

    name: ClassVar = "power-of-prestretch"
    title: ClassVar = "power"
    constants: ClassVar = (
        Constant("field", "At prestretch 1.", FIELD, above=0.0),
        Constant("exponent", "Of the prestretch.", left_out=1.0),
    )

    def at(self, prestretch: ArrayLike) -> Floats:
        return np.asarray(self.field * np.asarray(prestretch, dtype=float) ** self.exponent)

    def scaled(self, factor: float) -> Power:
        return replace(self, field=factor * self.field)


@dataclass(frozen=True, slots=True)
class Cooling(DielectricLaw):
    """eps = `permittivity` (1 - `loss` (T - 20 degC))."""

    permittivity: float
    loss: float

    name: ClassVar = "cooling"
    title: ClassVar = "cooling"
    constants: ClassVar = (
        Constant("permittivity", "At 20 degC.", PERMITTIVITY, above=0.0),
        Constant("loss", "Of cooling, in 1/K."),
    )

    def at(self, temperature: ArrayLike) -> Floats:
        return np.asarray(self.permittivity * (1 - self.loss * (np.asarray(temperature, dtype=float) - 20)))


@dataclass(frozen=True, slots=True)
class Eyring(FlowLaw):
    """a = sinh(y)/y with y = s/`stress` (H. Eyring, J. Chem. Phys. 4 (1936) 283)."""

    stress: float | Floats

    name: ClassVar = "eyring"
    title: ClassVar = "Eyring flow"
    constants: ClassVar = (Constant("stress", "Of eyring.", STRESS, above=0.0),)

    def activation(self, squared_stress: Floats) -> tuple[Floats, Floats]:
        squared = np.asarray(squared_stress / np.square(self.stress))
        y = np.sqrt(np.maximum(squared, 1e-4))  # a series below
        exact = np.sinh(y) / y, (np.cosh(y) - np.sinh(y) / y) / (2 * y * y)
        series = 1 + squared / 6 + squared**2 / 120, 1 / 6 + squared / 60 + squared**2 / 1680
        value, slope = (np.where(squared < 1e-4, *pair) for pair in zip(series, exact, strict=True))
        return value, slope / np.square(self.stress)


def register() -> None:
    """A line for each."""
    DIELECTRICS.register(Cooling)
    FLOWS.register(Eyring)
    SPRINGS.register(Varga)
    SHIFTS.register(Linear)
    BREAKDOWNS.register(Power)
