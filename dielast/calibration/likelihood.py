"""The likelihood of the parameters about a fit, and their standard errors.

The fit is by least squares with a fixed weighting, of points and of the factors of specimens (`weighting`). Its uncertainty follows
from the covariance of all measured values (`scatter`), and holds whether or not the weighting agrees with this covariance. With
weighted differences z, their covariance M, and the projection P on the space of the derivatives of z by the parameters at the fit,
the likelihood has the covariance

    S = P M P + v (1 - P),    v = tr A^2 / tr A,    A = (1 - P) M (1 - P).

Of the differences from the true curve, P z alone moves the fit, so that its distribution is known for any model (Hartley 1964,
DOI 10.1093/biomet/51.3-4.347). Outside this space, where curved models go, differences count as in least squares, over their mean
square per degree of freedom (Satterthwaite 1946, DOI 10.2307/3002019): with A itself, intervals of curved models would be too
narrow, as it rules out all differences along which it is small, and it is known only roughly. The likelihood compares the curves of
other parameters with those of the fit. Its curvature at the fit gives the covariance of least squares under M, the "sandwich"
(Huber 1967; White 1980, DOI 10.2307/1912934).

M is the mean over all possible scatters. As the fit does not depend on the scatter, the covariance of the parameters is the mean of
the covariances under the possible scatters, and a parameter has a mixture of Student's distributions, one for each scatter (Hoeting
et al. 1999, DOI 10.1214/ss/1009212519).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc, fdtri

from dielast.calibration.estimate import ResidualSpace, basis_of, likely
from dielast.calibration.fit import Fit
from dielast.calibration.levenberg import Residuals
from dielast.calibration.problem import FitProblem, root_of
from dielast.calibration.scatter import Curves, Scatter, Scatters, Weighting, covariance_of
from dielast.material.scatter import SpecimenScatter
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.roots import fall

MOST_FREEDOM = 1e6  # degrees of freedom beyond which no quantile changes
SEEN = 1e-8  # of the largest information about any parameter: less is a rounding error


@dataclass(frozen=True, slots=True, eq=False)
class Likelihood:
    """The likelihood about a `fit`: `residuals` for any coordinates, `information` (p, p) of the data alone at the fit, and
    `covariance` (p, p) with the prior, infinite on the diagonal for an undetermined parameter. For each of the `scatters`, `share`
    (members, p) is the variance of each parameter over that in `covariance`, from the model's error, specimens and noise, and
    `freedom` (members, p) its degrees of freedom (Welch 1947, DOI 10.1093/biomet/34.1-2.28); `value_freedom` are those of the
    variance of a further measured value. At the fit the sum of squares is 0.
    """

    fit: Fit
    residuals: Residuals
    information: Floats
    covariance: Floats
    scatters: Scatters
    share: Floats
    freedom: Floats
    value_freedom: float

    @property
    def specimens(self) -> SpecimenScatter:
        """The scatter of further specimens, with the model's error."""
        return SpecimenScatter(float(np.hypot(self.scatters.specimen, self.scatters.model_error)), self.value_freedom)

    @property
    def standard_error(self) -> Floats:
        """Standard errors (p,) of the coordinates."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Floats:
        """Correlations (p, p) of the coordinates, NaN if a standard error is not finite."""
        error = self.standard_error
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(np.isfinite(error[:, None] * error), self.covariance / (error[:, None] * error), np.nan)

    @property
    def common_freedom(self) -> float:
        """Degrees of freedom of the single Student's distribution that comes nearest to those of all parameters."""
        return float(1 / np.mean(1 / _freedom(self.scatters, self.share, self.freedom)))

    def thresholds(self, level: float) -> Floats:
        """The rise (p,) of the sum of squares at the ends of intervals of this level, for an estimated scatter."""
        ends = self.share * fdtri(1.0, self.freedom, level)  # of each member; that of the mixture lies between them
        low, high = (1 - 1e-9) * np.min(ends, axis=0), (1 + 1e-9) * np.max(ends, axis=0)

        def left(rise: Floats) -> Floats:
            return self.scatters.mean(np.asarray(fdtrc(1.0, self.freedom, rise / self.share), dtype=float)) - (1 - level)

        return fall(left, low, high)


