"""Recipes of `actuate` and `failure-map`."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from sys import float_info
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema, field_validator, model_validator

from dielast.commands.simulation.recipe import COLUMNS, Aim, HistoryStep, SimulationRecipe, Solver, starting
from dielast.errors import InputError, shown
from dielast.recipe.base import BreakdownField, RecipeBase
from dielast.recipe.fields import (
    ColumnName,
    InputFile,
    Length,
    PositiveTime,
    Section,
    StrainRate,
    Temperatures,
    Time,
    Voltage,
    VoltageRate,
    Voltages,
)
from dielast.recipe.uncertainty import FilmUncertainty
from dielast.units import STRAIN, TIME, VOLTAGE, parse

Value = TypeVar("Value")
BOUNDARIES = ("dead-load", "clamped")
# columns that only a comparison and a plot have: the electrode, as a camera sees it
MAJOR_AXIS, MINOR_AXIS = "major_axis [m]", "minor_axis [m]"
FIELD_COLUMNS = ("voltage [V]", "relative_stretch_1 [1]", "relative_stretch_2 [1]", "true_field [V/m]", "stability [1]")


def _boundary(value: Any) -> tuple[str, str]:
    """What holds axes 1 and 2."""
    pair = value if isinstance(value, list) else [value, value]
    if len(pair) != 2 or any(entry not in BOUNDARIES for entry in pair):
        raise InputError(f'{shown(value)}: "dead-load" or "clamped" is needed, or a pair of them, one a direction')
    return pair[0], pair[1]


def _prestretch(value: Any) -> tuple[float, float]:
    """The prestretch of axes 1 and 2."""
    pair = value if isinstance(value, list) else [value, value]
    numbers = [
        entry for entry in pair if isinstance(entry, int | float) and not isinstance(entry, bool) and 1 <= entry <= float_info.max
    ]
    if len(pair) != 2 or len(numbers) != 2:
        strain = next((strain for entry in pair if (strain := _strain(entry)) is not None), None)
        hint = "" if strain is None else f"; a prestretch is 1 + strain: if that is a strain, write {1 + strain:g}"
        raise InputError(f"{shown(value)}: a prestretch of at least 1 is needed, or a pair such as [3.0, 1.0]{hint}")
    return float(pair[0]), float(pair[1])


def _strain(value: Any) -> float | None:
    """The strain that a value looks like: a number between 0 and 1, or per cent."""
    if isinstance(value, str):
        try:
            return parse(value, STRAIN)
        except InputError:
            return None
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < 1 else None


def _prestretches(value: Any) -> tuple[tuple[float, float], ...]:
    """The prestretches of a map; a list is the grid's axis."""
    entries = value if isinstance(value, list) else [value]
    if not entries:
        raise InputError("a list of prestretches is needed, such as [1.7, 1.9]")
    return _distinct(tuple(_prestretch(entry) for entry in entries), _spelled)


def _spelled(pair: tuple[float, float]) -> str:
    return f"{pair[0]:.9g}" if pair[0] == pair[1] else f"{pair[0]:.9g} x {pair[1]:.9g}"


def _distinct(values: tuple[Value, ...], spelled: Callable[[Value], str]) -> tuple[Value, ...]:
    """The axis of a map, whose values differ in the digits that tables show."""
    seen = set[str]()
    for text in map(spelled, values):
        if text in seen:
            raise InputError(f"{text} stands there twice: the values of a map's axis must differ")
        seen.add(text)
    return values


_ONE_PRESTRETCH = {"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}]}
_ONE_BOUNDARY = {"enum": list(BOUNDARIES)}
Boundary = Annotated[
    tuple[str, str],
    PlainValidator(_boundary),
    WithJsonSchema({"anyOf": [_ONE_BOUNDARY, {"type": "array", "items": _ONE_BOUNDARY, "minItems": 2, "maxItems": 2}]}),
]
Prestretch = Annotated[tuple[float, float], PlainValidator(_prestretch), WithJsonSchema(_ONE_PRESTRETCH)]
Prestretches = Annotated[
    tuple[tuple[float, float], ...],
    PlainValidator(_prestretches),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "array", "items": _ONE_PRESTRETCH, "minItems": 1}]}),
]
MapTemperatures = Annotated[Temperatures, AfterValidator(lambda values: _distinct(values, "{:.9g} degC".format))]


