"""`[[compare]]`: measured points beside a simulation."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, PlainValidator, WithJsonSchema, model_validator

from dielast.commands.simulation.result_columns import ResultColumn, roles_of
from dielast.errors import InputError, shown
from dielast.readings.specimen_recipe import MachineColumns, Specimen
from dielast.recipe.base import TextTable, units_of
from dielast.recipe.file_fields import InputFile


def _cell(value: Any) -> str | int | float:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InputError(f"{shown(value)}: text or a number is needed")
    return value


Cell = Annotated[str | int | float, PlainValidator(_cell), WithJsonSchema({"type": ["string", "number"]})]


class Comparison(TextTable):
    """Measured points that are drawn over the plot; their misfit goes into the summary."""

    file: InputFile = Field(description="Table of the measured points.")
    x: ResultColumn = Field(description="Column of the result on the horizontal axis, such as time [s].")
    y: ResultColumn = Field(description="Column of the result on the vertical axis, such as nominal_stress_1 [Pa].")
    x_column: str | None = Field(None, description="Column of the file for x, if its name differs.")
    y_column: str | None = Field(None, description="Column of the file for y, if its name differs.")
    columns: MachineColumns = Field(
        MachineColumns(),
        description="Columns of the file for time, extension, force and the like, from which x and y are computed.",
    )
    specimen: Specimen | None = Field(
        None, description="The specimen on which extension and force were measured. Default: the recipe's [specimen]."
    )
    units: Annotated[dict[str, str], units_of(x=None, y=None)] = Field(
        {}, description="Units of x and y, where the header states none."
    )
    where: dict[str, Cell] = Field({}, description="Use only the rows where these columns have these values.")
    case: int = Field(0, ge=0, description="Number of the case that was measured.")
    label: str | None = Field(None, description="Name in the legend. Default: the name of the file.")

    @model_validator(mode="after")
    def _one_column_each(self) -> Self:
        for axis, header, column in (("x", self.x, self.x_column), ("y", self.y, self.y_column)):
            if column is not None and (named := roles_of(header) & self.columns.by_role.keys()):
                raise InputError(f"{axis}_column and columns.{min(named)} state the same column: one of them is needed")
        return self
