"""The flow of the springs over one step, and the elimination of their unknowns, a 2x2 block per spring.

A spring with stress p, q in axes 1 and 2 flows in proportion to F (p, q), F = [[2, -1], [-1, 2]] (Sec. 3 of DOI
10.1115/1.4030850). With K its tangent in Lambda = 2 ln lambda, f its flow factor in a step and c diagonal, its block is
D = c + f F K, and it contributes Q = mu K D^-1 to the tangent of the film. Arrays end with the axes springs, points or cases.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Floats


def flow_of(stress: Floats, factor: Floats) -> Floats:
    """F times the stress (2, n, cases) of the springs times `factor` (n, cases)."""
    flow = 3 * stress
    flow -= stress[0] + stress[1]
    flow *= factor
    return flow


@dataclass(frozen=True, slots=True, eq=False)
class Eliminated:
    """D^-1 of the springs as `diagonal` and `off_diagonal` entries (2, n, cases); `share` (2, 2, n, cases) is Q."""

    diagonal: Floats
    off_diagonal: Floats
    share: Floats

    @classmethod
    def of(cls, modulus: Floats, tangent: Floats, flow: Floats, hold: Floats | float) -> Eliminated:
        """Springs with `modulus` mu and flow factor `flow` f, both (n, cases), and the entries 11, 12, 22 of their `tangent` K
        (3, n, cases). `hold` is c: one number, which makes Q symmetric, or values for each spring and axis (2, n, cases).
        """
        k11, k12, k22 = tangent
        hold_1, hold_2 = (hold, hold) if isinstance(hold, float) else hold
        block = np.empty((2, 2, *k11.shape))
        np.multiply(k11, 2, out=block[0, 0])
        block[0, 0] -= k12
        np.multiply(k12, 2, out=block[1, 0])
        np.subtract(block[1, 0], k22, out=block[0, 1])
        block[1, 0] -= k11
        np.multiply(k22, 2, out=block[1, 1])
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
        share *= modulus
        if hold_1 is hold_2:
            share[1, 0] = share[0, 1]
        return cls(diagonal, off_diagonal, share)

    def solve(self, right: Floats, out: Floats) -> None:
        """Write D^-1 `right` to `out`, both (2, n, cases); `right` is overwritten."""
        np.multiply(self.diagonal, right, out=out)
        right *= self.off_diagonal[::-1]
        out += right[::-1]
