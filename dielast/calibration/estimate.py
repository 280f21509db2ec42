"""How large the scatter of measured curves is: that of the greatest restricted likelihood (Patterson and Thompson 1971, DOI
10.1093/biomet/58.3.545), in which the parameters of the linearised model are left out.

Along a curve the covariance is (share^2 K + noise^2) times the levels. The eigenvectors of the correlation K turn it into numbers
for all shares at once, and a specimen's factor is one rank more (Woodbury).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dielast.calibration.scatter import (
    CORRELATIONS,
    FIRST_LENGTH,
    FIRST_SHARE,
    USUAL_SCATTER,
    Curves,
    Scatter,
    noise_of,
    specimen_factors,
)
from dielast.numerics.columns import Cases, Floats

SHARES = 0.002 * 3.0 ** np.arange(0, 5.5, 0.5)  # of the model's error, that are tried
LENGTHS = (0.03, 0.1, 0.3, 1.0)  # of its correlation, that are tried
STEADY = (0.03, 0.2, 0.6)  # shares of the level's square that are the same along a curve, that are tried
USUAL_ERROR = 0.03  # of springs and branches along a curve
KNOWN_AS_FROM = 4.0  # specimens, and pieces of curves, from which what is usual is taken to be known
USUAL = -KNOWN_AS_FROM * (2 * np.log(SHARES) + np.square(USUAL_ERROR / SHARES))
"""Twice the logarithm of a scaled inverse chi-square prior of the model's error, as if so many pieces were known already."""
MOST_POINTS = 80  # of a curve, evenly chosen, which tell the scatter


def estimate(
    curves: Curves, differences: Floats, jacobian: Floats, precision: Floats, stated_specimen: float | None, known: Scatter | None
) -> Scatter:
    """The scatter that differences (n,) from a fitted model show, whose `jacobian` (n, p) and prior `precision` (p, p) say what the
    fit has taken out of them. `stated_specimen` is the scatter of specimens, if that is known; `known` is an earlier estimate.
    """
    specimen = stated_specimen if stated_specimen is not None else USUAL_SCATTER if known is None else known.specimen
    noise = noise_of(curves, curves.split(differences))
    found, best = Scatter(noise, FIRST_SHARE, FIRST_LENGTH, specimen), -np.inf
    few = _Few.of(curves, differences, jacobian)
    noises = [noise_of(curves, curves.split(differences), steady) for steady in STEADY]
    for smooth, length in product(range(len(CORRELATIONS)), LENGTHS):
        trial = Scatter(noise, FIRST_SHARE, length, specimen, smooth=smooth)
        spectra = [np.linalg.eigh(trial.correlation(place)) for place in few.curves.places]
        for steady, own in zip(STEADY, noises, strict=True):
            trial = replace(trial, noise=own, steady=steady)
            likelihood = _restricted(few, trial, spectra, precision) + USUAL
            if float(np.max(likelihood)) > best:
                best, share = float(np.max(likelihood)), _vertex(np.log(SHARES), likelihood)
                found = replace(trial, model_error=float(np.exp(share)))
    if stated_specimen is None:
        factors = specimen_factors(curves, found, differences)
        # a scaled inverse chi-square prior: as if so many specimens with the usual scatter were known already
        total = KNOWN_AS_FROM * USUAL_SCATTER**2 + float(np.sum((factors - factors.mean()) ** 2))
        found = replace(found, specimen=float(np.sqrt(total / (KNOWN_AS_FROM + factors.size - 1))))
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


def _restricted(few: _Few, scatter: Scatter, spectra: list[tuple[Floats, Floats]], precision: Floats) -> Floats:
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


def _vertex(place: Floats, height: Floats) -> float:
    """Where the parabola through the highest point and its neighbours is highest; evenly spaced places (k,)."""
    top = int(np.argmax(height))
    if not 0 < top < place.size - 1:
        return float(place[top])
    before, here, after = height[top - 1 : top + 2]
    return float(place[top] + 0.5 * (place[1] - place[0]) * (before - after) / (before - 2 * here + after))


def pieces_of(covariance: Floats, basis: Floats) -> float:
    """How many independent numbers of one variance tell as much of that variance as what is known beforehand, and differences of a
    `covariance` (n, n), of which a fit has taken out an orthonormal `basis` (n, p) (Satterthwaite 1946, DOI 10.2307/3002019).
    """
    crossed = covariance @ basis
    inside = basis.T @ crossed
    first = float(np.trace(covariance) - np.trace(inside))
    second = float(np.sum(np.square(covariance)) - 2 * np.sum(np.square(crossed)) + np.sum(np.square(inside)))
    return KNOWN_AS_FROM + (first**2 / max(second, 1e-300) if first > 0 else 0.0)
