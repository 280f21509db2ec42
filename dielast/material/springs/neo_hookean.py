"""The neo-Hookean spring: Gaussian chains without a limiting stretch."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from dielast.material.springs.first_invariant import FirstInvariantLaw
from dielast.material.springs.law import CardForm
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class NeoHookean(FirstInvariantLaw):
    """W = (I1 - 3)/2 for a modulus of 1, the limit of Gent's law (Eq. 5 of DOI 10.1115/1.4030850) as J tends to infinity."""

    name: ClassVar = "neo-hookean"
    title: ClassVar = "neo-Hookean"
    always_stable: ClassVar = True

    def stiffness(self, invariant: Floats) -> Floats:
        """1."""
        return np.ones_like(invariant)

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """1 and 0."""
        return np.ones_like(invariant), np.zeros_like(invariant)

    def energy_of(self, invariant: Floats) -> Floats:
        """(I1 - 3)/2."""
        return np.asarray(0.5 * (invariant - 3))

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Neo-Hookean, or Gent without a limit."""
        return CardForm("neo-hookean", modulus, {}), CardForm("gent", modulus, {"J_lim": math.inf}, needs="J_lim")
