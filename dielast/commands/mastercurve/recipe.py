"""Recipes of `mastercurve`."""

from typing import Annotated, Literal

from pydantic import Field

from dielast.base.errors import InputError
from dielast.material.shift import SHIFTS
from dielast.readings.recipe import MeasurementData
from dielast.recipe.base import RecipeBase
from dielast.recipe.fields import OneOf, Section, Temperature, ThermalExpansion


class Shift(Section):
    """How the curves are shifted, and the law fitted to the shift factors."""

    reference_temperature: Temperature = Field(description="Temperature of the master curve; it need not be a measured one.")
    law: Annotated[str, OneOf(lambda: [law.name for law in SHIFTS if law.is_fitted])] = Field(
        "wlf", description="Law that is fitted to the shift factors."
    )
    vertical: Literal["none", "density-temperature", "free"] = Field(
        "none",
        description="Whether and how moduli are shifted as well. With none, the table, the fitted curve and the moduli of the "
        "summary are those of the curves as measured, with all offsets between them.",
    )
    thermal_expansion: ThermalExpansion = Field(
        0.0, validate_default=False, description="Volumetric thermal expansion, for vertical = density-temperature."
    )
    on: Literal["auto", "moduli", "tan-delta", "storage"] = Field(
        "auto",
        description="The quantity by which frequency sweeps are shifted: storage and loss modulus together (moduli), tan delta, "
        "the storage modulus, or whichever determines the shifts best (auto).",
    )

    def _check(self) -> None:
        if self.thermal_expansion and self.vertical != "density-temperature":
            raise InputError(
                f'thermal_expansion acts only with vertical = "density-temperature", not with vertical = "{self.vertical}": '
                "change vertical, or leave thermal_expansion out"
            )


# arguments of `build_master_curve` -> keys of the recipe
KEYS = {name: f"shift.{name}" for name in Shift.model_fields} | {name: f"data.{name}" for name in ("temperature_stderr", "drift")}


class Draws(Section):
    """How many times the master curve is built from newly drawn noise."""

    draws: int = Field(
        200,
        ge=2,
        le=100_000,
        description="Number of draws; n draws determine a standard error to 1/sqrt(2n): 200 to 5 %, 40 to 11 %.",
    )
    seed: int = Field(
        1,
        ge=0,
        description="Seed of the random numbers: the same seed gives the same result, and the same drawn drift and errors of "
        "temperature to other tests at as many temperatures; state another for each of several tests to be compared.",
    )


class MasterCurveRecipe(RecipeBase):
    """Relaxation tests, creep tests or frequency sweeps at several temperatures -> master curve and shift factors."""

    kind: Literal["mastercurve"] = Field(description="The subcommand that runs this recipe.")
    data: MeasurementData = Field(description="The measurements.")
    shift: Shift = Field(description="How the curves are shifted.")
    uncertainty: Draws | None = Field(
        None, description="Resample the noise: draws of the master curve, for intervals of everything computed from it."
    )
