"""What a dielectric elastomer is: an equilibrium spring, relaxation processes, a shift law, a dielectric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError
from dielast.io.result import Result
from dielast.material.shift import ShiftLaw
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent, SpringLaw

NEO_HOOKEAN = Gent()
VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018


@dataclass(frozen=True, slots=True, repr=False)
class Breakdown(Result):
    """Breakdown field in V/m over equibiaxial prestretch, linear in between; beyond its ends the nearest entry holds."""

    prestretch: tuple[float, ...]
    field: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.prestretch) != len(self.field) or not self.field:
            raise InputError(
                f"{len(self.prestretch)} prestretches but {len(self.field)} breakdown fields: one field for each is needed"
            )
        if any(b <= a for a, b in zip(self.prestretch, self.prestretch[1:], strict=False)):
            raise InputError("breakdown prestretches must ascend")
        if any(value <= 0 for value in self.field):
            raise InputError("a breakdown field must be positive")

    def at(self, prestretch: ArrayLike) -> NDArray[np.float64]:
        """The field in V/m at equibiaxial prestretches of any shape; of unequal ones, take the square root of their product."""
        return np.asarray(np.interp(np.asarray(prestretch, dtype=float), self.prestretch, self.field))

    def is_known_at(self, prestretch: ArrayLike) -> NDArray[np.bool_]:
        """Whether equibiaxial prestretches (any shape) lie within those stated, so that no neighbour stands in for them."""
        values, ends = np.asarray(prestretch, dtype=float), (self.prestretch[0], self.prestretch[-1])
        # rounding is forgiven
        return (len(self.prestretch) == 1) | ((values >= ends[0] * (1 - 1e-9)) & (values <= ends[1] * (1 + 1e-9)))


@dataclass(frozen=True, slots=True, repr=False)
class Material(Result):
    """A viscoelastic dielectric elastomer; SI units, temperatures in degC.

    `equilibrium_modulus` is the shear modulus mu_eq in Pa of the spring `equilibrium_law`; `spectrum` holds the relaxation
    processes at the reference temperature, each with the spring `nonequilibrium_law`; `permittivity` in F/m.
    `measured_temperature` is the range that the shift law was measured in, if that is known.
    """

    name: str
    equilibrium_modulus: float
    spectrum: Spectrum
    shift: ShiftLaw
    equilibrium_law: SpringLaw = NEO_HOOKEAN
    nonequilibrium_law: SpringLaw = NEO_HOOKEAN
    permittivity: float | None = None
    breakdown: Breakdown | None = None
    measured_temperature: tuple[float, float] | None = None

    @property
    def reference_temperature(self) -> float:
        """Temperature in degC at which the spectrum holds."""
        return self.shift.reference_temperature

    def relaxation_time(self, temperature: ArrayLike) -> NDArray[np.float64]:
        """Relaxation times in s at `temperature` (degC) of any shape; the branches are a new last axis.

        Raises `InputError` where the shift law does.
        """
        shift_factor = 10 ** self.shift.log10_shift_factor(temperature)
        return np.asarray(shift_factor[..., None] * self.spectrum.relaxation_time)
