"""Laws whose energy W(I1) depends only on the first invariant, I1 = A + B + C, and those of chains with a limiting stretch."""

from typing import ClassVar, Self

import numpy as np

from dielast.material.springs.law import SpringLaw, Symmetry
from dielast.numerics.arrays import Floats


class FirstInvariantLaw(SpringLaw):
    """Base of laws W(I1). A law defines phi = 2 dW/dI1 (`stiffness`, `hardening`), W (`energy_of`) and the limit of I1.

    The stresses of a spring are p = phi (A - C) and q = phi (B - C) in axes 1 and 2 (Sec. 3 of DOI 10.1115/1.4030850).
    """

    __slots__ = ()

    def stiffness(self, invariant: Floats) -> Floats:
        """phi = 2 dW/dI1 at I1 (...); infinite outside the law's domain."""
        raise NotImplementedError

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """phi and its derivative dphi/dI1."""
        raise NotImplementedError

    def energy_of(self, invariant: Floats) -> Floats:
        """W at I1 (...); infinite outside the law's domain."""
        raise NotImplementedError

    def largest_invariant(self) -> Floats:
        """The limit of I1, which no load can reach; infinite for a law that holds at every stretch."""
        return np.asarray(np.inf)

    def stress(self, squared_stretch: Floats) -> Floats:
        """p = phi (A - C) and q = phi (B - C)."""
        total, thickness = _invariant(squared_stretch)
        carried = squared_stretch - thickness
        carried *= self.stiffness(total)
        return carried

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses, and dp/dlnA = phi (A + C) + phi' (A - C)^2, dp/dlnB = phi C + phi' (A - C) (B - C), and so on; phi' = dphi/dI1.

        Exact and symmetric.
        """
        total, thickness = _invariant(squared_stretch)
        stiffness, slope = self.hardening(total)
        difference = squared_stretch - thickness
        half = np.empty((3, *total.shape))
        np.add(squared_stretch, thickness, out=half[::2])
        half[1] = thickness
        half *= stiffness
        steeper = difference * slope
        half[:2] += steeper[0] * difference
        half[2] += steeper[1] * difference[1]
        difference *= stiffness
        return difference, half

    def energy(self, squared_stretch: Floats) -> Floats:
        """W(I1)."""
        return self.energy_of(_invariant(squared_stretch)[0])

    def margin(self, squared_stretch: Floats) -> Floats:
        """1 - (I1 - 3)/(limit of I1 - 3)."""
        return np.asarray(1 - (_invariant(squared_stretch)[0] - 3) / (self.largest_invariant() - 3))

    def axial_stress(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> Floats:
        """phi (A - C)."""
        stiffness = self.stiffness(_axial_invariant(symmetry, front, thickness))
        front -= thickness
        front *= stiffness
        return front

    def axial_tangent(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> tuple[Floats, Floats]:
        """phi (A - C), and phi (A + C `thinning`) + phi' `fronts` (A - C)^2."""
        stiffness, slope = self.hardening(_axial_invariant(symmetry, front, thickness))
        slope *= symmetry.fronts
        thickness_part = thickness * symmetry.thinning
        thickness_part += front
        thickness_part *= stiffness
        front -= thickness
        stress = front * stiffness
        front *= front
        front *= slope
        front += thickness_part
        return stress, front

    def equibiaxial_tangent(self, front: Floats) -> tuple[Floats, Floats]:
        """phi A, and phi C + phi' (A - C)^2."""
        back = front * front
        np.divide(1.0, back, out=back)
        stiffness, slope = self.hardening(front + front + back)
        difference = front - back
        slope *= difference
        slope *= difference
        back *= stiffness
        back += slope
        front *= stiffness
        return front, back


class LimitedLaw(FirstInvariantLaw):
    """Base of laws whose first constant states the limit of the chains, infinite by default: a number, or an array (n, cases) or
    (n, 1) for several springs. The chains stiffen towards the limit, so that a spring is stable at all stretches below it.

    `SHORTEST` is the constant of chains that are taut at a stretch of about 1.7; smaller values are implausible for a rubber.
    `MEASURE` says what the constant is a value of, in words that follow the number, and `USUAL` is a question about a likely
    mistake.
    """

    __slots__ = ()

    always_stable: ClassVar = True
    SHORTEST: ClassVar[float]
    MEASURE: ClassVar[str] = ""
    USUAL: ClassVar[str]

    def _limit(self) -> tuple[str, Floats]:
        """The name of the constant and its value."""
        name = self.constants[0].name
        return name, np.asarray(getattr(self, name), dtype=float)

    def describe_limit(self) -> str:
        """The limit with its number."""
        name, limit = self._limit()
        return f"the {self.title} limit, {name} = {float(limit):g}{self.MEASURE}"

    def warning(self, whose: str) -> str:
        """A warning of chains that are taut at small stretches, or an empty text."""
        name, limit = self._limit()
        shortest = float(np.min(limit))
        if shortest >= self.SHORTEST:
            return ""
        return f"{name} = {shortest:g} ({whose}): chains so short make no rubber: {self.USUAL}"

    def unlimited(self) -> Self:
        """The law without a limit."""
        return type(self)()


def _invariant(squared_stretch: Floats) -> tuple[Floats, Floats]:
    """I1 and C, both of shape (...)."""
    thickness = squared_stretch[0] * squared_stretch[1]
    np.divide(1.0, thickness, out=thickness)
    total = squared_stretch[0] + squared_stretch[1]
    total += thickness
    return total, thickness


def _axial_invariant(symmetry: Symmetry, front: Floats, thickness: Floats) -> Floats:
    """I1 under a symmetry."""
    pair, single = (front, thickness) if symmetry.fronts == 2 else (thickness, front)
    total = pair + pair
    total += single
    return total
