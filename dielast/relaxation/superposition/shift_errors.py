"""The covariance of shift factors from the scatter of the points: what the curves determine, and no more.

Three things make that of a least-squares fit too small where curves are nearly level.

The spreads of vertical offsets and tilts are hardly known then, and either looks like a shift. The errors are therefore those of
the mixture of the normal distributions that belong to all probable spreads, and to a drift. The mixture has a long tail, so that
its variance is that of spreads that are hardly probable; a standard error is therefore a width at which the interval of `LEVEL`
holds this much of the mixture.

A smooth curve through noise is never quite straight, so that every curve seems to fit its place alone. Noise in the slope S of the
smooth curves adds N = E[dS' M dS] to the information S' M S on the shifts, where M are the weights less what the curves, offsets
and tilts explain. The covariance V = (S' M S)^-1 of an estimate with exact slopes becomes V + V N V to first order (W. A. Fuller,
Measurement Error Models, 1987, Sec. 2.2).

The slope at the place of a curve is that of its neighbourhood, and known no better. A shift by w decades is refuted by the distance
w / sqrt(V + L w^2) in standard deviations, where L V = V N V: the limits of a ratio of two uncertain numbers (E. C. Fieller, J. R.
Stat. Soc. B 16 (1954) 175), or a profile likelihood over the shift. If L is too large, no shift is refuted.
"""

from dataclasses import replace

import numpy as np

from dielast.numerics.arrays import Floats
from dielast.relaxation.superposition.effects import probable
from dielast.relaxation.superposition.joint_problem import LOOSE, State, cross_products, with_random

LEVEL = 0.9  # of the intervals by which the distribution of a shift is measured
QUANTILE = 1.6448536269514722  # standard deviations of a normal distribution at that level
BISECTIONS = 30
SMALLEST_ERROR = 1e-7  # decades
NO_INFORMATION = 1e-12  # eigenvalue of normal equations, over the largest


def shift_covariance(state: State) -> Floats:
    """The covariance of the free parameters of a fit, from the scatter of its points and the offsets and tilts of its curves.

    An offset of probable size that was fitted as a shift, or the reverse, counts as an error.
    """
    prior, m, repeated = state.prior, state.points.curves, state.repeated
    random = prior.random_parameters(m)
    place = np.searchsorted(prior.free, random)
    moved = np.flatnonzero(prior.free < m)
    normal, gradient = state.normal.copy(), state.gradient.copy()
    precision = prior.precision[np.ix_(random, random)]
    normal[np.ix_(place, place)] -= precision
    gradient[place] -= precision @ state.theta[random]
    normal, gradient = normal / repeated, gradient / repeated
    shifts = np.ix_(prior.free[moved], prior.free[moved])
    by_curve = _slope_products(state)
    slopes = _slope_noise(state, by_curve, state.inverse)[shifts]
    probability, precisions = np.ones(1), np.zeros((1, 0, 0))
    if random.size:
        of_effects, right = effect_equations(state, _slope_noise(state, by_curve, _bent_by_offsets(state))[shifts])
        probability, precisions = probable(prior.random, of_effects, right)
    full = np.repeat(normal[None], probability.size, axis=0)
    full[:, place[:, None], place] += precisions
    inverse = np.linalg.inv(full)
    slope = np.repeat(gradient[None], probability.size, axis=0)
    slope[:, place] += precisions @ state.theta[random]
    step = np.einsum("sij,sj->si", inverse, slope)
    noise = _noise_information(state, full, slopes, by_curve)
    response = inverse[:, :, moved]
    blurred = response @ noise @ np.swapaxes(response, 1, 2)
    within = inverse + step[:, :, None] * step[:, None, :]
    mixed = np.einsum("s,sij->ij", probability, within + blurred)
    variance, blur = (np.maximum(np.einsum("sii->si", matrix), 0.0) for matrix in (within, blurred))
    stderr = _mixture_errors(probability, variance, blur / np.maximum(np.einsum("sii->si", inverse), 1e-300))
    scale = stderr / np.sqrt(np.maximum(np.diag(mixed), 1e-300))
    return np.asarray(mixed * scale[:, None] * scale)


def _mixture_errors(probability: Floats, variance: Floats, doubt: Floats) -> Floats:
    """Standard errors (p,) of the mixture of distributions with the `probability` (s,), each with a `variance` (s, p) of its
    parameters at exact slopes, and the `doubt` (s, p) of the slopes, L above.
    """
    from scipy.special import ndtr  # slow to load

    low, high = np.full(variance.shape[1], np.log(SMALLEST_ERROR)), np.full(variance.shape[1], -np.log(LOOSE) / 2)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        square = (QUANTILE * np.exp(middle)) ** 2
        held = probability @ (2 * ndtr(np.sqrt(square / (variance + doubt * square + 1e-300))) - 1)
        low, high = np.where(held < LEVEL, middle, low), np.where(held < LEVEL, high, middle)
    return np.asarray(np.exp(high))


