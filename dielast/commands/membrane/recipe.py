"""Recipes of `relax` and `creep`."""

import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field

from dielast.base.errors import InputError, shown
from dielast.base.units import FORCE, FORCE_RATE, STRESS, STRESS_RATE, Dimension
from dielast.commands.simulation.recipe import LoadingMode, SimulationRecipe
from dielast.commands.simulation.step_recipe import Aim, AnyOf, HistoryStep, starting
from dielast.readings.columns_recipe import MachineColumns, Specimen, unmeasured
from dielast.recipe.fields import Force, StrainRate, Stress


def _no_strain(value: Any) -> Any:
    """A stretch as stated; raises `InputError` for a value in per cent, which is a strain."""
    if isinstance(value, str) and (percent := re.fullmatch(r"\s*([+-]?\d+(?:\.\d+)?)\s*%\s*", value)):
        stretch = 1 + float(percent[1]) / 100
        raise InputError(f"{shown(value)}: a bare number is needed, and a stretch is 1 + strain, so this would be {stretch:g}")
    return value


Stretch = Annotated[float, BeforeValidator(_no_strain), Field(gt=0, allow_inf_nan=False)]


class StretchStep(HistoryStep):
    """A step of prescribed stretch."""

    CONTROL: ClassVar = "stretch"
    REST: ClassVar = 1.0
    ELSEWHERE: ClassVar = {
        "strain": "unknown key; state the stretch, 1 + strain: a strain of 100 % is stretch = 2.0",
        "extension": "unknown key; state the stretch, 1 + extension over gauge length: 80 mm of 80 mm is stretch = 2.0",
    }

    stretch: Stretch | None = Field(None, description="Stretch to reach; 1 is undeformed.")
    rate: StrainRate | None = Field(None, description="Rate of the stretch; negative to unload.")
    low: Stretch | None = Field(None, description="Lowest stretch of the waveform. Default: 1.")
    high: Stretch | None = Field(None, description="Highest stretch of the waveform.")
    columns: MachineColumns | None = Field(None, description="Columns of the table, if their names differ.")

    def aim(self) -> Aim | None:
        """The stretch."""
        return None if self.stretch is None else Aim("stretch", self.stretch, self.rate)


LoadValue = Annotated[tuple[float, str], AnyOf((FORCE, STRESS), "a force or a stress")]
LoadRate = Annotated[tuple[float, str], AnyOf((FORCE_RATE, STRESS_RATE), "a force or stress rate")]


class LoadStep(HistoryStep):
    """A step of prescribed force or nominal stress."""

    CONTROL: ClassVar = "stress"

    force: Force | None = Field(None, description="Force to reach; needs [specimen].")
    stress: Stress | None = Field(None, description="Nominal stress to reach.")
    rate: LoadRate | None = Field(None, description="Rate of the force or the stress; negative to unload.")
    low: LoadValue | None = Field(None, description="Lowest force or nominal stress of the waveform. Default: 0.")
    high: LoadValue | None = Field(None, description="Highest force or nominal stress of the waveform.")
    columns: MachineColumns | None = Field(None, description="Columns of the table, if their names differ.")

    def aim(self) -> Aim | None:
        """The force or the stress."""
        rate = None if self.rate is None else self.rate[0]
        if self.force is not None:
            return Aim("force", self.force, rate, FORCE.unit)
        return None if self.stress is None else Aim("stress", self.stress, rate, STRESS.unit)

    def _check(self) -> None:
        super()._check()
        if self.low is not None and self.high is not None and self.low[1] != self.high[1]:
            raise InputError("low and high of a waveform must both be forces, or both stresses")
        if self.rate is not None:
            needed: Dimension = FORCE_RATE if self.force is not None else STRESS_RATE
            if self.rate[1] != needed.unit:
                target = "force" if self.force is not None else "stress"
                raise InputError(f'{needed.name} is needed with {target}, such as "{needed.example}"', key="rate")


SLACK = (
    "What a specimen does that would be pressed together: one between clamps goes slack and bears nothing, until it is as long as "
    "the prescribed stretch again. Default: bears nothing; in equibiaxial mode, and for a stated pressure, pushes."
)
Slack = Literal["bears nothing", "pushes"]


class RelaxRecipe(SimulationRecipe):
    """Prescribed stretch -> stress."""

    kind: Literal["relax"] = Field(description="The subcommand that runs this recipe.")
    mode: LoadingMode = Field("uniaxial", description="How the specimen is stretched.")
    specimen: Specimen | None = Field(None, description="The specimen on which extension and force in tables were measured.")
    slack: Slack | None = Field(None, description=SLACK)
    step: Annotated[list[StretchStep], starting(1.0)] = Field(min_length=1, description="Load history.")


class CreepRecipe(SimulationRecipe):
    """Prescribed force or nominal stress -> stretch."""

    kind: Literal["creep"] = Field(description="The subcommand that runs this recipe.")
    mode: LoadingMode = Field("uniaxial", description="How the specimen is loaded.")
    specimen: Specimen | None = Field(
        None, description="The specimen that forces act on and extensions are measured on; not needed for stresses."
    )
    slack: Slack | None = Field(None, description=SLACK)
    step: Annotated[list[LoadStep], starting(0.0)] = Field(min_length=1, description="Load history.")

    def _check(self) -> None:
        super()._check()
        for index, step in enumerate(self.step):
            loads = {"force": step.force, "stress": step.stress, "low": (step.low or (None,))[0], "high": (step.high or (None,))[0]}
            if pressed := [key for key, load in loads.items() if self.slack == "bears nothing" and load is not None and load < 0]:
                raise InputError(
                    'a specimen that bears nothing takes no pressure: state slack = "pushes"', key=f"step[{index}].{pressed[0]}"
                )
            forced = "high" if step.high is not None and step.high[1] == FORCE.unit else "force"
            if (step.force is not None or forced == "high") and unmeasured(("force",), self.specimen):
                needed = "a force needs [specimen] with width and thickness, or state stress"
                raise InputError(needed, key=f"step[{index}].{forced}")


Recipe = RelaxRecipe | CreepRecipe
