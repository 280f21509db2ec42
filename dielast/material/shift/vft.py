"""The law of Vogel, Fulcher and Tammann."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.base.units import TEMPERATURE, TEMPERATURE_DIFFERENCE
from dielast.material.argument_types import checked
from dielast.material.law import Constant
from dielast.material.shift.law import FittedLaw, MovedLaw, ShiftLaw, refuse_frozen
from dielast.material.shift.wlf import WLF
from dielast.numerics.arrays import Floats

LN10 = float(np.log(10))


@checked
@dataclass(frozen=True, slots=True)
class VogelFulcherTammann(ShiftLaw):
    """ln a = B/(T - T_V) - B/(T_ref - T_V), with the Vogel temperature `T_V` in degC, at which relaxation would take for ever.

    H. Vogel, Phys. Z. 22 (1921) 645; G. S. Fulcher, DOI 10.1111/j.1151-2916.1925.tb16731.x; G. Tammann and W. Hesse,
    DOI 10.1002/zaac.19261560121. It is the WLF law with C2 = T_ref - T_V and C1 C2 = B / ln 10, in constants that do not depend on
    the reference temperature. `B` is in K, `reference_temperature` in degC. Raises `InputError` for a Vogel temperature that is not
    below the reference temperature, and for temperatures at or below it.
    """

    reference_temperature: float
    B: float
    T_V: float

    name: ClassVar = "vft"
    title: ClassVar = "Vogel-Fulcher-Tammann"
    constants: ClassVar = (
        Constant("B", "Constant B of the law of Vogel, Fulcher and Tammann.", TEMPERATURE_DIFFERENCE, above=0.0),
        Constant("T_V", "Vogel temperature, at which relaxation would take for ever.", TEMPERATURE),
    )

    def __post_init__(self) -> None:
        if not np.isfinite(self.B):  # may be negative: a fit to wrongly assigned temperatures
            raise InputError(f"{self.B:g}: a finite number is needed", argument="B")
        if not self.reference_temperature > self.T_V:
            needed = f"a temperature below the reference temperature, {self.reference_temperature:g} degC, is needed"
            raise InputError(f"{self.T_V:g} degC: {needed}", argument="T_V")

    def equivalent(self) -> WLF:
        """The same law in the constants of Williams, Landel and Ferry."""
        distance = self.reference_temperature - self.T_V
        return WLF(self.reference_temperature, self.B / (LN10 * distance), distance)

    def log10_shift_factor(self, temperature: ArrayLike) -> Floats:
        """log10 a(T); raises `InputError` at or below the Vogel temperature."""
        above = np.asarray(temperature, dtype=float) - self.T_V
        refuse_frozen(temperature, above, f"the Vogel temperature, {self.T_V:g} degC")
        return np.asarray(self.B / LN10 * (1 / above - 1 / (self.reference_temperature - self.T_V)))

    def label(self) -> str:
        """Both constants."""
        return f"Vogel-Fulcher-Tammann, $B$ = {self.B + 0.0:.4g} K, $T_V$ = {self.T_V + 0.0:.4g} °C"

    def warning(self) -> str:
        """A warning if the constants are not those of a polymer."""
        text = self.equivalent().warning()
        return text and f"{self.title} with B = {self.B:g} K and T_V = {self.T_V:g} degC: {text}"

    @classmethod
    def fit(cls, base: float, distance: Floats, log10_shift: Floats, whiten: Floats) -> FittedLaw:
        """The fit of the WLF law in the constants of this one, with the derivatives of B = ln 10 C1 C2 and T_V = T_ref - C2."""
        fitted = WLF.fit(base, distance, log10_shift, whiten)

        def about(move: float) -> MovedLaw:
            moved = fitted.about(move)
            law = moved.law
            assert isinstance(law, WLF)
            slopes = np.array([[LN10 * law.C2, LN10 * law.C1], [0.0, -1.0]])
            here = law.reference_temperature
            return replace(moved, law=cls(here, LN10 * law.C1 * law.C2, here - law.C2), to_constants=slopes @ moved.to_constants)

        same = "the Vogel-Fulcher-Tammann law is the WLF law with C2 = T_ref - T_V"
        return replace(fitted, about=about, assumed=fitted.assumed and f"{fitted.assumed} ({same})")
