"""How far measured curves may lie from the material: noise of each point, error of the model along a curve, and specimens.

The difference between a measured curve and the model's is taken for the sum of

- noise, independent from point to point, a share of the level of the curve, from the scatter of neighbouring points;
- the error of the model, a share of the level, correlated along the curve as exp(-d/l) over a distance d (`path_length`), so that
  ten thousand points of a curve tell no more than its shape does (Kennedy and O'Hagan 2001, DOI 10.1111/1467-9868.00294);
- a factor on all that is measured on one specimen, log-normal, a random effect: further points of a specimen do not tell more
  about the material than the specimen does (Laird and Ware 1982, DOI 10.2307/2529876).

The level of a curve is between each value and the root mean square of the whole curve: errors are partly relative and partly
absolute. How much of them is, and the size and length of the model's error, are those of the greatest restricted likelihood
(Patterson and Thompson 1971, DOI 10.1093/biomet/58.3.545).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dielast.numerics.columns import Cases, Floats

LEAST_NOISE = 1e-3  # of the level: no machine is better
SHARES = 0.002 * 3.0 ** np.arange(6)  # of the model's error, that are tried
LENGTHS = np.array((0.03, 0.1, 0.3, 1.0))  # of its correlation, that are tried
USUAL_SCATTER, KNOWN_AS_FROM = 0.05, 4.0  # of specimens, and of how many specimens that is taken to be known
STEADY = (0.03, 0.2, 0.6)  # shares of the level's square that are the same along a curve, that are tried
FIRST_SHARE, FIRST_LENGTH = 0.05, 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Scatter:
    """The scatter of measured curves: `noise` (curves,), `model_error` and `specimen` as shares of the level, `length` as distance
    along a curve. Of the level's square a share `steady` is the same along a curve, the rest follows it.
    """

    noise: Floats
    model_error: float
    length: float
    specimen: float
    steady: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Measured curves: their `values`, what the `model` gives, and `places` along each, lists of (n,); `specimen` (curves,).

    Shares are of the model: what is measured would pull the material towards whatever is low by chance (Peelle's puzzle, see
    D'Agostini 1994, DOI 10.1016/0168-9002(94)90719-6).
    """

    values: tuple[Floats, ...]
    model: tuple[Floats, ...]
    places: tuple[Floats, ...]
    specimen: Cases

    def levels(self, steady: float = 0.5) -> list[Floats]:
        """The level of each curve at its points (n,), of whose square a share `steady` is that of the whole curve."""
        return [np.sqrt((1 - steady) * np.square(values) + steady * np.mean(np.square(values))) for values in self.model]

    @property
    def measured(self) -> Floats:
        """All values, one curve after another."""
        return np.concatenate(self.values)

    @property
    def differences(self) -> Floats:
        """Measured less model, one curve after another."""
        return self.measured - np.concatenate(self.model)

    def split(self, joined: Floats) -> list[Floats]:
        """The parts (..., n) of all points (..., sum n) that belong to each curve."""
        return np.split(joined, np.cumsum([values.size for values in self.values])[:-1], axis=-1)

    def take(self, curves: Sequence[int]) -> Curves:
        """Some of the curves."""
        chosen = list(curves)
        values, model, places = (tuple(each[k] for k in chosen) for each in (self.values, self.model, self.places))
        return Curves(values, model, places, self.specimen[chosen])


def noise_of(curves: Curves, residuals: Sequence[Floats], steady: float = 0.5) -> Floats:
    """The noise (curves,) of each curve over its level, from how far each residual is from the line through its neighbours."""
    found = []
    for values, places, level in zip(residuals, curves.places, curves.levels(steady), strict=True):
        if values.size < 5:
            found.append(0.01)
            continue
        relative = values / level
        before, after = np.diff(places)[:-1], np.diff(places)[1:]
        share = np.where(before + after > 0, before / np.where(before + after > 0, before + after, 1.0), 0.5)
        miss = relative[1:-1] - ((1 - share) * relative[:-2] + share * relative[2:])
        spread = np.median(np.abs(miss) / np.sqrt(1 + (1 - share) ** 2 + share**2)) / 0.6745
        found.append(max(float(spread), LEAST_NOISE))
    return np.array(found)


