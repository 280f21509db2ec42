"""A power law in the present stretch and thickness of a film."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.material.argument_types import checked
from dielast.material.law import FIELD_SCATTER, BreakdownLaw, Constant
from dielast.numerics.arrays import Floats
from dielast.units import FIELD, LENGTH


@checked
@dataclass(frozen=True, slots=True)
class PowerBreakdown(BreakdownLaw):
    """E_B = E_ref l^a (h/h_ref)^-b, with the present l = sqrt(l1 l2) and thickness h.

    E_ref = `field` in V/m, a = `stretch_exponent`, b = `thickness_exponent`, h_ref = `reference_thickness` in m. Koh et al.,
    J. Polym. Sci. B 49 (2011) 504 (VHB 4910: a = 1.13, b = 0); Huang, Shian, Diebold, Suo and Clarke, Appl. Phys. Lett. 101 (2012)
    122905 (VHB 4905 and 4910: 51 MV/m h^-0.25 l^0.63, h in mm). Raises `InputError` for constants outside their bounds, and for a
    thickness exponent without a reference thickness.
    """

    field: float | Floats
    stretch_exponent: float | Floats = 0.0
    thickness_exponent: float | Floats = 0.0
    reference_thickness: float | Floats | None = None
    shape: float | Floats | None = None
    relative: float | Floats | None = None
    reference_area: float | Floats | None = None

    name: ClassVar = "power"
    title: ClassVar = "power law of breakdown"
    follows_film: ClassVar = True
    constants: ClassVar = (
        Constant("field", "power: breakdown field at stretch 1 and the reference thickness.", FIELD, above=0.0),
        Constant("stretch_exponent", "power: exponent of sqrt(l1 l2), the present stretch. Default: 0.", left_out=0.0),
        Constant(
            "thickness_exponent",
            "power: exponent of the reference thickness over the present thickness. Default: 0.",
            at_least=0.0,
            left_out=0.0,
        ),
        Constant(
            "reference_thickness",
            "power: thickness at which the field was measured; needed with thickness_exponent.",
            LENGTH,
            above=0.0,
            needed=False,
        ),
        *FIELD_SCATTER,
    )

    def __post_init__(self) -> None:
        if self.reference_thickness is None and np.any(self.thickness_exponent):
            raise InputError("thickness_exponent needs reference_thickness, the present thickness of films with the stated field")
        self.check_constants()
        self.check_scatter()

    def at(self, prestretch: ArrayLike) -> Floats:
        """The field of films with the reference thickness at this stretch."""
        return self.of_film(prestretch, 1.0 if self.reference_thickness is None else self.reference_thickness)

    def of_film(self, stretch: ArrayLike, thickness: ArrayLike) -> Floats:
        """E_ref l^a (h/h_ref)^-b."""
        powers = self.stretch_exponent * np.log(np.asarray(stretch, dtype=float))
        if self.reference_thickness is not None:  # films without a reference thickness have the exponent 0
            thinner = np.log(self.reference_thickness / np.asarray(thickness, dtype=float))
            powers = powers + np.where(np.asarray(self.thickness_exponent) == 0, 0.0, self.thickness_exponent * thinner)
        return np.asarray(self.field * np.exp(powers))

    def scaled(self, factor: float) -> Self:
        """The law with its field times `factor`."""
        return replace(self, field=factor * self.field)
