"""What is known of the parameters after a fit: the likelihood about it, and the standard errors that follow.

The fit is one of weighted least squares, which no assumption about the model's error misleads; how well it is known follows
from the covariance of all that was measured (`scatter`). With weighted differences z and their covariance M, and the projection P
on what the parameters can do about z at the fit, the likelihood has the covariance

    S = P M P + (1 - P) M (1 - P):

that of M in everything but the correlation between the two parts, which least squares does not use. It measures how far the curves
of other parameters are from those of the fit. Its curvature there gives the covariance of least squares under M, the "sandwich"
(Huber 1967; White 1980, DOI 10.2307/1912934).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import fdtri

from dielast.calibration.estimate import Left, basis_of
from dielast.calibration.fit import Fit, known_beforehand
from dielast.calibration.levenberg import Residuals
from dielast.calibration.problem import Problem, root_of, weights_of
from dielast.calibration.scatter import covariance_of
from dielast.numerics.columns import Cases, Flags, Floats

MOST_FREEDOM = 1e6  # no quantile changes beyond
SEEN = 1e-8  # of the largest information about any parameter: less is rounding


@dataclass(frozen=True, slots=True, eq=False)
class Likelihood:
    """The likelihood about a `fit`: `residuals` for any coordinates, `information` (p, p) of the data alone at the fit,
    `covariance` (p, p) with all that is known beforehand, infinite on the diagonal where nothing is, and from how many independent
    `pieces` of curves the model's error is known. The variance of each parameter, to which specimens and noise contribute, too, is
    known as from so many `freedom` (p,) pieces (Welch 1947, DOI 10.1093/biomet/34.1-2.28). The sum of squares is 0 at the fit.
    """

    fit: Fit
    residuals: Residuals
    information: Floats
    covariance: Floats
    pieces: float
    freedom: Floats

    @property
    def standard_error(self) -> Floats:
        """Of the coordinates (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Floats:
        """Between the coordinates (p, p), NaN where a standard error is not finite."""
        error = self.standard_error
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(np.isfinite(error[:, None] * error), self.covariance / (error[:, None] * error), np.nan)

    def thresholds(self, level: float) -> Floats:
        """By how much the sum of squares rises at the ends of intervals of this level (p,), the scatter being estimated."""
        return np.asarray(fdtri(1.0, self.freedom, level))


def likelihood_of(fit: Fit) -> Likelihood:
    """The likelihood about a fit."""
    problem, curves = fit.problem, fit.curves
    weight = np.concatenate(weights_of(curves, fit.scatter))
    slopes = weight[:, None] * fit.slopes
    # what rests on a bound is not where least squares would have it
    basis = basis_of(slopes[:, ~fit.at_bound])
    whole = covariance_of(curves, fit.scatter) * np.outer(weight, weight)
    inside = whole @ basis
    crossed = basis @ inside.T - basis @ (basis.T @ inside) @ basis.T  # P M (1 - P)
    root = np.linalg.cholesky(whole - crossed - crossed.T)
    whiten = solve_triangular(root, np.diag(weight), lower=True)
    model, known = np.concatenate(curves.model), known_beforehand(problem)

    def residuals(coordinates: Floats, fits: Cases) -> Floats:
        own = (problem.answers(coordinates) - model) @ whiten.T
        return np.concatenate((own, (coordinates - fit.coordinates) @ root_of(known)), axis=1)

    told = whiten @ fit.slopes
    information = told.T @ told
    pieces = Left.of(curves, fit.scatter, weight, fit.slopes[:, ~fit.at_bound]).known
    covariance = _covariance(information + known, ~fit.at_bound)
    told = np.where(np.isfinite(covariance), covariance, 0.0) @ told.T @ whiten
    return Likelihood(fit, residuals, information, covariance, pieces, _freedom(fit, told, pieces))


def _freedom(fit: Fit, follows: Floats, pieces: float) -> Floats:
    """From how many pieces the variance of each parameter (p,) is known, which `follows` (p, n) what was measured; that of noise is
    known well.
    """
    scatter, curves = fit.scatter, fit.curves
    quiet = replace(scatter, noise=np.zeros_like(scatter.noise))
    parts = (replace(quiet, specimen=0.0), pieces), (replace(quiet, model_error=0.0), scatter.specimens)
    shares = [
        (np.einsum("pn,nm,pm->p", follows, covariance_of(curves, each), follows, optimize=True), known) for each, known in parts
    ]
    total = np.einsum("pn,nm,pm->p", follows, covariance_of(curves, scatter), follows, optimize=True)
    uncertain = sum(np.square(share) / known for share, known in shares)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(total > 0, np.minimum(np.square(total) / uncertain, MOST_FREEDOM), pieces)


def _covariance(precision: Floats, moving: Flags) -> Floats:
    """The inverse (p, p) of a precision; infinite on the diagonal for what it says nothing of, and for what is not `moving`."""
    size = np.sqrt(np.maximum(np.diag(precision), 0.0))
    told = moving & (size > np.sqrt(SEEN) * float(np.max(size, initial=0.0)) * 1e-3)
    covariance = np.zeros_like(precision)
    inner = np.ix_(told, told)
    scaled = precision[inner] / np.outer(size[told], size[told])
    values, vectors = np.linalg.eigh(scaled)
    inverse = vectors / np.maximum(values, 1e-12) @ vectors.T
    covariance[inner] = inverse / np.outer(size[told], size[told])
    covariance[~told, ~told] = np.inf
    return covariance


def prior_alone(problem: Problem, information: Floats) -> Flags:
    """Parameters (p,) of which the data say nothing, whatever was known beforehand."""
    seen = np.diag(information)
    known = np.diag(problem.precision)
    return np.asarray(seen <= np.maximum(0.1 * known, SEEN * float(np.max(seen, initial=0.0))))
