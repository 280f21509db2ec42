"""Errors of shift factors beyond the scatter of the points: curves that do not superpose, tilts, parts of curves, smoothness."""

from dataclasses import dataclass, replace

import numpy as np

from dielast.numerics.arrays import Floats, Index
from dielast.numerics.robust import robust_variance
from dielast.relaxation.superposition.joint_problem import State, gauss_newton_step
from dielast.relaxation.superposition.points import FitPoints

PARTS = 4  # number of parts of each curve, of equal length in log time
VISIBLE = 0.01  # decades of modulus; usual differences of specimens and instruments
SURE = 4.0  # standard errors of the correlation of neighbours
KNOT_RATIO = 1.5  # ratio by which the knot spacing is changed, to find the dependence of the shifts on it
RESETTLING_STEPS = 3  # Gauss-Newton steps after a change of points or knots
LEFT_OUT = 1e-9  # weight of an omitted point
BOUND = 5.0  # standard deviations at which the distance of an omitted point is clipped


@dataclass(frozen=True, slots=True, eq=False)
class Misfit:
    """Root mean squares of the misfit in decades of modulus, of all points, `by_curve` (m,) and `by_part` of the curves (PARTS,).

    `noise` is the root mean square of the scatter, and `part` (n,) the part of its curve that contains a point. A misfit is `sure`
    if chance does not explain it. It `matters` if it also exceeds the noise and usual differences between specimens, or if it
    changes the shift factors.
    """

    rms: float
    noise: float
    by_curve: Floats
    by_part: Floats
    part: Index
    sure: bool
    matters: bool


def find_misfit(series: Index, curve: Index, log_time: Floats, residual: Floats) -> Misfit:
    """The misfit from the `residual` (n,) of points sorted by series (a channel of a curve), then time.

    Neighbouring points share the misfit but not the noise. So the mean product of their residuals is the square of the misfit, and
    the difference of their residuals is due to noise.
    """
    bounds = np.searchsorted(series, np.arange(series[-1] + 2))
    begin, end = log_time[bounds[:-1]], log_time[bounds[1:] - 1]
    along = (log_time - begin[series]) / np.maximum(end - begin, 1e-12)[series]
    part = np.minimum((PARTS * along).astype(np.intp), PARTS - 1)
    joined = np.flatnonzero(series[1:] == series[:-1])
    product = residual[joined] * residual[joined + 1]
    noise = float(np.sqrt(robust_variance(np.diff(residual)[joined]) / 2))
    rms = _root(float(np.mean(product)))
    by_curve = _root(np.bincount(curve[joined], product) / np.bincount(curve[joined]))
    count = np.bincount(part[joined], minlength=PARTS)
    by_part = _root(np.bincount(part[joined], product, minlength=PARTS) / np.maximum(count, 1))
    sure = rms**2 > SURE / np.sqrt(residual.size) * float(np.mean(residual**2))
    return Misfit(float(rms), noise, by_curve, by_part, part, bool(sure), bool(sure and rms > max(VISIBLE, noise)))


def _root(square: Floats | float) -> Floats:
    return np.sqrt(np.maximum(square, 0.0))


def leave_out(state: State, misfit: Misfit) -> tuple[Floats, tuple[float, ...]]:
    """The covariance (2m, 2m) of the shifts as each part of all curves is omitted in turn, and `left_out` of `MasterFit`.

    Where curves do not superpose, a shift depends on the part of the curves that determines it; the scatter does not show this.
    """
    points = state.points
    thetas, distance = [], np.zeros(points.curve.size)
    scatter = _scatter(points, state.residual)
    for k in range(PARTS):
        out = misfit.part == k
        weights = replace(state.weights, weight=np.where(out, LEFT_OUT, 1.0) * state.weights.weight)
        left = _resettled(state.with_weights(weights))
        thetas.append(left.theta[: 2 * points.curves])
        distance[out] = (left.residual**2 / (_predicted_variance(left) + scatter))[out]
    deviation = np.sqrt((PARTS - 1) / PARTS) * (np.array(thetas) - np.mean(thetas, axis=0))
    return _from_trials(deviation, points.curves), tuple(
        float(np.mean(np.minimum(distance[points.channel == k], BOUND**2))) for k in range(points.channels)
    )


def smoothing_errors(state: State) -> Floats:
    """Covariance (2m, 2m) of the shifts for wider and narrower knot spacings: the dependence on the smoothness of the curves."""
    factors = (KNOT_RATIO, 1 / KNOT_RATIO)
    others = [_resettled(state.with_knots(state.spacing * factor)).theta for factor in factors]
    deviation = (np.array(others) - state.theta)[:, : 2 * state.points.curves]
    return _from_trials(deviation / np.sqrt(len(factors)), state.points.curves)


def _resettled(state: State) -> State:
    """The fit a few steps from a `state` with other weights or knots."""
    for _ in range(RESETTLING_STEPS):
        state, _ = gauss_newton_step(state)
    return state


def _from_trials(deviation: Floats, curves: int) -> Floats:
    """Covariance (2m, 2m) of shifts and vertical shifts from a few trials with a `deviation` (k, 2m), which is 0 for the anchor.

    A few trials hardly determine which combinations have no error. So the correlations of the steps from one curve to the next are
    halved: a step depends on the data of its two curves, and not on the choice of the anchor.
    """
    steps = np.diff(deviation.reshape(-1, 2, curves), axis=2).reshape(len(deviation), -1)
    covariance = steps.T @ steps
    covariance = (covariance + np.diag(np.diag(covariance))) / 2
    fixed = np.flatnonzero(np.all(deviation[:, :curves] == 0, axis=0))
    sums = np.tril(np.ones((curves, curves)), -1)[:, : curves - 1]
    sums = np.kron(np.eye(2), sums - sums[fixed[0] if fixed.size else 0])
    return np.asarray(sums @ covariance @ sums.T)


def _scatter(points: FitPoints, residual: Floats) -> Floats:
    """Variance (n,) of each point: from the differences of neighbours in its channel, plus that of specimens and instruments."""
    joined = points.series[1:] == points.series[:-1]
    step = np.diff(residual)
    typical = [robust_variance(step[joined & (points.channel[1:] == k)]) / 2 for k in range(points.channels)]
    return np.array(typical)[points.channel] + points.variance + VISIBLE**2


def _predicted_variance(state: State) -> Floats:
    """Variance (n,) of the smooth curve at each point, from the covariance of its coefficients, shifts and offsets."""
    points, prior, curves, m = state.points, state.prior, state.curves, state.points.curves
    answer = (state.inverse @ state.cross)[:, prior.free]
    sensitive = -np.einsum("an,ank->nk", curves.basis, answer[curves.rows])
    place = np.full(3 * m, -1)
    place[prior.free] = np.arange(prior.free.size)
    for number, side in enumerate(state.sides):
        column = place[number * m + points.curve]
        selected = np.flatnonzero(column >= 0)
        sensitive[selected, column[selected]] += side[selected]
    of_parameters = np.sum(sensitive @ np.linalg.inv(state.normal) * sensitive, axis=1)
    return np.asarray(curves.leverage(state.inverse) + of_parameters)
