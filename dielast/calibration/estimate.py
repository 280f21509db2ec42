"""Estimate the scatter of measured curves. The correlation of the model's error along a curve follows from the restricted
likelihood (Patterson and Thompson 1971, DOI 10.1093/biomet/58.3.545), from which the parameters of the linearised model are
eliminated. This likelihood depends mostly on close points, which say little about the size of the error. The size follows from the
residual sum of squares of the fit, whose expectation is the trace of the covariance outside the space of the parameters.

Few curves do not determine the length over which the error is correlated, and too short a length gives standard errors that are
too small. Every correlation of a list is therefore kept with its posterior probability; the prior is uniform (Hoeting et al. 1999,
DOI 10.1214/ss/1009212519; Kenward and Roger 1997, DOI 10.2307/2533558, on the error of a single estimated covariance).

Along a curve the covariance is (share^2 K + noise^2) times the levels. The eigenvectors of the correlation K make it diagonal for
all shares at once; the factor of a specimen adds one rank (Woodbury).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np

from dielast.calibration.scatter import (
    CORRELATIONS,
    FIRST_SHARE,
    USUAL_SCATTER,
    Curves,
    Scatter,
    Scatters,
    Weighting,
    noise_of,
    specimen_factors,
)
from dielast.numerics.arrays import Floats

SHARES = 0.002 * 3.0 ** np.arange(0, 5.5, 0.5)  # sizes of the model's error that are tried
LENGTHS = (0.03, 0.1, 0.3, 1.0, 3.0)  # lengths of its correlation that are tried: from close points to a whole curve
STEADY = (0.03, 0.2, 0.6)  # constant shares of the squared level of a curve that are tried
USUAL_ERROR = 0.03  # usual error of springs and branches along a curve
PRIOR_SPECIMENS = 4.0  # number of specimens that the prior for the scatter of specimens counts as
PRIOR_FREEDOM = 2.0  # degrees of freedom that the prior for the model's error counts as
SEEN = 1e-4  # of the largest effect: smaller effects are rounding errors
MOST_POINTS = 80  # of a curve, evenly chosen, for the restricted likelihood
UNLIKELY = 1e-4  # relative to the most likely correlation: less likely ones are dropped


def estimate(curves: Curves, jacobian: Floats, precision: Floats, before: Scatter) -> Scatter:
    """The most likely scatter of measured curves about a fitted model.

    The model was fitted with the weighting by the scatter `before`, which also gives the scatter of specimens, final if it was
    stated; its `jacobian` (n, p) and the prior `precision` (p, p) say which part of the differences the fit removed.
    """
    tried, logarithm = _tried(curves, jacobian, precision, before)
    return _sized(tried[int(np.argmax(logarithm))], curves, jacobian, before)


def likely(curves: Curves, jacobian: Floats, precision: Floats, before: Scatter) -> Scatters:
    """The possible scatters with their probabilities; arguments as for `estimate`."""
    tried, logarithm = _tried(curves, jacobian, precision, before)
    probability = np.exp(logarithm - np.max(logarithm))
    kept = np.flatnonzero(probability >= UNLIKELY)
    members = tuple(_sized(tried[k], curves, jacobian, before) for k in kept.tolist())
    return Scatters(members, probability[kept] / np.sum(probability[kept]))


def _tried(curves: Curves, jacobian: Floats, precision: Floats, before: Scatter) -> tuple[list[Scatter], Floats]:
    """The correlations that are tried, and the logarithm (tried,) of their restricted likelihood, averaged over the sizes of the
    error (with a uniform prior on a logarithmic scale).
    """
    few = ThinnedCurves.of(curves, jacobian)
    noises = [noise_of(curves, curves.split(curves.differences), steady) for steady in STEADY]
    tried: list[Scatter] = []
    logarithm: list[float] = []
    for smooth, length in product(range(len(CORRELATIONS)), LENGTHS):
        trial = Scatter(noises[0], FIRST_SHARE, length, before.specimen, smooth=smooth)
        spectra = [np.linalg.eigh(trial.correlation(place)) for place in few.curves.places]
        for steady, noise in zip(STEADY, noises, strict=True):
            tried.append(replace(trial, noise=noise, steady=steady))
            half = 0.5 * _restricted(few, tried[-1], spectra, precision)
            logarithm.append(float(np.max(half) + np.log(np.mean(np.exp(half - np.max(half))))))
    return tried, np.array(logarithm)


def _sized(tried: Scatter, curves: Curves, jacobian: Floats, before: Scatter) -> Scatter:
    """A correlation with the size of the model's error and, unless stated, the scatter of specimens, both from differences."""
    weight, differences = Weighting.of(curves, before).weight, curves.differences
    scatter = replace(tried, model_error=ResidualSpace.of(curves, tried, weight, jacobian).size(differences))
    if np.isfinite(before.specimens):
        factors = specimen_factors(curves, scatter, differences)
        # a scaled inverse chi-square prior: counts as PRIOR_SPECIMENS specimens with the usual scatter
        total = PRIOR_SPECIMENS * USUAL_SCATTER**2 + float(np.sum((factors - factors.mean()) ** 2))
        specimens = PRIOR_SPECIMENS + factors.size - 1
        scatter = replace(scatter, specimen=float(np.sqrt(total / specimens)), specimens=specimens)
    return scatter