def _timescale(value: Any) -> tuple[float, bool]:
    """A share of the time since the voltage came on (True), or a time in s (False)."""
    for dimension, share in ((STRAIN, True), (TIME, False)):
        try:
            number = parse(value, dimension)
        except InputError:
            continue
        if number >= 0:
            return number, share
    raise InputError(
        f'{shown(value)}: a share of the time since the voltage came on, such as "1 %", or a time, such as "0 s", is needed'
    )


TimeScale = Annotated[
    tuple[float, bool], PlainValidator(_timescale), WithJsonSchema({"type": "string", "examples": ["1 %", "0 s", "0.1 s"]})
]


class PullIn(Section):
    """The pull-in criterion: det H = 0 with branches weighted by how much of them outlasts the time scale."""

    timescale: TimeScale = Field(
        default_factory=lambda: (0.01, True),
        description="How long a disturbance is watched: a share of the time since the size of the voltage last began to rise, "
        "after a hold or a fall; or a time; 0 s is det H = 0 to the letter.",
        json_schema_extra={"default": "1 %"},
    )


class Stop(Section):
    """Where a simulation ends."""

    at: Literal["breakdown", "pull-in", "end"] = Field(
        "breakdown", description="The event to stop at, or the end of the last step."
    )


class VoltageColumns(Section):
    """Columns of a table of voltages, where they are called otherwise."""

    time: ColumnName | None = Field(None, description='Left out: "time".')
    voltage: ColumnName | None = Field(None, description='Left out: "voltage".')


class VoltageStep(HistoryStep):
    """A step of prescribed voltage."""

    voltage: Voltage | None = Field(None, description="Voltage to reach.")
    rate: VoltageRate | None = Field(None, description="Of the voltage; negative to lower it.")
    low: Voltage | None = Field(None, description="Of a waveform; by default 0 V.")
    high: Voltage | None = Field(None, description="Of a waveform.")
    columns: VoltageColumns | None = Field(None, description="Columns of the table, where they are called otherwise.")

    def aim(self) -> Aim | None:
        """The voltage."""
        return None if self.voltage is None else Aim("voltage", self.voltage, self.rate, VOLTAGE.unit)


class FilmBase(Section):
    """What is common to the film of one experiment and of a map."""

    thickness: Length = Field(description="Undeformed.")
    prestretch_rate: StrainRate | None = Field(None, gt=0, description="Of the larger axis; both ramp together. Left out: at once.")
    relax: Time = Field(0.0, validate_default=False, description="At constant prestretch, before the voltage.")
    boundary: Boundary = Field(
        default_factory=lambda: ("dead-load", "dead-load"),
        description="What is held while the voltage is on: the nominal stress or the stretch; one for both axes, or a pair.",
        json_schema_extra={"default": "dead-load"},
    )


class Film(FilmBase):
    """The film of an actuation experiment."""

    prestretch: Prestretch = Field(
        default_factory=lambda: (1.0, 1.0),
        description="Equibiaxial, or a pair such as [3.0, 1.0].",
        json_schema_extra={"default": 1.0},
    )
    electrode_diameter: Length | None = Field(None, description="On the prestretched film; for measured axes in mm.")


