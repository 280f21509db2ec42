"""`[data]` of `mastercurve`: files of measurements, the roles of their columns, and the kind of measurement."""

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
"""The pairs of roles from which both moduli of a sweep follow."""
MECHANICAL = ("modulus", "strain", "stress", "compliance", "storage", "loss", "complex_modulus")
"""The roles that differ between tension and shear."""


class Columns(NamedColumns):
    """Columns of a relaxation or creep test over time, or of a frequency sweep."""

    temperature: ColumnName | None = Field(None, description="Temperature, where a file holds several.")
    set: ColumnName | None = Field(
        None, description="What is the same in all rows of one isothermal set; without it, temperature_tolerance parts the sets."
    )
    time: ColumnName | None = Field(None, description='Time since the start of the test; left out: "time".')
    modulus: ColumnName | None = Field(None, description="Relaxation modulus.")
    strain: ColumnName | None = Field(None, description="With stress or force, instead of modulus or compliance.")
    stretch: ColumnName | None = Field(None, description="1 + strain, instead of strain.")
    stress: ColumnName | None = Field(None, description="Nominal, with strain, stretch or extension.")
    extension: ColumnName | None = Field(None, description="A length, instead of strain; needs specimen.gauge_length.")
    force: ColumnName | None = Field(None, description="Instead of stress; needs specimen.width and thickness.")
    compliance: ColumnName | None = Field(None, description="Creep compliance.")
    frequency: ColumnName | None = Field(None, description="Frequency of a sweep, in Hz.")
    angular_frequency: ColumnName | None = Field(None, description="Angular frequency of a sweep, in rad/s.")
    storage: ColumnName | None = Field(None, description="Storage modulus, with loss or tan_delta.")
    loss: ColumnName | None = Field(None, description="Loss modulus.")
    tan_delta: ColumnName | None = Field(None, description="Loss over storage modulus, with storage or complex_modulus.")
    complex_modulus: ColumnName | None = Field(None, description="Magnitude of the complex modulus, with tan_delta.")
    complex_viscosity: ColumnName | None = Field(
        None, description="Magnitude of the complex viscosity; it shows whether frequencies are in Hz or rad/s as stated."
    )

    @property
    def measurement(self) -> KindName:
        """The kind of measurement by the columns; strain and stress are relaxation unless the recipe states creep."""
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
                f"{' and '.join(over_time)} are of a test over time, {' and '.join(over_frequency)} of a frequency sweep: "
                "one kind of measurement makes a master curve"
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
        raise InputError("tan_delta says nothing of a modulus: storage or complex_modulus is needed with it")
    if set(measured) not in MODULI:
        ways = "storage and loss, or storage and tan_delta, or complex_modulus and tan_delta"
        raise InputError(f"{ways}, are needed" + (f", not {' and '.join(measured)}" if measured else ""))
    if "frequency" not in columns and "angular_frequency" not in columns:
        raise InputError("frequency (in Hz) or angular_frequency (in rad/s) is needed")


