"""The elimination of the unknowns of the springs in one step, a small block per spring.

With K the tangent of a spring in Lambda = 2 ln lambda, G the derivative of its flow in a step in its stress (`flow`), and c
diagonal, its block is D = c + G K, and it contributes mu Q, Q = K D^-1, to the tangent of the film. Arrays end with the axes
springs, points or cases.

Under a load that keeps every spring symmetric, axis 1 stands for both. Arrays then have one axis in the place of two, K is
dp/dLambda_1 along the symmetry, and G, D and Q are numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.material.springs import UNIAXIAL, SpringLaw, Symmetry
from dielast.mechanics.flow import Mobility
from dielast.numerics.arrays import Floats


def stress_of(law: SpringLaw, symmetry: Symmetry | None, elastic: Floats) -> Floats:
    """Stresses (axes, n, cases) of springs at Lambda - x (axes, n, cases), which is overwritten."""
    if symmetry is None:
        return law.stress(np.exp(elastic, out=elastic))
    return law.axial_stress(symmetry, *_sides(symmetry, elastic[0]))[None]


def tangent_of(law: SpringLaw, symmetry: Symmetry | None, elastic: Floats) -> tuple[Floats, Floats]:
    """Stresses as by `stress_of`, and the entries of K: 11, 12 and 22 (3, n, cases), or the only one (1, n, cases)."""
    if symmetry is None:
        return law.tangent(np.exp(elastic, out=elastic))
    stress, tangent = law.axial_tangent(symmetry, *_sides(symmetry, elastic[0]))
    return stress[None], tangent[None]


def _sides(symmetry: Symmetry, elastic: Floats) -> tuple[Floats, Floats]:
    """A and C (n, cases) of springs, from one exponential."""
    if symmetry == UNIAXIAL:
        elastic *= -0.5
        thickness = np.exp(elastic, out=elastic)
        front = thickness * thickness
        return np.divide(1.0, front, out=front), thickness
    front = np.exp(elastic, out=elastic)
    thickness = front * front
    return front, np.divide(1.0, thickness, out=thickness)


@dataclass(frozen=True, slots=True, eq=False)
class Eliminated:
    """D^-1 of the springs as `diagonal` and `off_diagonal` entries (2, n, cases); `share` (2, 2, n, cases) is Q.

    With one axis, there are no off-diagonal entries, and the others are (1, n, cases) and (1, 1, n, cases).
    """

    diagonal: Floats
    off_diagonal: Floats | None
    share: Floats

    @classmethod
    def of(cls, tangent: Floats, mobility: Mobility, hold: Floats | float) -> Eliminated:
        """Springs of this G, and the entries of their `tangent` K (3, n, cases) or (1, n, cases), which may be overwritten. `hold`
        is c: one number, which makes Q symmetric, or one for each spring and axis (2, n, cases).
        """
        block = mobility.through(tangent)
        if len(tangent) == 1:
            inverse = block[0]
            inverse += hold
            np.divide(1.0, inverse, out=inverse)
            tangent *= inverse
            return cls(inverse, None, tangent[None])
        k11, k12, k22 = tangent
        hold_1, hold_2 = (hold, hold) if isinstance(hold, float) else hold
        block[0, 0] += hold_1
        block[1, 1] += hold_2
        determinant = block[0, 0] * block[1, 1]
        determinant -= block[0, 1] * block[1, 0]
        np.divide(1, determinant, out=determinant)
        entries, inverse = block.reshape(4, *k11.shape), np.empty((4, *k11.shape))
        diagonal, off_diagonal = inverse[::3], inverse[1:3]
        np.multiply(entries[::-3], determinant, out=diagonal)
        np.multiply(entries[1:3], determinant, out=off_diagonal)
        np.negative(off_diagonal, out=off_diagonal)
        first, second = inverse.reshape(block.shape)
        share = block
        np.multiply(k11, first, out=share[0])
        share[0] += k12 * second
        if hold_1 is hold_2:
            share[1, 0] = share[0, 1]
            np.multiply(k22, second[1], out=share[1, 1])
            share[1, 1] += k12 * first[1]
        else:
            np.multiply(k12, first, out=share[1])
            share[1] += k22 * second
        return cls(diagonal, off_diagonal, share)

    def carried(self, right: Floats) -> Floats:
        """Q times `right`, both (axes, n, cases)."""
        if self.off_diagonal is None:
            return np.asarray(self.share[0] * right)
        return np.asarray(np.einsum("bcnm,cnm->bnm", self.share, right))

    def scaled(self, units: Floats) -> Eliminated:
        """U D^-1 U^-1 in the place of D^-1, with U the diagonal matrix of `units` (2, n, cases); in place, without Q."""
        assert self.off_diagonal is not None
        ratio = units[0] / units[1]
        self.off_diagonal[0] *= ratio
        self.off_diagonal[1] /= ratio
        return self

    def solve(self, right: Floats, out: Floats) -> None:
        """Write D^-1 `right` to `out`, both (axes, n, cases); `right` is overwritten."""
        np.multiply(self.diagonal, right, out=out)
        if self.off_diagonal is not None:
            right *= self.off_diagonal[::-1]
            out += right[::-1]
