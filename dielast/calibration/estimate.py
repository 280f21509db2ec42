"""The scatter of measured curves. How the model's error goes along a curve is told by the restricted likelihood (Patterson and
Thompson 1971, DOI 10.1093/biomet/58.3.545), in which the parameters of the linearised model are left out. Close points, whose
likelihood that mostly is, tell little of how large the error is: that follows from the sum of squares that the fit has left, which
is expected to be the trace of what the covariance leaves beside the parameters.

Few curves leave open over which length the error is correlated, and a length that is too short makes the parameters look well
known. Every correlation that is tried is therefore kept with its probability, equal beforehand (Hoeting et al. 1999, DOI
10.1214/ss/1009212519; Kenward and Roger 1997, DOI 10.2307/2533558, on what a plugged-in covariance leaves out).

Along a curve the covariance is (share^2 K + noise^2) times the levels. The eigenvectors of the correlation K turn it into numbers
for all shares at once, and a specimen's factor is one rank more (Woodbury).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dielast.calibration.scatter import (
    CORRELATIONS,
    FIRST_SHARE,
    USUAL_SCATTER,
    Curves,
    Scatter,
    Scatters,
    noise_of,
    specimen_factors,
)
from dielast.numerics.columns import Floats

SHARES = 0.002 * 3.0 ** np.arange(0, 5.5, 0.5)  # of the model's error, that are tried
LENGTHS = (0.03, 0.1, 0.3, 1.0, 3.0)  # of its correlation, that are tried: from close points to a whole curve
STEADY = (0.03, 0.2, 0.6)  # shares of the level's square that are the same along a curve, that are tried
USUAL_ERROR = 0.03  # of springs and branches along a curve
KNOWN_AS_FROM = 4.0  # specimens from which the usual scatter of specimens is taken to be known
LIKE_PIECES = 2.0  # of curves, from which the usual error is taken to be known
SEEN = 1e-4  # of the largest effect: less is rounding
MOST_POINTS = 80  # of a curve, evenly chosen, which tell the scatter
UNLIKELY = 1e-4  # probability over that of the likeliest, below which a correlation is left out


def estimate(
    curves: Curves, differences: Floats, weight: Floats, jacobian: Floats, precision: Floats, specimen: float, stated: bool
) -> Scatter:
    """The likeliest scatter that differences (n,) show from a model that was fitted with this `weight` (n,); its `jacobian` (n, p)
    and prior `precision` (p, p) say what the fit has taken out of them. The scatter of specimens is `specimen` if that is `stated`,
    and else so far.
    """
    tried, logarithm = _tried(curves, differences, jacobian, precision, specimen)
    return _sized(tried[int(np.argmax(logarithm))], curves, differences, weight, jacobian, stated)


def likely(curves: Curves, differences: Floats, weight: Floats, jacobian: Floats, precision: Floats, known: Scatter) -> Scatters:
    """All that the scatter may be, as `estimate` has it, when that of specimens is about as `known`."""
    tried, logarithm = _tried(curves, differences, jacobian, precision, known.specimen)
    probability = np.exp(logarithm - np.max(logarithm))
    kept = np.flatnonzero(probability >= UNLIKELY)
    stated = not np.isfinite(known.specimens)
    members = tuple(_sized(tried[k], curves, differences, weight, jacobian, stated) for k in kept.tolist())
    return Scatters(members, probability[kept] / np.sum(probability[kept]))


def _tried(
    curves: Curves, differences: Floats, jacobian: Floats, precision: Floats, specimen: float
) -> tuple[list[Scatter], Floats]:
    """The correlations that are tried, and the logarithm of the restricted likelihood (tried,) of each, the mean over all sizes of
    the error (equally likely beforehand on a logarithmic scale).
    """
    few = _Few.of(curves, differences, jacobian)
    noises = [noise_of(curves, curves.split(differences), steady) for steady in STEADY]
    tried: list[Scatter] = []
    logarithm: list[float] = []
    for smooth, length in product(range(len(CORRELATIONS)), LENGTHS):
        trial = Scatter(noises[0], FIRST_SHARE, length, specimen, smooth=smooth)
        spectra = [np.linalg.eigh(trial.correlation(place)) for place in few.curves.places]
        for steady, own in zip(STEADY, noises, strict=True):
            tried.append(replace(trial, noise=own, steady=steady))
            half = 0.5 * _restricted(few, tried[-1], spectra, precision)
            logarithm.append(float(np.max(half) + np.log(np.mean(np.exp(half - np.max(half))))))
    return tried, np.array(logarithm)


def _sized(tried: Scatter, curves: Curves, differences: Floats, weight: Floats, jacobian: Floats, stated: bool) -> Scatter:
    """A correlation with the sizes of the model's error and, unless `stated`, of the scatter of specimens that differences show."""
    found = replace(tried, model_error=Left.of(curves, tried, weight, jacobian).size(differences))
    if not stated:
        factors = specimen_factors(curves, found, differences)
        # a scaled inverse chi-square prior: as if so many specimens with the usual scatter were known already
        total = KNOWN_AS_FROM * USUAL_SCATTER**2 + float(np.sum((factors - factors.mean()) ** 2))
        specimens = KNOWN_AS_FROM + factors.size - 1
        found = replace(found, specimen=float(np.sqrt(total / specimens)), specimens=specimens)
    return found


