"""Laws of moduli over temperature."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.base.registry import Registry
from dielast.base.units import THERMAL_EXPANSION, ZERO_CELSIUS, parse
from dielast.material.law import Constant, ModulusLaw as ModulusLaw
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True)
class ConstantModulus(ModulusLaw):
    """The modulus at the reference temperature, at all temperatures."""

    name: ClassVar = "constant"
    title: ClassVar = "constant moduli"
    depends_on_temperature: ClassVar = False

    def factor(self, temperature: ArrayLike, reference_temperature: float) -> Floats:
        """1."""
        return np.ones(np.shape(temperature))


@dataclass(frozen=True, slots=True)
class EntropicModulus(ModulusLaw):
    """mu(T) = mu_ref rho T/(rho_ref T_ref), T in kelvin, rho_ref/rho = 1 + `thermal_expansion` (T - T_ref), volumetric in 1/K
    (L. R. G. Treloar, The Physics of Rubber Elasticity, 3rd ed., Eq. 4.9; J. D. Ferry, Viscoelastic Properties of Polymers, 3rd
    ed., ch. 11). The factor is 1/b, with b the "density-temperature" vertical shift of a master curve.
    """

    thermal_expansion: float = 0.0

    name: ClassVar = "entropic"
    title: ClassVar = "entropic moduli"
    constants: ClassVar = (
        Constant(
            "thermal_expansion", "Volumetric thermal expansion of entropic springs. Default: 0.", THERMAL_EXPANSION, left_out=0.0
        ),
    )

    def factor(self, temperature: ArrayLike, reference_temperature: float) -> Floats:
        """rho T/(rho_ref T_ref)."""
        values = np.asarray(temperature, dtype=float)
        expanded = 1 + self.thermal_expansion * (values - reference_temperature)
        for value in values[~(expanded > 0)].flat[:1]:
            wrong = f"a thermal expansion of {self.thermal_expansion:g} /K gives no positive density at {value:g} degC"
            raise InputError(wrong, argument="temperature")
        for value in values[~(values > -ZERO_CELSIUS)].flat[:1]:
            raise InputError(f"{value:g} degC: a temperature above absolute zero is needed", argument="temperature")
        return np.asarray((values + ZERO_CELSIUS) / (expanded * (reference_temperature + ZERO_CELSIUS)))

    @classmethod
    def from_summary(cls, shift: Mapping[str, Any]) -> Self:
        """The law behind a "density-temperature" vertical shift, as a master curve's summary states it; raises `InputError`."""
        stated = shift.get("thermal_expansion")
        return cls() if stated is None else cls(parse(stated, THERMAL_EXPANSION))


CONSTANT_MODULUS = ConstantModulus()
MODULI: Registry[type[ModulusLaw]] = Registry("law of moduli over temperature", ConstantModulus, EntropicModulus)
