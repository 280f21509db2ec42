"""The Langevin function L = coth b - 1/b of a freely jointed chain, its inverse, and the chain energy, to double precision."""

import numpy as np

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
