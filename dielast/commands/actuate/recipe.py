"""Recipes of `actuate`."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, PlainValidator, WithJsonSchema, model_validator

from dielast.commands.simulation.film_recipe import SHARE_TEXT, FilmBase, FilmSolver, Prestretch, PullIn, Share
from dielast.commands.simulation.recipe import Output, SimulationRecipe
from dielast.commands.simulation.result_columns import COLUMNS
from dielast.commands.simulation.step_recipe import Aim, HistoryStep, starting
from dielast.commands.simulation.uncertainty_recipe import FilmUncertainty
from dielast.errors import InputError, shown
from dielast.mechanics.criteria import END, names
from dielast.recipe.base import BreakdownField
from dielast.recipe.fields import ColumnName, Section, Time, Voltage, VoltageRate
from dielast.units import VOLTAGE

# columns that only a comparison and a plot have: the electrode, as a camera sees it
MAJOR_AXIS, MINOR_AXIS = "major_axis [m]", "minor_axis [m]"
FIELD_COLUMNS = ("voltage [V]", "relative_stretch_1 [1]", "relative_stretch_2 [1]", "true_field [V/m]", "stability [1]")


def _stop(value: Any) -> str:
    """The name of an event, or of the end."""
    known = (*names(), END)
    if value not in known:
        raise InputError(f"{shown(value)}: {', '.join(map(shown, known[:-1]))} or {shown(END)} is needed")
    return str(value)


StopAt = Annotated[str, PlainValidator(_stop), WithJsonSchema({"enum": [*names(), END], "type": "string"})]


class Stop(Section):
    """Where a simulation ends."""

    at: StopAt = Field(
        "breakdown",
        description="The event to stop at, or the end of the last step. With breakdown, a film with a passive part stops at loss "
        "of tension as well.",
    )


class VoltageColumns(Section):
    """Columns of a table of voltages, where they are called otherwise."""

    time: ColumnName | None = Field(None, description='Left out: "time".')
    voltage: ColumnName | None = Field(None, description='Left out: "voltage".')


class VoltageStep(HistoryStep):
    """A step of prescribed voltage."""

    CONTROL: ClassVar = "voltage"

    voltage: Voltage | None = Field(None, description="Voltage to reach.")
    rate: VoltageRate | None = Field(None, description="Of the voltage; negative to lower it.")
    low: Voltage | None = Field(None, description="Of a waveform; by default 0 V.")
    high: Voltage | None = Field(None, description="Of a waveform.")
    columns: VoltageColumns | None = Field(None, description="Columns of the table, where they are called otherwise.")

    def aim(self) -> Aim | None:
        """The voltage."""
        return None if self.voltage is None else Aim("voltage", self.voltage, self.rate, VOLTAGE.unit)


class Film(FilmBase):
    """The film of an actuation experiment."""

    prestretch: Prestretch = Field(
        default_factory=lambda: (1.0, 1.0),
        description="Equibiaxial, or a pair such as [3.0, 1.0].",
        json_schema_extra={"default": 1.0},
    )
    electrode_share: Share | None = Field(None, description=SHARE_TEXT)

    def stated_shares(self) -> tuple[float, ...] | None:
        """The one that is stated."""
        return None if self.electrode_share is None else (self.electrode_share,)

    @property
    def prestretches(self) -> tuple[tuple[float, float], ...]:
        """The prestretch of axes 1 and 2, of the one film."""
        return (self.prestretch,)


class FilmOutput(Output):
    """Where the result is given."""

    profile: list[Time] | None = Field(
        None,
        min_length=1,
        description="Times at which profile.csv holds stretches and stresses over the radius of a film with a passive part.",
    )

    @model_validator(mode="after")
    def _profile_ascending(self) -> Self:
        if self.profile is not None and any(b <= a for a, b in pairwise(self.profile)):
            raise InputError("the times of profile must ascend")
        return self


class ActuateRecipe(SimulationRecipe):
    """Voltage history -> stretch of a prestretched film, and its failure."""

    COLUMNS: ClassVar = (*(header for header in COLUMNS if "true" not in header), *FIELD_COLUMNS, MAJOR_AXIS, MINOR_AXIS)

    kind: Literal["actuate"] = Field(description="The subcommand that runs this recipe.")
    film: Film = Field(description="The film and what is done to it before the voltage.")
    step: Annotated[list[VoltageStep], starting(0.0)] = Field(min_length=1, description="What happens, step by step.")
    breakdown: BreakdownField | None = Field(None, description="Default: the material's.")
    pull_in: PullIn = Field(default_factory=PullIn, description="The pull-in criterion.")
    output: FilmOutput = Field(FilmOutput(), description="Where the result is given.")
    solver: FilmSolver = Field(FilmSolver(), description="How exactly the equations are solved.")
    stop: Stop = Field(Stop(), description="Where the simulation ends.")
    uncertainty: FilmUncertainty | None = Field(None, description="Intervals about all results, from draws of material and film.")

    @model_validator(mode="after")
    def _a_diameter_for_axes(self) -> Self:
        asked = [("plot.x", self.plot.x), ("plot.y", self.plot.y)]
        for index, comparison in enumerate(self.compare):
            asked += [(f"compare[{index}].x", comparison.x), (f"compare[{index}].y", comparison.y)]
        for key, header in asked:
            if header in (MAJOR_AXIS, MINOR_AXIS) and self.film.electrode_diameter is None:
                raise InputError(f'"{header}" is of the electrode: state film.electrode_diameter', key=key)
        return self

    @model_validator(mode="after")
    def _boundary_of_film(self) -> Self:
        self.film.check_boundary()
        if self.output.profile is not None and self.film.shares is None:
            raise InputError('a profile is of a film with a passive part, boundary = "frame" or "strip"', key="output.profile")
        return self

    @model_validator(mode="after")
    def _no_noise(self) -> Self:
        if self.output.noise is not None:
            raise InputError("only relax and creep make test data with noise", key="output.noise")
        return self
