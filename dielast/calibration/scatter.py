"""Scatter of measured curves about the model: noise of points, error of the model along a curve, differences of specimens.

The difference between a measured and a modelled curve is assumed to be the sum of

- noise, independent from point to point, a share of the level of the curve, estimated from the scatter of neighbouring points;
- the error of the model, a share of the level, correlated along the curve by one of Matern's functions of the distance d
  (`path_length`) with a length l, of which exp(-d/l) is the roughest; ten thousand points of a curve then carry no more information
  than its shape (Kennedy and O'Hagan 2001, DOI 10.1111/1467-9868.00294; Rasmussen and Williams 2006, Eqs. 4.16 and 4.17);
- a factor on all values measured on one specimen, log-normal, a random effect that the fit takes to first order: further points
  of a specimen do not carry more information about the material than the specimen itself (Laird and Ware 1982,
  DOI 10.2307/2529876).

The level of a curve at a point lies between the value there and the root mean square of the curve: errors are partly relative and
partly absolute.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.robust import robust_deviation

LEAST_NOISE = 1e-3  # of the level: no machine measures better
USUAL_SCATTER = 0.05  # of the stress of specimens
FARTHEST = 5.0  # logarithm of a factor
FIRST_SHARE, FIRST_LENGTH = 0.05, 0.3
CORRELATIONS: tuple[Callable[[Floats], Floats], ...] = (
    lambda d: np.exp(-d),
    lambda d: (1 + np.sqrt(3) * d) * np.exp(-np.sqrt(3) * d),
    lambda d: (1 + np.sqrt(5) * d + 5 / 3 * d**2) * np.exp(-np.sqrt(5) * d),
)
"""Matern's correlations over d/l, for an error with no, one and two derivatives."""
INTEGRALS = (2.0, 4 / np.sqrt(3), 16 / (3 * np.sqrt(5)))
"""Integrals of the correlations over all d/l of either sign."""


@dataclass(frozen=True, slots=True, eq=False)
class Scatter:
    """The scatter of measured curves: `noise` (curves,), `model_error` and `specimen` as shares of the level; the correlation of
    the model's error is number `smooth` of `CORRELATIONS`, with a `length` along a curve. The share of the mean square of the whole
    curve in the squared level of a point is `steady`; the rest is the square at the point. `specimens` are the degrees of freedom
    of the scatter of specimens, infinite if it was stated.
    """

    noise: Floats
    model_error: float
    length: float
    specimen: float
    steady: float = 0.5
    smooth: int = 0
    specimens: float = np.inf

    def correlation(self, place: Floats) -> Floats:
        """Correlation (n, n) of the model's error between places (n,) along a curve."""
        return CORRELATIONS[self.smooth](np.abs(place[:, None] - place) / self.length)

    @property
    def piece(self) -> float:
        """The correlation length of the model's error: the integral of its correlation along a curve."""
        return INTEGRALS[self.smooth] * self.length


@dataclass(frozen=True, slots=True, eq=False)
class Scatters:
    """Possible scatters, `members`, and their `probability` (members,); with few points, several are likely."""

    members: tuple[Scatter, ...]
    probability: Floats

    def mean(self, values: Floats) -> Floats:
        """The mean (...) of one value of each member (members, ...)."""
        return np.asarray(np.tensordot(self.probability, values, axes=1))

    @property
    def specimen(self) -> float:
        """The scatter of specimens, the root of its mean square."""
        return float(np.sqrt(self.mean(np.square([member.specimen for member in self.members]))))

    @property
    def model_error(self) -> float:
        """The model's error, the root of its mean square."""
        return float(np.sqrt(self.mean(np.square([member.model_error for member in self.members]))))

    def covariance(self, curves: Curves) -> Floats:
        """The covariance (n, n) of all differences, the mean over the members, which all have the mean 0."""
        whole = np.zeros((curves.measured.size,) * 2)
        for probability, member in zip(self.probability, self.members, strict=True):
            whole += probability * covariance_of(curves, member)
        return whole

    def variance(self, model: Floats, wide: Floats | float = 1.0, power: float = 1.0) -> Floats:
        """The variance (n,) of values measured on a further specimen, at the points (n,) of a modelled curve; `wide` and `power` as
        in `Curves`.
        """
        parts = [
            np.square(wide * level_of(model, member.steady)) * (member.model_error**2 + float(np.mean(member.noise)) ** 2)
            + np.square(member.specimen * power * model)
            for member in self.members
        ]
        return self.mean(np.stack(parts))


