"""The joint problem: a smooth curve of log modulus over log reduced time, together with all shift factors.

The smooth curve is a cubic B-spline on even knots; a frequency sweep has two channels, each with its curve, that share the shifts.
For given shifts, the coefficients are a linear problem, so they are projected out (variable projection in Kaufman's form, DOI
10.1007/BF01932995), and a Gauss-Newton iteration acts on the shifts alone.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Self

import numpy as np

from dielast.numerics.arrays import Floats, Index
from dielast.relaxation.superposition.effects import Effect, RandomEffect, joint_precision
from dielast.relaxation.superposition.points import FitPoints, Weights, robust_weights
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


@dataclass(frozen=True, eq=False)
class State:
    """The best smooth curves of the `points` at parameters `theta` (3m,) with a `prior`, on the splines `curves`; computed as far
    as it is needed.

    The first `count` of shifts, vertical shifts and tilts may be free.
    """

    points: FitPoints
    theta: Floats
    weights: Weights
    curves: SplineProblem
    count: int
    prior: Prior

    @classmethod
    def of(cls, points: FitPoints, theta: Floats, prior: Prior, weights: Weights, spacing: float) -> Self:
        """The state at the parameters `theta` (3m,), with knots `spacing` apart in decades."""
        curves = SplineProblem.of(points.log_time - theta[points.curve], spacing, points.channel, points.channels)
        count = theta.size // points.curves if prior.free.size and prior.free[-1] >= points.curves else 1
        return cls(points, theta, weights, curves, count, prior)

    def at(self, theta: Floats) -> Self:
        """The state at other parameters (3m,)."""
        return self.of(self.points, theta, self.prior, self.weights, self.spacing)

    def of_points(self, points: FitPoints) -> Self:
        """The state of other points of the same curves."""
        return self.of(points, self.theta, self.prior, self.weights, self.spacing)

    def with_knots(self, spacing: float) -> Self:
        """The state with other knots, `spacing` apart in decades."""
        return self.of(self.points, self.theta, self.prior, self.weights, spacing)

    def with_weights(self, weights: Weights) -> Self:
        """The state with other weights."""
        return replace(self, weights=weights)

    def with_prior(self, prior: Prior) -> Self:
        """The state with another prior; what was computed without the prior is kept."""
        new = replace(self, prior=prior)
        vars(new).update({name: value for name, value in vars(self).items() if name in _WITHOUT_PRIOR})
        return new

    @cached_property
    def _fit(self) -> tuple[Floats, Floats, Floats]:
        m, curve = self.points.curves, self.points.curve
        moved = sum(side * self.theta[k * m :][curve] for k, side in enumerate(self._linear, start=1))
        target = self.points.log_modulus + moved
        inverse, coefficient, fitted = self.curves.fit(self.weights.weight, target)
        return inverse, coefficient, target - fitted

    @property
    def _linear(self) -> list[Floats]:
        return [self.points.lift, self.points.lean][: self.theta.size // self.points.curves - 1]

    @property
    def inverse(self) -> Floats:
        """The inverse (K, K) of the normal matrix of the curves."""
        return self._fit[0]

    @property
    def coefficient(self) -> Floats:
        """Coefficients (K,) of the curves."""
        return self._fit[1]

    @property
    def residual(self) -> Floats:
        """Distances (n,) of the points from the curves."""
        return self._fit[2]

    @cached_property
    def sides(self) -> list[Floats]:
        """Derivatives (n,) of the residuals with respect to shifts, vertical shifts and tilts."""
        slope = np.sum(self.curves.slope * self.coefficient[self.curves.rows], axis=0)
        return [slope, *self._linear][: self.count]

    @cached_property
    def cross(self) -> Floats:
        """Weighted products (K, sides m) of the derivatives with the basis of the curves."""
        weighted, size = self.curves.basis * self.weights.weight, self.curves.size * self.curves.channels
        return np.hstack([cross_products(self.points, self.curves.rows, weighted * side, size) for side in self.sides])

    @cached_property
    def _normal(self) -> Floats:
        """The normal matrix (sides m, sides m) without a prior."""
        m, curve, weight, count = self.points.curves, self.points.curve, self.weights.weight, self.count
        each = np.arange(m)
        blocks = np.zeros((count, m, count, m))
        for i, j in combinations_with_replacement(range(count), 2):
            sums = np.bincount(curve, weight * self.sides[i] * self.sides[j], minlength=m)
            blocks[i, each, j, each] = blocks[j, each, i, each] = sums
        return np.asarray(blocks.reshape(count * m, count * m) - self.cross.T @ self.inverse @ self.cross)

    @cached_property
    def _pull(self) -> Floats:
        """Half the gradient (sides m,) of the weighted squares of the residuals."""
        weighted = self.weights.weight * self.residual
        return np.hstack([np.bincount(self.points.curve, weighted * side, minlength=self.points.curves) for side in self.sides])

    @cached_property
    def cost(self) -> float:
        """Weighted squares of the residuals and of the distance from the prior."""
        deviation = self.theta - self.prior.mean
        squares = np.sum(self.weights.weight * self.residual**2)
        return float(squares + deviation @ self.prior.precision @ deviation)

    @cached_property
    def gradient(self) -> Floats:
        """Half the gradient (p,) of the cost with respect to the free parameters."""
        free = self.prior.free
        return np.asarray(self._pull[free] + self.prior.precision[free] @ (self.theta - self.prior.mean), dtype=float)

    @cached_property
    def normal(self) -> Floats:
        """The normal matrix (p, p) of the free parameters."""
        free = self.prior.free
        return np.asarray(self._normal[free[:, None], free] + self.prior.precision[free[:, None], free], dtype=float)

    @property
    def splines(self) -> tuple[Spline, ...]:
        """The smooth curve of each channel."""
        return self.curves.splines(self.coefficient)

    @property
    def parameters(self) -> float:
        """The effective number of parameters of the fit."""
        return self.coefficient.size + self.prior.freedom

    @property
    def spacing(self) -> float:
        """Knot spacing in decades."""
        return self.curves.spacing

    @cached_property
    def repeated(self) -> float:
        """The number of correlated points that count as one: (1 + r)/(1 - r), with r the correlation of neighbours."""
        z = self.residual * np.sqrt(self.weights.weight)
        joined = self.points.series[1:] == self.points.series[:-1]
        r = float(np.sum((z[1:] * z[:-1])[joined]) / max(float(np.sum(z**2)), 1e-300))
        return (1 + r) / (1 - r) if r > 3 / np.sqrt(z.size) else 1.0


# what a state computes without its prior
_WITHOUT_PRIOR = ("_fit", "sides", "cross", "_normal", "_pull", "repeated")


def with_random(prior: Prior, random: tuple[RandomEffect, ...], curves: int, repeated: float = 1.0) -> Prior:
    """The prior with these random effects; `repeated` correlated points count as one independent point."""
    new = replace(prior, precision=prior.precision.copy(), random=random)
    places = new.random_parameters(curves)
    new.precision[np.ix_(places, places)] = repeated * joint_precision(random, curves)
    return new


def cross_products(points: FitPoints, rows: Index, values: Floats, size: int) -> Floats:
    """Sums (size, m) of `values` (4, n) over the points of each curve, for each coefficient of `rows` (4, n)."""
    m = points.curves
    key = (rows * m + points.curve).ravel()
    return np.asarray(np.bincount(key, values.ravel(), minlength=size * m).reshape(size, m), dtype=float)


def gauss_newton_step(state: State) -> tuple[State, float]:
    """One Gauss-Newton step of the shifts, shortened until the cost falls, and its length in standard errors."""
    free = state.prior.free
    if not free.size:
        return state, 0.0
    step = -np.linalg.solve(state.normal, state.gradient)
    step *= min(1.0, MAX_STEP / max(float(np.max(np.abs(step))), 1e-300))
    for _ in range(SHORTENINGS):
        theta = state.theta.copy()
        theta[free] += step
        new = state.at(theta)
        length = float(np.sqrt(max(float(step @ state.normal @ step), 0.0) / step.size))
        if length < CONVERGED or new.cost <= state.cost:
            return new, length
        step = step / 3
    return state, 0.0


def reweighed(state: State, share: Floats) -> State:
    """The fit at the same shifts with weights from the residuals; `share` (n,) is that of `robust_weights`."""
    return state.with_weights(robust_weights(state.points.variance, state.residual, state.parameters, share, state.weights))


def akaike(state: State, evidence: float) -> float:
    """Akaike's criterion corrected for small samples, with a bound on the contribution of an outlier, plus `evidence`."""
    n, p = state.residual.size, state.parameters
    bounded = np.minimum(state.residual**2 / state.weights.variance, 16.0)
    return float(np.sum(np.log(state.weights.variance)) + np.sum(bounded)) + evidence + 2 * p * n / max(n - p - 1, 1)
