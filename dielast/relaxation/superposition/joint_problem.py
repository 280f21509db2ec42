"""The joint problem: a smooth curve of log modulus over log reduced time, together with all shift factors.

The smooth curve is a cubic B-spline on even knots; a frequency sweep has two channels, each with its curve, that share the shifts.
For given shifts, the coefficients are a linear problem, so they are projected out (variable projection in Kaufman's form, DOI
10.1007/BF01932995), and a Gauss-Newton iteration acts on the shifts alone.
"""

from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np

from dielast.numerics.arrays import Floats, Index
from dielast.relaxation.superposition.effects import Effect, RandomEffect, joint_precision
from dielast.relaxation.superposition.points import FitPoints, Weights, neighbour_correlation, robust_weights
from dielast.relaxation.superposition.spline import Spline, SplineProblem

LOOSE = 30.0**-2  # precision (1/decade^2) of the prior, which keeps the normal matrix regular where there are no data
MAX_STEP = 0.5  # decades; largest change of a shift in one iteration
SHORTENINGS = 8  # of a step, each by a factor of 3, before it is abandoned
CONVERGED = 0.01  # standard errors


@dataclass(frozen=True, slots=True, eq=False)
class Prior:
    """Mean (3m,) and precision (3m, 3m) of all shifts, followed by all vertical shifts and all tilts, and the indices of those that
    are `free`. Tilts, and vertical shifts as well, may be missing.

    The parameters of `random` effects are random with their spreads, which add `evidence` to -2 ln likelihood; all free parameters
    together count as `freedom` parameters.
    """

    mean: Floats
    precision: Floats
    free: Index
    freedom: float
    random: tuple[RandomEffect, ...] = ()
    evidence: float = 0.0

    def random_parameters(self, curves: int) -> Index:
        """The indices of the random effects, one kind after another."""
        return np.concatenate([each.kind.block * curves + np.arange(curves) for each in self.random] or [self.free[:0]])

    def spread(self, kind: Effect) -> float:
        """The spread of the effects of a kind; 0 if there are none."""
        return sum(each.spread for each in self.random if each.kind is kind)


@dataclass(frozen=True, slots=True, eq=False)
class LinearParts:
    """The best smooth curves at given shifts: the `inverse` of their normal matrix (K, K), coefficients (K,) and residuals (n,).

    `sides` are the derivatives (n,) of the residuals with respect to shifts, vertical shifts and tilts, and `cross` (K, sides m)
    their weighted products with the basis of the curves.
    """

    curves: SplineProblem
    inverse: Floats
    coefficient: Floats
    residual: Floats
    sides: list[Floats]
    cross: Floats


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """The best smooth curves for given parameters `theta` (3m,), the weights used, and the cost, with its gradient and normal
    matrix with respect to the free parameters.
    """

    theta: Floats
    parts: LinearParts
    cost: float
    gradient: Floats
    normal: Floats
    weights: Weights
    freedom: float

    @property
    def splines(self) -> tuple[Spline, ...]:
        """The smooth curve of each channel."""
        return self.parts.curves.splines(self.parts.coefficient)

    @property
    def residual(self) -> Floats:
        """Distances (n,) of the points from the smooth curves."""
        return self.parts.residual

    @property
    def parameters(self) -> float:
        """The effective number of parameters of the fit."""
        return self.parts.coefficient.size + self.freedom

    @property
    def spacing(self) -> float:
        """Knot spacing in decades."""
        return self.parts.curves.spacing


def with_random(prior: Prior, random: tuple[RandomEffect, ...], curves: int, repeated: float = 1.0) -> Prior:
    """The prior with these random effects; `repeated` correlated points count as one independent point."""
    new = replace(prior, precision=prior.precision.copy(), random=random)
    places = new.random_parameters(curves)
    new.precision[np.ix_(places, places)] = repeated * joint_precision(random, curves)
    return new