class MeasuredData(TextTable):
    """What was measured in a test: which column is what, in which units, of which specimen."""

    file: InputFile | None = Field(None, description="A table of numbers or an instrument's export.")
    measurement: KindName | None = Field(None, description="What was measured; told from the columns if left out.")
    columns: Columns | None = Field(None, description="Which column is what; an instrument's export says it itself.")
    steps: list[Step] | None = Field(
        None, description="Steps of an instrument's export to take, by name (with * and ?) or number; left out: all that fit."
    )
    format: Literal["table"] | None = Field(None, description="Take the file for a plain table, whatever it looks like.")
    units: Annotated[dict[str, str], units_of(**ROLES)] = Field(
        {}, description="Units by column, where the header does not say them."
    )
    specimen: Specimen | None = Field(None, description="What extension and force are measured on.")
    test: Literal["tension", "shear"] | None = Field(
        None,
        description="A shear modulus is written as Young's, three times as much. Left out: tension, or what an export says.",
    )
    discard_before: Time = Field(0.0, validate_default=False, description="Drop earlier points, such as the ramp.")
    ramp: PositiveTime | None = Field(
        None,
        description="Duration of the ramp that the times begin with. They are then counted from its middle, and points before "
        "twice the ramp are dropped unless discard_before says otherwise.",
    )
    temperature_tolerance: TemperatureDifference = Field(
        0.5, validate_default=False, description="Readings closer together than this belong to one temperature."
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
        raise NotImplementedError

    @property
    def roles(self) -> Collection[str]:
        """The roles of the stated columns."""
        return () if self.columns is None else self.columns.by_role

    @property
    def first_time(self) -> float:
        """The measured time in s before which points are dropped; 0 drops none."""
        return max(self.discard_before, self.ramp or 0.0) if self.discard_before > 0 else 2 * (self.ramp or 0.0)

    @property
    def time_offset(self) -> float:
        """The time in s that is subtracted from measured times.

        A ramp acts like a step at its middle, to second order in ramp/time: L. J. Zapas and J. C. Phillips, J. Res. Natl. Bur.
        Stand. A 75 (1971) 33. With times from the start of the ramp, shift factors would be wrong by tenths of a decade.
        """
        return 0.5 * (self.ramp or 0.0)

    @property
    def is_plain(self) -> bool:
        """Whether the recipe states the layout of the text, so that it is not an instrument's export."""
        return self.format == "table" or self.separator is not None or self.skip_rows > 0

    @model_validator(mode="after")
    def _one_measurement(self) -> Self:
        by_columns = self.columns.measurement if self.columns is not None else None
        stressed = not {"stress", "force"}.isdisjoint(self.roles)
        if self.measurement is not None and by_columns not in (None, self.measurement) and not stressed:
            raise InputError(f'measurement = "{self.measurement}", but columns are those of "{by_columns}"')
        if self.measurement == "oscillation" and stressed:
            raise InputError('measurement = "oscillation", but strain and stress are columns of a test over time')
        kind = self.measurement or by_columns
        if kind == "oscillation" and (self.ramp is not None or self.discard_before > 0):
            raise InputError("ramp and discard_before are times of a test over time: a frequency sweep has none")
        return self

    @model_validator(mode="after")
    def _a_specimen_of_tension(self) -> Self:
        machine = [role for role in ("stretch", "extension", "force") if role in self.roles]
        if machine and self.test == "shear":
            raise InputError(
                f"{' and '.join(machine)} are of a test in tension: of one in shear, state strain and stress, or modulus"
            )
        if lacking := unmeasured(machine, self.specimen):
            raise InputError(lacking)
        return self


class MeasurementData(MeasuredData):
    """Measurements at several temperatures: one file with a temperature column, one file for each, or an instrument's export."""

    file: InputFile | None = Field(
        None, description="One file with a temperature column, or with columns for each temperature, or an instrument's export."
    )
    files: InputFiles | None = Field(None, description="A list of files, or a glob pattern relative to the recipe.")
    temperatures: list[Temperature] | None = Field(None, description="Temperature of each of files, in their order.")
    temperature_in_name: str | None = Field(
        None, description="Where a file's name states its temperature: text with {degC} or {K} in the number's place."
    )
    layout: Literal["long", "wide"] | None = Field(
        None,
        description="Wide: columns of their own for each temperature, which their headers or a row above state; long: the same "
        "columns for all. Left out: wide where headers state several temperatures and nothing else states any.",
    )

    temperature_stderr: TemperatureError = Field(
        0.1,
        validate_default=False,
        description='Standard error of each temperature by itself; it is in the standard errors and the draws. "0 K" for none.',
    )
    drift: Share | None = Field(
        None,
        description="By how much the specimen's modulus changes from one temperature to the next, as a standard deviation, such as "
        '"2 %": a random walk in the order in which they stand in the data, in the standard errors and the draws. Left out: only '
        "offsets of whole curves that show are allowed for.",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the files, in their order."""
        return (self.file,) if self.file is not None else self.files or ()

    @property
    def is_plain(self) -> bool:
        """Whether the recipe states the layout of the text, so that it is not an instrument's export."""
        return super().is_plain or self.layout is not None

    @property
    def sources(self) -> str:
        """The places where the temperatures may be stated, for messages."""
        return "columns.temperature" if self.file else "one of columns.temperature, temperatures, temperature_in_name"

    @property
    def states_temperatures(self) -> bool:
        """Whether the recipe states where the temperatures are."""
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
