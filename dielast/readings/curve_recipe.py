"""`[data]` of `spectrum`: one test or one master curve, and the roles of its columns."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from dielast.readings.recipe import Columns, MeasuredData
from dielast.recipe.fields import InputFile, Temperature


class CurveColumns(Columns):
    """Columns of a test or a master curve at one temperature, over time or frequency, reduced or not."""

    @property
    def by_role(self) -> dict[str, str | int]:
        """The stated columns by their role; in a test without other measured columns, the default of the modulus is "modulus"."""
        columns = super().by_role
        return columns if columns.keys() - {"temperature", "set", "time"} else {**columns, "modulus": "modulus"}


class CurveData(MeasuredData):
    """One test at one temperature, or a master curve from elsewhere: relaxation, creep or oscillation."""

    ELSEWHERE: ClassVar = {
        "files": "files of several temperatures are for mastercurve; a spectrum has one file",
        "temperatures": "several temperatures are for mastercurve; a spectrum has one: reference_temperature",
        "temperature": "the temperature of the test is reference_temperature",
        "temperature_in_name": "the temperature of the test is reference_temperature",
        "layout": "columns for each temperature are for mastercurve; a spectrum has one temperature",
        "temperature_stderr": "errors of shift factors are for mastercurve; a spectrum has one temperature",
        "drift": "a drift from one temperature to the next is for mastercurve; a spectrum has one temperature",
    }

    file: InputFile = Field(description="The test or the curve, a table of numbers or an instrument's export.")
    columns: CurveColumns | None = Field(
        None, description='Which column is what; an instrument\'s export says it itself, other columns are "time" and "modulus".'
    )
    reference_temperature: Temperature | None = Field(
        None, description="Where the test or curve holds, which has no shift law; left out: the temperature that the data state."
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The name of the file."""
        return (self.file,)
