"""A table of breakdown fields over prestretch."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.material.law import FIELD_SCATTER, BreakdownLaw, Constant, check_table
from dielast.numerics.arrays import Floats
from dielast.units import FIELD


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
        for name in ("shape", "relative", "reference_area"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise InputError(f"{value:g}: a positive number is needed", argument=name)
        self.check_scatter()

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
