"""`[data]` of `mastercurve` and `spectrum`: files of measurements, which column holds what, and what was measured."""

from collections.abc import Collection
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, field_validator

from dielast.base.errors import InputError
from dielast.material.measurement_kind import KindName
from dielast.material.ramp import DROPPED
from dielast.readings.columns_recipe import ROLES, Columns, Specimen, unmeasured
from dielast.recipe.base import TextTable, units_of
from dielast.recipe.fields import RelativeDeviation, Temperature, TemperatureDifference, TemperatureError, Time
from dielast.recipe.file_fields import InputFile, InputFiles, Step


class MeasuredData(TextTable):
    """What was measured in a test: which column holds what, in which units, on which specimen."""

    file: InputFile | None = Field(None, description="A table of numbers or an instrument's export.")
    measurement: KindName | None = Field(None, description="What was measured. Default: as the columns show.")
    columns: Columns | None = Field(None, description="Which column holds what; an instrument's export needs none.")
    steps: list[Step] | None = Field(
        None,
        description="Steps of an instrument's export to read, by name (with * and ?) or number. Default: all of this measurement.",
    )
    format: Literal["table"] | None = Field(
        None, description="Read the file as a plain table, even if it looks like an instrument's export."
    )
    units: Annotated[dict[str, str], units_of(**ROLES)] = Field({}, description="Units by column, where the header states none.")
    specimen: Specimen | None = Field(None, description="The specimen on which extension and force were measured.")
    test: Literal["tension", "shear"] | None = Field(
        None,
        description="A modulus in shear is converted to Young's modulus, three times as large. Default: tension, or what an "
        "instrument's export states.",
    )
    discard_before: Time = Field(
        0.0, validate_default=False, description="Drop points before this time, such as those of the ramp."
    )
    ramp: Time | None = Field(
        None,
        description="Duration of the ramp at the beginning of each test. Times are then mean log ages of the load, which count "
        "from about the middle of the ramp, and points before twice its duration are dropped, unless discard_before is stated. "
        "0 s: there is none. Default: what mastercurve finds in the curves of several tests; in a single test none is looked for.",
    )
    temperature_tolerance: TemperatureDifference = Field(
        0.5, validate_default=False, description="Temperature readings closer together than this count as one temperature."
    )

    @field_validator("sheet", mode="before")
    @classmethod
    def _one_sheet(cls, sheet: Any) -> Any:
        if isinstance(sheet, list):
            raise InputError(
                "one sheet is read, by its name or number: save sheets of one temperature each as files, and state them in files, "
                "with temperatures"
            )
        return sheet

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the files, in their order."""
        return (self.file,) if self.file is not None else ()

    @property
    def roles(self) -> Collection[str]:
        """The roles of the stated columns."""
        return () if self.columns is None else self.columns.by_role

    @property
    def first_time(self) -> float:
        """Measured points before this time in s are dropped; 0 drops none."""
        return max(self.discard_before, self.ramp or 0.0) if self.discard_before > 0 else DROPPED * (self.ramp or 0.0)

    @property
    def is_plain(self) -> bool:
        """Whether the recipe itself states the layout of the text, so that the file is not read as an instrument's export."""
        return self.format == "table" or self.separator is not None or self.skip_rows > 0

    def _check(self) -> None:
        super()._check()
        by_columns = self.columns.measurement if self.columns is not None else None
        stressed = not {"stress", "force"}.isdisjoint(self.roles)
        if self.measurement is not None and by_columns not in (None, self.measurement) and not stressed:
            raise InputError(f'measurement = "{self.measurement}", but the columns are those of "{by_columns}"')
        if self.measurement == "oscillation" and stressed:
            raise InputError('measurement = "oscillation", but strain and stress are columns of a test over time')
        kind = self.measurement or by_columns
        if kind == "oscillation" and (self.ramp is not None or self.discard_before > 0):
            raise InputError("ramp and discard_before belong to a test over time: leave them out for a frequency sweep")
        machine = [role for role in ("stretch", "extension", "force") if role in self.roles]
        if machine and self.test == "shear":
            raise InputError(
                f"{' and '.join(machine)} belong to a test in tension: for a test in shear state strain and stress, or modulus"
            )
        if lacking := unmeasured(machine, self.specimen):
            raise InputError(lacking)


class MeasurementData(MeasuredData):
    """Measurements at several temperatures: one file with a temperature column, one file for each, or an instrument's export."""

    file: InputFile | None = Field(
        None, description="One file: with a temperature column, with columns for each temperature, or an instrument's export."
    )
    files: InputFiles | None = Field(None, description="A list of files, or a glob pattern relative to the recipe.")
    temperatures: list[Temperature] | None = Field(None, description="Temperature of each of the files, in their order.")
    temperature_in_name: str | None = Field(
        None, description="Pattern of file names that state the temperature: text with {degC} or {K} in place of the number."
    )
    layout: Literal["long", "wide"] | None = Field(
        None,
        description="wide: a column (or several) for each temperature, which the headers or a row above them state; long: the same "
        "columns for all temperatures. Default: wide where the headers state several temperatures and no other key states any.",
    )

    temperature_stderr: TemperatureError = Field(
        0.3,
        validate_default=False,
        description="Standard error of each temperature, independent of the others; it enters the standard errors and the draws. "
        "Default: what the steps of published shift factors of measured melts bear out: 90 % intervals hold 83 % of these, and "
        'with 0.1 K 71 %. "0 K": none.',
    )
    drift: RelativeDeviation | None = Field(
        None,
        description="Standard deviation of the change of the specimen's modulus from one temperature to the next, such as "
        '"2 %": a random walk in the order of the temperatures in the data, which enters the standard errors and the draws. '
        "Default: only the offsets between whole curves that the data show.",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the files, in their order."""
        return self.files or super().names

    @property
    def is_plain(self) -> bool:
        """Whether the recipe itself states the layout of the text, so that the file is not read as an instrument's export."""
        return super().is_plain or self.layout is not None

    @property
    def sources(self) -> str:
        """The keys that may state the temperatures."""
        return "columns.temperature" if self.file else "one of columns.temperature, temperatures, temperature_in_name"

    @property
    def temperature_keys(self) -> list[str]:
        """The keys that state the temperatures, or where they stand."""
        in_column = ["columns.temperature"] if "temperature" in self.roles else []
        return in_column + [key for key in ("temperatures", "temperature_in_name") if getattr(self, key) is not None]

    def _check(self) -> None:
        super()._check()
        if (self.file is None) == (self.files is None):
            raise InputError("either file or files is needed" + (", not both" if self.file is not None else ""))
        stated = self.temperature_keys
        headed = self.columns is None or self.file is not None or self.layout == "wide"  # perhaps: the file shows it
        if len(stated) + headed == 0 or len(stated) > 1 or (self.file and stated not in ([], ["columns.temperature"])):
            raise InputError(
                f"temperatures are needed from {self.sources}" + (f", not from {' and '.join(stated)}" if stated else "")
            )
        if self.layout == "wide" and stated:
            raise InputError(f'layout = "wide": the headers state the temperatures, so leave out {stated[0]}')
        if self.columns is None and self.is_plain and self.layout != "wide":
            raise InputError("columns are needed for a plain table")
        if self.files is not None and self.temperatures is not None and len(self.files) != len(self.temperatures):
            raise InputError(f"{len(self.files)} files but {len(self.temperatures)} temperatures")
        if self.temperature_in_name is not None and not any(mark in self.temperature_in_name for mark in ("{degC}", "{K}")):
            raise InputError('temperature_in_name needs {degC} or {K} where the number stands, such as "dma_{degC}C.csv"')


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
