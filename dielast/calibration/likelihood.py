"""What is known of the parameters after a fit: the likelihood about it, and the standard errors that follow.

The fit itself weighs points alone, which no assumption about the model's error misleads. Its uncertainty takes the whole covariance of
what was measured (`scatter`): the sum of squares here is that of whitened differences, with what the parameters could still take out
of them at the fit removed, so that the fit is its minimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.calibration.fit import Fit, whitening_of
from dielast.calibration.levenberg import Residuals
from dielast.calibration.problem import Problem
from dielast.numerics.columns import Flags, Floats

SEEN = 1e-8  # of the largest information about any parameter: less is rounding


@dataclass(frozen=True, slots=True, eq=False)
class Likelihood:
    """The likelihood about a `fit`: `residuals` for any coordinates, `information` (p, p) of the data alone at the fit,
    `covariance` (p, p) with all that is known beforehand, infinite on the diagonal where nothing is, and the `least` sum of squares.
    """

    fit: Fit
    residuals: Residuals
    information: Floats
    covariance: Floats
    least: float

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


def likelihood_of(fit: Fit) -> Likelihood:
    """The likelihood about a fit."""
    problem, at = fit.problem, fit.coordinates
    whiten = whitening_of(fit)
    miss, slopes = whiten(-fit.curves.differences), whiten(fit.slopes.T).T
    known = problem.precision + problem.smoothness if problem.smoothness.size else problem.precision
    pull = problem.precision @ (at - problem.space.centre)
    if problem.smoothness.size:
        pull = pull + problem.smoothness @ at
    moving = ~fit.at_bound
    information = slopes.T @ slopes
    scale = np.sqrt(np.maximum(np.diag(information), SEEN * max(float(np.max(np.diag(information))), 1e-300)))
    inner = np.ix_(moving, moving)
    wanted = ((slopes.T @ miss + pull) / scale)[moving]
    taken = np.zeros(at.size)
    taken[moving] = np.linalg.lstsq((information / np.outer(scale, scale))[inner], wanted, rcond=1e-10)[0] / scale[moving]
    rest = miss - slopes @ taken
    pseudo = np.concatenate(fit.curves.model) - whiten.undo(rest)
    residuals = problem.whitened(whiten, pseudo)
    beforehand = problem.beforehand(at[None])[0]
    least = float(rest @ rest + beforehand @ beforehand)
    return Likelihood(fit, residuals, information, _covariance(information + known, moving), least)


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
