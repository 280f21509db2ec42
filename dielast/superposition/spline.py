"""Cubic B-splines on even knots: value, slope, and the normal equations of a fit, gathered by counting."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Spline:
    """Cubic B-spline with `coefficient` (K,) on K - 3 intervals of width `spacing` from `origin`; fitted to points up to `end`."""

    origin: float
    spacing: float
    coefficient: Array
    end: float

    def __call__(self, x: Array) -> Array:
        """Value at `x` (n,)."""
        index, basis, _ = spline_basis(x, self.origin, self.spacing, self.coefficient.size)
        return np.asarray(np.sum(basis * self.coefficient[index + np.arange(4)[:, None]], axis=0))

    def slope(self, x: Array) -> Array:
        """First derivative at `x` (n,)."""
        index, _, slope = spline_basis(x, self.origin, self.spacing, self.coefficient.size)
        return np.asarray(np.sum(slope * self.coefficient[index + np.arange(4)[:, None]], axis=0))


def spline_basis(x: Array, origin: float, spacing: float, size: int) -> tuple[Index, Array, Array]:
    """First coefficient (n,), values (4, n) and derivatives (4, n) of the four basis functions that do not vanish at `x` (n,)."""
    position = (x - origin) / spacing
    index = np.clip(position.astype(np.intp), 0, size - 4)
    t = position - index
    r = 1 - t
    tt, rr = t * t, r * r
    basis, slope = np.empty((4, x.size)), np.empty((4, x.size))
    basis[0], basis[3] = rr * r / 6, tt * t / 6
    basis[1], basis[2] = basis[3] * 3 - tt + 2 / 3, basis[0] * 3 - rr + 2 / 3
    slope[0], slope[3] = -rr / (2 * spacing), tt / (2 * spacing)
    slope[1], slope[2] = 3 * slope[3] - 2 / spacing * t, 3 * slope[0] + 2 / spacing * r
    return index, basis, slope


def gram(index: Index, basis: Array, weight: Array, size: int) -> Array:
    """Sum over the points of weight times the products of their basis functions, (size, size)."""
    matrix = np.zeros((size, size))
    intervals = np.arange(size - 3)
    weighted = basis * weight
    for a in range(4):
        for b in range(a, 4):
            matrix[intervals + a, intervals + b] += np.bincount(index, weighted[a] * basis[b], minlength=size - 3)
    return np.asarray(matrix + np.triu(matrix, 1).T)


def roughness(size: int, spacing: float) -> Array:
    """Weak prior on second differences of the coefficients, (size, size): the slope changes by about one from knot to knot."""
    second = np.diff(np.eye(size), 2, axis=0)
    return np.asarray(second.T @ second / spacing**2)
