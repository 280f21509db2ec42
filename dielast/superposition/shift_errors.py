"""The covariance of shift factors from the scatter of the points: what the curves determine, and no more.

Two things make that of a least-squares fit too small where curves are nearly level. The spread of their vertical offsets is hardly
known then, and an offset looks like a shift; the covariance is therefore averaged over the distribution of the spread. And a smooth
curve through noise is never quite straight, so that every curve seems to fit its place alone: the information from slopes that are
noise is subtracted (the bias of a regression whose regressor has errors; W. A. Fuller, Measurement Error Models, 1987, Sec. 2.2).
"""

import numpy as np

from dielast.numerics.arrays import Floats
from dielast.superposition.effects import OFFSET, precision_of, probable
from dielast.superposition.joint_problem import LOOSE, LinearParts, Prior, State, correlation, linear_parts
from dielast.superposition.points import FitPoints


def shift_covariance(points: FitPoints, prior: Prior, state: State) -> tuple[Floats, Floats]:
    """The covariance of the free parameters of a fit, from the scatter of its points and the offsets of its curves.

    Also the standard deviations (m,), in decades, of the offsets that its shifts may contain.

    An offset of probable size that was fitted as a shift, or the reverse, counts as an error.
    """
    m, repeated = points.curves, correlation(points, state)
    parts = linear_parts(points, state.theta, prior.free, state.weights, state.spacing)
    moved = prior.free < m
    shifts = prior.free[moved]
    noise = np.zeros(state.normal.shape)
    noise[np.ix_(moved, moved)] = repeated * _noise_information(points, state, parts)[np.ix_(shifts, shifts)]
    if prior.spread == 0:
        return repeated * _inverse(state.normal - noise), np.zeros(m)
    raised, level = np.ix_(~moved, ~moved), state.theta[m:]
    normal, gradient = state.normal.copy(), state.gradient.copy()
    normal[raised] -= prior.precision[m:, m:]
    gradient[~moved] -= prior.precision[m:, m:] @ level
    covariance = np.zeros(normal.shape)
    of_offsets, right = offset_equations(prior, state, repeated)
    spreads, probabilities = probable(OFFSET, of_offsets, right, prior.drift)
    at_shifts, hidden = normal[raised] / repeated, np.zeros(m)
    for spread, probability in zip(spreads.tolist(), probabilities.tolist(), strict=True):
        precision = precision_of(spread, m, prior.drift)
        # the variance of the offsets beyond a drift, with the shifts unknown less that with the shifts known
        gained = np.linalg.inv(of_offsets + precision) - np.linalg.inv(at_shifts + precision)
        hidden += probability * spread**4 * np.diag(precision @ gained @ precision)
        precision = repeated * precision
        here, slope = normal.copy(), gradient.copy()
        here[raised] += precision
        slope[~moved] += precision @ level
        step = np.linalg.solve(here, slope)
        covariance += probability * (repeated * _inverse(here - noise) + np.outer(step, step))
    return covariance, np.sqrt(np.maximum(hidden, 0.0))


def offset_equations(prior: Prior, state: State, repeated: float) -> tuple[Floats, Floats]:
    """The normal equations of the offsets, whatever the shifts: matrix (m, m) and right-hand side (m,), without a prior."""
    m = prior.mean.size // 2
    random = prior.free >= m
    fixed, level, precision = ~random, state.theta[m:], prior.precision[m:, m:]
    normal, gradient = state.normal[np.ix_(random, random)] - precision, state.gradient[random] - precision @ level
    across = state.normal[np.ix_(random, fixed)]
    answer = np.linalg.solve(state.normal[np.ix_(fixed, fixed)], np.column_stack((across.T, state.gradient[fixed])))
    normal, gradient = normal - across @ answer[:, :-1], gradient - across @ answer[:, -1]
    return normal / repeated, (normal @ level - gradient) / repeated


def _noise_information(points: FitPoints, state: State, parts: LinearParts) -> Floats:
    """The information (m, m) on the shifts that is expected of curves without a slope: that of the noise in their slopes.

    With residuals W - W B G B' W, where B are the basis functions and G is the covariance of their coefficients, it is the sum over
    the points i of one curve and j of another of these times the covariances S G S' of the slopes at i and j.
    """
    m, curves, weight, inverse = points.curves, parts.curves, state.weights.weight, parts.inverse
    size = len(inverse)
    products = np.zeros(m * size * size)
    for basis, row in zip(curves.basis, curves.rows, strict=True):
        for slope, column in zip(curves.slope, curves.rows, strict=True):
            key = (points.curve * size + row) * size + column
            products += np.bincount(key, weight * basis * slope, minlength=products.size)
    by_curve = products.reshape(m, size, size)
    shared = by_curve.reshape(m, -1) @ (inverse @ by_curve @ inverse).reshape(m, -1).T
    direct = np.bincount(points.curve, weight * curves.slope_variance(inverse), minlength=m)
    return np.asarray(np.diag(direct) - (shared + shared.T) / 2)


def _inverse(normal: Floats) -> Floats:
    """The inverse of a normal matrix, in which directions without information have that of the loose prior."""
    values, vectors = np.linalg.eigh(normal)
    return np.asarray(vectors / np.maximum(values, LOOSE) @ vectors.T)
