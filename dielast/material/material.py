"""A dielectric elastomer: its equilibrium spring, relaxation processes, shift law and dielectric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.io.result import Result
from dielast.material.breakdown import Breakdown, BreakdownLaw
from dielast.material.calibrated import CalibratedRange
from dielast.material.damage import DamageLaw
from dielast.material.dielectric import VACUUM_PERMITTIVITY, ConstantPermittivity, DielectricLaw
from dielast.material.modulus import CONSTANT_MODULUS, ModulusLaw
from dielast.material.shift import ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent, SpringLaw
from dielast.numerics.arrays import Floats

__all__ = ["NEO_HOOKEAN", "VACUUM_PERMITTIVITY", "Breakdown", "Material"]

NEO_HOOKEAN = Gent()


@dataclass(frozen=True, slots=True, repr=False)
class Material(Result):
    """A viscoelastic dielectric elastomer; SI units, temperatures in degC.

    `equilibrium_modulus` is the shear modulus mu_eq in Pa of the spring `equilibrium_law`; `spectrum` holds the relaxation
    processes, whose springs have the `nonequilibrium_law`. Both hold at the reference temperature; `equilibrium_scaling` and
    `nonequilibrium_scaling` state how the moduli depend on temperature. `permittivity` is a number in F/m, or the law of a
    dielectric. `measured_temperature` is the range in which the shift law was measured, None if unknown. `damage` is the law of
    ageing in a field, None if it is not considered. `calibrated` is the range of the tests to which the material was fitted, if
    any.
    """

    name: str
    equilibrium_modulus: float
    spectrum: Spectrum
    shift: ShiftLaw
    equilibrium_law: SpringLaw = NEO_HOOKEAN
    nonequilibrium_law: SpringLaw = NEO_HOOKEAN
    permittivity: float | DielectricLaw | None = None
    breakdown: BreakdownLaw | None = None
    measured_temperature: tuple[float, float] | None = None
    damage: DamageLaw | None = None
    equilibrium_scaling: ModulusLaw = CONSTANT_MODULUS
    nonequilibrium_scaling: ModulusLaw = CONSTANT_MODULUS
    calibrated: CalibratedRange | None = None

    @property
    def reference_temperature(self) -> float:
        """Temperature in degC at which the spectrum holds."""
        return self.shift.reference_temperature

    @property
    def dielectric(self) -> DielectricLaw | None:
        """The law of the permittivity, None if it is unknown."""
        if not self.permittivity:
            return None
        return self.permittivity if isinstance(self.permittivity, DielectricLaw) else ConstantPermittivity(self.permittivity)

    def relaxation_time(self, temperature: ArrayLike) -> Floats:
        """Relaxation times in s at `temperature` (degC) of any shape; the branches are a new last axis.

        Raises `InputError` where the shift law does.
        """
        shift_factor = 10 ** self.shift.log10_shift_factor(temperature)
        return np.asarray(shift_factor[..., None] * self.spectrum.relaxation_time)
