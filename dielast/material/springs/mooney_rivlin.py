"""The Mooney-Rivlin spring: linear in both invariants."""

from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from dielast.base.units import STRESS
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.springs.law import CardForm, ScaledLaw
from dielast.numerics.arrays import Floats


@checked
@dataclass(frozen=True, slots=True, eq=False)
class MooneyRivlin(ScaledLaw):
    """W = C10 (I1 - 3) + C01 (I2 - 3), I2 = 1/A + 1/B + 1/C (Rivlin 1948, DOI 10.1098/rsta.1948.0024), with the initial shear
    modulus 2 (C10 + C01).

    The constants are in Pa, or in any other unit: a spring of modulus mu has W = (mu/2) ((1 - s) (I1 - 3) + s (I2 - 3)) with
    s = C01/(C10 + C01).
    """

    C10: float | Floats
    C01: float | Floats = 0.0
    _share: Floats = field(init=False, repr=False)

    name: ClassVar = "mooney-rivlin"
    title: ClassVar = "Mooney-Rivlin"
    modulus_formula: ClassVar = "2 (C10 + C01)"
    takes_modulus: ClassVar = False
    stresses: ClassVar = ("C10", "C01")
    constants: ClassVar = (
        # otherwise the tension falls at large stretches of one mode or another
        Constant("C10", "mooney-rivlin: coefficient of I1 - 3.", STRESS, possible=0.0),
        Constant("C01", "mooney-rivlin: coefficient of I2 - 3.", STRESS, possible=0.0),
    )

    def __post_init__(self) -> None:
        self._check_modulus(self.C10, self.C01)
        object.__setattr__(self, "_share", np.asarray(self.C01) / np.add(self.C10, self.C01))

    def modulus_of(self) -> Floats:
        """2 (C10 + C01)."""
        return np.asarray(2 * np.add(self.C10, self.C01, dtype=float))

    def stress(self, squared_stretch: Floats) -> Floats:
        """p = (A - C) (1 - s + s B) and q = (B - C) (1 - s + s A), as 1/C - 1/A = (A - C) B."""
        carried = squared_stretch - 1 / (squared_stretch[0] * squared_stretch[1])
        carried *= self._share * squared_stretch[::-1] + (1 - self._share)
        return np.asarray(carried)

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses, and dp/dlnA = (1 - s) (A + C) + s (AB + 1/A), dp/dlnB = (1 - s) C + s AB, and so on."""
        area_squared = squared_stretch[0] * squared_stretch[1]
        third, share, rest = 1 / area_squared, self._share, 1 - self._share
        half = np.empty((3, *area_squared.shape))
        half[1] = rest * third + share * area_squared
        half[::2] = half[1] + rest * squared_stretch + share / squared_stretch
        return self.stress(squared_stretch), half

    def energy(self, squared_stretch: Floats) -> Floats:
        """((1 - s) (I1 - 3) + s (I2 - 3))/2."""
        area_squared = squared_stretch[0] * squared_stretch[1]
        first = squared_stretch[0] + squared_stretch[1] + 1 / area_squared - 3
        second = 1 / squared_stretch[0] + 1 / squared_stretch[1] + area_squared - 3
        return np.asarray(0.5 * ((1 - self._share) * first + self._share * second))

    def unlimited(self) -> Self:
        """C01 = 0."""
        return type(self)(1.0)

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Mooney-Rivlin, or Ogden with the exponents 2 and -2; neo-Hookean, an approximation unless C01 = 0."""
        share = float(self._share)
        first, second = modulus * (1 - share), modulus * share
        return (
            CardForm("neo-hookean", modulus, {}, _NEO_HOOKEAN_NOTES, exact=share == 0),
            CardForm("mooney-rivlin", modulus, {"C10": first / 2, "C01": second / 2}),
            CardForm("ogden", modulus, {"mu_1": first, "alpha_1": 2.0, "mu_2": -second, "alpha_2": -2.0}),
        )


_NEO_HOOKEAN_NOTES = (
    "  A neo-Hookean spring of the same modulus puts I1 - 3 for I2 - 3: in uniaxial tension it is too stiff by the share",
    "  C01/(C10 + C01) (1 - 1/stretch), in equibiaxial tension too soft by C01/(C10 + C01) (stretch^2 - 1).",
)
