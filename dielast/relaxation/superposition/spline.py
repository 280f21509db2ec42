"""Cubic B-splines on even knots: values, slopes and penalised fits, with normal equations assembled by bincount.

SciPy has such splines, but importing scipy.interpolate takes longer than building a whole master curve.
"""

from dataclasses import dataclass
from functools import cache
from typing import Self

import numpy as np

from dielast.numerics.arrays import Floats, Index


@dataclass(frozen=True, slots=True, eq=False)
class Spline:
    """Cubic B-spline with `coefficient` (K,) on K - 3 intervals of width `spacing` from `origin`; fitted to points up to `end`."""

    origin: float
    spacing: float
    coefficient: Floats
    end: float

    def __call__(self, x: Floats) -> Floats:
        """Value at `x` (n,)."""
        index, basis, _ = spline_basis(x, self.origin, self.spacing, self.coefficient.size)
        return np.asarray(np.sum(basis * self.coefficient[index + np.arange(4)[:, None]], axis=0))

    def extended(self, x: Floats) -> Floats:
        """Value at `x` (n,), on straight lines beyond the points."""
        inside = np.clip(x, self.origin, self.end)
        index, _, slope = spline_basis(inside, self.origin, self.spacing, self.coefficient.size)
        return np.asarray(self(inside) + (x - inside) * np.sum(slope * self.coefficient[index + np.arange(4)[:, None]], axis=0))


@dataclass(frozen=True, slots=True, eq=False)
class SplineProblem:
    """Splines to fit to points (n,), one for each channel: for each point, the indices `rows` (4, n) of its coefficients, and the
    `basis` and `slope` (4, n) of their functions. Each channel has `size` coefficients, one channel after another.
    """

    rows: Index
    basis: Floats
    slope: Floats
    origin: float
    spacing: float
    end: float
    size: int
    channels: int

    @classmethod
    def of(cls, x: Floats, spacing: float, channel: Index | None = None, channels: int = 1) -> Self:
        """The problem for points at `x` (n,), with knots `spacing` apart."""
        origin, end = float(x.min()), float(x.max())
        size = int(np.ceil((end - origin) / spacing + 1e-9)) + 3
        index, basis, slope = spline_basis(x, origin, spacing, size)
        if channel is not None and channels > 1:  # one block of coefficients per channel; no interval belongs to two
            index = index + channel * size
        rows = np.asarray(index + np.arange(4)[:, None], dtype=np.intp)
        return cls(rows, basis, slope, origin, spacing, end, size, channels)

    def fit(self, weight: Floats, target: Floats) -> tuple[Floats, Floats, Floats]:
        """Inverse of the normal matrix, coefficients, and fitted values (n,) for a `target` (n,) with `weight` (n,)."""
        inverse = self._inverse(gram(self.rows[0], self.basis, weight, self.size * self.channels))
        coefficient = inverse @ self.gather(self.basis * weight * target)
        return inverse, coefficient, np.sum(self.basis * coefficient[self.rows], axis=0)

    def gather(self, values: Floats) -> Floats:
        """Sums of `values` (4, n) for each coefficient."""
        return np.asarray(np.bincount(self.rows.ravel(), values.ravel(), minlength=self.size * self.channels), dtype=float)

    def leverage(self, inverse: Floats) -> Floats:
        """Variance (n,) of the fitted values for weights that are inverse variances."""
        return self._variance(inverse, self.basis)

    def slope_variance(self, inverse: Floats) -> Floats:
        """Variance (n,) of the slopes at the points for weights that are inverse variances."""
        return self._variance(inverse, self.slope)

    def _variance(self, inverse: Floats, side: Floats) -> Floats:
        return np.asarray(np.einsum("an,abn,bn->n", side, inverse[self.rows[:, None], self.rows[None]], side))

    def splines(self, coefficient: Floats) -> tuple[Spline, ...]:
        """The spline of each channel."""
        return tuple(Spline(self.origin, self.spacing, part, self.end) for part in np.split(coefficient, self.channels))

    def _inverse(self, matrix: Floats) -> Floats:
        """Inverse of the block-diagonal `matrix` plus the prior of smoothness in every block."""
        prior, inverse = roughness(self.size, self.spacing), np.zeros(matrix.shape)
        for first in range(0, len(matrix), self.size):
            block = slice(first, first + self.size)
            inverse[block, block] = np.linalg.inv(matrix[block, block] + prior)
        return inverse


def spline_basis(x: Floats, origin: float, spacing: float, size: int) -> tuple[Index, Floats, Floats]:
    """First coefficient (n,), values (4, n) and slopes (4, n) of the four basis functions that do not vanish at `x` (n,)."""
    position = (x - origin) / spacing
    index = np.clip(position.astype(np.intp), 0, size - 4)
    t = position - index
    r = 1 - t
    t2, r2 = t * t, r * r
    basis, slope = np.empty((4, x.size)), np.empty((4, x.size))
    basis[0], basis[3] = r2 * r / 6, t2 * t / 6
    basis[1], basis[2] = basis[3] * 3 - t2 + 2 / 3, basis[0] * 3 - r2 + 2 / 3
    slope[0], slope[3] = -r2 / (2 * spacing), t2 / (2 * spacing)
    slope[1], slope[2] = 3 * slope[3] - 2 / spacing * t, 3 * slope[0] + 2 / spacing * r
    return index, basis, slope


def gram(index: Index, basis: Floats, weight: Floats, size: int) -> Floats:
    """Sum over the points of weight times the products of their basis functions, (size, size)."""
    matrix = np.zeros((size, size))
    flat, weighted = matrix.reshape(-1), basis * weight
    for a in range(4):
        for b in range(a, 4):
            sums = np.bincount(index, weighted[a] * basis[b], minlength=size - 3)
            # the entries (a, b), (a + 1, b + 1), ... of the intervals, and their mirror images
            for first in {a * size + b, b * size + a}:
                flat[first :: size + 1][: size - 3] += sums
    return matrix


def roughness(size: int, spacing: float) -> Floats:
    """Weak prior on second differences of the coefficients, (size, size): the slope may change by about 1 from knot to knot."""
    return _squared_differences(size) / spacing**2


@cache
def _squared_differences(size: int) -> Floats:
    second = np.diff(np.eye(size), 2, axis=0)
    return np.asarray(second.T @ second)
