"""Energies of hyperelastic springs: W(l1, l2) in J per undeformed m^3, plane stress, incompressible.

Every function takes the principal in-plane stretches l1, l2 (any shape; real, complex or `Taylor`), then the law's constants, and
writes the law down in l1, l2 and l3 = 1/(l1 l2) with W = 0 at rest. Nominal stress is dW/dl_i, true stress less the pressure that
keeps the surface free l_i dW/dl_i. `stress` and `tangent` differentiate: the first by a complex step, exact to rounding, the second
by Taylor numbers, exact as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from peers.taylor import Taylor, log, stretches

Energy = Callable[[Any, Any], Any]

STEP = 1e-30  # of a complex step: its square is nothing beside 1
FRACTION_BELOW, FRACTION_TERMS = 4.0, 15  # |beta| below which the Langevin function is a continued fraction, of so many terms


def invariants(l1: Any, l2: Any) -> tuple[Any, Any]:
    """I1 = l1^2 + l2^2 + l3^2 and I2 = l1^-2 + l2^-2 + l3^-2 with l3 = 1/(l1 l2)."""
    a, b = l1 * l1, l2 * l2
    return a + b + (a * b) ** -1.0, a**-1.0 + b**-1.0 + a * b


def neo_hookean(l1: Any, l2: Any, mu: float) -> Any:
    """W = mu/2 (I1 - 3); Treloar 1943. mu in Pa."""
    return mu / 2 * (invariants(l1, l2)[0] - 3)


def gent(l1: Any, l2: Any, mu: float, limit: float) -> Any:
    """W = -mu J/2 ln(1 - (I1 - 3)/J); Gent 1996. mu in Pa, J = `limit` dimensionless."""
    return -mu * limit / 2 * log(1 - (invariants(l1, l2)[0] - 3) / limit)


def gent_i2(l1: Any, l2: Any, mu1: float, limit: float, mu2: float, m: float) -> Any:
    """W = -mu1 J/2 ln(1 - (I1 - 3)/J) + 3 mu2/(2 m) ((I2/3)^m - 1), m = 0: 3 mu2/2 ln(I2/3); Pucci and Saccomandi 2002."""
    share = invariants(l1, l2)[1] / 3
    return gent(l1, l2, mu1, limit) + 1.5 * mu2 * (log(share) if m == 0 else (share**m - 1) / m)


def yeoh(l1: Any, l2: Any, c10: float, c20: float, c30: float) -> Any:
    """W = C10 (I1 - 3) + C20 (I1 - 3)^2 + C30 (I1 - 3)^3; Yeoh 1993. All in Pa, mu = 2 C10."""
    y = invariants(l1, l2)[0] - 3
    return (c10 + (c20 + c30 * y) * y) * y


def mooney_rivlin(l1: Any, l2: Any, c10: float, c01: float) -> Any:
    """W = C10 (I1 - 3) + C01 (I2 - 3); Rivlin 1948. Both in Pa, mu = 2 (C10 + C01)."""
    first, second = invariants(l1, l2)
    return c10 * (first - 3) + c01 * (second - 3)


def ogden(l1: Any, l2: Any, mu: Sequence[float], alpha: Sequence[float]) -> Any:
    """W = sum mu_p/alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3); Ogden 1972.

    mu_p in Pa, alpha_p dimensionless; the initial shear modulus is sum mu_p alpha_p / 2.
    """
    terms = [m / a * (l1**a + l2**a + (l1 * l2) ** -a - 3) for m, a in zip(mu, alpha, strict=True)]
    return sum(terms[1:], terms[0])


def arruda_boyce(l1: Any, l2: Any, mu: float, locking: float) -> Any:
    """W = 3 mu l_m / beta_0 [y beta + ln(beta / sinh beta)], less its value at rest; Arruda and Boyce 1993.

    y = sqrt(I1/3)/l_m is the share of the chain's length that is used up, coth beta - 1/beta = y, and beta_0 is beta at rest. The
    factor makes mu (Pa) the initial shear modulus; l_m = `locking` is the chain stretch at which the stress is infinite.
    """
    rest = np.array(1 / locking)
    front = 3 * mu * locking / inverse_langevin(rest)
    return front * (chain((invariants(l1, l2)[0] / 3) ** 0.5 / locking) - chain(rest))


def chain(y: Any) -> Any:
    """y beta + ln(beta / sinh beta) of the relative chain length y, 0 < y < 1; its derivative in y is beta.

    A complex y is a complex step away from a real one, where the first order is exact to rounding.
    """
    length = y.parts[0] if isinstance(y, Taylor) else np.real(y)
    beta = inverse_langevin(length)
    value = length * beta + np.log(2 * beta) - beta - np.log(-np.expm1(-2 * beta))  # sinh beta = exp(beta) (1 - exp(-2 beta)) / 2
    return y.function(value, beta, 1 / langevin(beta)[1]) if isinstance(y, Taylor) else value + beta * (y - length)


def langevin(beta: Any) -> tuple[Any, Any]:
    """L = coth beta - 1/beta and its derivative 1/beta^2 - 1/sinh^2 beta, any shape, beta > 0, to rounding.

    Where the terms would cancel, L is the continued fraction beta/(3 + beta^2/(5 + beta^2/(7 + ...))), as follows from that of
    tanh, and the derivative 1 - L^2 - 2 L/beta.
    """
    square, fraction = beta * beta, 2.0 * FRACTION_TERMS + 1
    for odd in range(2 * FRACTION_TERMS - 1, 2, -2):
        fraction = odd + square / fraction
    low = np.abs(beta) < FRACTION_BELOW
    small, large = beta / fraction, np.where(low, FRACTION_BELOW, beta)
    less = np.exp(-2 * large)
    value = np.where(low, small, (1 + less) / (1 - less) - 1 / large)
    return value, np.where(low, 1 - small**2 - 2 / fraction, large**-2.0 - 4 * less / (1 - less) ** 2)


def inverse_langevin(y: Any) -> Any:
    """beta with coth beta - 1/beta = y, any shape, 0 < y < 1: Newton's method from y F/(1 - y^2).

    F lies between 2 and 3 and is interpolated in a table to 1e-6, so that two steps go to rounding.
    """
    y = np.where(y < 1, y, np.nan)  # no chain is longer than it can be
    return newton(y, y * np.interp(y, LENGTHS, FACTORS) / (1 - y * y), 2)


def newton(y: Any, beta: Any, steps: int) -> Any:
    """Steps towards coth beta - 1/beta = y."""
    for _ in range(steps):
        value, slope = langevin(beta)
        beta = beta - (value - y) / slope
    return beta


LENGTHS = np.linspace(1e-3, 0.9999, 1000)
FACTORS = newton(LENGTHS, LENGTHS * (3 - LENGTHS**2) / (1 - LENGTHS**2), 6) * (1 - LENGTHS**2) / LENGTHS


def stress(energy: Energy, l1: Any, l2: Any) -> NDArray[np.float64]:
    """Nominal stresses dW/dl1 and dW/dl2 in Pa, shape (2, ...), by complex steps."""
    return np.imag(energy(np.add.outer([1j * STEP, 0.0], l1), np.add.outer([0.0, 1j * STEP], l2))) / STEP


def tangent(energy: Energy, l1: Any, l2: Any) -> NDArray[np.float64]:
    """d2W/dl_i dl_j in Pa, shape (2, 2, ...), from the Taylor numbers in ln l: (K_ij - p_i delta_ij)/(l_i l_j)."""
    _, p1, p2, k11, k12, k22 = energy(*stretches(np.log(np.stack(np.broadcast_arrays(l1, l2))))).parts
    cross = k12 / (l1 * l2)
    return np.stack((np.stack(((k11 - p1) / l1**2, cross)), np.stack((cross, (k22 - p2) / l2**2))))
