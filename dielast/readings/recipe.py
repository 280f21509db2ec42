"""`[data]` of `mastercurve`: files of measurements, which column holds what, and what was measured."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from dielast.errors import InputError
from dielast.material.measurement_kind import KindName
from dielast.readings.specimen_recipe import NamedColumns, Specimen, unmeasured
from dielast.recipe.base import TextTable, units_of
from dielast.recipe.fields import (
    ColumnName,
    InputFile,
    InputFiles,
    PositiveTime,
    Share,
    Step,
    Temperature,
    TemperatureDifference,
    TemperatureError,
    Time,
)
from dielast.units import (
    ANGULAR_FREQUENCY,
    COMPLIANCE,
    FORCE,
    FREQUENCY,
    LENGTH,
    NUMBER,
    STRAIN,
    STRESS,
    TEMPERATURE,
    TIME,
    VISCOSITY,
)

ROLES = {
    "temperature": TEMPERATURE,
    "time": TIME,
    "modulus": STRESS,
    "strain": STRAIN,
    "stretch": NUMBER,
    "stress": STRESS,
    "extension": LENGTH,
    "force": FORCE,
    "compliance": COMPLIANCE,
    "frequency": FREQUENCY,
    "angular_frequency": ANGULAR_FREQUENCY,
    "storage": STRESS,
    "loss": STRESS,
    "tan_delta": NUMBER,
    "complex_modulus": STRESS,
    "complex_viscosity": VISCOSITY,
}
OVER_TIME = ("time", "modulus", "strain", "stretch", "stress", "extension", "force", "compliance")
OVER_FREQUENCY = ("frequency", "angular_frequency", "storage", "loss", "tan_delta", "complex_modulus", "complex_viscosity")
MODULI = ({"storage", "loss"}, {"storage", "tan_delta"}, {"complex_modulus", "tan_delta"})
"""The columns from which the two moduli of a sweep can be computed."""
MECHANICAL = ("modulus", "strain", "stress", "compliance", "storage", "loss", "complex_modulus")
"""What differs between tension and shear."""


class Columns(NamedColumns):
    """Columns of a relaxation or creep test over time, or of a frequency sweep."""

    temperature: ColumnName | None = Field(None, description="Temperature, where one file holds several temperatures.")
    set: ColumnName | None = Field(
        None,
        description="A label or number that is the same in all rows at one temperature. Default: temperature_tolerance separates "
        "them.",
    )
    time: ColumnName | None = Field(None, description='Time since the start of the test. Default: "time".')
    modulus: ColumnName | None = Field(None, description="Relaxation modulus.")
    strain: ColumnName | None = Field(None, description="Strain, with stress or force; instead of modulus or compliance.")
    stretch: ColumnName | None = Field(None, description="Stretch, which is 1 + strain; instead of strain.")
    stress: ColumnName | None = Field(None, description="Nominal stress, with strain, stretch or extension.")
    extension: ColumnName | None = Field(None, description="Extension, a length, instead of strain; needs specimen.gauge_length.")
    force: ColumnName | None = Field(None, description="Force, instead of stress; needs specimen.width and thickness.")
    compliance: ColumnName | None = Field(None, description="Creep compliance.")
    frequency: ColumnName | None = Field(None, description="Frequency of a sweep, in Hz.")
    angular_frequency: ColumnName | None = Field(None, description="Angular frequency of a sweep, in rad/s.")
    storage: ColumnName | None = Field(None, description="Storage modulus, with loss or tan_delta.")
    loss: ColumnName | None = Field(None, description="Loss modulus.")
    tan_delta: ColumnName | None = Field(None, description="Loss modulus over storage modulus, with storage or complex_modulus.")
    complex_modulus: ColumnName | None = Field(None, description="Magnitude of the complex modulus, with tan_delta.")
    complex_viscosity: ColumnName | None = Field(
        None, description="Magnitude of the complex viscosity, by which the unit of the frequencies, Hz or rad/s, is checked."
    )

    @property
    def measurement(self) -> KindName:
        """The kind of measurement that the columns show; strain and stress mean relaxation unless the recipe says creep."""
        columns = self.by_role
        if any(role in columns for role in OVER_FREQUENCY):
            return "oscillation"
        return "creep" if "compliance" in columns else "relaxation"

    @model_validator(mode="after")
    def _one_measurement(self) -> Self:
        columns = self.by_role
        over_time = [role for role in OVER_TIME if role in columns]
        over_frequency = [role for role in OVER_FREQUENCY if role in columns]
        if over_time and over_frequency:
            raise InputError(
                f"columns of a test over time ({', '.join(over_time)}) and of a frequency sweep ({', '.join(over_frequency)}): "
                "state those of one kind of measurement"
            )
        if over_frequency:
            _check_sweep(columns)
        else:
            _check_over_time(columns)
        first: dict[str | int, str] = {}
        for role, column in columns.items():
            if first.setdefault(column, role) != role:
                raise InputError(f'{first[column]} and {role} are the same column, "{column}"')
        return self


def _check_over_time(columns: Collection[str]) -> None:
    strains, stresses = (
        [role for role in pair if role in columns] for pair in (("strain", "stretch", "extension"), ("stress", "force"))
    )
    for pair in (strains, stresses):
        if len(pair) > 1:
            raise InputError(f"{' and '.join(pair)} say the same: one of them is needed")
    if len(strains) != len(stresses):
        raise InputError("strain (or stretch, or extension) and stress (or force) go together")
    stiffness = [role for role in ("modulus", *stresses, "compliance") if role in columns]
    if not stiffness:
        raise InputError(
            "either modulus, or strain and stress, is needed (or extension and force); for creep compliance; "
            "for a sweep storage and loss over frequency or angular_frequency"
        )
    if len(stiffness) > 1:
        raise InputError(f"either modulus, or strain and stress, is needed, or compliance, not {' and '.join(stiffness)}")


def _check_sweep(columns: Collection[str]) -> None:
    measured = [role for role in ("storage", "loss", "tan_delta", "complex_modulus") if role in columns]
    if measured == ["tan_delta"]:
        raise InputError("tan_delta alone gives no modulus: storage or complex_modulus is needed with it")
    if set(measured) not in MODULI:
        ways = "storage and loss, or storage and tan_delta, or complex_modulus and tan_delta"
        raise InputError(f"{ways}, are needed" + (f", not {' and '.join(measured)}" if measured else ""))
    if "frequency" not in columns and "angular_frequency" not in columns:
        raise InputError("frequency (in Hz) or angular_frequency (in rad/s) is needed")


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
    ramp: PositiveTime | None = Field(
        None,
        description="Duration of the ramp at the beginning of each test. Times are then counted from the middle of the ramp, and "
        "points before twice its duration are dropped, unless discard_before is stated.",
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
        """The files, in their order."""
        raise NotImplementedError

    @property
    def roles(self) -> Collection[str]:
        """The roles of the columns that are stated."""
        return () if self.columns is None else self.columns.by_role

    @property
    def first_time(self) -> float:
        """Measured points before this time in s are dropped; 0 drops none."""
        return max(self.discard_before, self.ramp or 0.0) if self.discard_before > 0 else 2 * (self.ramp or 0.0)

    @property
    def time_offset(self) -> float:
        """The time in s that is subtracted from the measured times.

        A ramp acts like a step at its middle, to second order in ramp/time: L. J. Zapas and J. C. Phillips, J. Res. Natl. Bur.
        Stand. A 75 (1971) 33. With times from its start, shift factors would come out wrong by tenths of a decade.
        """
        return 0.5 * (self.ramp or 0.0)

    @property
    def is_plain(self) -> bool:
        """Whether the recipe itself states the layout of the text, so that the file is not read as an instrument's export."""
        return self.format == "table" or self.separator is not None or self.skip_rows > 0

    @model_validator(mode="after")
    def _one_measurement(self) -> Self:
        by_columns = self.columns.measurement if self.columns is not None else None
        stressed = not {"stress", "force"}.isdisjoint(self.roles)
        if self.measurement is not None and by_columns not in (None, self.measurement) and not stressed:
            raise InputError(f'measurement = "{self.measurement}", but the columns are those of "{by_columns}"')
        if self.measurement == "oscillation" and stressed:
            raise InputError('measurement = "oscillation", but strain and stress are columns of a test over time')
        kind = self.measurement or by_columns
        if kind == "oscillation" and (self.ramp is not None or self.discard_before > 0):
            raise InputError("ramp and discard_before belong to a test over time: leave them out for a frequency sweep")
        return self

    @model_validator(mode="after")
    def _a_specimen_of_tension(self) -> Self:
        machine = [role for role in ("stretch", "extension", "force") if role in self.roles]
        if machine and self.test == "shear":
            raise InputError(
                f"{' and '.join(machine)} belong to a test in tension: for a test in shear state strain and stress, or modulus"
            )
        if lacking := unmeasured(machine, self.specimen):
            raise InputError(lacking)
        return self


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
        0.1,
        validate_default=False,
        description="Standard error of each temperature, independent of the others; it enters the standard errors and the draws. "
        '"0 K": none.',
    )
    drift: Share | None = Field(
        None,
        description="Standard deviation of the change of the specimen's modulus from one temperature to the next, such as "
        '"2 %": a random walk in the order of the temperatures in the data, which enters the standard errors and the draws. '
        "Default: only the offsets between whole curves that the data show.",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The files, in their order."""
        return (self.file,) if self.file is not None else self.files or ()

    @property
    def is_plain(self) -> bool:
        """Whether the recipe itself states the layout of the text, so that the file is not read as an instrument's export."""
        return super().is_plain or self.layout is not None

    @property
    def sources(self) -> str:
        """The keys that may state the temperatures."""
        return "columns.temperature" if self.file else "one of columns.temperature, temperatures, temperature_in_name"

    @property
    def states_temperatures(self) -> bool:
        """Whether the recipe states where the temperatures stand."""
        in_column = self.columns is not None and self.columns.temperature is not None
        return in_column or self.temperatures is not None or self.temperature_in_name is not None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.file is None) == (self.files is None):
            raise InputError("either file or files is needed")
        stated = [name for name in ("temperatures", "temperature_in_name") if getattr(self, name) is not None]
        if self.columns is not None and self.columns.temperature is not None:
            stated.insert(0, "columns.temperature")
        headed = self.columns is None or self.file is not None or self.layout == "wide"  # perhaps, which reading tells
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
        return self
