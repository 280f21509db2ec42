"""The damage laws."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.registry import Registry
from dielast.base.units import FIELD, TIME
from dielast.material.argument_types import checked
from dielast.material.law import OF_DAMAGE, Constant, DamageLaw as DamageLaw
from dielast.numerics.arrays import Floats


@checked
@dataclass(frozen=True, slots=True)
class InversePower(DamageLaw):
    """dD/dt = (|E|/E_0)^n/t_0. The life at a constant field is t_0 (E_0/E)^n; breakdown at E_0 in the limit of infinite n.

    E_0 = `field` in V/m, t_0 = `time` in s, n = `exponent`. Silicone: life falls 62-fold from 80 to 100 V/um (Albuquerque and
    Shea, Smart Mater. Struct. 30 (2021) 125022), which is n = 18.5. Damages of different fields add up (Miner's rule). Raises
    `InputError` for constants that are not positive.
    """

    field: float | Floats
    time: float | Floats
    exponent: float | Floats
    shape: float | Floats | None = None
    reference_area: float | Floats | None = None
    activation_energy: float | Floats | None = None

    name: ClassVar = "inverse-power"
    title: ClassVar = "inverse power law of damage"
    constants: ClassVar = (
        Constant("field", "inverse-power: true field that a film withstands for time.", FIELD, above=0.0),
        Constant("time", "inverse-power: time for which a film withstands field.", TIME, above=0.0),
        Constant("exponent", "inverse-power: exponent; the life falls with this power of the field.", above=0.0),
        *OF_DAMAGE,
    )

    def rate(self, field: ArrayLike) -> Floats:
        """(|E|/E_0)^n/t_0."""
        return np.asarray((np.asarray(field, dtype=float) / self.field) ** self.exponent / self.time)

    def scaled(self, factor: float) -> Self:
        """The law with its field times `factor`."""
        return replace(self, field=factor * self.field)


@checked
@dataclass(frozen=True, slots=True)
class EyringDamage(DamageLaw):
    """dD/dt = sinh(|E|/E_a) / (t_0 sinh(E_0/E_a)). The life at E_0 is t_0, and falls e-fold for each E_a above.

    E_0 = `field` and E_a = `activation_field` in V/m, t_0 = `time` in s. Rates of jumps over a barrier that the field tilts:
    Eyring, J. Chem. Phys. 4 (1936) 283; Dissado and Fothergill, Electrical Degradation and Breakdown in Polymers (1992), Ch. 14.
    Raises `InputError` for constants that are not positive.
    """

    field: float | Floats
    time: float | Floats
    activation_field: float | Floats
    shape: float | Floats | None = None
    reference_area: float | Floats | None = None
    activation_energy: float | Floats | None = None

    name: ClassVar = "eyring"
    title: ClassVar = "Eyring's law of damage"
    constants: ClassVar = (
        Constant("field", "eyring: true field that a film withstands for time.", FIELD, above=0.0),
        Constant("time", "eyring: time for which a film withstands field.", TIME, above=0.0),
        Constant("activation_field", "eyring: the life falls e-fold for each such field above field.", FIELD, above=0.0),
        *OF_DAMAGE,
    )

    def rate(self, field: ArrayLike) -> Floats:
        """sinh(|E|/E_a) / (t_0 sinh(E_0/E_a)), without overflow."""
        x, x0 = np.asarray(field, dtype=float) / self.activation_field, np.asarray(self.field) / self.activation_field
        return np.asarray(np.exp(x - x0) * np.expm1(-2 * x) / np.expm1(-2 * x0) / self.time)

    def scaled(self, factor: float) -> Self:
        """The law with its fields times `factor`."""
        return replace(self, field=factor * self.field, activation_field=factor * self.activation_field)


DAMAGES: Registry[type[DamageLaw]] = Registry("damage law", InversePower, EyringDamage, group="dielast.damage", base=DamageLaw)