class ActuateRecipe(SimulationRecipe):
    """Voltage history -> stretch of a prestretched film, and its failure."""

    COLUMNS: ClassVar = (*(header for header in COLUMNS if "true" not in header), *FIELD_COLUMNS, MAJOR_AXIS, MINOR_AXIS)

    kind: Literal["actuate"] = Field(description="The subcommand that runs this recipe.")
    film: Film = Field(description="The film and what is done to it before the voltage.")
    step: Annotated[list[VoltageStep], starting(0.0)] = Field(min_length=1, description="What happens, step by step.")
    breakdown: BreakdownField | None = Field(None, description="Default: the material's.")
    pull_in: PullIn = Field(default_factory=PullIn, description="The pull-in criterion.")
    stop: Stop = Field(Stop(), description="Where the simulation ends.")
    uncertainty: FilmUncertainty | None = Field(None, description="Intervals about all results, from draws of material and film.")

    @model_validator(mode="after")
    def _a_diameter_for_axes(self) -> Self:
        asked = [("plot.x", self.plot.x), ("plot.y", self.plot.y)]
        for index, one in enumerate(self.compare):
            asked += [(f"compare[{index}].x", one.x), (f"compare[{index}].y", one.y)]
        for key, header in asked:
            if header in (MAJOR_AXIS, MINOR_AXIS) and self.film.electrode_diameter is None:
                raise InputError(f'"{header}" is of the electrode: state film.electrode_diameter', key=key)
        return self

    @model_validator(mode="after")
    def _no_noise(self) -> Self:
        if self.output.noise is not None:
            raise InputError("only relax and creep make test data with noise", key="output.noise")
        return self


class MapFilm(FilmBase):
    """The film of a failure map."""

    prestretch: Prestretches = Field(description="The axis of the grid: equibiaxial prestretches, or pairs.")


class VoltageAxis(Section):
    """The voltages of a map: values, or points from one to another, evenly spaced."""

    values: Voltages | None = Field(None, description="Ascending; instead of from, to and points.")
    start: Voltage | None = Field(None, alias="from", description="The lowest.")
    to: Voltage | None = Field(None, description="The highest.")
    points: int | None = Field(None, ge=1, le=100_000, description="How many, evenly spaced.")
    ramp: Time = Field(0.0, validate_default=False, description="How long each voltage takes to come on.")

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        spaced = [value is not None for value in (self.start, self.to, self.points)]
        if (self.values is None) != all(spaced) or (self.values is not None and any(spaced)):
            raise InputError("either values, or from, to and points, are needed")
        if self.start is not None and self.to is not None:
            if self.points == 1 and self.start != self.to:
                raise InputError(f"points = 1 is a single voltage: from ({self.start:g} V) and to ({self.to:g} V) must be the same")
            if not 0 <= self.start <= self.to or (self.start == self.to and self.points != 1):
                raise InputError(f"from ({self.start:g} V) must be below to ({self.to:g} V)")
        return self

    @field_validator("values")
    @classmethod
    def _ascending(cls, values: tuple[float, ...] | None) -> tuple[float, ...] | None:
        for before, after in pairwise(values or ()):
            if after <= before:
                raise InputError(f"{after:g} V after {before:g} V: the voltages must ascend")
        return values


class MapSolver(Solver):
    """How exactly the equations of a map are solved."""

    rtol: float = Field(
        1e-6,
        ge=1e-12,
        le=1e-2,
        description="Relative tolerance of each time step. If it is not stated, draws of [uncertainty] have a looser one, 5e-4, by "
        "which their times are exact to 0.1 %; state it where bounds closer together than that matter.",
    )


class FailureMapRecipe(RecipeBase):
    """Time to failure over voltage, prestretch and temperature."""

    kind: Literal["failure-map"] = Field(description="The subcommand that runs this recipe.")
    material: InputFile = Field(description="A material file, written by spectrum or by hand.")
    temperature: MapTemperatures | None = Field(None, description="Default: the material's reference temperature.")
    horizon: PositiveTime = Field(description="How long the voltage stays on; what lives longer survives.")
    film: MapFilm = Field(description="The films and what is done to them before the voltage.")
    voltage: VoltageAxis = Field(description="The axis of voltages.")
    breakdown: BreakdownField | None = Field(None, description="Default: the material's.")
    pull_in: PullIn = Field(default_factory=PullIn, description="The pull-in criterion.")
    solver: MapSolver = Field(MapSolver(), description="How exactly the equations are solved.")
    uncertainty: FilmUncertainty | None = Field(None, description="Intervals about all times, from draws of material and film.")

    @model_validator(mode="after")
    def _on_in_time(self) -> Self:
        if self.voltage.ramp > self.horizon:
            raise InputError(f"{self.voltage.ramp:g} s is longer than the horizon of {self.horizon:g} s", key="voltage.ramp")
        return self
