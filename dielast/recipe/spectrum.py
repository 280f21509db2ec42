"""Recipes of `spectrum`."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from dielast.errors import InputError
from dielast.recipe.base import BreakdownField, Dielectric, RecipeBase, TextTable, units_of
from dielast.recipe.fields import ColumnName, InputFile, InputFolder, Modulus, PositiveModulus, PositiveTime, Section, Temperature
from dielast.units import STRESS, TIME


class CurveColumns(Section):
    """Columns of a relaxation modulus over reduced time."""

    time: ColumnName = "time"
    modulus: ColumnName = "modulus"


class CurveData(TextTable):
    """A master curve from elsewhere: one file of relaxation modulus over reduced time."""

    file: InputFile
    columns: CurveColumns = CurveColumns()
    units: Annotated[dict[str, str], units_of(time=TIME, modulus=STRESS)] = Field({})
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
