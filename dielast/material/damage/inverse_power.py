"""The inverse power law: the life of a film decreases with a power of the field."""

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

    def __post_init__(self) -> None:
        self.check_constants()

    def rate(self, field: ArrayLike) -> Floats:
        """(|E|/E_0)^n/t_0."""
        return np.asarray((np.asarray(field, dtype=float) / self.field) ** self.exponent / self.time)

    def lasting(self, factor: float) -> Self:
        """The law with its time times `factor`."""
        return replace(self, time=factor * self.time)

    def scaled(self, factor: float) -> Self:
        """The law with its field times `factor`."""
        return replace(self, field=factor * self.field)