def linear_parts(points: FitPoints, theta: Floats, free: Index, weights: Weights, spacing: float) -> LinearParts:
    """The smooth curves at the parameters `theta` (3m,), with knots `spacing` apart in decades."""
    m, curve = points.curves, points.curve
    linear = [points.lift, points.lean][: theta.size // m - 1]
    target = points.log_modulus + sum(side * theta[k * m :][curve] for k, side in enumerate(linear, start=1))
    curves = SplineProblem.of(points.log_time - theta[curve], spacing, points.channel, points.channels)
    inverse, coefficient, fitted = curves.fit(weights.weight, target)
    slope = np.sum(curves.slope * coefficient[curves.rows], axis=0)
    sides = [slope, *linear] if free.size and free[-1] >= m else [slope]
    size = curves.size * curves.channels
    cross = np.hstack([cross_products(points, curves.rows, curves.basis * weights.weight * side, size) for side in sides])
    return LinearParts(curves, inverse, coefficient, target - fitted, sides, cross)


def cross_products(points: FitPoints, rows: Index, values: Floats, size: int) -> Floats:
    """Sums (size, m) of `values` (4, n) over the points of each curve, for each coefficient of `rows` (4, n)."""
    m = points.curves
    key = (rows * m + points.curve).ravel()
    return np.asarray(np.bincount(key, values.ravel(), minlength=size * m).reshape(size, m), dtype=float)


def assemble(points: FitPoints, theta: Floats, prior: Prior, weights: Weights, spacing: float) -> State:
    """The best smooth curves at `theta` (3m,), with cost, gradient and normal matrix of the free parameters."""
    m, curve, weight, free = points.curves, points.curve, weights.weight, prior.free
    parts = linear_parts(points, theta, free, weights, spacing)
    each, count = np.arange(m), len(parts.sides)
    blocks = np.zeros((count, m, count, m))
    for i, j in combinations_with_replacement(range(count), 2):
        sums = np.bincount(curve, weight * parts.sides[i] * parts.sides[j], minlength=m)
        blocks[i, each, j, each] = blocks[j, each, i, each] = sums
    pull = np.hstack([np.bincount(curve, weight * parts.residual * side, minlength=m) for side in parts.sides])
    deviation = theta - prior.mean
    normal = blocks.reshape(count * m, count * m) - parts.cross.T @ parts.inverse @ parts.cross
    normal = normal[free[:, None], free] + prior.precision[free[:, None], free]
    gradient = np.asarray(pull[free] + prior.precision[free] @ deviation, dtype=float)
    cost = float(np.sum(weight * parts.residual**2) + deviation @ prior.precision @ deviation)
    return State(theta, parts, cost, gradient, normal, weights, prior.freedom)


def gauss_newton_step(points: FitPoints, prior: Prior, state: State) -> tuple[State, float]:
    """One Gauss-Newton step of the shifts, shortened until the cost falls, and its length in standard errors."""
    if not prior.free.size:
        return state, 0.0
    step = -np.linalg.solve(state.normal, state.gradient)
    step *= min(1.0, MAX_STEP / max(float(np.max(np.abs(step))), 1e-300))
    for _ in range(SHORTENINGS):
        theta = state.theta.copy()
        theta[prior.free] += step
        new = assemble(points, theta, prior, state.weights, state.spacing)
        length = float(np.sqrt(max(float(step @ state.normal @ step), 0.0) / step.size))
        if length < CONVERGED or new.cost <= state.cost:
            return new, length
        step = step / 3
    return state, 0.0


def reweigh(points: FitPoints, state: State, prior: Prior, share: Floats) -> State:
    """The fit at the same shifts with weights from the residuals; `share` (n,) is that of `robust_weights`."""
    weights = robust_weights(points.variance, state.residual, state.parameters, share, state.weights)
    return assemble(points, state.theta, prior, weights, state.spacing)


def akaike(state: State, evidence: float) -> float:
    """Akaike's criterion corrected for small samples, with a bound on the contribution of an outlier, plus `evidence`."""
    n, p = state.residual.size, state.parameters
    bounded = np.minimum(state.residual**2 / state.weights.variance, 16.0)
    return float(np.sum(np.log(state.weights.variance)) + np.sum(bounded)) + evidence + 2 * p * n / max(n - p - 1, 1)


def correlation(points: FitPoints, state: State) -> float:
    """Factor on the covariance for correlated residuals: (1 + r)/(1 - r), with r the correlation of neighbours."""
    z = state.residual * np.sqrt(state.weights.weight)
    r = neighbour_correlation(points.series, z)
    return (1 + r) / (1 - r) if r > 3 / np.sqrt(z.size) else 1.0
