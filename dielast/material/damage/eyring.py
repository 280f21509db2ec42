"""Eyring's law: the field favours thermally activated jumps in one direction."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.material.argument_types import checked
from dielast.material.law import OF_DAMAGE, Constant, DamageLaw
from dielast.numerics.arrays import Floats
from dielast.units import FIELD, TIME


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

    def __post_init__(self) -> None:
        self.check_constants()

    def rate(self, field: ArrayLike) -> Floats:
        """sinh(|E|/E_a) / (t_0 sinh(E_0/E_a)), without overflow."""
        x, x0 = np.asarray(field, dtype=float) / self.activation_field, np.asarray(self.field) / self.activation_field
        return np.asarray(np.exp(x - x0) * np.expm1(-2 * x) / np.expm1(-2 * x0) / self.time)

    def lasting(self, factor: float) -> Self:
        """The law with its time times `factor`."""
        return replace(self, time=factor * self.time)

    def scaled(self, factor: float) -> Self:
        """The law with its fields times `factor`."""
        return replace(self, field=factor * self.field, activation_field=factor * self.activation_field)