@dataclass(frozen=True, slots=True, eq=False)
class ThinnedCurves:
    """Evenly chosen points of curves, with the `columns` (n, p + 2) of each curve: differences, derivatives, and the model."""

    curves: Curves
    columns: list[Floats]

    @classmethod
    def of(cls, curves: Curves, jacobian: Floats) -> Self:
        """At most `MOST_POINTS` of each curve."""
        sizes = [values.size for values in curves.values]
        rows = [np.unique(np.linspace(0, size - 1, min(size, MOST_POINTS)).astype(np.intp)) for size in sizes]
        values, model, places, wider = (
            tuple(part[chosen] for part, chosen in zip(parts, rows, strict=True))
            for parts in (curves.values, curves.model, curves.places, curves.wide)
        )
        miss, slopes = curves.split(curves.differences), np.split(jacobian, np.cumsum(sizes)[:-1])
        columns = [np.column_stack((miss[k][row], slopes[k][row], curves.by_factor[k][row])) for k, row in enumerate(rows)]
        return cls(Curves(values, model, places, curves.specimen, wider, curves.power), columns)


def _restricted(few: ThinnedCurves, scatter: Scatter, spectra: Sequence[tuple[Floats, Floats]], precision: Floats) -> Floats:
    """Twice the restricted log-likelihood (shares,), up to a constant, of a scatter with each of the `SHARES`; `spectra` are the
    eigenvalues and eigenvectors of the correlation along each curve.
    """
    size = few.columns[0].shape[1]
    products: dict[int, Floats] = {}
    determined = np.zeros(SHARES.size)
    levels = few.curves.levels(scatter.steady)
    for k, (values, vectors) in enumerate(spectra):
        turned = vectors.T @ (few.columns[k] / levels[k][:, None])
        variance = np.square(SHARES)[:, None] * np.maximum(values, 0.0) + scatter.noise[k] ** 2
        determined += np.sum(np.log(variance), axis=1)
        product = (turned.T / variance[:, None, :]) @ turned
        specimen = int(few.curves.specimen[k])
        products[specimen] = products.get(specimen, np.zeros_like(product)) + product
    whole = np.zeros((SHARES.size, size, size))
    for product in products.values():
        shared = 1 + scatter.specimen**2 * product[:, -1, -1]
        whole += product - scatter.specimen**2 / shared[:, None, None] * product[:, :, -1:] * product[:, -1:, :]
        determined += np.log(shared)
    # the levels are a part of the covariance, and depend on the share `steady`
    determined += 2 * sum(float(np.sum(np.log(level))) for level in levels)
    normal, pull = whole[:, 1:-1, 1:-1] + precision, whole[:, 1:-1, 0]
    scale = np.sqrt(np.maximum(np.einsum("spp->sp", normal), 1e-300))
    roots, vectors = np.linalg.eigh(normal / (scale[:, :, None] * scale[:, None, :]))
    roots = np.maximum(roots, 1e-12)
    along = np.einsum("spq,sp->sq", vectors, pull / scale)
    determined += np.sum(np.log(roots), axis=1) + 2 * np.sum(np.log(scale), axis=1)
    return np.asarray(-(whole[:, 0, 0] - np.sum(np.square(along) / roots, axis=1) + determined))


