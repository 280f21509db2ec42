"""The flow of the springs over one step, and the elimination of their unknowns, a small block per spring.

A spring with stress p, q in axes 1 and 2 flows in proportion to F (p, q), F = [[2, -1], [-1, 2]] (Sec. 3 of DOI
10.1115/1.4030850). With K its tangent in Lambda = 2 ln lambda, f its flow factor in a step and c diagonal, its block is
D = c + f F K, and it contributes mu Q, Q = K D^-1, to the tangent of the film. Arrays end with the axes springs, points or cases.

Under a load that keeps every spring symmetric, axis 1 stands for both. Arrays then have one axis in the place of two, F is the
number `Symmetry.flow`, K is dp/dLambda_1 along the symmetry, and D and Q are numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.material.springs import UNIAXIAL, SpringLaw, Symmetry
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
    if symmetry is UNIAXIAL:
        elastic *= -0.5
        thickness = np.exp(elastic, out=elastic)
        front = thickness * thickness
        return np.divide(1.0, front, out=front), thickness
    front = np.exp(elastic, out=elastic)
    thickness = front * front
    return front, np.divide(1.0, thickness, out=thickness)


def flow_of(stress: Floats, factor: Floats) -> Floats:
    """F times the stress (axes, n, cases) of the springs times `factor` (n, cases), which holds F itself if there is one axis."""
    if len(stress) == 1:
        return np.asarray(stress[0] * factor)[None]
    flow = 3.0 * stress
    flow -= stress[0] + stress[1]
    flow *= factor
    return flow


@dataclass(frozen=True, slots=True, eq=False)
class Eliminated:
    """D^-1 of the springs as `diagonal` and `off_diagonal` entries (2, n, cases); `share` (2, 2, n, cases) is Q.

    With one axis, there are no off-diagonal entries, and the others are (1, n, cases) and (1, 1, n, cases).
    """

    diagonal: Floats
    off_diagonal: Floats | None
    share: Floats

    @classmethod
    def of(cls, tangent: Floats, flow: Floats, hold: Floats | float) -> Eliminated:
        """Springs of flow factor `flow` f (n, cases), and the entries of their `tangent` K (3, n, cases) or (1, n, cases), which
        may be overwritten. `hold` is c: one number, which makes Q symmetric, or one for each spring and axis (2, n, cases).
        """
        if len(tangent) == 1:
            inverse = tangent[0] * flow
            inverse += hold
            np.divide(1.0, inverse, out=inverse)
            tangent *= inverse
            return cls(inverse[None], None, tangent[None])
        k11, k12, k22 = tangent
        hold_1, hold_2 = (hold, hold) if isinstance(hold, float) else hold
        block = np.empty((2, 2, *k11.shape))
        np.add(k11, k11, out=block[0, 0])
        block[0, 0] -= k12
        np.add(k12, k12, out=block[1, 0])
        np.subtract(block[1, 0], k22, out=block[0, 1])
        block[1, 0] -= k11
        np.add(k22, k22, out=block[1, 1])
        block[1, 1] -= k12
        block *= flow
        block[0, 0] += hold_1
        block[1, 1] += hold_2
        determinant = block[0, 0] * block[1, 1]
        determinant -= block[0, 1] * block[1, 0]
        np.divide(1, determinant, out=determinant)
        diagonal = block[(1, 0), (1, 0)] * determinant
        off_diagonal = block[(0, 1), (1, 0)] * -determinant
        (d11, d22), (d12, d21) = diagonal, off_diagonal
        share = block
        np.multiply(k11, d11, out=share[0, 0])
        share[0, 0] += k12 * d21
        np.multiply(k11, d12, out=share[0, 1])
        share[0, 1] += k12 * d22
        if hold_1 is not hold_2:
            np.multiply(k12, d11, out=share[1, 0])
            share[1, 0] += k22 * d21
        np.multiply(k22, d22, out=share[1, 1])
        share[1, 1] += k12 * d12
        if hold_1 is hold_2:
            share[1, 0] = share[0, 1]
        return cls(diagonal, off_diagonal, share)

    def following(self, flow: Floats) -> Floats:
        """f F Q (axes, axes, n, cases), the change of Lambda - x that flows away per change of Lambda, of springs of flow factor
        `flow` f (n, cases); D^-1 (f F K) = 1 - c D^-1 where c is one number.
        """
        if self.off_diagonal is None:
            return np.asarray(self.share * flow)
        return flow_of(self.share, flow)

    def carried(self, right: Floats) -> Floats:
        """Q times `right`, both (axes, n, cases)."""
        if self.off_diagonal is None:
            return np.asarray(self.share[0] * right)
        return np.asarray(np.einsum("bcnm,cnm->bnm", self.share, right))

    def solve(self, right: Floats, out: Floats) -> None:
        """Write D^-1 `right` to `out`, both (axes, n, cases); `right` is overwritten."""
        np.multiply(self.diagonal, right, out=out)
        if self.off_diagonal is not None:
            right *= self.off_diagonal[::-1]
            out += right[::-1]