def effect_equations(state: State, noise: Floats | None = None) -> tuple[Floats, Floats]:
    """The normal equations of the random effects, whatever the other parameters: matrix (g m, g m) and right-hand side (g m,),
    without a prior.

    The information `noise` (k, k) on the k shifts from noise in the slopes is subtracted: with it, level or straight curves would
    tell an offset from a shift.
    """
    prior, repeated = state.prior, state.repeated
    places = prior.random_parameters(state.points.curves)
    random, fixed = np.searchsorted(prior.free, places), np.flatnonzero(~np.isin(prior.free, places))
    effects, precision = state.theta[places], prior.precision[np.ix_(places, places)]
    normal, gradient = state.normal[np.ix_(random, random)] - precision, state.gradient[random] - precision @ effects
    across = state.normal[np.ix_(random, fixed)]
    answer = np.linalg.solve(state.normal[np.ix_(fixed, fixed)], np.column_stack((across.T, state.gradient[fixed])))
    normal, gradient = normal - across @ answer[:, :-1], gradient - across @ answer[:, -1]
    right = normal @ effects - gradient
    if noise is not None:
        shifts = answer[: len(noise), :-1]
        normal, right = _less(normal, right, repeated * shifts.T @ noise @ shifts)
    return normal / repeated, right / repeated


def _less(normal: Floats, right: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Normal equations without the information `noise`, in each direction as far as there is information."""
    values, vectors = np.linalg.eigh(normal)
    root = np.sqrt(np.maximum(values, NO_INFORMATION * values[-1]))
    share, turned = np.linalg.eigh((vectors / root).T @ noise @ (vectors / root))
    left, half = np.clip(1 - share, 0.0, 1.0), (vectors * root) @ turned
    return half * left @ half.T, half * left @ (turned.T @ ((vectors / root).T @ right))


def _bent_by_offsets(state: State) -> Floats:
    """The covariance (K, K) of the coefficients of the smooth curves, as of independent points, with random effects of the usual
    spreads.
    """
    prior = state.prior
    usual = tuple(replace(each, spread=max(each.spread, each.kind.usual)) for each in prior.random)
    change = with_random(prior, usual, state.points.curves, state.repeated).precision - prior.precision
    change = change[np.ix_(prior.free, prior.free)]
    response = state.inverse @ state.cross[:, prior.free]
    return np.asarray(state.inverse + response @ np.linalg.solve(state.normal + change, response.T))


def _slope_products(state: State) -> Floats:
    """Sums (m, K, K) over the points of each curve of the products of basis functions with their slopes."""
    points, curves, weight, size = state.points, state.curves, state.weights.weight, len(state.inverse)
    products = np.zeros(points.curves * size * size)
    for basis, row in zip(curves.basis, curves.rows, strict=True):
        for slope, column in zip(curves.slope, curves.rows, strict=True):
            key = (points.curve * size + row) * size + column
            products += np.bincount(key, weight * basis * slope, minlength=products.size)
    return products.reshape(points.curves, size, size)


def _slope_noise(state: State, by_curve: Floats, covariance: Floats) -> Floats:
    """The information (m, m) on all shifts that is expected of noise in the slopes if smooth curves alone are fitted.

    `by_curve` (m, K, K) are the `_slope_products`, and `covariance` (K, K) that of the coefficients.
    """
    points, m = state.points, state.points.curves
    shared = by_curve.reshape(m, -1) @ (state.inverse @ by_curve @ covariance).reshape(m, -1).T
    direct = np.bincount(points.curve, state.weights.weight * state.curves.slope_variance(covariance), minlength=m)
    return np.asarray(np.diag(direct) - (shared + shared.T) / 2)


def _noise_information(state: State, full: Floats, slopes: Floats, by_curve: Floats) -> Floats:
    """The information (s, k, k) on the k free shifts that is expected of curves without a slope: that of the noise in their slopes.

    `full` (s, p, p) are the normal matrices of all free parameters, as of independent points. With M = W - W X A X' W, where X are
    the basis functions B, the offsets and the tilts, and A is the covariance of their coefficients, it is the sum over the points i
    of one curve and j of another of M times the covariances S G S' of the slopes at i and j. G is the covariance of the
    coefficients of B. `slopes` (k, k) and `by_curve` are those of `_slope_noise` and `_slope_products`.
    """
    points, prior, weight = state.points, state.prior, state.weights.weight
    m, curves, inverse = points.curves, state.curves, state.inverse
    moved = prior.free < m
    shifts, linear = prior.free[moved], prior.free[~moved]
    if not linear.size:
        return np.broadcast_to(slopes, (len(full), *slopes.shape))
    # products (m, linear parameters, K) of the slopes of each curve with what the smooth curves leave of the linear parameters
    left = -np.swapaxes(inverse @ state.cross[:, linear], 0, 1) @ by_curve
    sloped = np.hstack([cross_products(points, curves.rows, curves.slope * weight * side, len(inverse)) for side in state.sides])
    left[linear % m, np.arange(linear.size)] += sloped[:, linear].T
    left = left[shifts] @ np.linalg.cholesky(inverse)
    root = np.linalg.cholesky(np.linalg.inv(full[:, ~moved][:, :, ~moved]) / state.repeated)
    explained = np.einsum("sab,kac->skbc", root, left, optimize=True).reshape(len(full), shifts.size, -1)
    return np.asarray(slopes - explained @ np.swapaxes(explained, 1, 2))
