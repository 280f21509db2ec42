"""Recipes of `mastercurve`."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from dielast.errors import InputError
from dielast.recipe.base import RecipeBase, TextTable, units_of
from dielast.recipe.fields import (
    ColumnName,
    InputFile,
    InputFiles,
    PositiveTime,
    Section,
    Temperature,
    TemperatureDifference,
    ThermalExpansion,
    Time,
)
from dielast.units import STRAIN, STRESS, TEMPERATURE, TIME

ROLES = {"temperature": TEMPERATURE, "time": TIME, "modulus": STRESS, "strain": STRAIN, "stress": STRESS}


class RelaxationColumns(Section):
    """Columns of a relaxation test; the modulus is measured, or is stress over strain."""

    temperature: ColumnName | None = None
    time: ColumnName = "time"
    modulus: ColumnName | None = None
    strain: ColumnName | None = None
    stress: ColumnName | None = None

    @model_validator(mode="after")
    def _modulus_or_stress(self) -> Self:
        if (self.strain is None) != (self.stress is None):
            raise InputError("strain and stress go together")
        if (self.modulus is None) == (self.stress is None):
            raise InputError("either modulus, or strain and stress, is needed")
        return self


class RelaxationData(TextTable):
    """Relaxation tests at several temperatures: one file with a temperature column, or one file for each temperature."""

    file: InputFile | None = None
    files: InputFiles | None = Field(None, description="A list of files, or a glob pattern relative to the recipe.")
    temperatures: list[Temperature] | None = Field(None, description="Temperature of each of files, in their order.")
    temperature_in_name: str | None = Field(
        None, description="Where a file's name states its temperature: text with {degC} or {K} in the number's place."
    )
    columns: RelaxationColumns
    units: Annotated[dict[str, str], units_of(temperature=TEMPERATURE, time=TIME, modulus=STRESS, strain=STRAIN, stress=STRESS)] = (
        Field({})
    )
    test: Literal["tension", "shear"] = Field("tension", description="A shear modulus is written as Young's, three times as much.")
    discard_before: Time = Field(0.0, validate_default=False, description="Drop earlier points, such as the ramp.")
    ramp: PositiveTime | None = Field(
        None,
        description="Duration of the ramp that the times begin with. They are then counted from its middle, and points before "
        "twice the ramp are dropped unless discard_before says otherwise.",
    )
    temperature_tolerance: TemperatureDifference = Field(
        0.5, validate_default=False, description="Readings closer together than this belong to one temperature."
    )

    @property
    def first_time(self) -> float:
        """Points before this time in s, as measured, are dropped; at 0 none are."""
        return max(self.discard_before, self.ramp or 0.0) if self.discard_before > 0 else 2 * (self.ramp or 0.0)

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.file is None) == (self.files is None):
            raise InputError("either file or files is needed")
        stated = [
            name
            for name, value in (
                ("columns.temperature", self.columns.temperature),
                ("temperatures", self.temperatures),
                ("temperature_in_name", self.temperature_in_name),
            )
            if value is not None
        ]
        allowed = "columns.temperature" if self.file else "one of columns.temperature, temperatures, temperature_in_name"
        if len(stated) != 1 or (self.file and stated != ["columns.temperature"]):
            raise InputError(f"temperatures are needed from {allowed}" + (f", not from {' and '.join(stated)}" if stated else ""))
        if self.files is not None and self.temperatures is not None and len(self.files) != len(self.temperatures):
            raise InputError(f"{len(self.files)} files but {len(self.temperatures)} temperatures")
        if self.temperature_in_name is not None and not any(mark in self.temperature_in_name for mark in ("{degC}", "{K}")):
            raise InputError('temperature_in_name needs {degC} or {K} where the number stands, such as "dma_{degC}C.csv"')
        return self


class Shift(Section):
    """How the curves are shifted, and the law fitted to the shift factors."""

    reference_temperature: Temperature
    law: Literal["wlf", "arrhenius", "table"] = "wlf"
    vertical: Literal["none", "density-temperature", "free"] = "none"
    thermal_expansion: ThermalExpansion = Field(
        0.0, validate_default=False, description="Volumetric, for vertical = density-temperature."
    )


class MasterCurveRecipe(RecipeBase):
    """Relaxation tests at several temperatures -> master curve and shift factors."""

    kind: Literal["mastercurve"]
    data: RelaxationData
    shift: Shift