def level_of(values: Floats, steady: float) -> Floats:
    """The level of a curve at its points (n,); the mean square of the whole curve has the share `steady` in its square."""
    return np.sqrt((1 - steady) * np.square(values) + steady * np.mean(np.square(values)))


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Measured curves: their `values`, those of the `model`, and `places` along the curve, lists of (n,); `specimen` (curves,).

    Levels are those of the model: measured levels would bias the material towards values that are low by chance (Peelle's puzzle,
    see D'Agostini 1994, DOI 10.1016/0168-9002(94)90719-6).

    The errors of points with a factor `wide`, arrays (n,) of the curves, are larger by it than at other points of their level. The
    values of a curve go with the `power` of the stress, so of the factor of the specimen: 1 for a stress, 1/2 for a voltage.
    """

    values: tuple[Floats, ...]
    model: tuple[Floats, ...]
    places: tuple[Floats, ...]
    specimen: Cases
    wide: tuple[Floats, ...] = ()
    power: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "wide", self.wide or tuple(np.ones(values.shape) for values in self.values))
        object.__setattr__(self, "power", self.power or (1.0,) * len(self.values))

    def levels(self, steady: float = 0.5) -> list[Floats]:
        """The level of each curve at its points (n,), as `level_of` states it, times `wide`."""
        return [wide * level_of(values, steady) for values, wide in zip(self.model, self.wide, strict=True)]

    @property
    def by_factor(self) -> list[Floats]:
        """The derivatives (n,) of the modelled values of each curve by the logarithm of the factor of its specimen."""
        return [power * values for values, power in zip(self.model, self.power, strict=True)]

    @property
    def measured(self) -> Floats:
        """All values, one curve after another."""
        return np.concatenate(self.values)

    @property
    def differences(self) -> Floats:
        """Measured minus modelled values, one curve after another."""
        return self.measured - np.concatenate(self.model)

    def split(self, joined: Floats) -> list[Floats]:
        """An array over all points (..., sum n), split into curves (..., n)."""
        return np.split(joined, np.cumsum([values.size for values in self.values])[:-1], axis=-1)

    def take(self, curves: Sequence[int]) -> Self:
        """Some of the curves."""
        chosen = list(curves)
        values, model, places, wide = (
            tuple(parts[k] for k in chosen) for parts in (self.values, self.model, self.places, self.wide)
        )
        return type(self)(values, model, places, self.specimen[chosen], wide, tuple(self.power[k] for k in chosen))

    def by_specimen(self) -> Iterator[tuple[Cases, Self]]:
        """For each specimen the indices of its curves, and these curves."""
        for specimen in np.unique(self.specimen):
            members = np.flatnonzero(self.specimen == specimen)
            yield members, self.take(members.tolist())


def noise_of(curves: Curves, residuals: Sequence[Floats], steady: float = 0.5) -> Floats:
    """The noise (curves,) over the level of each curve, from the distance of each residual to the line through its neighbours."""
    noises = []
    for values, places, level in zip(residuals, curves.places, curves.levels(steady), strict=True):
        if values.size < 5:
            noises.append(0.01)
            continue
        relative = values / level
        before, after = np.diff(places)[:-1], np.diff(places)[1:]
        share = np.where(before + after > 0, before / np.where(before + after > 0, before + after, 1.0), 0.5)
        miss = relative[1:-1] - ((1 - share) * relative[:-2] + share * relative[2:])
        spread = robust_deviation(miss / np.sqrt(1 + (1 - share) ** 2 + share**2))
        noises.append(max(spread, LEAST_NOISE))
    return np.array(noises)


def covariance_of(curves: Curves, scatter: Scatter) -> Floats:
    """The covariance (n, n) of all differences."""
    edges = np.concatenate(([0], np.cumsum([values.size for values in curves.values])))
    specimen, joined = np.repeat(curves.specimen, np.diff(edges)), np.concatenate(curves.by_factor)
    whole: Floats = (specimen[:, None] == specimen) * np.outer(joined, scatter.specimen**2 * joined)
    for k, (place, level) in enumerate(zip(curves.places, curves.levels(scatter.steady), strict=True)):
        points = slice(edges[k], edges[k + 1])
        error = scatter.model_error**2 * scatter.correlation(place) + scatter.noise[k] ** 2 * np.eye(level.size)
        whole[points, points] += np.outer(level, level) * error
    return whole


class Whitening:
    """Turns differences from measured curves into independent numbers of variance 1, specimen by specimen."""

    def __init__(self, curves: Curves, scatter: Scatter) -> None:
        edges = np.concatenate(([0], np.cumsum([values.size for values in curves.values])))
        self.blocks: list[tuple[Cases, Floats]] = []
        for members, of_specimen in curves.by_specimen():
            rows = np.concatenate([np.arange(edges[k], edges[k + 1]) for k in members])
            factor = np.linalg.cholesky(covariance_of(of_specimen, replace(scatter, noise=scatter.noise[members])))
            self.blocks.append((rows, np.asarray(np.linalg.inv(factor), dtype=float)))

    def __call__(self, differences: Floats) -> Floats:
        """The independent numbers (..., n) of differences (..., n)."""
        made = np.empty_like(differences)
        for rows, factor in self.blocks:
            made[..., rows] = differences[..., rows] @ factor.T
        return made


@dataclass(frozen=True, slots=True, eq=False)
class Weighting:
    """The weighting of differences in first fits and in cross-validation: that of points, `weight` (n,) in 1/Pa, and the factor on
    each specimen's stress.

    The weight of a curve is that of its number of correlation lengths in independent points, whatever its sampling. The factor of a
    specimen is a random effect (Laird and Ware 1982, DOI 10.2307/2529876) with the scatter s: with the derivatives m of modelled
    values by the logarithm of the factor (`by_factor`), the covariance of its differences is W^-2 + s^2 m m^T,
    W = diag(weight). With u = W m, the root of the inverse is [1 - (1 - 1/sqrt(1 + s^2 u.u)) u u^T/(u.u)] W, as its square shows by
    the formula of Sherman and Morrison (1950, DOI 10.1214/aoms/1177729893).
    """

    weight: Floats
    by_factor: Floats
    specimen: Cases
    scatter: float

    @classmethod
    def of(cls, curves: Curves, scatter: Scatter) -> Self:
        """For measured curves with this scatter."""
        variance = scatter.model_error**2
        weights = []
        for k, (level, place) in enumerate(zip(curves.levels(), curves.places, strict=True)):
            spacing = np.gradient(place) if place.size > 1 else np.ones(1)
            independent = np.maximum(spacing, 0.0) / scatter.piece + 1e-6
            weights.append(np.sqrt(independent / (variance + scatter.noise[k] ** 2)) / level)
        specimen = np.repeat(curves.specimen, [values.size for values in curves.values])
        return cls(np.concatenate(weights), np.concatenate(curves.by_factor), specimen, scatter.specimen)

    def __call__(self, differences: Floats, factor: Floats | None = None) -> Floats:
        """Weighted differences (..., n); `factor` (..., n) is on the weight of points, and 0 leaves a point out."""
        weight = self.weight if factor is None else factor * self.weight
        weighted = weight * (differences if factor is None else np.where(factor > 0, differences, 0.0))
        shape = weight * self.by_factor
        for specimen in np.unique(self.specimen):
            rows = self.specimen == specimen
            u = shape[..., rows]
            size = np.sum(np.square(u), axis=-1, keepdims=True)
            root = np.sqrt(1 + self.scatter**2 * size)
            # (1 - 1/root)/size, without its difference of close numbers
            share = self.scatter**2 / (root * (1 + root))
            weighted[..., rows] -= share * u * np.sum(u * weighted[..., rows], axis=-1, keepdims=True)
        return weighted


def _slope(logarithm: float, size: Floats, ratio: Floats, power: Floats) -> float:
    factor = np.exp(power * logarithm)
    return float(np.sum(power * size * factor * (factor - ratio))) + logarithm


def specimen_factors(curves: Curves, scatter: Scatter, differences: Floats) -> Floats:
    """The logarithm of each specimen's factor, the most likely one for differences (n,) from the model.

    With the whitened modelled values m and measured values y of each curve, and the power p of the factor in it, the sum of
    p [exp(2pb) m.m - exp(pb) m.y] + b/s^2 = 0 at the least of the sum of |y - exp(pb) m|^2 + b^2/s^2.
    """
    from scipy.optimize import brentq

    alone, parts = replace(scatter, specimen=0.0), curves.split(differences)
    factors = []
    for members, chosen in curves.by_specimen():
        whiten = Whitening(chosen, replace(alone, noise=scatter.noise[members]))
        shapes, misses = (chosen.split(whiten(np.concatenate(values))) for values in (chosen.model, [parts[k] for k in members]))
        square = np.array([shape @ shape for shape in shapes])
        ratio = 1 + np.array([shape @ miss for shape, miss in zip(shapes, misses, strict=True)]) / square
        power, size = np.array(chosen.power), square * max(scatter.specimen, 1e-12) ** 2
        slope = partial(_slope, size=size, ratio=ratio, power=power)
        # the ends: no deviation at all, and the farthest of those of single curves alone
        away = -float(np.sign(slope(0.0)))
        lone = np.where(ratio > np.exp(-FARTHEST), np.log(np.maximum(ratio, np.exp(-FARTHEST))), -FARTHEST) / power
        far = away * min(max(float(np.max(away * lone)), 0.0), FARTHEST)
        factors.append(float(brentq(slope, min(far, 0.0), max(far, 0.0))) if slope(0.0) * slope(far) < 0 else far)
    return np.array(factors)


def about_factors(curves: Curves, scatter: Scatter) -> Curves:
    """Curves with the measured values that make the fit, of first order in the factors, one about the most likely factors.

    With the most likely logarithm b of a factor and a further part c, y = exp(b + c) m is to first order y exp(-b) (1 - c) = m. As
    b + c has the mean 0 and the scatter of specimens, y exp(-b) (1 + b) differs from m by (b + c) y exp(-b). Logarithms count with
    the power of the curve.
    """
    logarithm = specimen_factors(curves, scatter, curves.differences)[curves.specimen] * np.array(curves.power)
    parts = zip(curves.values, logarithm.tolist(), strict=True)
    return replace(curves, values=tuple(values * np.exp(-b) * (1 + b) for values, b in parts))
