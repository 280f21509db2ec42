"""Hyperelastic springs of an incompressible membrane: plane stress, through-thickness stress eliminated.

A spring is described by its squared elastic stretches, an array of shape (2, ...): A = lambda_1^2 and B = lambda_2^2 in front, with
C = 1/(A B) = lambda_3^2 understood. Every law here has unit shear modulus; the caller multiplies by mu. A second law is a second
frozen dataclass that offers what `SpringLaw` asks for.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class SpringLaw(Protocol):
    """What every hyperelastic law offers, for squared elastic stretches of shape (2, ...) and unit shear modulus."""

    def stress(self, squared_stretch: Floats) -> Floats:
        """True stresses (p, q) in axes 1 and 2, shape (2, ...); not finite outside the law's domain."""

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses, and their derivatives (K11, K12, K22) in the logarithmic stretches, shape (3, ...)."""

    def energy(self, squared_stretch: Floats) -> Floats:
        """Strain energy per undeformed volume, shape (...); infinite outside the law's domain."""

    def reach(self, squared_stretch: Floats) -> Floats:
        """How much of the law's domain is used: 0 undeformed, 1 at the limit; shape (...)."""

    def take(self, cases: NDArray[np.intp]) -> SpringLaw:
        """The law for some of the cases, the last axis, if its constants differ from case to case."""


@dataclass(frozen=True, slots=True, eq=False)
class Gent:
    """Gent's law, W = -(J/2) ln(1 - (A + B + C - 3)/J), Eq. 5 of DOI 10.1115/1.4030850; `J_lim` to infinity is neo-Hookean.

    p = (A - C)/d, q = (B - C)/d with d = 1 - (A + B + C - 3)/J. `J_lim` may be an array that broadcasts against the stresses.
    """

    J_lim: float | Floats = float("inf")
    _slope: Floats = field(init=False, repr=False)
    _offset: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        slope = -1 / np.asarray(self.J_lim, dtype=float)
        object.__setattr__(self, "_slope", slope)
        object.__setattr__(self, "_offset", 1 - 3 * slope)

    def take(self, cases: NDArray[np.intp]) -> Gent:
        """The law for some of the cases, if the limit is given case by case: `J_lim` of shape (n, cases)."""
        limit = np.asarray(self.J_lim)
        return self if limit.ndim < 2 or limit.shape[-1] == 1 else Gent(limit[..., cases])

    def stress(self, squared_stretch: Floats) -> Floats:
        """True stresses (p, q); infinite or NaN at and beyond the limit."""
        thickness, margin = self._margin(squared_stretch)
        stress = squared_stretch - thickness
        stress /= margin
        return stress

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses and K11 = 2(A + C)/d + 2p^2/J, K12 = 2C/d + 2pq/J, K22 = 2(B + C)/d + 2q^2/J (exact and symmetric)."""
        thickness, margin = self._margin(squared_stretch)
        stress = (squared_stretch - thickness) / margin
        tangent = np.empty((3, *thickness.shape))
        np.add(squared_stretch, thickness, out=tangent[::2])
        tangent[1] = thickness
        tangent /= margin
        weighted = stress * -self._slope
        tangent[0] += weighted[0] * stress[0]
        tangent[1] += weighted[0] * stress[1]
        tangent[2] += weighted[1] * stress[1]
        tangent *= 2
        return stress, tangent

    def energy(self, squared_stretch: Floats) -> Floats:
        """-(J/2) ln d, or (A + B + C - 3)/2 where J is infinite."""
        excess = squared_stretch[0] + squared_stretch[1] + 1 / (squared_stretch[0] * squared_stretch[1]) - 3
        limit = np.broadcast_to(np.asarray(self.J_lim, dtype=float), excess.shape)
        finite = np.where(np.isfinite(limit), limit, 1.0)
        with np.errstate(divide="ignore"):
            stiffening = -0.5 * finite * np.log1p(-np.minimum(excess / finite, 1.0))
        return np.asarray(np.where(np.isfinite(limit), stiffening, 0.5 * excess))

    def reach(self, squared_stretch: Floats) -> Floats:
        """(A + B + C - 3)/J."""
        excess = squared_stretch[0] + squared_stretch[1] + 1 / (squared_stretch[0] * squared_stretch[1]) - 3
        return np.asarray(excess / self.J_lim)

    def _margin(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """C, and d clamped at zero, so that whatever is divided by it shows that the limit was passed."""
        thickness = squared_stretch[0] * squared_stretch[1]
        np.divide(1.0, thickness, out=thickness)
        margin = squared_stretch[0] + squared_stretch[1]
        margin += thickness
        margin *= self._slope
        margin += self._offset
        np.maximum(margin, 0.0, out=margin)
        return thickness, margin


@dataclass(frozen=True, slots=True, eq=False)
class FirstAndRest:
    """One law for the first of n springs and another for the rest; arrays of shape (2, n, ...)."""

    first: SpringLaw
    rest: SpringLaw

    def stress(self, squared_stretch: Floats) -> Floats:
        """Stresses of both laws, joined."""
        return np.concatenate((self.first.stress(squared_stretch[:, :1]), self.rest.stress(squared_stretch[:, 1:])), axis=1)

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses and tangents of both laws, joined."""
        first, rest = self.first.tangent(squared_stretch[:, :1]), self.rest.tangent(squared_stretch[:, 1:])
        return np.concatenate((first[0], rest[0]), axis=1), np.concatenate((first[1], rest[1]), axis=1)

    def energy(self, squared_stretch: Floats) -> Floats:
        """Energies of both laws, joined."""
        return np.concatenate((self.first.energy(squared_stretch[:, :1]), self.rest.energy(squared_stretch[:, 1:])))

    def reach(self, squared_stretch: Floats) -> Floats:
        """Reaches of both laws, joined."""
        return np.concatenate((self.first.reach(squared_stretch[:, :1]), self.rest.reach(squared_stretch[:, 1:])))

    def take(self, cases: NDArray[np.intp]) -> FirstAndRest:
        """Both laws for some of the cases."""
        return FirstAndRest(self.first.take(cases), self.rest.take(cases))


def join(first: SpringLaw, rest: SpringLaw, count: int) -> SpringLaw:
    """A law for one spring of `first` and `count` springs of `rest`, stacked along the axis after the components."""
    if isinstance(first, Gent) and isinstance(rest, Gent):
        limits = [np.reshape(first.J_lim, (1, -1)), np.reshape(rest.J_lim, (1, -1))]
        width = max(limit.shape[1] for limit in limits)
        return Gent(np.repeat([np.broadcast_to(limit[0], (width,)) for limit in limits], (1, count), axis=0))
    return FirstAndRest(first, rest)
