"""Material points that move together: an active part of a film and the passive part around it, between rigid supports.

A film has P points with undeformed areas w, relative to that of the active part. Their stretches are linear in u unknowns:
l_i = sum_j gather_ij u_j + fixed_i, and unknown 0 is the stretch l_1 of the active part. With W the energy of a point per
undeformed volume (its electric part acts in point 0 only), the film is in equilibrium where sum_p w W is stationary in u:

    F_j = sum_p w sum_i s_i gather_ij = 0,    with the nominal stresses s_i = dW/dl_i.

The tangent dF_j/du_k = sum_p w gather_ij ds_i/dl_m gather_mk is symmetric. Elimination from the last unknown to the first leaves
one pivot per unknown, and all are positive if the equilibrium is stable. No part of a matrix is softer than the whole, so the last
pivot, the stiffness of the film at the rim of the active part, is the first to fall to zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dielast.numerics.arrays import ByCase, Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Structure(ByCase):
    """The coefficients of the points' stretches: `weight` w (P, cases), `gather` (2, P, u, cases) and `fixed` (2, P, cases).

    `home` (u, cases) are the unknowns in the homogeneous state. `rim` (P, cases) are the weights in the mean of the transverse
    stresses that may be the first to fall to zero.
    """

    weight: Floats
    gather: Floats
    fixed: Floats
    home: Floats
    rim: Floats
    weighted: Floats = field(init=False)
    """w gather (2, P, u, cases)."""
    watched: Floats = field(init=False)
    """The weights (2, 2, P, cases) of the points' nominal stresses in the two stresses that are watched (`border`)."""

    def __post_init__(self) -> None:
        watched = np.zeros((2, 2, *self.weight.shape))
        watched[0, 0, 0], watched[1, 1] = 1.0, self.rim
        for name, value in {"weighted": self.weight[:, None] * self.gather, "watched": watched}.items():
            object.__setattr__(self, name, value)

    @property
    def points(self) -> int:
        """The number of material points P."""
        return len(self.weight)

    @property
    def unknowns(self) -> int:
        """The number of unknowns u."""
        return len(self.home)

    def columns(self, cases: Cases) -> Cases:
        """The indices (P k,) of the points of `cases` (k,) in arrays over the points of all cases, point after point."""
        return np.asarray((self.weight.shape[1] * np.arange(self.points)[:, None] + cases).ravel())

    def moved(self, change: Floats) -> Floats:
        """The change (2, P, cases) of the stretches due to a `change` (u, cases) of the unknowns."""
        return np.asarray(np.einsum("apuc,uc->apc", self.gather, change))

    def stretch(self, unknown: Floats) -> Floats:
        """Stretches (2, P, cases) at unknowns (u, cases)."""
        return self.moved(unknown) + self.fixed

    def force(self, nominal: Floats) -> Floats:
        """The forces F (u, cases) from nominal stresses (2, P, cases)."""
        return np.asarray(np.einsum("apuc,apc->uc", self.weighted, nominal))

    def border(self, nominal: Floats) -> Floats:
        """The nominal stress of the active part along axis 1, and the transverse one that may be the first to fall to zero,
        (2, ..., cases), from nominal stresses (2, P, ..., cases).
        """
        return np.asarray(np.einsum("kapc,ap...c->k...c", self.watched, nominal))

    def pushed(self, slope: Floats) -> Floats:
        """The change ds/du (..., 2, P, u, cases) of the nominal stresses from ds_i/dl_j (..., 2, 2, P, cases)."""
        return np.asarray(np.einsum("...abpc,bpvc->...apvc", slope, self.gather))

    def assembled(self, pushed: Floats) -> Floats:
        """dF/du (..., u, u, cases) from ds/du (..., 2, P, u, cases)."""
        return np.asarray(np.einsum("apuc,...apvc->...uvc", self.weighted, pushed))

    def tangent(self, slope: Floats) -> Floats:
        """dF/du (..., u, u, cases) from ds_i/dl_j (..., 2, 2, P, cases)."""
        return self.assembled(self.pushed(slope))


def rim_stiffness(tangent: Floats) -> Floats:
    """The last pivot (...) of dF/du (u, u, ...), eliminated from the last row to the first; negative if it is not positive
    definite. The loop is over the few rows.
    """
    rest = tangent.copy()
    for row in range(len(rest) - 1, 0, -1):
        rest[:row, :row] -= (rest[:row, row] / rest[row, row])[:, None] * rest[row, None, :row]
    pivots = np.einsum("uu...->u...", rest)
    return np.asarray(np.where(np.all(pivots[1:] > 0, axis=0), pivots[0], -np.abs(pivots[0])))


def solved(matrix: Floats, right: Floats) -> Floats:
    """The solutions (u, k, cases) of systems (u, u, cases) for right-hand sides (u, k, cases); NaN where a matrix is singular."""
    matrices, sides = np.ascontiguousarray(np.moveaxis(matrix, -1, 0)), np.moveaxis(right, -1, 0)
    try:
        solutions = np.linalg.solve(matrices, sides)
    except np.linalg.LinAlgError:
        matrices[np.linalg.det(matrices) == 0] = np.nan
        solutions = np.linalg.solve(matrices, sides)
    return np.ascontiguousarray(np.moveaxis(solutions, 0, -1), dtype=float)


def inverse(matrix: Floats) -> Floats:
    """The inverse (u, u, cases) of matrices, for many right-hand sides in turn; NaN where a matrix is singular."""
    return solved(matrix, np.eye(len(matrix))[:, :, None])
