"""Hyperelastic laws W(I1) of unit shear modulus, with I1 the sum of the squared elastic stretches.

A law answers for its stiffness phi = 2 dW/dI1 alone; what that means for a membrane under plane stress is `kinematics`' business.
Another law is another frozen dataclass with what `SpringLaw` asks for (neo-Hookean is Gent's law without a limit).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Cases = NDArray[np.intp]


class SpringLaw(Protocol):
    """What every law offers; `invariant` is I1 of any shape that the law's own constants broadcast against."""

    def stiffness(self, invariant: Floats) -> Floats:
        """phi = 2 dW/dI1; infinite outside the law's domain."""

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """phi and its derivative dphi/dI1."""

    def energy(self, invariant: Floats) -> Floats:
        """W; infinite outside the law's domain."""

    def largest_invariant(self) -> Floats:
        """The I1 that no load can reach, perhaps infinite."""

    def take(self, cases: Cases) -> SpringLaw:
        """The law for some of the cases, the last axis, if its constants differ from case to case."""


@dataclass(frozen=True, slots=True, eq=False)
class Gent:
    """Gent's law, W = -(J/2) ln(1 - (I1 - 3)/J), Eq. 5 of DOI 10.1115/1.4030850; `J_lim` to infinity is neo-Hookean.

    `J_lim` may be an array that broadcasts against the invariant; its last axis of length > 1, if it has two, are the cases.
    """

    J_lim: float | Floats = float("inf")
    _slope: Floats = field(init=False, repr=False)
    _offset: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        slope = -1 / np.asarray(self.J_lim, dtype=float)
        object.__setattr__(self, "_slope", slope)
        object.__setattr__(self, "_offset", 1 - 3 * slope)

    def stiffness(self, invariant: Floats) -> Floats:
        """1/(1 - (I1 - 3)/J)."""
        stiffness = np.asarray(invariant * self._slope)
        stiffness += self._offset
        np.maximum(stiffness, 0.0, out=stiffness)
        return np.divide(1.0, stiffness, out=stiffness)

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """phi and phi^2/J."""
        stiffness = self.stiffness(invariant)
        return stiffness, stiffness * stiffness * -self._slope

    def energy(self, invariant: Floats) -> Floats:
        """-(J/2) ln(1 - (I1 - 3)/J), or (I1 - 3)/2 where J is infinite."""
        limited = self._slope < 0
        share = np.minimum((invariant - 3) * -self._slope, 1.0)
        with np.errstate(divide="ignore"):
            return np.asarray(
                np.where(limited, 0.5 * np.log1p(-share) / np.where(limited, self._slope, 1.0), 0.5 * (invariant - 3))
            )

    def largest_invariant(self) -> Floats:
        """3 + J."""
        return np.asarray(3.0 + self.J_lim)

    def take(self, cases: Cases) -> Gent:
        """The law for some of the cases, where `J_lim` is of shape (n, cases)."""
        limit = np.asarray(self.J_lim)
        return self if limit.ndim < 2 or limit.shape[-1] == 1 else Gent(np.take(limit, cases, axis=-1))


@dataclass(frozen=True, slots=True, eq=False)
class FirstAndRest:
    """One law for the first of n springs and another for the rest; arrays of shape (n, ...)."""

    first: SpringLaw
    rest: SpringLaw

    def stiffness(self, invariant: Floats) -> Floats:
        """Stiffnesses of both laws, joined."""
        return np.concatenate((self.first.stiffness(invariant[:1]), self.rest.stiffness(invariant[1:])))

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """Stiffnesses and derivatives of both laws, joined."""
        first, rest = self.first.hardening(invariant[:1]), self.rest.hardening(invariant[1:])
        return np.concatenate((first[0], rest[0])), np.concatenate((first[1], rest[1]))

    def energy(self, invariant: Floats) -> Floats:
        """Energies of both laws, joined."""
        return np.concatenate((self.first.energy(invariant[:1]), self.rest.energy(invariant[1:])))

    def largest_invariant(self) -> Floats:
        """Limits of both laws, joined."""
        return np.concatenate([np.reshape(law.largest_invariant(), (1, -1)) for law in (self.first, self.rest)])

    def take(self, cases: Cases) -> FirstAndRest:
        """Both laws for some of the cases."""
        return FirstAndRest(self.first.take(cases), self.rest.take(cases))


def join(first: SpringLaw, rest: SpringLaw, count: int) -> SpringLaw:
    """A law for n = 1 + `count` springs, the first of which follows `first`, the others `rest`."""
    if isinstance(first, Gent) and isinstance(rest, Gent):
        limits = np.broadcast_arrays(np.reshape(first.J_lim, (1, -1)), np.reshape(rest.J_lim, (1, -1)))
        return Gent(np.concatenate((limits[0], np.repeat(limits[1], count, axis=0))))
    return FirstAndRest(first, rest)
