"""Yeoh's spring: a cubic in I1 - 3; with negative C20 and positive C30 it first softens and then stiffens."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from dielast.base.errors import InputError
from dielast.base.units import STRESS
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.springs.first_invariant import FirstInvariantLaw
from dielast.material.springs.law import CardForm, ScaledLaw
from dielast.numerics.arrays import Floats


@checked
@dataclass(frozen=True, slots=True, eq=False)
class Yeoh(ScaledLaw, FirstInvariantLaw):
    """W = C10 x + C20 x^2 + C30 x^3 with x = I1 - 3 (Yeoh 1993, DOI 10.5254/1.3538343), with the initial shear modulus 2 C10.

    The constants are in Pa, or in any other unit: a spring of modulus mu has W = (mu/2) (x + (C20/C10) x^2 + (C30/C10) x^3).
    """

    C10: float | Floats
    C20: float | Floats = 0.0
    C30: float | Floats = 0.0
    _square: Floats = field(init=False, repr=False)
    _cube: Floats = field(init=False, repr=False)

    name: ClassVar = "yeoh"
    title: ClassVar = "Yeoh"
    modulus_formula: ClassVar = "2 C10"
    stresses: ClassVar = ("C10", "C20", "C30")
    constants: ClassVar = (
        Constant(
            "C10", "yeoh: coefficient of I1 - 3, half the initial shear modulus; instead of shear_modulus.", STRESS, needed=False
        ),
        Constant("C20", "yeoh: coefficient of (I1 - 3)^2. Default: 0.", STRESS, left_out=0.0),
        Constant("C30", "yeoh: coefficient of (I1 - 3)^3. Default: 0.", STRESS, left_out=0.0),
    )

    def __post_init__(self) -> None:
        self._check_modulus(self.C10, self.C20, self.C30)
        object.__setattr__(self, "_square", np.asarray(self.C20) / self.C10)
        object.__setattr__(self, "_cube", np.asarray(self.C30) / self.C10)

    def modulus_of(self) -> Floats:
        """2 C10."""
        return 2 * np.asarray(self.C10, dtype=float)

    @classmethod
    def of_file(cls, stated: Mapping[str, Any], modulus: float | None) -> Self:
        """The law from C10, or from the shear modulus in place of C10."""
        arguments = cls.arguments(stated)
        if modulus is not None and arguments["C10"] is not None:
            raise InputError('law "yeoh" takes shear_modulus or C10 = shear_modulus/2, not both', key="C10")
        if arguments["C10"] is None:
            if modulus is None:
                raise InputError('law "yeoh" needs C10, or in [equilibrium] shear_modulus: C20 and C30 are relative to it')
            arguments["C10"] = 0.5 * modulus
        return cls(**arguments)

    def stiffness(self, invariant: Floats) -> Floats:
        """1 + 2 a x + 3 b x^2 with a = C20/C10 and b = C30/C10."""
        x = invariant - 3
        return np.asarray((3 * self._cube * x + 2 * self._square) * x + 1)

    def hardening(self, invariant: Floats) -> tuple[Floats, Floats]:
        """phi, and 2 a + 6 b x."""
        return self.stiffness(invariant), np.asarray(6 * self._cube * (invariant - 3) + 2 * self._square)

    def energy_of(self, invariant: Floats) -> Floats:
        """(x + a x^2 + b x^3)/2."""
        x = invariant - 3
        return np.asarray(0.5 * x * ((self._cube * x + self._square) * x + 1))

    def unlimited(self) -> Self:
        """C20 = C30 = 0."""
        return type(self)(self.C10)

    def forms(self, modulus: float = 1.0) -> tuple[CardForm, ...]:
        """Yeoh; neo-Hookean, an approximation unless C20 = C30 = 0."""
        series = {"C10": modulus / 2, "C20": modulus / 2 * float(self._square), "C30": modulus / 2 * float(self._cube)}
        return (
            CardForm("neo-hookean", modulus, {}, _NEO_HOOKEAN_NOTES, exact=self._square == 0 and self._cube == 0),
            CardForm("yeoh", modulus, series),
        )


_NEO_HOOKEAN_NOTES = (
    "  A neo-Hookean spring leaves out the share 2 (C20/C10) x + 3 (C30/C10) x^2, x = I1 - 3, of Yeoh's stiffness.",
)
