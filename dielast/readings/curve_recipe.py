"""`[data]` of `spectrum`: one test or one master curve, and the roles of its columns."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dielast.readings.columns_recipe import Columns
from dielast.readings.recipe import MeasuredData
from dielast.recipe.fields import Temperature
from dielast.recipe.file_fields import InputFile


class CurveColumns(Columns):
    """Columns of a test or a master curve at one temperature, over time or frequency, or over their reduced values."""

    @property
    def by_role(self) -> dict[str, str | int]:
        """The columns that are stated, by role; without a measured quantity among them, the modulus is the column "modulus"."""
        columns = super().by_role
        return columns if columns.keys() - {"temperature", "set", "time"} else {**columns, "modulus": "modulus"}


class CurveData(MeasuredData):
    """One test at one temperature, or a master curve from elsewhere: relaxation, creep or oscillation."""

    ELSEWHERE: ClassVar = {
        "files": "files of several temperatures are for mastercurve; a spectrum has one file",
        "temperatures": "several temperatures are for mastercurve; a spectrum has one: reference_temperature",
        "temperature": "the temperature of the test is reference_temperature",
        "temperature_in_name": "the temperature of the test is reference_temperature",
        "layout": "one column for each temperature is for mastercurve; a spectrum has one temperature",
        "temperature_stderr": "errors of shift factors are for mastercurve; a spectrum has one temperature",
        "drift": "a drift from one temperature to the next is for mastercurve; a spectrum has one temperature",
    }

    file: InputFile = Field(description="The test or the curve, a table of numbers or an instrument's export.")
    columns: CurveColumns | None = Field(
        None, description='Which column holds what; an instrument\'s export needs none. Default: "time" and "modulus".'
    )
    reference_temperature: Temperature | None = Field(
        None, description="Temperature of the test or curve, which has no shift law. Default: the temperature that the data state."
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The name of the file."""
        return (self.file,)
