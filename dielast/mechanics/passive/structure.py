"""Material points that move together: an active part of a film and the passive part around it, between rigid supports.

A film has P points of undeformed areas w, that of the active part being 1. Their stretches are linear in u unknowns: l_i = sum_j
gather_ij u_j + fixed_i, the unknown 0 being the stretch l_1 of the active part. With W the energy of a point per undeformed
volume (of which the electric part acts in point 0 alone), the film is in equilibrium where sum_p w W is stationary in u:

    F_j = sum_p w sum_i s_i gather_ij = 0,    s_i = dW/dl_i the nominal stresses.

The tangent dF_j/du_k = sum_p w gather_ij ds_i/dl_m gather_mk is symmetric. Eliminated from the last unknown to the first, it leaves
a pivot for each: all are positive where the equilibrium is stable, and as no part of a matrix is softer than the whole, the last
pivot, the stiffness of the film as it is felt at the rim of the active part, is the first to fall to zero.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from dielast.numerics.columns import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """Weights `weight` (P, cases), `gather` (2, P, u, cases) and `fixed` (2, P, cases) of the points' stretches, and `home`
    (u, cases), the unknowns where the film is homogeneous.

    `rim` (P, cases) says which mean of the points' hoop stresses may be the first to fall to zero.
    """

    weight: Floats
    gather: Floats
    fixed: Floats
    home: Floats
    rim: Floats

    @property
    def points(self) -> int:
        """The number of material points P."""
        return len(self.weight)

    @property
    def unknowns(self) -> int:
        """The number of unknowns u."""
        return len(self.home)

    def take(self, cases: Cases) -> Structure:
        """The same for some of the cases."""
        return Structure(*(np.take(getattr(self, one.name), cases, axis=-1) for one in fields(self)))

    def columns(self, cases: Cases) -> Cases:
        """Where the points of some cases (k,) stand, (P k,), in arrays whose columns are all cases, point after point."""
        return np.asarray((self.weight.shape[1] * np.arange(self.points)[:, None] + cases).ravel())

    def moved(self, change: Floats) -> Floats:
        """What a `change` (u, cases) of the unknowns changes in the stretches, (2, P, cases)."""
        return np.asarray(np.einsum("apuc,uc->apc", self.gather, change))

    def stretch(self, unknown: Floats) -> Floats:
        """Stretches (2, P, cases)."""
        return self.moved(unknown) + self.fixed

    def force(self, nominal: Floats) -> Floats:
        """F (u, cases) of nominal stresses (2, P, cases)."""
        return np.asarray(np.einsum("apuc,apc->uc", self.gather, self.weight * nominal))

    def tangent(self, slope: Floats) -> Floats:
        """dF/du (..., u, u, cases) of ds_i/dl_j (..., 2, 2, P, cases)."""
        pushed = np.einsum("...abpc,bpvc->...apvc", self.weight * slope, self.gather)
        return np.asarray(np.einsum("apuc,...apvc->...uvc", self.gather, pushed))


@dataclass(frozen=True, slots=True, eq=False)
class Factors:
    """A matrix (u, u, cases), or (u, u, k, cases), as U L, eliminated from the last row to the first without exchanging rows:
    `upper` holds what was taken of later rows, `lower` the rows that were left, pivots on the diagonal. Of a symmetric matrix they
    are those of L D L^T.
    """

    upper: Floats
    lower: Floats

    @classmethod
    def of(cls, matrix: Floats) -> Factors:
        """Eliminate; the rows are few, and so is what is done for each."""
        lower, upper = matrix.copy(), np.zeros_like(matrix)
        for row in range(len(matrix) - 1, 0, -1):
            np.divide(lower[:row, row], lower[row, row], out=upper[:row, row])
            lower[:row, :row] -= upper[:row, row, None] * lower[row, None, :row]
        return cls(upper, lower)

    def solve(self, right: Floats) -> Floats:
        """The solution (u, cases), or solutions (u, k, cases)."""
        solution = right.copy()
        upper, lower = (
            (np.expand_dims(self.upper, 2), np.expand_dims(self.lower, 2)) if right.ndim > 2 else (self.upper, self.lower)
        )
        for row in range(len(right) - 1, 0, -1):
            solution[:row] -= upper[:row, row] * solution[row]
        for row in range(len(right)):
            for earlier in range(row):
                solution[row] -= lower[row, earlier] * solution[earlier]
            solution[row] /= lower[row, row]
        return np.asarray(solution)

    def inverse(self) -> Floats:
        """The inverse (u, u, cases): for many right sides one after another."""
        unit = np.eye(len(self.lower))[:, :, None]
        return self.solve(np.broadcast_to(unit, self.lower.shape))

    def rim_stiffness(self) -> Floats:
        """The last pivot (cases,), or (k, cases), of a symmetric matrix; negative wherever that is not positive definite."""
        pivots = np.einsum("uu...->u...", self.lower)
        return np.asarray(np.where(np.all(pivots[1:] > 0, axis=0), pivots[0], -np.abs(pivots[0])))
