"""Ogden's spring: a sum of powers of the principal stretches."""

from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from dielast.base.errors import InputError
from dielast.base.units import STRESS
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.springs.law import CardForm, ScaledLaw, Symmetry
from dielast.numerics.arrays import Floats

STEEPEST = 50.0  # largest exponent: at a stretch of 10, larger powers would soon overflow


@checked
@dataclass(frozen=True, slots=True, eq=False)
class Ogden(ScaledLaw):
    """W = sum mu_p/alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3) (Ogden 1972, DOI 10.1098/rspa.1972.0026), with the initial
    shear modulus sum mu_p alpha_p / 2.

    `mu` in Pa, or in any other unit: a spring of modulus m has mu_p m / (sum mu_q alpha_q / 2). Terms are along the first axis.
    Raises `InputError` for invalid exponents, and for lists of different length.
    """

    mu: tuple[float, ...] | Floats
    alpha: tuple[float, ...] | Floats
    _weight: Floats = field(init=False, repr=False)
    _power: Floats = field(init=False, repr=False)

    name: ClassVar = "ogden"
    title: ClassVar = "Ogden"
    modulus_formula: ClassVar = "sum mu_p alpha_p / 2"
    takes_modulus: ClassVar = False
    stresses: ClassVar = ("mu",)
    constants: ClassVar = (
        Constant("mu", "ogden: mu_p of each term; the energy has the factor mu_p/alpha_p.", STRESS, many=True),
        Constant("alpha", "ogden: exponent alpha_p of each term.", many=True),
    )

    def __post_init__(self) -> None:
        moduli, exponents = (np.atleast_1d(np.asarray(value, dtype=float)) for value in (self.mu, self.alpha))
        if len(moduli) != len(exponents):
            raise InputError(f"{len(moduli)} mu but {len(exponents)} alpha: one of each is needed for every term")
        for exponent in exponents[(exponents == 0) | (np.abs(exponents) > STEEPEST)][:1]:
            raise InputError(f"alpha: {exponent:g}: an exponent from -{STEEPEST:g} to {STEEPEST:g} other than 0 is needed")
        self._check_modulus(moduli, exponents)
        object.__setattr__(self, "_weight", moduli / self.modulus_of())
        object.__setattr__(self, "_power", 0.5 * exponents)

    def modulus_of(self) -> Floats:
        """Sum mu_p alpha_p / 2."""
        return np.asarray(0.5 * np.sum(np.multiply(self.mu, self.alpha), axis=0))

    def stress(self, squared_stretch: Floats) -> Floats:
        """p = sum w (A^h - C^h) and q = sum w (B^h - C^h), h = alpha/2 and w = mu over the initial modulus."""
        log, third = _logarithms(squared_stretch)
        carried = np.zeros_like(log)
        for weight, power in zip(self._weight, self._power, strict=True):
            carried += weight * (np.exp(power * log) - np.exp(power * third))
        return carried

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses, and dp/dlnA = sum w h (A^h + C^h), dp/dlnB = sum w h C^h, and so on."""
        log, third = _logarithms(squared_stretch)
        carried, half = np.zeros_like(log), np.zeros((3, *third.shape))
        for weight, power in zip(self._weight, self._power, strict=True):
            front, back = np.exp(power * log), np.exp(power * third)
            carried += weight * (front - back)
            half[::2] += weight * power * (front + back)
            half[1] += weight * power * back
        return carried, half

    def energy(self, squared_stretch: Floats) -> Floats:
        """Sum w/alpha (l1^alpha + l2^alpha + l3^alpha - 3), with 1 subtracted from each power separately."""
        log, third = _logarithms(squared_stretch)
        total = np.zeros_like(third)
        for weight, power in zip(self._weight, self._power, strict=True):
            total += weight / (2 * power) * (np.expm1(power * log).sum(axis=0) + np.expm1(power * third))
        return np.asarray(total)

    def axial_stress(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> Floats:
        """Sum w (A^h - C^h)."""
        log, carried = np.log(front), np.zeros_like(front)
        for weight, power in zip(self._weight, self._power, strict=True):
            first, last = _powers(symmetry, power * log)
            first -= last
            first *= weight
            carried += first
        return carried

    def axial_tangent(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> tuple[Floats, Floats]:
        """Sum w (A^h - C^h), and sum w h (A^h + `thinning` C^h)."""
        log, carried, slope = np.log(front), np.zeros_like(front), np.zeros_like(front)
        for weight, power in zip(self._weight, self._power, strict=True):
            first, last = _powers(symmetry, power * log)
            carried += weight * (first - last)
            slope += weight * power * (first + symmetry.thinning * last)
        return carried, slope

    def unlimited(self) -> Self:
        """One term with the exponent 2, and the other terms without stress."""
        count = len(np.atleast_1d(np.asarray(self.mu)))
        return type(self)((1.0,) + (0.0,) * (count - 1), (2.0,) * count)

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Ogden; Mooney-Rivlin if the exponents are 2 and -2; neo-Hookean, an approximation unless all exponents are 2."""
        weights, powers = self._weight.tolist(), self._power.tolist()
        carrying = {power for power, weight in zip(powers, weights, strict=True) if weight != 0}
        pairs: dict[str, float] = {}
        for index, (weight, power) in enumerate(zip(weights, powers, strict=True), 1):
            pairs |= {f"mu_{index}": modulus * weight, f"alpha_{index}": 2 * power}
        first = float(np.sum(self._weight[self._power == 1.0]))
        mooney_rivlin = CardForm("mooney-rivlin", modulus, {"C10": modulus / 2 * first, "C01": modulus / 2 * (1 - first)})
        return (
            CardForm("neo-hookean", modulus, {}, _NEO_HOOKEAN_NOTES, exact=carrying == {1.0}),
            CardForm("ogden", modulus, pairs),
            *([mooney_rivlin] if carrying == {1.0, -1.0} else []),
        )


def _logarithms(squared_stretch: Floats) -> tuple[Floats, Floats]:
    """ln A and ln B (2, ...), and ln C (...)."""
    log = np.log(squared_stretch)
    return log, -(log[0] + log[1])


def _powers(symmetry: Symmetry, exponent: Floats) -> tuple[Floats, Floats]:
    """A^h and C^h = A^(-h `thinning`) from h ln A (...) with a single exponential; `thinning` is 1/2 or 2."""
    if symmetry.thinning > 1:
        front = np.exp(exponent)
        return front, 1 / (front * front)
    root = np.exp(symmetry.thinning * exponent)
    return root * root, 1 / root


_NEO_HOOKEAN_NOTES = ("  A neo-Hookean spring has one exponent, 2, and the same modulus: it is right at small strain only.",)