@dataclass(frozen=True, slots=True, eq=False)
class _Few:
    """Evenly chosen points of curves, with the `columns` (n, p + 2) of each: differences, derivatives, and the model."""

    curves: Curves
    columns: list[Floats]

    @classmethod
    def of(cls, curves: Curves, differences: Floats, jacobian: Floats) -> _Few:
        """At most so many points of each curve as tell the scatter."""
        sizes = [values.size for values in curves.values]
        rows = [np.unique(np.linspace(0, size - 1, min(size, MOST_POINTS)).astype(np.intp)) for size in sizes]
        values, model, places = (
            tuple(each[own] for each, own in zip(parts, rows, strict=True))
            for parts in (curves.values, curves.model, curves.places)
        )
        miss, slopes = curves.split(differences), np.split(jacobian, np.cumsum(sizes)[:-1])
        columns = [np.column_stack((miss[k][own], slopes[k][own], curves.model[k][own])) for k, own in enumerate(rows)]
        return cls(Curves(values, model, places, curves.specimen), columns)


def _restricted(few: _Few, scatter: Scatter, spectra: Sequence[tuple[Floats, Floats]], precision: Floats) -> Floats:
    """Twice the restricted log-likelihood (shares,) of a scatter with each of the `SHARES`, but for a constant; `spectra` are the
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
        own = (turned.T / variance[:, None, :]) @ turned
        specimen = int(few.curves.specimen[k])
        products[specimen] = products.get(specimen, np.zeros_like(own)) + own
    whole = np.zeros((SHARES.size, size, size))
    for own in products.values():
        shared = 1 + scatter.specimen**2 * own[:, -1, -1]
        whole += own - scatter.specimen**2 / shared[:, None, None] * own[:, :, -1:] * own[:, -1:, :]
        determined += np.log(shared)
    # the levels are a part of the covariance that differs between shares of what is steady
    determined += 2 * sum(float(np.sum(np.log(level))) for level in levels)
    normal, pull = whole[:, 1:-1, 1:-1] + precision, whole[:, 1:-1, 0]
    scale = np.sqrt(np.maximum(np.einsum("spp->sp", normal), 1e-300))
    roots, vectors = np.linalg.eigh(normal / (scale[:, :, None] * scale[:, None, :]))
    roots = np.maximum(roots, 1e-12)
    along = np.einsum("spq,sp->sq", vectors, pull / scale)
    determined += np.sum(np.log(roots), axis=1) + 2 * np.sum(np.log(scale), axis=1)
    return np.asarray(-(whole[:, 0, 0] - np.sum(np.square(along) / roots, axis=1) + determined))


def basis_of(columns: Floats) -> Floats:
    """An orthonormal basis (n, q) of what `columns` (n, p) span."""
    size = np.linalg.norm(columns, axis=0)
    seen = size > SEEN * float(np.max(size, initial=0.0))
    vectors, values, _ = np.linalg.svd(columns[:, seen] / size[seen], full_matrices=False)
    return np.asarray(vectors[:, values > SEEN * np.max(values, initial=0.0)])


@dataclass(frozen=True, slots=True, eq=False)
class Left:
    """What is left of weighted differences beside the parameters and the factors of specimens, which the orthonormal `basis` (n, q)
    spans; `expected` is the sum of squares there of a model's error of size 1, and that scatters as the squares of so many
    independent `pieces` do (Satterthwaite 1946, DOI 10.2307/3002019).
    """

    curves: Curves
    scatter: Scatter
    weight: Floats
    basis: Floats
    expected: float
    pieces: float

    @classmethod
    def of(cls, curves: Curves, scatter: Scatter, weight: Floats, jacobian: Floats) -> Left:
        """Of differences with a `weight` (n,) from a model of the `jacobian` (n, p)."""
        factors = [
            np.concatenate([values if k == one else 0 * values for k, values in zip(curves.specimen, curves.model, strict=True)])
            for one in np.unique(curves.specimen)
        ]
        basis = basis_of(weight[:, None] * np.column_stack((jacobian, *factors)))
        first, second = 0.0, 0.0
        inside, crossed = np.zeros((2, basis.shape[1], basis.shape[1]))
        parts = zip(curves.places, curves.levels(scatter.steady), curves.split(weight), curves.split(basis.T), strict=True)
        for place, level, own, vectors in parts:
            block = scatter.correlation(place) * np.outer(own * level, own * level)
            turned = block @ vectors.T
            first, second = first + float(np.trace(block)), second + float(np.sum(np.square(block)))
            inside, crossed = inside + vectors @ turned, crossed + turned.T @ turned
        first = max(first - float(np.trace(inside)), 0.0)
        second += float(np.sum(np.square(inside)) - 2 * np.trace(crossed))
        return cls(curves, scatter, weight, basis, first, first**2 / second if first > 0 and second > 0 else 0.0)

    @property
    def known(self) -> float:
        """From how many pieces the size of the model's error is known, those that are known beforehand among them."""
        return LIKE_PIECES + self.pieces

    def size(self, differences: Floats) -> float:
        """The size of the model's error that differences (n,) show, with what is usual as a scaled inverse chi-square prior."""
        levels = self.curves.levels(self.scatter.steady)
        noise = self.weight * np.concatenate([k * level for k, level in zip(self.scatter.noise, levels, strict=True)])
        weighted = self.weight * differences
        left = float(weighted @ weighted - np.sum(np.square(self.basis.T @ weighted)))
        left -= float(noise @ noise - np.sum(np.square(self.basis * noise[:, None])))
        shown = max(left, 0.0) / self.expected if self.expected > 0 else 0.0
        return float(np.sqrt((self.pieces * shown + LIKE_PIECES * USUAL_ERROR**2) / self.known))