def basis_of(columns: Floats) -> Floats:
    """An orthonormal basis (n, q) of the space of the `columns` (n, p)."""
    size = np.linalg.norm(columns, axis=0)
    seen = size > SEEN * float(np.max(size, initial=0.0))
    vectors, values, _ = np.linalg.svd(columns[:, seen] / size[seen], full_matrices=False)
    return np.asarray(vectors[:, values > SEEN * np.max(values, initial=0.0)])


@dataclass(frozen=True, slots=True, eq=False)
class ResidualSpace:
    """Weighted differences outside the space of the parameters and the factors of specimens, which has the orthonormal `basis` (n,
    q). `expected` is the expectation of their sum of squares for a model's error of size 1, and `pieces` its effective degrees of
    freedom (Satterthwaite 1946, DOI 10.2307/3002019).
    """

    curves: Curves
    scatter: Scatter
    weight: Floats
    basis: Floats
    expected: float
    pieces: float

    @classmethod
    def of(cls, curves: Curves, scatter: Scatter, weight: Floats, jacobian: Floats) -> Self:
        """For differences with a `weight` (n,) from a model with the `jacobian` (n, p)."""
        factors = [
            np.concatenate(
                [values if k == specimen else 0 * values for k, values in zip(curves.specimen, curves.by_factor, strict=True)]
            )
            for specimen in np.unique(curves.specimen)
        ]
        basis = basis_of(weight[:, None] * np.column_stack((jacobian, *factors)))
        first, second = 0.0, 0.0
        inside, crossed = np.zeros((2, basis.shape[1], basis.shape[1]))
        parts = zip(curves.places, curves.levels(scatter.steady), curves.split(weight), curves.split(basis.T), strict=True)
        for place, level, factor, vectors in parts:
            block = scatter.correlation(place) * np.outer(factor * level, factor * level)
            turned = block @ vectors.T
            first, second = first + float(np.trace(block)), second + float(np.sum(np.square(block)))
            inside, crossed = inside + vectors @ turned, crossed + turned.T @ turned
        first = max(first - float(np.trace(inside)), 0.0)
        second += float(np.sum(np.square(inside)) - 2 * np.trace(crossed))
        return cls(curves, scatter, weight, basis, first, first**2 / second if first > 0 and second > 0 else 0.0)

    @property
    def known(self) -> float:
        """Degrees of freedom of the size of the model's error, those of the prior included."""
        return PRIOR_FREEDOM + self.pieces

    def size(self, differences: Floats) -> float:
        """The size of the model's error from differences (n,), with the usual error as a scaled inverse chi-square prior."""
        levels = self.curves.levels(self.scatter.steady)
        noise = self.weight * np.concatenate([k * level for k, level in zip(self.scatter.noise, levels, strict=True)])
        weighted = self.weight * differences
        left = float(weighted @ weighted - np.sum(np.square(self.basis.T @ weighted)))
        left -= float(noise @ noise - np.sum(np.square(self.basis * noise[:, None])))
        shown = max(left, 0.0) / self.expected if self.expected > 0 else 0.0
        return float(np.sqrt((self.pieces * shown + PRIOR_FREEDOM * USUAL_ERROR**2) / self.known))