def likelihood_of(fit: Fit) -> Likelihood:
    """The likelihood about a fit, under all scatters that the curves make likely."""
    problem, curves = fit.problem, fit.curves
    weighting = Weighting.of(curves, fit.scatter)
    weight = weighting.weight
    scatters = likely(curves, fit.slopes, problem.prior, fit.scatter)
    slopes = weighting(fit.slopes.T).T
    # a parameter at a bound is not a solution of least squares
    basis = basis_of(slopes[:, ~fit.at_bound])
    whole = weighting(weighting(scatters.covariance(curves)).T)
    inside = whole @ basis
    within = basis.T @ inside
    outside = whole - basis @ inside.T - inside @ basis.T + basis @ within @ basis.T
    size = float(np.sum(np.square(outside)) / np.trace(outside))
    beyond = (np.eye(weight.size) - basis @ basis.T) / np.sqrt(size)
    whiten = np.concatenate((np.linalg.solve(np.linalg.cholesky(within), basis.T), beyond)) @ weighting(np.eye(weight.size)).T
    model, prior = np.concatenate(curves.model), problem.prior

    def residuals(coordinates: Floats, fits: Cases) -> Floats:
        moved = (problem.answers(coordinates) - model) @ whiten.T
        return np.concatenate((moved, (coordinates - fit.coordinates) @ root_of(prior)), axis=1)

    slopes = whiten @ fit.slopes
    information = slopes.T @ slopes
    covariance = _covariance(information + prior, ~fit.at_bound)
    follows = np.where(np.isfinite(covariance), covariance, 0.0) @ slopes.T @ whiten
    pieces = np.array([ResidualSpace.of(curves, member, weight, fit.slopes[:, ~fit.at_bound]).known for member in scatters.members])
    variance, freedom = (
        np.stack(member)
        for member in zip(
            *(_variance(curves, member, follows, size) for member, size in zip(scatters.members, pieces.tolist(), strict=True)),
            strict=True,
        )
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        # the prior does not depend on the scatter
        share = np.where(variance > 0, 1 + (variance - scatters.mean(variance)) / np.diag(covariance), 1.0)
    value, known_as = np.array([_value(member, size) for member, size in zip(scatters.members, pieces.tolist(), strict=True)]).T
    return Likelihood(fit, residuals, information, covariance, scatters, share, freedom, float(_freedom(scatters, value, known_as)))


def _freedom(scatters: Scatters, variance: Floats, freedom: Floats) -> Floats:
    """The degrees of freedom of the mean (...) of the variances (members, ...) with these degrees of `freedom` (Satterthwaite 1946,
    DOI 10.2307/3002019), with the differences between members.
    """
    mean = scatters.mean(variance)
    spread = scatters.mean(np.square(variance) / freedom + 0.5 * np.square(variance - mean))
    return np.minimum(np.square(mean) / np.maximum(spread, 1e-300), MOST_FREEDOM)


def _value(scatter: Scatter, pieces: float) -> tuple[float, float]:
    """The variance of a further measured value, over the square of its level, and its degrees of freedom."""
    error, specimens = scatter.model_error**2, scatter.specimen**2
    total = error + specimens + float(np.mean(scatter.noise)) ** 2
    return total, total**2 / (error**2 / pieces + specimens**2 / scatter.specimens)


def _variance(curves: Curves, scatter: Scatter, follows: Floats, pieces: float) -> tuple[Floats, Floats]:
    """The variance (p,) of the parameters, whose derivatives by the measured values are `follows` (p, n), and its degrees of
    freedom (p,), if the model's error has `pieces`; the variance of noise is known well.
    """

    def part(scatter: Scatter) -> Floats:
        return np.asarray(np.einsum("pn,pn->p", follows @ covariance_of(curves, scatter), follows), dtype=float)

    quiet = replace(scatter, noise=np.zeros_like(scatter.noise))
    total, error, specimens = part(scatter), part(replace(quiet, specimen=0.0)), part(replace(quiet, model_error=0.0))
    uncertain = np.square(error) / pieces + np.square(specimens) / scatter.specimens
    with np.errstate(invalid="ignore", divide="ignore"):
        known = np.minimum(np.square(total) / uncertain, MOST_FREEDOM)
    return total, np.asarray(np.where(total > 0, known, MOST_FREEDOM), dtype=float)


def _covariance(precision: Floats, moving: Flags) -> Floats:
    """The inverse (p, p) of a precision; infinite on the diagonal for undetermined parameters, and for those not `moving`."""
    size = np.sqrt(np.maximum(np.diag(precision), 0.0))
    determined = moving & (size > np.sqrt(SEEN) * float(np.max(size, initial=0.0)) * 1e-3)
    covariance = np.zeros_like(precision)
    inner = np.ix_(determined, determined)
    scaled = precision[inner] / np.outer(size[determined], size[determined])
    values, vectors = np.linalg.eigh(scaled)
    inverse = vectors / np.maximum(values, 1e-12) @ vectors.T
    covariance[inner] = inverse / np.outer(size[determined], size[determined])
    covariance[~determined, ~determined] = np.inf
    return covariance


def prior_alone(problem: FitProblem, information: Floats) -> Flags:
    """Whether parameters (p,) are determined by the prior only, and not by the data."""
    seen = np.diag(information)
    known = np.diag(problem.space.precision)
    return np.asarray(seen <= np.maximum(0.1 * known, SEEN * float(np.max(seen, initial=0.0))))
