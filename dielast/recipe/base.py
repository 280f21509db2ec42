"""What recipes of several kinds share."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from dielast.errors import InputError
from dielast.measured import TextFormat
from dielast.recipe.fields import BreakdownFields, Permittivity, Section


class RecipeBase(Section):
    """What every recipe has."""

    title: str | None = Field(None, description="A line for the head of the plot, such as where the data come from.")


class TextTable(Section):
    """How a table of numbers is written; what is left out is sniffed."""

    separator: str | None = Field(None, min_length=1, max_length=1)
    decimal: Literal[".", ","] | None = None
    encoding: str | None = None
    skip_rows: int = Field(0, ge=0)

    def text_format(self) -> TextFormat:
        """The same for the reader."""
        return TextFormat(self.separator, self.decimal, self.encoding, self.skip_rows)


def units_of(*roles: str) -> AfterValidator:
    """Units by the role of a column, for the headers that do not say them."""

    def check(units: dict[str, str]) -> dict[str, str]:
        unknown = [role for role in units if role not in roles]
        if unknown:
            raise InputError(f'unit of an unknown column "{unknown[0]}"; columns are {", ".join(roles)}')
        return units

    return AfterValidator(check)


class BreakdownField(Section):
    """Breakdown field, one for every prestretch or interpolated over prestretch."""

    prestretch: list[Annotated[float, Field(ge=1)]] | None = None
    field: BreakdownFields

    @model_validator(mode="after")
    def _paired(self) -> Self:
        if len(self.field) != len(self.prestretch or [1.0]):
            raise InputError(f"{len(self.prestretch or [])} prestretches but {len(self.field)} fields")
        if self.prestretch and any(b <= a for a, b in pairwise(self.prestretch)):
            raise InputError("prestretch must ascend")
        return self


class Dielectric(Section):
    """Permittivity, absolute or relative to that of vacuum."""

    permittivity: Permittivity | None = None
    relative_permittivity: float | None = Field(None, ge=1)

    @model_validator(mode="after")
    def _one(self) -> Self:
        if self.permittivity is not None and self.relative_permittivity is not None:
            raise InputError("give permittivity or relative_permittivity, not both")
        return self
