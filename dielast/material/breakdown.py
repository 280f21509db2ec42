"""The breakdown laws."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError
from dielast.base.registry import Registry
from dielast.base.units import FIELD, LENGTH
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.law import FIELD_SCATTER, BreakdownLaw as BreakdownLaw, Constant, check_table
from dielast.numerics.arrays import Floats


@checked
@dataclass(frozen=True, slots=True, repr=False)
class Breakdown(Result, BreakdownLaw):
    """Breakdown `field` (n,) in V/m over ascending equibiaxial `prestretch` (n,), linear between entries, constant outside.
    Without prestretches, one field holds at all of them.

    Raises `InputError` for lists of different length, prestretches that do not ascend, and fields that are not positive.
    """

    prestretch: tuple[float, ...]
    field: tuple[float, ...]
    shape: float | None = None
    relative: float | None = None
    reference_area: float | None = None

    name: ClassVar = "table"
    title: ClassVar = "breakdown table"
    constants: ClassVar = (
        Constant(
            "prestretch",
            "table: equibiaxial prestretches, ascending, one for each field. Default: one field for all prestretches.",
            at_least=1.0,
            many=True,
            left_out=(),
        ),
        Constant(
            "field",
            "table: true field at which the film breaks down, for each prestretch; interpolated between them, constant outside.",
            FIELD,
            above=0.0,
            many=True,
        ),
        *FIELD_SCATTER,
    )

    def __post_init__(self) -> None:
        if not self.prestretch and len(self.field) > 1:
            raise InputError(f"{len(self.field)} fields, but no prestretch: state the prestretch of each, or one field for all")
        if self.prestretch or not self.field:
            check_table(self.title, ("prestretches", self.prestretch), ("fields", self.field))
        if any(value <= 0 for value in self.field):
            raise InputError("a breakdown field must be positive")
        self.check_constants()

    def at(self, prestretch: ArrayLike) -> Floats:
        """The field in V/m at equibiaxial prestretches of any shape; for unequal ones, pass the square root of their product."""
        stated = self.prestretch or (1.0,)  # with one entry, any
        return np.asarray(np.interp(np.asarray(prestretch, dtype=float), stated, self.field))

    def scaled(self, factor: float) -> Self:
        """The table with every field times `factor`."""
        return replace(self, field=tuple(factor * value for value in self.field))

    def outside(self, prestretch: float) -> str:
        """The nearest entry, and the table with a further entry; a field without a prestretch holds at all prestretches."""
        rounded = prestretch * (1 + 1e-9), prestretch * (1 - 1e-9)
        if not self.prestretch or (self.prestretch[0] <= rounded[0] and rounded[1] <= self.prestretch[-1]):
            return ""
        entries = [
            (prestretch, '"..."'),
            *((at, f'"{field / 1e6:.4g} MV/m"') for at, field in zip(self.prestretch, self.field, strict=True)),
        ]
        prestretches, fields = zip(*sorted(entries), strict=True)
        first, last = self.prestretch[0], self.prestretch[-1]
        span = f"{first:g} to {last:g}" if last > first else f"{first:g} alone"
        return (
            f"breakdown fields are stated for {span}: the nearest, {float(self.at(prestretch)) / 1e6:.4g} MV/m, is taken; to state "
            f"one, write [breakdown] prestretch = [{', '.join(f'{at:.4g}' for at in prestretches)}], field = [{', '.join(fields)}]"
        )

    def typical_fields(self) -> Floats:
        """The fields of the table."""
        return np.array(self.field)


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


BREAKDOWNS: Registry[type[BreakdownLaw]] = Registry(
    "breakdown law",
    Breakdown,
    PowerBreakdown,
    group="dielast.breakdown",
    base=BreakdownLaw,
)
