"""Base classes and tables that recipes of several kinds share."""

from __future__ import annotations

import codecs
from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal, Protocol

from pydantic import AfterValidator, BaseModel, Field, field_validator

from dielast.base.errors import InputError, Mistakes, Problem, shown
from dielast.base.units import Dimension, conversion
from dielast.recipe.fields import Section
from dielast.recipe.file_fields import SheetName

if TYPE_CHECKING:
    from dielast.io.cells import TextFormat


class RecipeBase(Section):
    """Base of all recipes."""

    title: str | None = Field(None, description="Title of the plot, such as the origin of the data.")

    @classmethod
    def material_model(cls) -> type[BaseModel] | None:
        """The model of the material file whose keys a sweep and --set may state as well; None for recipes without a material."""
        return None


class Kind(Protocol):
    """A kind of recipe as this package needs it; the commands pass in the kinds that exist."""

    @property
    def model(self) -> type[RecipeBase]:
        """The model of its recipes."""

    @property
    def files(self) -> tuple[str, ...]:
        """The names of all files that its runs may write, besides figures and summaries."""


Kinds = Mapping[str, Kind]
"""Every kind of recipe by its name."""


class TextTable(Section):
    """How a table of numbers is written; keys that are left out are recognised from the file."""

    separator: str | None = Field(None, description="The character between columns. Default: recognised from the file.")
    decimal: Literal[".", ","] | None = Field(None, description="Decimal mark. Default: recognised from the file.")
    encoding: str | None = Field(None, description="Text encoding, such as utf-8 or latin-1. Default: recognised from the file.")
    skip_rows: int = Field(0, ge=0, description="Number of lines to skip at the top of the file.")
    sheet: SheetName | None = Field(None, description="Sheet of a workbook (Excel, OpenDocument). Default: the first sheet.")

    @field_validator("separator")
    @classmethod
    def _can_separate(cls, separator: str | None) -> str | None:
        if separator is not None and (len(separator) != 1 or separator.isalnum() or separator in "\"'\r\n+-."):
            raise InputError(f'{shown(separator)}: one character is needed, such as ";" or "\\t"')
        return separator

    @field_validator("encoding")
    @classmethod
    def _known_encoding(cls, encoding: str | None) -> str | None:
        try:
            codecs.lookup(encoding or "utf-8")
        except (LookupError, ValueError):
            raise InputError(f'"{encoding}": unknown encoding, such as "utf-8" or "latin-1" is needed') from None
        return encoding

    def _check(self) -> None:
        if self.separator is not None and self.separator == self.decimal:
            raise InputError(f'"{self.separator}" cannot be both separator and decimal')

    def text_format(self) -> TextFormat:
        """The text format as the reader of tables takes it."""
        from dielast.io.cells import TextFormat

        return TextFormat(self.separator, self.decimal, self.encoding, self.skip_rows, self.sheet)


def units_of(**roles: Dimension | None) -> AfterValidator:
    """Units by the role of a column, for headers without units; None leaves the dimension open."""

    def check(units: dict[str, str]) -> dict[str, str]:
        wrong = Mistakes()
        for role, unit in units.items():
            if role not in roles:
                wrong.append(Problem(f'unit of an unknown column "{role}"; columns are {", ".join(roles)}'))
            elif (dimension := roles[role]) is not None:
                try:
                    conversion(unit, dimension)
                except InputError as error:
                    wrong.append(Problem(f'{role} = "{unit}": {error}'))
        wrong.refuse()
        return units

    return AfterValidator(check)
