"""Gent's spring with a second term in the second invariant."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dielast.base.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.springs.gent import Gent
from dielast.material.springs.law import CardForm, SpringLaw, Symmetry
from dielast.numerics.arrays import Floats


@checked
@dataclass(frozen=True, slots=True, eq=False)
class GentI2(Gent):
    """W = -(1 - s) (J/2) ln(1 - (I1 - 3)/J) + (3 s/(2 m)) ((I2/3)^m - 1), I2 = 1/A + 1/B + 1/C, of unit modulus.

    The second term is (3 s/2) ln(I2/3) for m = 0 (Pucci and Saccomandi, Rubber Chem. Technol. 75 (2002) 839), and that of Mooney
    and Rivlin for m = 1. s = `I2_share` is the share of the second term in the initial shear modulus, m = `I2_exponent`. All are
    numbers, or arrays as in `Gent`. Raises `InputError` for a share outside 0 to 1.
    """

    I2_share: float | Floats = 0.0
    I2_exponent: float | Floats = 0.0

    name: ClassVar = "gent-i2"
    title: ClassVar = "Gent-I2"
    always_stable: ClassVar = False
    constants: ClassVar = (
        Constant(
            "J_lim",
            "gent-i2: value of I1 - 3 at which its first term locks. Default: none, a neo-Hookean term.",
            at_least=1e-6,
            left_out=math.inf,
        ),
        Constant("I2_share", "gent-i2: share of the second term in the shear modulus.", at_least=0.0, at_most=1.0),
        Constant("I2_exponent", "gent-i2: exponent of I2 in the second term. Default: 0, the logarithm of I2.", left_out=0.0),
    )

    def __post_init__(self) -> None:
        Gent.__post_init__(self)
        share = np.asarray(self.I2_share, dtype=float)
        if not np.all((share >= 0) & (share <= 1)):
            wrong = float(share[~((share >= 0) & (share <= 1))].flat[0])
            raise InputError(f"{wrong:g}: the share of the second term is needed, from 0 to 1", argument="I2_share")
        if not np.all(np.isfinite(self.I2_exponent)):
            raise InputError("a finite exponent of I2 is needed", argument="I2_exponent")

    def stress(self, squared_stretch: Floats) -> Floats:
        """Gent's stresses, and p = psi (1/C - 1/A) and q = psi (1/C - 1/B), psi = 2 dW/dI2 = s (I2/3)^(m - 1)."""
        stress = Gent.stress(self, squared_stretch)
        stress *= 1 - np.asarray(self.I2_share)
        stiffness, _, difference = self._second(squared_stretch)
        difference *= stiffness
        stress += difference
        return stress

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Gent's, and dp/dlnA = psi (1/C + 1/A) + psi' (1/C - 1/A)^2, dp/dlnB = psi/C + psi' (1/C - 1/A) (1/C - 1/B), and so on;
        psi' = dpsi/dI2.
        """
        stress, half = Gent.tangent(self, squared_stretch)
        rest = 1 - np.asarray(self.I2_share)
        stress *= rest
        half *= rest
        stiffness, slope, difference = self._second(squared_stretch)
        area_squared = squared_stretch[0] * squared_stretch[1]
        half[::2] += stiffness * (2 * area_squared - difference) + slope * difference * difference
        half[1] += stiffness * area_squared + slope * difference[0] * difference[1]
        stress += stiffness * difference
        return stress, half

    def energy(self, squared_stretch: Floats) -> Floats:
        """Gent's, and (3 s/(2 m)) ((I2/3)^m - 1)."""
        exponent = np.asarray(self.I2_exponent, dtype=float)
        logarithm = np.log(_second_invariant(squared_stretch) / 3)
        power = np.where(exponent == 0, logarithm, np.expm1(exponent * logarithm) / np.where(exponent == 0, 1.0, exponent))
        return np.asarray((1 - np.asarray(self.I2_share)) * Gent.energy(self, squared_stretch) + 1.5 * self.I2_share * power)

    # both terms in the two axes: a short form for a symmetry would have the second term twice
    def axial_stress(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> Floats:
        """p from the stresses in both axes."""
        return SpringLaw.axial_stress(self, symmetry, front, thickness)

    def axial_tangent(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> tuple[Floats, Floats]:
        """p and dp/dlnA from the tangent in both axes."""
        return SpringLaw.axial_tangent(self, symmetry, front, thickness)

    def equibiaxial_tangent(self, front: Floats) -> tuple[Floats, Floats]:
        """dp/dlnA - dp/dlnB and dp/dlnB from the tangent in both axes."""
        return SpringLaw.equibiaxial_tangent(self, front)

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Neo-Hookean, Gent and Mooney-Rivlin of the same modulus: exact without the second term (and J_lim), or for m = 1 without
        J_lim.
        """
        if np.ndim(self.J_lim):
            raise InputError("a card holds Gent springs of one J_lim only", argument="formats")
        limit, share, exponent = float(self.J_lim), float(self.I2_share), float(self.I2_exponent)
        unlimited = math.isinf(limit)
        linear = {"C10": modulus * (1 - share) / 2, "C01": modulus * share / 2}
        return (
            CardForm("neo-hookean", modulus, {}, _NEO_HOOKEAN_NOTES, exact=unlimited and share == 0),
            CardForm("gent", modulus, {"J_lim": limit}, _GENT_NOTES, needs="J_lim" if unlimited else "", exact=share == 0),
            CardForm("mooney-rivlin", modulus, linear, _MOONEY_NOTES, exact=unlimited and (share == 0 or exponent == 1)),
        )

    def _second(self, squared_stretch: Floats) -> tuple[Floats, Floats, Floats]:
        """psi and psi' (...), and 1/C - 1/A and 1/C - 1/B (2, ...)."""
        invariant, exponent = _second_invariant(squared_stretch), np.asarray(self.I2_exponent, dtype=float)
        stiffness = self.I2_share * (invariant / 3) ** (exponent - 1)
        difference = squared_stretch[0] * squared_stretch[1] - 1 / squared_stretch
        return stiffness, stiffness * (exponent - 1) / invariant, difference


def _second_invariant(squared_stretch: Floats) -> Floats:
    """I2 = 1/A + 1/B + A B (...)."""
    inverse = 1 / squared_stretch
    return np.asarray(inverse[0] + inverse[1] + squared_stretch[0] * squared_stretch[1])


_NEO_HOOKEAN_NOTES = (
    "  A neo-Hookean spring of the same modulus has neither the limit J_lim nor the second term: in uniaxial tension that",
    "  term is softer by the share 1 - (I2/3)^(I2_exponent - 1)/stretch of its stiffness.",
)
_GENT_NOTES = (
    "  Gent's spring of the same modulus has all of it in I1: in uniaxial tension the second term is softer by the share",
    "  1 - (I2/3)^(I2_exponent - 1)/stretch, in equibiaxial tension stiffer by (I2/3)^(I2_exponent - 1) stretch^2 - 1.",
)
_MOONEY_NOTES = (
    "  Mooney-Rivlin's second term is linear in I2, too stiff by the share (I2/3)^(1 - I2_exponent) - 1 of the material's;",
    "  its first term is too soft by the share (I1 - 3)/J_lim.",
)
