"""Recipes of `spectrum`."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from dielast.commands.spectrum.export import ExportSection
from dielast.errors import InputError
from dielast.handover.law_section import BreakdownField
from dielast.readings.recipe import CurveData
from dielast.recipe.base import Dielectric, RecipeBase
from dielast.recipe.fields import Modulus, PositiveModulus, PositiveTime, RelaxationTime, Section, Temperatures
from dielast.recipe.file_fields import InputFolder


class RelaxationTimes(Section):
    """The shortest and the longest relaxation time."""

    min: RelaxationTime | None = Field(None, description="The shortest relaxation time. Default: from the curve.")
    max: RelaxationTime | None = Field(None, description="The longest relaxation time. Default: from the curve.")

    def _check(self) -> None:
        if self.min is not None and self.max is not None and self.min >= self.max:
            raise InputError(f"min ({self.min:g} s) must be below max ({self.max:g} s)")


class Fit(Section):
    """How the spectrum is fitted; moduli are Young's, by default those that the curve shows."""

    method: Literal["schwarzl-staverman", "nnls"] | None = Field(
        None,
        description="The second-order approximation of Schwarzl and Staverman on a polynomial, the default for a relaxation curve; "
        "or non-negative least squares, the only method for oscillation and creep.",
    )
    branches: int = Field(30, ge=1, le=200, description="Number of branches, with relaxation times evenly spaced in log time.")
    polynomial_degree: int = Field(
        7, ge=1, le=30, description="Degree of the polynomial of log modulus over log time, for schwarzl-staverman."
    )
    relaxation_time: RelaxationTimes = Field(RelaxationTimes(), description="The range of relaxation times.")
    equilibrium_modulus: Modulus | None = Field(
        None, description="Young's modulus when all branches have relaxed. Default: from the long-time end of the curve."
    )
    glassy_modulus: PositiveModulus | None = Field(
        None, description="Young's modulus of all springs together. Default: from the short-time end of the curve."
    )
    liquid: bool = Field(False, description="Whether the material is a melt, which flows: its equilibrium modulus is then 0.")
    continuous: bool = Field(False, description="Whether to write the continuous spectrum H(ln tau) as well.")

    def _check(self) -> None:
        if self.liquid and self.equilibrium_modulus:
            raise InputError("liquid = true and an equilibrium_modulus above 0 contradict each other: state one of them")


class Truncate(Section):
    """Keep only the slowest branches."""

    keep: int = Field(ge=1, description="Number of the slowest branches that are kept.")


class Reduce(Section):
    """The smallest spectrum whose response over a window of times is that of the whole spectrum."""

    window: list[PositiveTime] = Field(
        min_length=2,
        max_length=2,
        description="First and last time between which the stress must agree with that of the whole spectrum, counted from the "
        "beginning of a step of strain, or of a ramp of any duration.",
    )
    temperatures: Temperatures | None = Field(
        None, description="Temperatures at which the stress must agree over the window. Default: the reference temperature."
    )
    tolerance: float = Field(0.01, gt=0, lt=1, description="Greatest relative difference from the stress of the whole spectrum.")

    def _check(self) -> None:
        first, last = self.window
        if first >= last:
            raise InputError(f"window from {first:g} to {last:g} s: the shorter time must come first")


# arguments of the fit and of the reduction -> keys of the recipe
FIT_KEYS = {name: f"fit.{name}" for name in Fit.model_fields} | {"retardation_time": "fit.relaxation_time", "keep": "truncate.keep"}
REDUCE_KEYS = {name: f"reduce.{name}" for name in Reduce.model_fields} | {"temperature": "reduce.temperatures"}


class GentLimits(Section):
    """J_lim of the equilibrium spring and of the branches; a spring without it is neo-Hookean."""

    equilibrium: float | None = Field(None, ge=1e-6, description="J_lim of the equilibrium spring. Default: neo-Hookean.")
    nonequilibrium: float | None = Field(None, ge=1e-6, description="J_lim of the springs of all branches. Default: neo-Hookean.")


class MaterialConstants(Dielectric):
    """Constants that no relaxation test gives, passed on to the material file."""

    name: str = Field("unnamed", description="Name of the material, for legends.")
    J_lim: GentLimits = Field(GentLimits(), description="Limits of stretch of the Gent springs.")
    breakdown: BreakdownField | None = Field(None, description="The breakdown field.")


class SpectrumRecipe(RecipeBase):
    """Master curve -> discrete relaxation spectrum and material file."""

    ELSEWHERE: ClassVar = {
        "uncertainty": "the draws of a spectrum are those of its master curve: state [uncertainty] in the recipe of mastercurve"
    }

    kind: Literal["spectrum"] = Field(description="The subcommand that runs this recipe.")
    mastercurve: InputFolder | None = Field(None, description="A folder written by mastercurve.")
    data: CurveData | None = Field(None, description="Instead of mastercurve: a test at one temperature or a curve from elsewhere.")
    fit: Fit = Field(Fit(), description="How the spectrum is fitted.")
    truncate: Truncate | None = Field(None, description="Keep only the slowest branches.")
    reduce: Reduce | None = Field(None, description="Keep only as many branches as a window of times needs.")
    material: MaterialConstants = Field(MaterialConstants(), description="Constants passed on to the material file.")
    export: ExportSection | None = Field(None, description="Material cards for finite-element codes.")

    def _check(self) -> None:
        if (self.mastercurve is None) == (self.data is None):
            raise InputError("either mastercurve (a folder) or [data] (a file) is needed")
        if self.truncate is not None and self.reduce is not None:
            raise InputError("[truncate] and [reduce] both select branches: state one of them")
