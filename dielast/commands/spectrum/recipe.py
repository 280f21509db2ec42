"""Recipes of `spectrum`."""

from dataclasses import fields
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from dielast.base.errors import InputError, Mistakes, Problem
from dielast.base.units import DENSITY
from dielast.handover.export.card import CODES, spring_names
from dielast.handover.export.code import MODULI, SCALES, UNITS, CardOptions
from dielast.handover.law_section import BreakdownField
from dielast.material.dielectric import ConstantPermittivity
from dielast.readings.recipe import CurveData
from dielast.recipe.base import RecipeBase
from dielast.recipe.fields import (
    Modulus,
    OneOf,
    Permittivity,
    PositiveModulus,
    PositiveTime,
    RelaxationTime,
    Section,
    Temperature,
    Temperatures,
    WithUnit,
)
from dielast.recipe.file_fields import InputFile, InputFolder
from dielast.relaxation.result import BRANCHES, Method


class RelaxationTimes(Section):
    """The shortest and the longest relaxation time."""

    min: RelaxationTime | None = Field(None, description="The shortest relaxation time. Default: from the curve.")
    max: RelaxationTime | None = Field(None, description="The longest relaxation time. Default: from the curve.")

    def _check(self) -> None:
        if self.min is not None and self.max is not None and self.min >= self.max:
            raise InputError(f"min ({self.min:g} s) must be below max ({self.max:g} s)")


class FitSection(Section):
    """How the spectrum is fitted; moduli are Young's, by default those that the curve shows."""

    method: Method | None = Field(
        None,
        description="Non-negative least squares, the default and the only method for oscillation and creep; or the second-order "
        "approximation of Schwarzl and Staverman on a polynomial, for a relaxation curve.",
    )
    branches: int | None = Field(
        None,
        ge=1,
        le=200,
        description="Number of branches, with relaxation times evenly spaced in log time. Default: 30; or 5 a decade if these "
        "are more, of the curve or of the range of relaxation_time, unless the table [truncate] or schwarzl-staverman is stated.",
    )
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

    @property
    def states_the_end(self) -> bool:
        """Whether the equilibrium modulus is known."""
        return self.liquid or self.equilibrium_modulus is not None

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
FIT_KEYS = {name: f"fit.{name}" for name in FitSection.model_fields}
FIT_KEYS |= {"retardation_time": "fit.relaxation_time", "keep": "truncate.keep"}
REDUCE_KEYS = {name: f"reduce.{name}" for name in Reduce.model_fields} | {"temperature": "reduce.temperatures"}


class GentLimits(Section):
    """J_lim of the equilibrium spring and of the branches; a spring without it is neo-Hookean."""

    equilibrium: float | None = Field(None, ge=1e-6, description="J_lim of the equilibrium spring. Default: neo-Hookean.")
    nonequilibrium: float | None = Field(None, ge=1e-6, description="J_lim of the springs of all branches. Default: neo-Hookean.")


class MaterialConstants(Section):
    """Constants that no relaxation test gives, passed on to the material file."""

    permittivity: Permittivity | None = Field(None, description="Absolute permittivity of the ideal dielectric.")
    relative_permittivity: float | None = Field(
        None, ge=1, description="Permittivity over that of vacuum; instead of permittivity."
    )
    name: str = Field("unnamed", description="Name of the material, for legends.")
    J_lim: GentLimits = Field(GentLimits(), description="Limits of stretch of the Gent springs.")
    breakdown: BreakdownField | None = Field(None, description="The breakdown field.")

    def _check(self) -> None:
        self.dielectric()

    def dielectric(self) -> float | None:
        """The permittivity in F/m; None if none is stated."""
        return ConstantPermittivity(self.permittivity or 0.0, self.relative_permittivity).brief()


Format = Annotated[str, OneOf(lambda: CODES.names)]
EXPORT_KEYS = {name: f"export.{name}" for name in ("formats", *(field.name for field in fields(CardOptions)))}
"""Arguments and options of `export_card` -> keys of the recipe."""


