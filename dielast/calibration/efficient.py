"""Estimates by generalised least squares, where the covariance of the tests can be believed.

With the covariance M of all measured values (`scatter`), generalised least squares has the least variance of all linear estimates,
but relies on M: where the model's error is none of its random curves, it follows small wiggles and misses the curves themselves.
Least squares with the weights W of independent points needs no M. If M holds, the difference of both estimates has the covariance
C = V - V*, with the covariances V and V* of both (Hausman 1978, DOI 10.2307/1913827), and the sum of squares of the latter rises
from its least by

    T = d' H d,    E T = tr(H C),    var T = 2 tr(H C H C),    H = J'W^2 J + prior,    d the difference,

which is nearly a scaled chi-square (Satterthwaite 1946, DOI 10.2307/3002019). A T that is too large for this shows that M does not
hold, and the estimate is left as it was.
"""

import numpy as np
from scipy.special import fdtri

from dielast.calibration.estimate import Left, likely
from dielast.calibration.levenberg import Residuals, minimise
from dielast.calibration.problem import FitProblem
from dielast.calibration.scatter import Curves, Scatter, Whitening, about_factors
from dielast.calibration.weighting import Weighting
from dielast.numerics.arrays import Cases, Flags, Floats

LEVEL = 0.95  # of T, up to which the covariance is believed
SEEN = 1e-8  # of the largest eigenvalue of the scaled H: directions of less are not seen by the tests


def efficient(
    problem: FitProblem, curves: Curves, scatter: Scatter, slopes: Floats, at: Floats, moving: Flags
) -> tuple[Floats, Whitening] | None:
    """The coordinates (p,) by generalised least squares and their weighting, from those by least squares, `at` (p,), with the
    derivatives `slopes` (n, p) of the `curves`; None if the covariance does not hold. Parameters not `moving` (p,) are at a bound.
    """
    if not moving.any():
        return None
    weighting = Weighting.of(curves, scatter)
    scatters = likely(curves, curves.differences, weighting.weight, slopes, problem.prior, scatter)
    whitening, about = Whitening(curves, scatters), about_factors(curves, scatter)
    found = minimise(problem.weighted(about, whitening), at[None], problem.space.bounds)
    if not np.isfinite(found.cost[0]):
        return None
    rise = _cost(problem.weighted(about, weighting), found.coordinates) - _cost(problem.weighted(about, weighting), at[None])
    own, prior = slopes[:, moving], problem.prior[np.ix_(moving, moving)]
    plain, white = weighting(own.T).T, whitening(own.T).T
    whole = weighting(weighting(scatters.covariance(curves)).T)
    bend = plain.T @ plain + prior
    size = np.sqrt(np.maximum(np.diag(bend), 1e-300))
    values, vectors = np.linalg.eigh(bend / np.outer(size, size))
    root = (vectors / np.sqrt(np.maximum(values, 1e-300)) / size[:, None])[:, values > SEEN * values[-1]]  # H^(-1/2)
    usual = root.T @ (plain.T @ whole @ plain + prior) @ root
    best = np.linalg.inv(root.T @ (white.T @ white + prior) @ root)
    apart = usual - best
    mean, square = float(np.trace(apart)), float(np.sum(np.square(apart)))
    if mean <= 0:
        return None
    freedom = Left.of(curves, scatters.members[int(np.argmax(scatters.probability))], weighting.weight, own).known
    largest = mean * float(fdtri(mean**2 / square, freedom, LEVEL))
    return (found.coordinates[0], whitening) if rise <= largest else None


def _cost(residuals: Residuals, at: Floats) -> float:
    alone: Cases = np.zeros(1, dtype=np.intp)
    return float(np.sum(np.square(residuals(at, alone))))
