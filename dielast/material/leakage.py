"""Leakage: the current through a film under a field, which discharges it."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.numerics.arrays import Cases, Floats


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Leakage(Result):
    """The true current density j = sigma_0 exp(|E|/E_c) E in A/m^2 of a true field E in V/m: a `conductivity` sigma_0 in S/m that
    grows by a factor e in every `field` E_c in V/m; by default it is constant, Ohm's law. Both are one number, or one for each
    case.

    This is how leakage through VHB is commonly fitted (Foo, Cai, Koh, Bauer and Suo, J. Appl. Phys. 111 (2012) 034102).
    Raises `InputError` for a conductivity that is negative or a field that is not positive.
    """

    conductivity: ArrayLike = 0.0
    field: ArrayLike = np.inf

    def __post_init__(self) -> None:
        conductivity, field = (np.asarray(value, dtype=float) for value in (self.conductivity, self.field))
        if not np.all(np.isfinite(conductivity) & (conductivity >= 0)):
            worst = float(np.min(conductivity))
            raise InputError(f"conductivity {worst:g} S/m: a finite number of at least 0 is needed", argument="leakage")
        if not np.all(field > 0):
            worst = float(np.min(field))
            raise InputError(f"field {worst:g} V/m: a positive number is needed; leave it out for Ohm's law", argument="leakage")

    def varied(self) -> list[ArrayLike]:
        """The constants that may be arrays (cases,)."""
        return [self.conductivity, self.field]

    def take(self, cases: Cases) -> Self:
        """The leakage of some of the cases."""
        return type(self)(np.asarray(self.conductivity)[cases], np.asarray(self.field)[cases])

    def current_density(self, true_field: Floats) -> Floats:
        """j in A/m^2, with its sign, at a true field in V/m."""
        return np.asarray(self.conductivity * np.exp(np.abs(true_field) / self.field) * true_field)

    def slope(self, true_field: Floats) -> Floats:
        """dj/dE in S/m."""
        share = np.abs(true_field) / self.field
        return np.asarray(self.conductivity * np.exp(share) * (1 + share))
