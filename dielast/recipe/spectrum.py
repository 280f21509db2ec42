"""Recipes of `spectrum`."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from dielast.errors import InputError
from dielast.recipe.base import BreakdownField, Dielectric, RecipeBase, TextTable, units_of
from dielast.recipe.export import Export
from dielast.recipe.fields import (
    ColumnName,
    InputFile,
    InputFolder,
    Modulus,
    PositiveModulus,
    PositiveTime,
    RelaxationTime,
    Section,
    Temperature,
    Temperatures,
)
from dielast.recipe.measurements import ROLES as MEASURED

OVER_TIME = ("time", "modulus", "compliance")
OVER_FREQUENCY = ("frequency", "angular_frequency", "storage", "loss", "tan_delta")
ROLES = {role: MEASURED[role] for role in (*OVER_TIME, *OVER_FREQUENCY)}


class CurveColumns(Section):
    """Columns of a relaxation modulus or a creep compliance over reduced time, or of storage and loss over reduced frequency."""

    time: ColumnName | None = Field(None, description='Reduced time; left out: "time".')
    modulus: ColumnName | None = Field(None, description='Relaxation modulus; left out with all others: "modulus".')
    compliance: ColumnName | None = Field(None, description="Creep compliance, instead of modulus.")
    frequency: ColumnName | None = Field(None, description="Reduced frequency in Hz.")
    angular_frequency: ColumnName | None = Field(None, description="Reduced angular frequency in rad/s.")
    storage: ColumnName | None = Field(None, description="Storage modulus.")
    loss: ColumnName | None = Field(None, description="Loss modulus.")
    tan_delta: ColumnName | None = Field(None, description="Loss over storage modulus, instead of loss.")

    @property
    def measurement(self) -> Literal["relaxation", "oscillation", "creep"]:
        """What was measured."""
        if any(getattr(self, role) is not None for role in OVER_FREQUENCY):
            return "oscillation"
        return "relaxation" if self.compliance is None else "creep"

    @model_validator(mode="after")
    def _one_measurement(self) -> Self:
        given = [role for role in ROLES if getattr(self, role) is not None]
        if self.modulus is not None and self.compliance is not None:
            raise InputError("either modulus or compliance is needed, not both")
        if self.measurement != "oscillation":
            return self
        if strangers := [role for role in OVER_TIME if role in given]:
            raise InputError(f"{' and '.join(strangers)} cannot stand beside the columns of a frequency sweep")
        if "storage" not in given or ("loss" in given) == ("tan_delta" in given):
            raise InputError("storage, and either loss or tan_delta, are needed of a frequency sweep")
        if ("frequency" in given) == ("angular_frequency" in given):
            raise InputError("either frequency (in Hz) or angular_frequency (in rad/s) is needed")
        return self


class CurveData(TextTable):
    """A master curve from elsewhere: one file of a relaxation, creep or oscillation curve."""

    file: InputFile = Field(description="The curve, a table of numbers.")
    columns: CurveColumns = Field(CurveColumns(), description="Which column is what.")
    units: Annotated[dict[str, str], units_of(**ROLES)] = Field(
        {}, description="Units of the columns, where the header does not say them."
    )
    test: Literal["tension", "shear"] = Field("tension", description="Whether moduli are Young's or shear.")
    reference_temperature: Temperature = Field(description="Where the curve holds; it comes without a shift law.")


class RelaxationTimes(Section):
    """The shortest and the longest relaxation time."""

    min: RelaxationTime | None = Field(None, description="The shortest; by default from the curve.")
    max: RelaxationTime | None = Field(None, description="The longest; by default from the curve.")

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        if self.min is not None and self.max is not None and self.min >= self.max:
            raise InputError(f"min ({self.min:g} s) must be below max ({self.max:g} s)")
        return self


class Fit(Section):
    """How the spectrum is found; moduli are Young's, and default to what the curve shows."""

    method: Literal["schwarzl-staverman", "nnls"] | None = Field(
        None,
        description="Second-order approximation on a polynomial, which a relaxation curve has if left out, or non-negative least "
        "squares, which oscillation and creep have.",
    )
    branches: int = Field(30, ge=1, le=200, description="Relaxation processes, evenly spaced in log time.")
    polynomial_degree: int = Field(7, ge=1, le=30, description="Of log modulus over log time, for schwarzl-staverman.")
    relaxation_time: RelaxationTimes = Field(RelaxationTimes(), description="The range of relaxation times.")
    equilibrium_modulus: Modulus | None = Field(None, description="Young's; by default from the curve's long-time end.")
    glassy_modulus: PositiveModulus | None = Field(
        None, description="Young's, that of all springs together; by default from the curve's short-time end."
    )
    continuous: bool = Field(False, description="Whether to write the continuous spectrum H(ln tau), too.")


class Truncate(Section):
    """Keep only the slowest branches."""

    keep: int = Field(ge=1, description="How many of the slowest branches are kept.")


class Reduce(Section):
    """The smallest spectrum that answers like the whole one over a window of times."""

    window: list[PositiveTime] = Field(
        min_length=2, max_length=2, description="The times from and to which a step or ramp of strain must come out alike."
    )
    temperatures: Temperatures | None = Field(None, description="Where the window holds; left out: the reference temperature.")
    tolerance: float = Field(0.01, gt=0, lt=1, description="Greatest relative error of the stress against the whole spectrum's.")

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        first, last = self.window
        if first >= last:
            raise InputError(f"window from {first:g} to {last:g} s: the shorter time must come first")
        return self


class GentLimits(Section):
    """J_lim of the equilibrium spring and of the branches; left out, a spring is neo-Hookean."""

    equilibrium: float | None = Field(None, ge=1e-6, description="Of the spring that never relaxes.")
    nonequilibrium: float | None = Field(None, ge=1e-6, description="Of the spring in every branch.")


class MaterialConstants(Dielectric):
    """Constants that no relaxation test gives, passed on to the material file."""

    name: str = Field("unnamed", description="Of the material, for legends.")
    J_lim: GentLimits = Field(GentLimits(), description="Limits of stretch of the Gent springs.")
    breakdown: BreakdownField | None = Field(None, description="The field that the film breaks down at.")


class SpectrumRecipe(RecipeBase):
    """Master curve -> discrete relaxation spectrum and material file."""

    ELSEWHERE: ClassVar = {
        "uncertainty": "the draws of a spectrum are those of its master curve: [uncertainty] belongs into the recipe of mastercurve"
    }

    kind: Literal["spectrum"] = Field(description="The subcommand that runs this recipe.")
    mastercurve: InputFolder | None = Field(None, description="A folder written by mastercurve.")
    data: CurveData | None = Field(None, description="Instead of mastercurve: a curve from elsewhere.")
    fit: Fit = Field(Fit(), description="How the spectrum is found.")
    truncate: Truncate | None = Field(None, description="Keep only the slowest branches.")
    reduce: Reduce | None = Field(None, description="Keep as few branches as a window of times needs.")
    material: MaterialConstants = Field(MaterialConstants(), description="Constants passed on to the material file.")
    export: Export | None = Field(None, description="Material cards for finite-element codes.")

    @model_validator(mode="after")
    def _one_curve(self) -> Self:
        if (self.mastercurve is None) == (self.data is None):
            raise InputError("either mastercurve (a folder) or [data] (a file) is needed")
        if self.truncate is not None and self.reduce is not None:
            raise InputError("[truncate] and [reduce] both say which branches to keep: give one of them")
        return self
