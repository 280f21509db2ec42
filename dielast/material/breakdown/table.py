"""A table of breakdown fields over prestretch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.io.result import Result
from dielast.material.breakdown.law import BreakdownLaw
from dielast.material.law import Constant
from dielast.numerics.arrays import Flags, Floats
from dielast.units import FIELD


@dataclass(frozen=True, slots=True, repr=False)
class Breakdown(Result, BreakdownLaw):
    """Breakdown field in V/m over equibiaxial prestretch, linear between entries; beyond the table, the nearest entry holds."""

    prestretch: tuple[float, ...]
    field: tuple[float, ...]

    name: ClassVar = "table"
    title: ClassVar = "breakdown table"
    constants: ClassVar = (
        Constant(
            "prestretch",
            "Ascending equibiaxial prestretches, one for each field; left out: one field for all.",
            at_least=1.0,
            many=True,
            left_out=(1.0,),
        ),
        Constant(
            "field",
            "True field that the film breaks down at, for each prestretch; interpolated in between, the nearest beyond.",
            FIELD,
            above=0.0,
            many=True,
        ),
    )

    def __post_init__(self) -> None:
        if len(self.prestretch) != len(self.field) or not self.field:
            raise InputError(
                f"{len(self.prestretch)} prestretches but {len(self.field)} breakdown fields: one field for each is needed"
            )
        if any(b <= a for a, b in zip(self.prestretch, self.prestretch[1:], strict=False)):
            raise InputError("breakdown prestretch must ascend")
        if any(value <= 0 for value in self.field):
            raise InputError("a breakdown field must be positive")

    def at(self, prestretch: ArrayLike) -> Floats:
        """The field in V/m at equibiaxial prestretches of any shape; for unequal ones, pass the square root of their product."""
        return np.asarray(np.interp(np.asarray(prestretch, dtype=float), self.prestretch, self.field))

    def scaled(self, factor: float) -> Breakdown:
        """The table with every field times `factor`."""
        return Breakdown(self.prestretch, tuple(factor * value for value in self.field))

    def is_known_at(self, prestretch: ArrayLike) -> Flags:
        """Whether equibiaxial prestretches (any shape) lie within the table; a single entry holds at all prestretches."""
        values, ends = np.asarray(prestretch, dtype=float), (self.prestretch[0], self.prestretch[-1])
        # rounding is tolerated
        return (len(self.prestretch) == 1) | ((values >= ends[0] * (1 - 1e-9)) & (values <= ends[1] * (1 + 1e-9)))

    def outside(self, prestretch: float) -> str:
        """The nearest entry, and the table with a further entry, for a warning."""
        entries = [
            (prestretch, '"..."'),
            *((at, f'"{field / 1e6:.4g} MV/m"') for at, field in zip(self.prestretch, self.field, strict=True)),
        ]
        prestretches, fields = zip(*sorted(entries), strict=True)
        return (
            f"breakdown fields are stated for {self.prestretch[0]:g} to {self.prestretch[-1]:g}: the nearest, "
            f"{float(self.at(prestretch)) / 1e6:.4g} MV/m, is taken; to state one, write [breakdown] "
            f"prestretch = [{', '.join(f'{at:.4g}' for at in prestretches)}], field = [{', '.join(fields)}]"
        )

    def typical_fields(self) -> Floats:
        """The fields of the table."""
        return np.array(self.field)
