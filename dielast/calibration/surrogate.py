"""A surrogate of residuals: cheap to evaluate, and exact where the residuals were evaluated.

The residuals are a function of the coordinates that is linear in some features, plus a smooth rest. The features are the
coordinates and, for logarithms, the values: the stress is linear in moduli. The rest is interpolated by cubes of distances
(Wendland 2004, DOI 10.1017/CBO9780511617539, Ch. 8), with each coordinate over its scatter.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.calibration.levenberg import costs
from dielast.numerics.arrays import Flags, Floats

SMALL = 1e-3  # root mean square of residuals that are left out
RANK = 1e-7  # of the largest feature: less is a rounding error
ROUNDING = 1e-9  # of the largest element of the matrix, added to its diagonal


@dataclass(frozen=True, slots=True, eq=False)
class Surrogate:
    """The surrogate about `points` (m, p), which are distances from the `centre` (p,) over the `spread` (p,); `logarithm` (p,) are
    coordinates that are logarithms. `features` and `cubes` are the coefficients (f, q) of features and (m, q) of cubed distances.
    """

    centre: Floats
    spread: Floats
    logarithm: Flags
    points: Floats
    features: Floats
    cubes: Floats

    @classmethod
    def of(cls, at: Floats, residuals: Floats, logarithm: Flags) -> Self:
        """The surrogate that has these `residuals` (m, n) at the coordinates `at` (m, p)."""
        centre, spread = at.mean(axis=0), at.std(axis=0)
        spread = np.where(spread > 0, spread, 1.0)
        # as many numbers as matter, with the same products between points
        products, axes = np.linalg.eigh(residuals @ residuals.T)
        matter = products > SMALL**2 * len(at)
        kept = axes[:, matter] * np.sqrt(products[matter])
        points = (at - centre) / spread
        left, size, right = np.linalg.svd(_features(points, spread, logarithm), full_matrices=False)
        seen = size > RANK * size[0]
        # the coefficients of cubes are orthogonal to all features
        basis = np.linalg.qr(left[:, seen], mode="complete")[0]
        inside, outside = basis[:, : np.sum(seen)], basis[:, np.sum(seen) :]
        matrix = _cubes(points, points)
        projected = outside.T @ matrix @ outside
        projected += ROUNDING * (float(np.max(matrix)) or 1.0) * np.eye(len(projected))
        cubes = outside @ np.linalg.solve(projected, outside.T @ kept)
        rest = inside.T @ (kept - matrix @ cubes)
        features = (right[seen].T / size[seen]) @ (left[:, seen].T @ inside @ rest)
        return cls(centre, spread, logarithm, points, features, cubes)

    def cost(self, at: Floats) -> Floats:
        """The sums of squares (k,) at coordinates (k, p)."""
        places = (at - self.centre) / self.spread
        with np.errstate(over="ignore", invalid="ignore"):
            residuals = _features(places, self.spread, self.logarithm) @ self.features + _cubes(places, self.points) @ self.cubes
        return costs(residuals)


def _features(places: Floats, spread: Floats, logarithm: Flags) -> Floats:
    """The features (k, f) at places (k, p)."""
    values = np.expm1(places[:, logarithm] * spread[logarithm]) / spread[logarithm]
    return np.column_stack((np.ones(len(places)), places, (values - places[:, logarithm]) / spread[logarithm]))


def _cubes(places: Floats, points: Floats) -> Floats:
    """The cubed distances (k, m) of places (k, p) from points (m, p)."""
    squared = np.sum(np.square(places), axis=1)[:, None] + np.sum(np.square(points), axis=1) - 2 * places @ points.T
    squared = np.maximum(squared, 0.0)
    return np.asarray(squared * np.sqrt(squared))
