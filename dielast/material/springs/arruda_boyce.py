"""The Arruda-Boyce spring: eight chains of finite length, with the exact inverse Langevin function, not its series.

The Langevin function L = coth b - 1/b of a freely jointed chain, its inverse and the chain energy are in double precision.
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dielast.base.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.springs.first_invariant import LimitedLaw
from dielast.material.springs.law import CardForm
from dielast.numerics.arrays import Floats

FRACTION_BELOW, FRACTION_TERMS = 4.0, 15  # b below which L is evaluated as a continued fraction, and its number of terms
NEWTON_STEPS = 3  # the initial error of 0.3 % is squared by every step: 1e-5, 1e-10, rounding
SERIES_BELOW, SERIES_TERMS = 1.0, 9  # b below which ln(sinh b / b) is evaluated as a series, and its number of terms
POLYNOMIAL_BELOW = 0.6  # y^2 up to which a polynomial replaces the inverse; at 0.6, b is 4.4
LANES, DEGREE = 4, 23  # the coefficients of the polynomial are below 1e-16 from degree 22 on


def over_argument(b: Floats) -> tuple[Floats, Floats]:
    """L/b and dL/db at b >= 0 of any shape.

    Where the terms of coth b - 1/b would cancel, L/b is the continued fraction 1/(3 + b^2/(5 + b^2/(7 + ...))) of
    tanh, and dL/db = 1 - L^2 - 2 L/b.
    """
    small = np.minimum(b, FRACTION_BELOW)
    square = small * small
    fraction = np.full_like(small, 2.0 * FRACTION_TERMS + 1)
    for odd in range(2 * FRACTION_TERMS - 1, 2, -2):
        np.divide(square, fraction, out=fraction)
        fraction += odd
    large = np.maximum(b, FRACTION_BELOW)
    less = np.exp(-2 * large)
    far = (1 + less) / (1 - less) - 1 / large
    low = b < FRACTION_BELOW
    ratio = np.where(low, 1 / fraction, far / large)
    slope = np.where(low, 1 - square / fraction**2 - 2 / fraction, large**-2.0 - 4 * less / (1 - less) ** 2)
    return ratio, slope


def by_newton(y: Floats) -> tuple[Floats, Floats]:
    """b/y (3 at y = 0) and db/dy with L(b) = y, at 0 <= y < 1 of any shape; infinite at and beyond 1.

    Newton's method from y (3 - y^2/5 (6 + y^2 - 2 y^4))/(1 - y^2), which has an error of 0.3 % (Kroger 2015,
    DOI 10.1016/j.jnnfm.2015.05.007).
    """
    inside = y < 1
    share = np.where(inside, y, 0.5)
    square = share * share
    b = share * (3 - 0.2 * square * (6 + square * (1 - 2 * square))) / (1 - square)
    for _ in range(NEWTON_STEPS):
        ratio, slope = over_argument(b)
        b -= (ratio * b - share) / slope
    ratio, slope = over_argument(b)
    return np.where(inside, 1 / ratio, np.inf), np.where(inside, 1 / slope, np.inf)


def _coefficients() -> Floats:
    """Coefficients (steps, lanes, 1) of the polynomial in t for (1 - y^2) b/y at y^2 = (1 + t) `POLYNOMIAL_BELOW`/2, in groups of
    `LANES` powers, from the highest group down to the powers 0, 1, 2 and 3.

    It interpolates Newton's method at Chebyshev points. The factor 1 - y^2 removes the pole at y = 1.
    """
    order = np.arange(DEGREE + 1)
    angle = np.pi * (order + 0.5) / order.size
    square = 0.5 * POLYNOMIAL_BELOW * (1 + np.cos(angle))
    series = np.cos(np.outer(order, angle)) @ ((1 - square) * by_newton(np.sqrt(square))[0]) * 2 / order.size
    series[0] /= 2
    powers = np.eye(order.size)  # row k: Chebyshev's polynomial T_k = 2 t T_(k - 1) - T_(k - 2) in powers of t
    for k in order[2:]:
        powers[k] = 2 * np.roll(powers[k - 1], 1) - powers[k - 2]
    return np.asarray((series @ powers).reshape(-1, LANES, 1)[::-1])


_COEFFICIENTS = _coefficients()


def stiffness(square: Floats) -> Floats:
    """b/y with L(b) = y at `square` = y^2 >= 0 of any shape; infinite at and beyond 1."""
    far = square > POLYNOMIAL_BELOW
    if beyond := bool(np.any(far)):
        outside, square = square[far], np.where(far, 0.0, square)
    shape, square = np.shape(square), np.ravel(square)
    t = square * (2 / POLYNOMIAL_BELOW)
    t -= 1
    # the powers are summed in lanes, so that the operations are few and act on long arrays
    squared = t * t
    fourth = squared * squared
    lanes = np.broadcast_to(_COEFFICIENTS[0], (LANES, square.size)).copy()
    for coefficients in _COEFFICIENTS[1:]:
        lanes *= fourth
        lanes += coefficients
    lanes[1::2] *= t
    pairs = lanes[::2]
    pairs += lanes[1::2]
    ratio = pairs[1] * squared
    ratio += pairs[0]
    ratio /= 1 - square
    stiff: Floats = ratio.reshape(shape)
    if beyond:
        stiff[far] = by_newton(np.sqrt(outside))[0]
    return stiff


def stiffness_and_slope(square: Floats) -> tuple[Floats, Floats]:
    """b/y and db/dy with L(b) = y at `square` = y^2 >= 0 of any shape, by dL/db = 1 - y^2 - 2 y/b; infinite at and beyond 1."""
    ratio = stiffness(square)
    slope = np.asarray(1 - square - 2 / ratio)
    with np.errstate(divide="ignore"):
        np.divide(1, slope, out=slope)
    if np.any(far := square > POLYNOMIAL_BELOW):  # where the terms would cancel
        slope[far] = by_newton(np.sqrt(square[far]))[1]
    return ratio, slope


def inverse(y: Floats) -> tuple[Floats, Floats, Floats]:
    """b with L(b) = y, b/y (3 at y = 0), and db/dy, at 0 <= y < 1 of any shape; infinite at and beyond 1."""
    ratio, slope = stiffness_and_slope(y * y)
    return y * ratio, ratio, slope


def chain_energy(y: Floats) -> Floats:
    """Energy y b - ln(sinh b / b) of a chain extended to the fraction y of its length, per link and in units of k T; any shape.

    Its derivative with respect to y is b; it is infinite at and beyond y = 1.
    """
    inside = y < 1
    share = np.where(inside, y, 0.5)
    b = inverse(share)[0]
    small, large = np.minimum(b, SERIES_BELOW), np.maximum(b, SERIES_BELOW)
    square, series = small * small, np.zeros_like(small)  # sinh b / b - 1 = b^2/6 (1 + b^2/20 (1 + b^2/42 (...)))
    for term in range(SERIES_TERMS, 0, -1):
        series = square / (2 * term * (2 * term + 1)) * (1 + series)
    far = large + np.log(-np.expm1(-2 * large)) - np.log(2 * large)
    return np.where(inside, share * b - np.where(b < SERIES_BELOW, np.log1p(series), far), np.inf)


SERIES = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)  # coefficients of W/mu in I1^k/l_m^(2k - 2), as used by codes


@checked
@dataclass(frozen=True, slots=True, eq=False)
class ArrudaBoyce(LimitedLaw):
    """W = (3 l_m/b_0) (y b - ln(sinh b / b)), less its value at rest, with y = sqrt(I1/3)/l_m and L(b) = coth b - 1/b = y;
    b_0 is b at rest (Arruda and Boyce 1993, DOI 10.1016/0022-5096(93)90013-6).

    The factor makes the initial shear modulus 1. `locking_stretch`, l_m, is the stretch sqrt(I1/3) of the chains at which the
    stress is infinite; if it is infinite, the spring is neo-Hookean. It is a number, or an array (n, cases) or (n, 1) of several
    springs. Raises `InputError` for a locking stretch that is not above 1.
    """

    locking_stretch: float | Floats = math.inf
    _share: Floats = field(init=False, repr=False)
    _third: Floats = field(init=False, repr=False)
    _rest: Floats = field(init=False, repr=False)

    name: ClassVar = "arruda-boyce"
    title: ClassVar = "Arruda-Boyce"
    SHORTEST: ClassVar = 1.2
    MEASURE: ClassVar = " of sqrt(I1/3)"
    USUAL: ClassVar = "is it a strain? It is usually 2 to 10"
    constants: ClassVar = (
        Constant("locking_stretch", "arruda-boyce: stretch sqrt(I1/3) of the chains at which they lock.", above=1.0),
    )

    def __post_init__(self) -> None:
        locking = np.asarray(self.locking_stretch, dtype=float)
        if not np.all(locking > 1):
            raise InputError(f"locking_stretch: {float(np.min(locking)):g}: above 1 is needed: chains at rest have a stretch of 1")
        object.__setattr__(self, "_share", 1 / locking)
        object.__setattr__(self, "_third", 1 / (3 * locking**2))
        object.__setattr__(self, "_rest", stiffness(1 / locking**2))

    def stiffness(self, invariant: Floats) -> Floats:
        """(b/y)/(b_0/y_0)."""
        return np.asarray(stiffness(invariant * self._third) / self._rest)

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """phi, and (db/dy - b/y)/(2 I1)/(b_0/y_0), as dy/dI1 = y/(2 I1)."""
        ratio, slope = stiffness_and_slope(invariant * self._third)
        with np.errstate(invalid="ignore"):
            steeper = np.where(np.isfinite(ratio), slope - ratio, np.inf)
        return ratio / self._rest, steeper / (2 * invariant * self._rest)

    def energy_of(self, invariant: Floats) -> Floats:
        """3 l_m^2/(b_0/y_0) times the energy of the chain minus that at rest, or (I1 - 3)/2 if l_m is infinite."""
        ends = self._share > 0
        share = np.where(ends, self._share, 0.5)
        drawn = chain_energy(np.sqrt(invariant / 3) * share) - chain_energy(share)
        return np.asarray(np.where(ends, 3 / (share**2 * self._rest) * drawn, 0.5 * (invariant - 3)))

    def largest_invariant(self) -> Floats:
        """3 l_m^2."""
        return np.asarray(3 * np.square(np.asarray(self.locking_stretch, dtype=float)))

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Arruda-Boyce with the constant mu of the series used by codes; neo-Hookean, an approximation if the chains lock.

        The initial modulus of that series is 2 dW/dI1 at I1 = 3, which is larger than mu.
        """
        share = float(self._share)
        initial = 2 * math.fsum(k * c * (3 * share**2) ** (k - 1) for k, c in enumerate(SERIES, 1))
        constants = {"locking_stretch": float(self.locking_stretch), "mu": modulus / initial}
        needs = "" if share else "locking_stretch"
        return (
            CardForm("neo-hookean", modulus, {}, _NEO_HOOKEAN_NOTES, exact=not share),
            CardForm("arruda-boyce", modulus, constants, _SERIES_NOTES, needs),
        )


_NEO_HOOKEAN_NOTES = (
    "  A neo-Hookean spring has no end; it is too soft by 1 % at sqrt(I1/3) = 0.13 locking_stretch, if that is large.",
)
_SERIES_NOTES = (
    "Arruda-Boyce: the code has the series of five terms in I1; mu is its constant, which makes the initial modulus dielast's.",
    "The series has no end: against the inverse Langevin function it is too soft by 0.5 %, 2.4 % and 10 % at",
    "sqrt(I1/3) = 0.6, 0.7 and 0.8 of locking_stretch.",
)
