"""The Arruda-Boyce spring: eight chains of finite length, with the exact inverse Langevin function, not its series."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dielast.base.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.springs.first_invariant import LimitedLaw
from dielast.material.springs.langevin import chain_energy, stiffness, stiffness_and_slope
from dielast.material.springs.law import CardForm
from dielast.numerics.arrays import Floats

SERIES = (1 / 2, 1 / 20, 11 / 1050, 19 / 7000, 519 / 673750)  # coefficients of W/mu in I1^k/l_m^(2k - 2), as used by codes


@checked
@dataclass(frozen=True, slots=True, eq=False)
class ArrudaBoyce(LimitedLaw):
    """W = (3 l_m/b_0) (y b - ln(sinh b / b)), less its value at rest, with y = sqrt(I1/3)/l_m and L(b) = coth b - 1/b = y;
    b_0 is b at rest (Arruda and Boyce 1993, DOI 10.1016/0022-5096(93)90013-6).

    The factor makes the initial shear modulus 1. `locking_stretch`, l_m, is the stretch sqrt(I1/3) of the chains at which the
    stress is infinite; if it is infinite, the spring is neo-Hookean. It is a number, or an array (n, cases) or (n, 1) of several
    springs. Raises `InputError` for a locking stretch that is not above 1.
    """

    locking_stretch: float | Floats = math.inf
    _share: Floats = field(init=False, repr=False)
    _third: Floats = field(init=False, repr=False)
    _rest: Floats = field(init=False, repr=False)

    name: ClassVar = "arruda-boyce"
    title: ClassVar = "Arruda-Boyce"
    SHORTEST: ClassVar = 1.2
    MEASURE: ClassVar = " of sqrt(I1/3)"
    USUAL: ClassVar = "is it a strain? 2 to 10 by rule"
    constants: ClassVar = (
        Constant("locking_stretch", "arruda-boyce: stretch sqrt(I1/3) of the chains at which they lock.", above=1.0),
    )

    def __post_init__(self) -> None:
        locking = np.asarray(self.locking_stretch, dtype=float)
        if not np.all(locking > 1):
            raise InputError(f"locking_stretch: {float(np.min(locking)):g}: above 1 is needed: chains at rest have a stretch of 1")
        object.__setattr__(self, "_share", 1 / locking)
        object.__setattr__(self, "_third", 1 / (3 * locking**2))
        object.__setattr__(self, "_rest", stiffness(1 / locking**2))

    def stiffness(self, invariant: Floats) -> Floats:
        """(b/y)/(b_0/y_0)."""
        return np.asarray(stiffness(invariant * self._third) / self._rest)

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """phi, and (db/dy - b/y)/(2 I1)/(b_0/y_0), as dy/dI1 = y/(2 I1)."""
        ratio, slope = stiffness_and_slope(invariant * self._third)
        with np.errstate(invalid="ignore"):
            steeper = np.where(np.isfinite(ratio), slope - ratio, np.inf)
        return ratio / self._rest, steeper / (2 * invariant * self._rest)

    def energy_of(self, invariant: Floats) -> Floats:
        """3 l_m^2/(b_0/y_0) times the energy of the chain minus that at rest, or (I1 - 3)/2 if l_m is infinite."""
        ends = self._share > 0
        share = np.where(ends, self._share, 0.5)
        drawn = chain_energy(np.sqrt(invariant / 3) * share) - chain_energy(share)
        return np.asarray(np.where(ends, 3 / (share**2 * self._rest) * drawn, 0.5 * (invariant - 3)))

    def largest_invariant(self) -> Floats:
        """3 l_m^2."""
        return np.asarray(3 * np.square(np.asarray(self.locking_stretch, dtype=float)))

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Arruda-Boyce with the constant mu of the series used by codes; neo-Hookean, an approximation if the chains lock.

        The initial modulus of that series is 2 dW/dI1 at I1 = 3, which is larger than mu.
        """
        share = float(self._share)
        initial = 2 * math.fsum(k * c * (3 * share**2) ** (k - 1) for k, c in enumerate(SERIES, 1))
        constants = {"locking_stretch": float(self.locking_stretch), "mu": modulus / initial}
        needs = "" if share else "locking_stretch"
        return (
            CardForm("neo-hookean", modulus, {}, _NEO_HOOKEAN_NOTES, exact=not share),
            CardForm("arruda-boyce", modulus, constants, _SERIES_NOTES, needs),
        )


_NEO_HOOKEAN_NOTES = (
    "  A neo-Hookean spring has no end; it is too soft by 1 % at sqrt(I1/3) = 0.13 locking_stretch, if that is large.",
)
_SERIES_NOTES = (
    "Arruda-Boyce: the code has the series of five terms in I1; mu is its constant, which makes the initial modulus dielast's.",
    "The series has no end: against the inverse Langevin function it is too soft by 0.5 %, 2.4 % and 10 % at",
    "sqrt(I1/3) = 0.6, 0.7 and 0.8 of locking_stretch.",
)
