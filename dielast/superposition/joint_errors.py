"""Errors of shift factors beyond the scatter of the points: from tilted curves, from their parts, and from their smoothness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dielast.numerics.arrays import Floats
from dielast.superposition.effects import TILT, likeliest
from dielast.superposition.joint_problem import (
    Prior,
    State,
    assemble,
    correlation,
    cross_products,
    gauss_newton_step,
    linear_parts,
)
from dielast.superposition.misfit import PARTS, VISIBLE, Misfit
from dielast.superposition.points import FitPoints
from dielast.superposition.robust import Weights

TILT_ROUNDS = 50
KNOT_RATIO = 1.5  # by which the spacing of the knots is changed, for the dependence of the shifts on it
RESETTLING_STEPS = 3  # of the shifts after a change of points or knots
LEFT_OUT = 1e-9  # weight of a point that is left out
BOUND = 5.0  # standard deviations that the distance of a point left out counts for at most


def tilt_errors(points: FitPoints, prior: Prior, state: State) -> tuple[Floats, float]:
    """What tilts of the curves add to the covariance of the free parameters, and the spread of the tilts."""
    weight, m = state.weights.weight, points.curves
    parts = linear_parts(points, state.theta, prior.free, state.weights, state.spacing)
    lean = points.lean
    cross = cross_products(parts.curves, points, weight * lean)
    of_tilts = np.diag(np.bincount(points.curve, weight * lean**2, minlength=m)) - cross.T @ parts.inverse @ cross
    pull = np.bincount(points.curve, weight * parts.residual * lean, minlength=m)
    both = np.vstack([np.diag(np.bincount(points.curve, weight * side * lean, minlength=m)) for side in parts.sides])
    beside = np.asarray(both - parts.cross.T @ parts.inverse @ cross, dtype=float)[prior.free]
    response = np.linalg.solve(state.normal, np.column_stack((beside, state.gradient)))
    normal, right = of_tilts - beside.T @ response[:, :-1], beside.T @ response[:, -1] - pull
    repeated = correlation(points, state)
    tilt = likeliest(TILT, normal / repeated, right / repeated, TILT.first, TILT_ROUNDS)
    return tilt.spread**2 * response[:, :-1] @ response[:, :-1].T, tilt.spread


def leave_out(points: FitPoints, prior: Prior, state: State, misfit: Misfit) -> tuple[Floats, tuple[float, ...]]:
    """The covariance (2m, 2m) of the shifts as one part of all curves after the other is left out, and by how much the points left
    out are missed in each channel, as in `MasterFit`.

    Where curves do not superpose, a shift depends on the part of the curves that it is read from, which no scatter shows.
    """
    moved, off = [], np.zeros(points.curve.size)
    scatter = _scatter(points, state.residual)
    for k in range(PARTS):
        out = misfit.part == k
        weights = replace(state.weights, weight=np.where(out, LEFT_OUT, 1.0) * state.weights.weight)
        left = _resettled(points, prior, state.theta, weights, state.spacing)
        moved.append(left.theta)
        off[out] = (left.residual**2 / (_predicted_variance(points, prior, left) + scatter))[out]
    away = np.array(moved) - np.mean(moved, axis=0)
    return _half_correlated((PARTS - 1) / PARTS * away.T @ away), tuple(
        float(np.mean(np.minimum(off[points.channel == k], BOUND**2))) for k in range(points.channels)
    )


def smoothing_errors(points: FitPoints, prior: Prior, state: State) -> Floats:
    """Covariance (2m, 2m) of the shifts as the knots are set wider and closer: their dependence on the smoothness of the curves."""
    factors = (KNOT_RATIO, 1 / KNOT_RATIO)
    others = [_resettled(points, prior, state.theta, state.weights, state.spacing * factor).theta for factor in factors]
    away = np.array(others) - state.theta
    return _half_correlated(away.T @ away / len(factors))


def _resettled(points: FitPoints, prior: Prior, theta: Floats, weights: Weights, spacing: float) -> State:
    """The fit with other weights or knots, a few steps on from `theta` (2m,)."""
    state = assemble(points, theta, prior, weights, spacing)
    for _ in range(RESETTLING_STEPS):
        state, _ = gauss_newton_step(points, prior, state)
    return state


def _half_correlated(covariance: Floats) -> Floats:
    """The covariance with its correlations halved: a few trials hardly show which combinations of shifts have no error."""
    return np.asarray((covariance + np.diag(np.diag(covariance))) / 2)


def _scatter(points: FitPoints, residual: Floats) -> Floats:
    """Variance (n,) of each point: that of the differences of neighbours in its channel, and that of specimens and instruments."""
    joined = points.series[1:] == points.series[:-1]
    square = np.diff(residual) ** 2 / 2
    typical = [np.median(square[joined & (points.channel[1:] == k)]) / 0.455 for k in range(points.channels)]
    return np.array(typical)[points.channel] + points.variance + VISIBLE**2


def _predicted_variance(points: FitPoints, prior: Prior, state: State) -> Floats:
    """Variance (n,) of the smooth curve at each point, from the errors of its coefficients, shifts and offsets."""
    parts = linear_parts(points, state.theta, prior.free, state.weights, state.spacing)
    m, curves = points.curves, parts.curves
    answer = (parts.inverse @ parts.cross)[:, prior.free]
    sensitive = -np.einsum("an,ank->nk", curves.basis, answer[curves.rows])
    place = np.full(2 * m, -1)
    place[prior.free] = np.arange(prior.free.size)
    for number, side in enumerate(parts.sides):
        column = place[number * m + points.curve]
        here = np.flatnonzero(column >= 0)
        sensitive[here, column[here]] += side[here]
    return np.asarray(curves.leverage(parts.inverse) + np.einsum("nk,kl,nl->n", sensitive, np.linalg.inv(state.normal), sensitive))
