"""Gent's spring, with a limiting stretch of its chains; without a limit it is neo-Hookean."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dielast.base.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.springs.first_invariant import LimitedLaw
from dielast.material.springs.law import CardForm
from dielast.numerics.arrays import Floats


@checked
@dataclass(frozen=True, slots=True, eq=False)
class Gent(LimitedLaw):
    """W = -(J/2) ln(1 - (I1 - 3)/J), Eq. 5 of DOI 10.1115/1.4030850, with J = `J_lim`; J to infinity is neo-Hookean.

    `J_lim` is a number, or an array (n, cases) or (n, 1) of several springs. W is for a modulus of 1. Raises `InputError` for a
    J_lim that is not positive.
    """

    J_lim: float | Floats = math.inf
    _slope: Floats = field(init=False, repr=False)
    _offset: Floats = field(init=False, repr=False)

    name: ClassVar = "gent"
    title: ClassVar = "Gent"
    SHORTEST: ClassVar = 1.0
    USUAL: ClassVar = "is it I1 - 3 where they are taut, usually 10 to 200?"
    constants: ClassVar[tuple[Constant, ...]] = (
        Constant(
            "J_lim",
            "gent: value of I1 - 3 at which the spring locks. Default: none, a neo-Hookean spring.",
            at_least=1e-6,
            left_out=math.inf,
        ),
    )

    def __post_init__(self) -> None:
        limit = np.asarray(self.J_lim, dtype=float)
        if not np.all(limit > 0):
            wrong = float(limit[~(limit > 0)].flat[0])
            raise InputError(
                f"{wrong:g}: the value of I1 - 3 at which the spring locks is needed, which is above 0", argument="J_lim"
            )
        slope = -1 / limit
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

    def energy_of(self, invariant: Floats) -> Floats:
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

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Gent with its J_lim; neo-Hookean, an approximation if there is a limit; Yeoh as an approximation.

        Yeoh's constants are those of the series of W to the third power of I1 - 3: mu/2, mu/(4 J), mu/(6 J^2).
        """
        if np.ndim(self.J_lim):
            raise InputError("a card holds Gent springs of one J_lim only", argument="formats")
        limit = float(self.J_lim)
        needs = "J_lim" if math.isinf(limit) else ""
        series = {"C10": modulus / 2, "C20": modulus / (4 * limit), "C30": modulus / (6 * limit**2)}
        return (
            CardForm("neo-hookean", modulus, {}, _NEO_HOOKEAN_NOTES, exact=math.isinf(limit)),
            CardForm("gent", modulus, {"J_lim": limit}, needs=needs),
            CardForm("yeoh", modulus, series, _YEOH_NOTES, needs, exact=False),
        )


_NEO_HOOKEAN_NOTES = (
    "  A neo-Hookean spring is too soft by the share (I1 - 3)/J_lim of Gent's stiffness: 1 % at I1 - 3 = 0.01 J_lim.",
)
_YEOH_NOTES = (
    "  Yeoh's is the series of Gent's energy to the third power of I1 - 3: too soft by the share ((I1 - 3)/J_lim)^3",
    "  of Gent's stiffness: 1 % at I1 - 3 = 0.215 J_lim, 10 % at 0.464 J_lim; it has no limit.",
)
