"""The recipe models of every kind; `RECIPES` lists them."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from dielast.errors import InputError
from dielast.recipe.fields import (
    BreakdownFields,
    ColumnName,
    InputFile,
    InputFiles,
    InputFolder,
    Modulus,
    Permittivity,
    PositiveModulus,
    PositiveTime,
    Section,
    Temperature,
    TemperatureDifference,
    ThermalExpansion,
    Time,
)


class RecipeBase(Section):
    """What every recipe has."""

    title: str | None = Field(None, description="A line for the head of the plot, such as where the data come from.")


class TextTable(Section):
    """How a table of numbers is written; what is left out is sniffed."""

    separator: str | None = Field(None, min_length=1, max_length=1)
    decimal: Literal[".", ","] | None = None
    encoding: str | None = None
    skip_rows: int = Field(0, ge=0)


def _only(*roles: str) -> AfterValidator:
    """Units by the role of a column, for the headers that do not say them."""

    def check(units: dict[str, str]) -> dict[str, str]:
        unknown = [role for role in units if role not in roles]
        if unknown:
            raise InputError(f'unit of an unknown column "{unknown[0]}"; columns are {", ".join(roles)}')
        return units

    return AfterValidator(check)


# --- mastercurve -----------------------------------------------------------------------------------------------------------


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
    units: Annotated[dict[str, str], _only("temperature", "time", "modulus", "strain", "stress")] = Field({})
    test: Literal["tension", "shear"] = Field("tension", description="A shear modulus is written as Young's, three times as much.")
    discard_before: Time = Field(0.0, validate_default=False, description="Drop earlier points, such as the ramp.")
    temperature_tolerance: TemperatureDifference = Field(
        0.5, validate_default=False, description="Readings closer together than this belong to one temperature."
    )

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


# --- spectrum --------------------------------------------------------------------------------------------------------------


class CurveColumns(Section):
    """Columns of a relaxation modulus over reduced time."""

    time: ColumnName = "time"
    modulus: ColumnName = "modulus"


class CurveData(TextTable):
    """A master curve from elsewhere: one file of relaxation modulus over reduced time."""

    file: InputFile
    columns: CurveColumns = CurveColumns()
    units: Annotated[dict[str, str], _only("time", "modulus")] = Field({})
    test: Literal["tension", "shear"] = Field("tension", description="Whether the modulus is Young's or shear.")
    reference_temperature: Temperature


class RelaxationTimes(Section):
    """The shortest and the longest relaxation time."""

    min: PositiveTime | None = None
    max: PositiveTime | None = None

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        if self.min is not None and self.max is not None and self.min >= self.max:
            raise InputError(f"min ({self.min:g} s) must be below max ({self.max:g} s)")
        return self


class Fit(Section):
    """How the spectrum is found; moduli are Young's, and default to what the curve shows."""

    method: Literal["schwarzl-staverman", "nnls"] = "schwarzl-staverman"
    branches: int = Field(30, ge=1, le=2000)
    polynomial_degree: int = Field(7, ge=1, le=30)
    relaxation_time: RelaxationTimes = RelaxationTimes()
    equilibrium_modulus: Modulus | None = None
    glassy_modulus: PositiveModulus | None = None


class Truncate(Section):
    """Keep only the slowest branches."""

    keep: int = Field(ge=1)


class GentLimits(Section):
    """J_lim of the equilibrium spring and of the branches; left out, a spring is neo-Hookean."""

    equilibrium: float | None = Field(None, gt=0)
    nonequilibrium: float | None = Field(None, gt=0)


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


class MaterialConstants(Dielectric):
    """Constants that no relaxation test gives, passed on to the material file."""

    name: str = "unnamed"
    J_lim: GentLimits = GentLimits()
    breakdown: BreakdownField | None = None


class SpectrumRecipe(RecipeBase):
    """Master curve -> discrete relaxation spectrum and material file."""

    kind: Literal["spectrum"]
    mastercurve: InputFolder | None = Field(None, description="A folder written by mastercurve.")
    data: CurveData | None = Field(None, description="Instead of mastercurve: a curve from elsewhere.")
    fit: Fit = Fit()
    truncate: Truncate | None = None
    material: MaterialConstants = MaterialConstants()

    @model_validator(mode="after")
    def _one_curve(self) -> Self:
        if (self.mastercurve is None) == (self.data is None):
            raise InputError("either mastercurve (a folder) or [data] (a file) is needed")
        return self


RECIPES: dict[str, type[RecipeBase]] = {"mastercurve": MasterCurveRecipe, "spectrum": SpectrumRecipe}
"""The recipe model of each kind, in the order of a workflow."""
