"""The structures of a disc in a circular frame and of a strip between bars.

The disc (undeformed radius A) stays homogeneous and equibiaxial, whatever isotropic springs it has. In the annulus around it, A < R
< B with r(B) = l_p B, the unknown is the hoop stretch l_2 = r/R as a function of s = (A/R)^2. The radial stretch is then
l_1 = dr/dR = l_2 - 2 s dl_2/ds. Small strains about a homogeneous state are l_2 = a + b s exactly (Lame), and large ones a short
power series: a polynomial of degree n through its values at the rim, at the frame and at n - 1 radii between them. Its energy is
integrated over 2 R dR/A^2 = ds/s^2 at n points, the Gauss points of the weight 1/s^2, which integrate the homogeneous state, the
linear one, and all polynomials of degree 2n - 1 in s exactly. The error falls faster than any power of 1/n.

In the strip an active share f of the length and a passive one are in series, the width is clamped:
f l_a + (1 - f) l_passive = l_p1, l_2 = l_p2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from dielast.mechanics.passive.structure import Structure
from dielast.numerics.columns import Floats

RADII = 41  # of the annulus in a profile
FINE = 200  # Gauss-Legendre points in ln s, of which the Gauss points of the weight 1/s^2 are made


def disc(share: Floats, prestretch: Floats, points: int) -> Structure:
    """Discs whose radius is this `share` (cases,) of the frame's, at a prestretch (cases,), with so many points in the annulus."""
    parts = [_annulus(float(each), points) for each in share]
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
    """Strips of which a `share` of the length is active, at prestretches of the length and of the width, all (cases,)."""
    rest, one, none = 1 - share, np.ones_like(share), np.zeros_like(share)
    gather = np.array([[one, -share / rest], [none, none]])[:, :, None]
    fixed = np.array([[none, first / rest], [second, second]])
    return Structure(np.array([one, rest / share]), gather, fixed, first[None].copy(), np.array([one, none]))


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """What the points say of places at a `radius` (r, cases), over that of the active part: the `weight` (r, P, cases) of each."""

    radius: Floats
    weight: Floats


def across_disc(share: Floats, points: int) -> Spread:
    """The middle and the edge of discs, and radii of the annulus from there to the frame: the polynomial through its points."""
    inside, outside = np.zeros((2, points + 1, share.size)), np.zeros((RADII, points + 1, share.size))
    inside[:, 0] = 1.0
    radius = np.geomspace(np.ones_like(share), 1 / share, RADII)
    for case, each in enumerate(share.tolist()):
        inner = each * each
        z = (1 / np.square(radius[:, case]) - inner) / ((1 - each) * (1 + each))
        outside[:, 1:, case] = _lagrange(_gauss(each, points)[0], z)[0]
    ends = np.stack((np.zeros_like(share), np.ones_like(share)))
    return Spread(np.concatenate((ends, radius)), np.concatenate((inside, outside)))


def across_strip(share: Floats) -> Spread:
    """The middle and the edge of the active part, and both ends of the passive one."""
    one, none = np.ones_like(share), np.zeros_like(share)
    weight = np.array([[one, none], [one, none], [none, one], [none, one]])
    return Spread(np.array([none, one, one, 1 / share]), weight)


@cache
def _annulus(share: float, points: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Of the points of an annulus: areas over that of the disc (n,), l_1 and l_2 (n, n + 1) from the values of l_2 at the nodes,
    and the extrapolation (n,) of a quantity to the rim.
    """
    # z from 0 at the frame to 1 at the rim
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
    """Gauss points in z, s = share^2 + (1 - share^2) z, and weights (n,) of ds/s^2, by the three-term recurrence of their
    polynomials (Golub and Welsch, Math. Comp. 23 (1969) 221).
    """
    fine, weight = _fine()
    depth = -2 * np.log(share)
    up = 0.5 * (1 + fine) * depth  # ln s over that at the frame
    weight = 0.5 * weight * depth * np.exp(depth - up)
    z = np.expm1(up) / np.expm1(depth)
    before, present = np.zeros(FINE), np.full(FINE, 1 / np.sqrt(weight.sum()))
    middle, beside = np.zeros(points), np.zeros(points)
    for row in range(points):
        middle[row] = weight @ (z * present * present)
        following = (z - middle[row]) * present - (beside[row - 1] if row else 0.0) * before
        beside[row] = np.sqrt(weight @ (following * following))
        before, present = present, following / beside[row]
    place, vectors = np.linalg.eigh(np.diag(middle) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1))
    return place, weight.sum() * vectors[0] ** 2


def _lagrange(nodes: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Values and slopes (k, n) at places (k,) of the polynomials that are 1 at one of the nodes (n,) and 0 at the others."""
    value, slope = np.ones((2, at.size, nodes.size))
    for one in range(nodes.size):
        others = np.delete(nodes, one)
        factors = (at[:, None] - others) / (nodes[one] - others)
        value[:, one] = factors.prod(axis=1)
        slope[:, one] = sum(np.delete(factors, row, axis=1).prod(axis=1) / (nodes[one] - others[row]) for row in range(others.size))
    return value, slope
