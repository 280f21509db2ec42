"""Weights of measured points in the first fits, and in cross-validation: those of independent points, few for each curve."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.calibration.scatter import Curves, Scatter
from dielast.numerics.arrays import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Weighting:
    """The weighting of differences in the fit: that of points, `weight` (n,) in 1/Pa, and the factor on each specimen's stress.

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