class ExportSection(Section):
    """Material cards to write beside material.toml; what a code cannot carry is an error unless a key here allows it."""

    formats: list[Format] = Field(min_length=1, description="Finite-element codes to write cards for.")
    units: Annotated[str, OneOf(lambda: tuple(UNITS))] = Field(
        "SI", description="Consistent units of the cards; the card for COMSOL is always in SI."
    )
    temperature_scale: Annotated[str, OneOf(lambda: SCALES)] = Field(
        "degC", description="Scale of the model's temperatures (Abaqus, ANSYS)."
    )
    hyperelastic: Annotated[str, OneOf(spring_names)] | None = Field(
        None, description="Law of the springs in the cards. Default: that of the material, or an error if a code lacks it."
    )
    J_lim: float | None = Field(None, gt=0, description="One J_lim for all springs, for codes that take only one.")
    moduli: Annotated[str, OneOf(lambda: MODULI)] = Field(
        "instantaneous", description="The modulus that the elastic constants state (Abaqus, FEBio)."
    )
    bulk_modulus: PositiveModulus | None = Field(None, description="Bulk modulus. Default: incompressible, or from poisson_ratio.")
    poisson_ratio: float | None = Field(
        None,
        ge=0,
        lt=0.5,
        description="Poisson's ratio at time zero. Default: 0.495 for codes that need a bulk modulus (FEBio, MFront).",
    )
    density: Annotated[float, WithUnit(DENSITY, above=0.0)] | None = Field(None, description="Density. Default: none in the cards.")
    temperature: Temperature | None = Field(None, description="Temperature of the cards for codes that cannot carry the shift law.")

    def _check(self) -> None:
        wrong = Mistakes()
        if len(set(self.formats)) < len(self.formats):
            wrong.append(Problem("formats must differ"))
        wrong.tried(self.options)
        Mistakes(problem.in_keys({problem.argument or "": problem.argument or ""}) for problem in wrong).refuse()

    def options(self) -> CardOptions:
        """The options as the library takes them."""
        return CardOptions(**self.model_dump(exclude={"formats"}))


class SpectrumRecipe(RecipeBase):
    """Master curve -> discrete relaxation spectrum and material file."""

    ELSEWHERE: ClassVar = {
        "uncertainty": "the draws of a spectrum are those of its master curve: state [uncertainty] in the recipe of mastercurve"
    }

    kind: Literal["spectrum"] = Field(description="The subcommand that runs this recipe.")
    mastercurve: InputFolder | None = Field(None, description="A folder written by mastercurve.")
    data: CurveData | None = Field(None, description="Instead of mastercurve: a test at one temperature or a curve from elsewhere.")
    prony: InputFile | None = Field(
        None,
        description="Instead of mastercurve: a Prony series that exists, in a card of Abaqus (*VISCOELASTIC, TIME=PRONY) or ANSYS "
        "(TB,PRONY), or as a table of g_i and tau_i. Where it has no elastic constants, fit.glassy_modulus (Young's, "
        "instantaneous) or fit.equilibrium_modulus (long-term) states the modulus.",
    )
    prony_units: Annotated[str, OneOf(lambda: tuple(UNITS))] | None = Field(
        None, description="Consistent units of the card, which does not state them; needed with a card of Abaqus or ANSYS."
    )
    prony_temperature_scale: Annotated[str, OneOf(lambda: SCALES)] | None = Field(
        None, description="Scale of the card's temperatures, which it does not state; needed where it has a shift law."
    )
    fit: FitSection = Field(FitSection(), description="How the spectrum is fitted.")
    truncate: Truncate | None = Field(None, description="Keep only the slowest branches.")
    reduce: Reduce | None = Field(None, description="Keep only as many branches as a window of times needs.")
    material: MaterialConstants = Field(MaterialConstants(), description="Constants passed on to the material file.")
    export: ExportSection | None = Field(None, description="Material cards for finite-element codes.")

    @property
    def whole_fit(self) -> FitSection:
        """The fit before any branches are left out, which are counted from the slowest of the usual number."""
        counted = self.truncate is not None and self.fit.branches is None
        return self.fit.model_copy(update={"branches": BRANCHES}) if counted else self.fit

    def _check(self) -> None:
        if sum(source is not None for source in (self.mastercurve, self.data, self.prony)) != 1:
            raise InputError("either mastercurve (a folder), [data] (a file) or prony (a card) is needed")
        for key in ("prony_units", "prony_temperature_scale"):
            if self.prony is None and getattr(self, key) is not None:
                raise InputError("is of a card: state prony as well, or leave it out", key=key)
        if self.prony is not None:
            fitted = [f"fit.{key}" for key in sorted(self.fit.model_fields_set - {"glassy_modulus", "equilibrium_modulus"})]
            fitted += [key for key in ("truncate", "reduce") if getattr(self, key) is not None]
            Mistakes(Problem("a series of prony is taken as it is: leave this out", key=key) for key in fitted).refuse()
        if self.truncate is not None and self.reduce is not None:
            raise InputError("[truncate] and [reduce] both select branches: state one of them")
