"""A dielectric elastomer: an equilibrium spring, relaxation processes, a shift law, a dielectric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.io.result import Result
from dielast.material.arguments import real_number
from dielast.material.breakdown import Breakdown, BreakdownLaw
from dielast.material.damage import DamageLaw
from dielast.material.dielectric import VACUUM_PERMITTIVITY, ConstantPermittivity, DielectricLaw
from dielast.material.modulus import CONSTANT_MODULUS, ModulusLaw
from dielast.material.shift import ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent, SpringLaw
from dielast.numerics.arrays import Floats

__all__ = ["NEO_HOOKEAN", "VACUUM_PERMITTIVITY", "Breakdown", "Material"]

NEO_HOOKEAN = Gent()


@dataclass(frozen=True, slots=True)
class CalibratedRange(Result):
    """The range of the tests to which a material was fitted: `modes` of loading, the largest first invariant I1 of the stretches,
    the shortest and longest `time` in s, and the lowest and highest `temperature` in degC.
    """

    modes: tuple[str, ...]
    largest_invariant: float
    time: tuple[float, float]
    temperature: tuple[float, float]


@dataclass(frozen=True, slots=True, repr=False)
class Material(Result):
    """A viscoelastic dielectric elastomer; SI units, temperatures in degC.

    `equilibrium_modulus` is the shear modulus mu_eq in Pa of the spring `equilibrium_law`; `spectrum` holds the relaxation
    processes at the reference temperature, each with the spring `nonequilibrium_law`; `permittivity` is a
    number in F/m or the law of a dielectric.
    `measured_temperature` is the range in which the shift factors were measured, None if unknown. The moduli hold at the reference
    temperature; `equilibrium_scaling` and `nonequilibrium_scaling` say how those of the equilibrium spring and of the branches
    change with temperature. `breakdown` and `damage` are criteria of electrical failure, None for none. `calibrated` is the range
    of the tests that the material was fitted to, None if it was not fitted.
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

    def __post_init__(self) -> None:
        real_number(self.equilibrium_modulus, "equilibrium_modulus")

    @property
    def reference_temperature(self) -> float:
        """Temperature in degC at which the spectrum holds."""
        return self.shift.reference_temperature

    @property
    def dielectric(self) -> DielectricLaw | None:
        """The law of the permittivity; None if none is stated."""
        if not self.permittivity:
            return None
        return self.permittivity if isinstance(self.permittivity, DielectricLaw) else ConstantPermittivity(self.permittivity)

    def relaxation_time(self, temperature: ArrayLike) -> Floats:
        """Relaxation times in s at `temperature` (degC) of any shape; the branches are a new last axis.

        Raises `InputError` at temperatures at which the shift law does not hold.
        """
        shift_factor = 10 ** self.shift.log10_shift_factor(temperature)
        return np.asarray(shift_factor[..., None] * self.spectrum.relaxation_time)
