"""The structures of a disc in a circular frame and of a strip between bars.

The disc (undeformed radius A) stays homogeneous and equibiaxial for any isotropic springs. In the annulus around it, A < R < B with
r(B) = l_p B, the unknown is the hoop stretch l_2 = r/R as a function of s = (A/R)^2. The radial stretch is then
l_1 = dr/dR = l_2 - 2 s dl_2/ds. Small strains about a homogeneous state are exactly l_2 = a + b s (Lame), and large strains a short
power series in s. So l_2 is a polynomial of degree n, given by its values at the rim, at the frame and at n - 1 radii between them.
The energy is integrated over 2 R dR/A^2 = ds/s^2 with the n Gauss points of the weight 1/s^2, which are exact for all polynomials
of degree 2n - 1 in s, and so for the homogeneous and the linear state. The error falls faster than any power of 1/n.

In the strip an active fraction f of the length and the passive part are in series, and the width is clamped:
f l_a + (1 - f) l_passive = l_p1, l_2 = l_p2.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from dielast.mechanics.passive.structure import Structure
from dielast.numerics.arrays import Floats

RADII = 41  # radii of the annulus in a profile
FINE = 200  # Gauss-Legendre points in ln s, from which the Gauss points of the weight 1/s^2 are computed


def disc(share: Floats, prestretch: Floats, points: int) -> Structure:
    """Discs with a radius of `share` times that of the frame, at a prestretch, both (cases,); `points` is of the annulus."""
    parts = [_annulus(float(radius_ratio), points) for radius_ratio in share]
    area, first, second, rim = (np.stack(column, axis=-1) for column in zip(*parts, strict=True))
    cases = share.size
    gather = np.zeros((2, points + 1, points, cases))
    gather[:, 0, 0] = 1.0
    gather[0, 1:], gather[1, 1:] = first[:, :-1], second[:, :-1]
    fixed = np.zeros((2, points + 1, cases))
    fixed[0, 1:], fixed[1, 1:] = first[:, -1] * prestretch, second[:, -1] * prestretch
    none, home = np.zeros((1, cases)), np.repeat(prestretch[None], points, axis=0)
    weight = np.concatenate((np.ones((1, cases)), area))
    return Structure(weight, gather, fixed, home, np.concatenate((none, rim)))


def strip(share: Floats, first: Floats, second: Floats) -> Structure:
    """Strips with an active fraction `share` of the length, prestretched by `first` along it and `second` across: all (cases,)."""
    passive, one, none = 1 - share, np.ones_like(share), np.zeros_like(share)
    gather = np.array([[one, -share / passive], [none, none]])[:, :, None]
    fixed = np.array([[none, first / passive], [second, second]])
    return Structure(np.array([one, passive / share]), gather, fixed, first[None].copy(), np.array([one, none]))


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Places at a `radius` (r, cases) over that of the active part, and the `weight` (r, P, cases) of the points' values there."""

    radius: Floats
    weight: Floats


def across_disc(share: Floats, points: int) -> Spread:
    """The centre and the edge of discs, and radii of the annulus from rim to frame, by the polynomial through the points."""
    inside, outside = np.zeros((2, points + 1, share.size)), np.zeros((RADII, points + 1, share.size))
    inside[:, 0] = 1.0
    radius = np.geomspace(np.ones_like(share), 1 / share, RADII)
    for case, radius_ratio in enumerate(share.tolist()):
        inner = radius_ratio * radius_ratio
        z = (1 / np.square(radius[:, case]) - inner) / ((1 - radius_ratio) * (1 + radius_ratio))
        outside[:, 1:, case] = _lagrange(_gauss(radius_ratio, points)[0], z)[0]
    ends = np.stack((np.zeros_like(share), np.ones_like(share)))
    return Spread(np.concatenate((ends, radius)), np.concatenate((inside, outside)))


def across_strip(share: Floats) -> Spread:
    """The centre and the edge of the active part, and both ends of the passive part."""
    one, none = np.ones_like(share), np.zeros_like(share)
    weight = np.array([[one, none], [one, none], [none, one], [none, one]])
    return Spread(np.array([none, one, one, 1 / share]), weight)


@cache
def _annulus(share: float, points: int) -> tuple[Floats, Floats, Floats, Floats]:
    """The points of an annulus: their areas over that of the disc (n,), the matrices (n, n + 1) of l_1 and l_2 at the points from
    the values of l_2 at the nodes, and the weights (n,) that extrapolate a quantity to the rim.
    """
    # z is 0 at the frame and 1 at the rim
    inner = share * share
    width = (1 - share) * (1 + share)
    place, area = _gauss(share, points)
    nodes = 0.5 * (1 + np.cos(np.pi * np.arange(points + 1) / points))
    second, slope = _lagrange(nodes, place)
    s = inner + width * place
    rim, _ = _lagrange(place, np.ones(1))
    return area, second - 2 * (s / width)[:, None] * slope, second, rim[0]


@cache
def _fine() -> tuple[Floats, Floats]:
    """Gauss-Legendre points and weights."""
    return np.polynomial.legendre.leggauss(FINE)


def _gauss(share: float, points: int) -> tuple[Floats, Floats]:
    """Gauss points in z, where s = share^2 + (1 - share^2) z, and weights (n,) for ds/s^2, by the three-term recurrence of the
    orthogonal polynomials (Golub and Welsch, Math. Comp. 23 (1969) 221).
    """
    fine, weight = _fine()
    depth = -2 * np.log(share)
    up = 0.5 * (1 + fine) * depth  # ln s minus its value at the frame
    weight = 0.5 * weight * depth * np.exp(depth - up)
    z = np.expm1(up) / np.expm1(depth)
    before, present = np.zeros(FINE), np.full(FINE, 1 / np.sqrt(weight.sum()))
    diagonal, off_diagonal = np.zeros(points), np.zeros(points)
    for row in range(points):
        diagonal[row] = weight @ (z * present * present)
        following = (z - diagonal[row]) * present - (off_diagonal[row - 1] if row else 0.0) * before
        off_diagonal[row] = np.sqrt(weight @ (following * following))
        before, present = present, following / off_diagonal[row]
    place, vectors = np.linalg.eigh(np.diag(diagonal) + np.diag(off_diagonal[:-1], 1) + np.diag(off_diagonal[:-1], -1))
    return place, weight.sum() * vectors[0] ** 2


def _lagrange(nodes: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Values and slopes (k, n) at places (k,) of the Lagrange polynomials, which are 1 at one node (n,) and 0 at the others."""
    value, slope = np.ones((2, at.size, nodes.size))
    for node in range(nodes.size):
        others = np.delete(nodes, node)
        gaps = nodes[node] - others
        factors = (at[:, None] - others) / gaps
        value[:, node] = factors.prod(axis=1)
        slope[:, node] = sum(np.delete(factors, row, axis=1).prod(axis=1) / gaps[row] for row in range(others.size))
    return value, slope
