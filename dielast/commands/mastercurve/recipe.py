"""Recipes of `mastercurve`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dielast.material.shift import SHIFTS
from dielast.readings.recipe import MeasurementData
from dielast.recipe.base import RecipeBase
from dielast.recipe.fields import OneOf, Section, Temperature, ThermalExpansion

# the recipe's key for each argument of `build_master_curve`
KEYS = {
    "reference_temperature": "shift.reference_temperature",
    "law": "shift.law",
    "vertical": "shift.vertical",
    "thermal_expansion": "shift.thermal_expansion",
    "on": "shift.on",
    "temperature_stderr": "data.temperature_stderr",
    "drift": "data.drift",
}


class Shift(Section):
    """How the curves are shifted, and the law fitted to the shift factors."""

    reference_temperature: Temperature = Field(description="Any, measured or not.")
    law: Annotated[str, OneOf(lambda: [law.name for law in SHIFTS if law.is_fitted])] = Field(
        "wlf", description="Fitted to the shift factors."
    )
    vertical: Literal["none", "density-temperature", "free"] = Field("none", description="Whether moduli are shifted, too.")
    thermal_expansion: ThermalExpansion = Field(
        0.0, validate_default=False, description="Volumetric, for vertical = density-temperature."
    )
    on: Literal["auto", "moduli", "tan-delta", "storage"] = Field(
        "auto",
        description="What frequency sweeps are shifted on: storage and loss modulus together, tan delta alone, the storage modulus "
        "alone, or what determines the shifts best.",
    )


class Draws(Section):
    """How often the noise is drawn anew."""

    draws: int = Field(200, ge=2, le=100_000, description="How many.")
    seed: int = Field(1, ge=0, description="Of the random numbers: the same seed, the same result.")


class MasterCurveRecipe(RecipeBase):
    """Relaxation tests, creep tests or frequency sweeps at several temperatures -> master curve and shift factors."""

    kind: Literal["mastercurve"] = Field(description="The subcommand that runs this recipe.")
    data: MeasurementData = Field(description="The measurements.")
    shift: Shift = Field(description="How they are shifted.")
    uncertainty: Draws | None = Field(None, description="Resample the noise, for the uncertainty of all that follows.")