class Whitening:
    """Turns differences from measured curves into independent numbers of variance 1, specimen by specimen."""

    def __init__(self, curves: Curves, scatter: Scatter) -> None:
        self.curves, self.scatter = curves, scatter
        edges = np.concatenate(([0], np.cumsum([values.size for values in curves.values])))
        self.blocks: list[tuple[Cases, Floats]] = []
        self.factors: list[Floats] = []
        self.log_determinant = 0.0
        for specimen in np.unique(curves.specimen):
            own = np.flatnonzero(curves.specimen == specimen)
            rows = np.concatenate([np.arange(edges[k], edges[k + 1]) for k in own])
            factor = np.linalg.cholesky(self._covariance(own))
            self.blocks.append((rows, np.asarray(np.linalg.inv(factor), dtype=float)))
            self.factors.append(np.asarray(factor, dtype=float))
            self.log_determinant += 2 * float(np.sum(np.log(np.diag(factor))))

    def _covariance(self, own: Cases) -> Floats:
        """The covariance of all points of one specimen."""
        scatter, levels = self.scatter, self.curves.levels(self.scatter.steady)
        sizes = [levels[k].size for k in own]
        matrix = np.zeros((sum(sizes), sum(sizes)))
        first = 0
        for k, size in zip(own, sizes, strict=True):
            place, level = self.curves.places[k], levels[k]
            part = slice(first, first + size)
            along = np.exp(-np.abs(place[:, None] - place) / scatter.length)
            matrix[part, part] = np.outer(level, level) * (scatter.model_error**2 * along + scatter.noise[k] ** 2 * np.eye(size))
            first += size
        joined = np.concatenate([self.curves.model[k] for k in own])
        matrix += scatter.specimen**2 * np.outer(joined, joined)
        return matrix

    def __call__(self, differences: Floats) -> Floats:
        """The independent numbers (..., n) that differences (..., n) amount to."""
        made = np.empty_like(differences)
        for rows, factor in self.blocks:
            made[..., rows] = differences[..., rows] @ factor.T
        return made

    def covariance(self) -> Floats:
        """The covariance (n, n) of all differences."""
        size = sum(rows.size for rows, _ in self.blocks)
        whole = np.zeros((size, size))
        for (rows, _), factor in zip(self.blocks, self.factors, strict=True):
            whole[np.ix_(rows, rows)] = factor @ factor.T
        return whole


def specimen_factors(curves: Curves, scatter: Scatter, differences: Floats) -> Floats:
    """The logarithm of each specimen's factor, the best prediction from differences (n,) from the model."""
    alone, parts = replace(scatter, specimen=0.0), curves.split(differences)
    found = []
    for specimen in np.unique(curves.specimen):
        own = np.flatnonzero(curves.specimen == specimen)
        chosen = curves.take(own.tolist())
        whiten = Whitening(chosen, replace(alone, noise=scatter.noise[own]))
        shape, miss = whiten(np.concatenate(chosen.model)), whiten(np.concatenate([parts[k] for k in own]))
        found.append(float(shape @ miss / (shape @ shape + 1 / max(scatter.specimen, 1e-12) ** 2)))
    return np.array(found)


def estimate(
    curves: Curves, differences: Floats, jacobian: Floats, precision: Floats, stated_specimen: float | None, known: Scatter | None
) -> Scatter:
    """The scatter that differences (n,) from a fitted model show, whose `jacobian` (n, p) and prior `precision` (p, p) say what the
    fit has taken out of them. `stated_specimen` is the scatter of specimens, if that is known; `known` is an earlier estimate.
    """
    noise = noise_of(curves, curves.split(differences))
    specimen = stated_specimen if stated_specimen is not None else USUAL_SCATTER if known is None else known.specimen
    found = Scatter(noise, FIRST_SHARE, FIRST_LENGTH, specimen)
    best = -np.inf
    for length, steady in product(LENGTHS.tolist(), STEADY):
        noise = noise_of(curves, curves.split(differences), steady)
        trials = [Scatter(noise, float(share), length, specimen, steady) for share in SHARES]
        likelihood = [_restricted(curves, trial, differences, jacobian, precision) for trial in trials]
        if max(likelihood) > best:
            best, share = max(likelihood), _vertex(np.log(SHARES), np.array(likelihood))
            found = replace(trials[0], model_error=float(np.exp(share)))
    if stated_specimen is None:
        factors = specimen_factors(curves, found, differences)
        # a scaled inverse chi-square prior: as if so many specimens with the usual scatter were known already
        total = KNOWN_AS_FROM * USUAL_SCATTER**2 + float(np.sum((factors - factors.mean()) ** 2))
        found = replace(found, specimen=float(np.sqrt(total / (KNOWN_AS_FROM + factors.size - 1))))
    return found


def _vertex(place: Floats, height: Floats) -> float:
    """Where the parabola through the highest point and its neighbours is highest; evenly spaced places (k,)."""
    top = int(np.argmax(height))
    if not 0 < top < place.size - 1:
        return float(place[top])
    before, here, after = height[top - 1 : top + 2]
    return float(place[top] + 0.5 * (place[1] - place[0]) * (before - after) / (before - 2 * here + after))


def _restricted(curves: Curves, scatter: Scatter, differences: Floats, jacobian: Floats, precision: Floats) -> float:
    """Twice the restricted log-likelihood of a scatter, but for a constant."""
    whiten = Whitening(curves, scatter)
    miss, slopes = whiten(differences), whiten(jacobian.T).T
    normal = slopes.T @ slopes + precision
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    values = np.linalg.eigvalsh(normal / np.outer(scale, scale))
    determined = float(np.sum(np.log(np.maximum(values, 1e-12))) + 2 * np.sum(np.log(scale)))
    return -(float(miss @ miss) + whiten.log_determinant + determined)
