"""Recipes of `failure-map`."""

from itertools import pairwise
from typing import ClassVar, Literal

from pydantic import Field, field_validator

from dielast.commands.simulation.grid_recipe import GridFilm, GridRecipe
from dielast.commands.simulation.uncertainty_recipe import SENSITIVITY_TEXT
from dielast.errors import InputError
from dielast.recipe.fields import NamedTimes, PositiveTime, Section, Time, Voltage, Voltages


class VoltageAxis(Section):
    """The voltages of a map: stated values, or evenly spaced points."""

    values: Voltages | None = Field(None, description="Voltages, ascending; instead of from, to and points.")
    start: Voltage | None = Field(None, alias="from", description="Lowest voltage.")
    to: Voltage | None = Field(None, description="Highest voltage.")
    points: int | None = Field(None, ge=1, le=100_000, description="Number of voltages, evenly spaced.")
    ramp: Time = Field(0.0, validate_default=False, description="Time in which each voltage rises from 0.")

    def _check(self) -> None:
        spaced = [value is not None for value in (self.start, self.to, self.points)]
        if (self.values is None) != all(spaced) or (self.values is not None and any(spaced)):
            raise InputError("either values, or from, to and points, are needed")
        if self.start is not None and self.to is not None:
            if self.points == 1 and self.start != self.to:
                raise InputError(f"points = 1 is a single voltage: from ({self.start:g} V) and to ({self.to:g} V) must be the same")
            if not 0 <= self.start <= self.to or (self.start == self.to and self.points != 1):
                raise InputError(f"from ({self.start:g} V) must be below to ({self.to:g} V)")

    @field_validator("values")
    @classmethod
    def _ascending(cls, values: tuple[float, ...] | None) -> tuple[float, ...] | None:
        for before, after in pairwise(values or ()):
            if after <= before:
                raise InputError(f"{after:g} V after {before:g} V: the voltages must ascend")
        return values


class StretchSection(Section):
    """The times at which a map states the stretch of its films."""

    at: NamedTimes = Field(
        description="Times since the voltage began to rise, within the horizon; they name the columns, such as "
        "relative_stretch_1 after 1 h."
    )

    @field_validator("at")
    @classmethod
    def _differ(cls, at: tuple[tuple[str, float], ...]) -> tuple[tuple[str, float], ...]:
        for number, (name, time) in enumerate(at):
            if (same := next((other for other, earlier in at[:number] if earlier == time), None)) is not None:
                raise InputError(f'"{name}" is as long as "{same}": state each time once')
        return at


class FailureMapRecipe(GridRecipe):
    """Time to failure over voltage, prestretch and temperature."""

    ELSEWHERE: ClassVar = dict.fromkeys(
        ("control", "source", "leakage"),
        "charges, sources with a resistance and leakage are for actuate, with a [sweep] over what varies",
    )

    kind: Literal["failure-map"] = Field(description="The subcommand that runs this recipe.")
    horizon: PositiveTime = Field(description="Time for which the voltage stays on; a film that lives longer survives.")
    film: GridFilm = Field(description="The films, and their prestretch before the voltage.")
    voltage: VoltageAxis = Field(description="The voltages, an axis of the grid.")
    stretch: StretchSection | None = Field(
        None, description="Times at which the stretch of the films is written and drawn: the operating map."
    )
    sensitivity: bool = Field(False, description=SENSITIVITY_TEXT)

    def _check(self) -> None:
        self.film.check_boundary(self.solver)
        if self.voltage.ramp > self.horizon:
            raise InputError(f"{self.voltage.ramp:g} s is longer than the horizon of {self.horizon:g} s", key="voltage.ramp")
        for name, time in () if self.stretch is None else self.stretch.at:
            if time > self.horizon:
                raise InputError(f'"{name}" is longer than the horizon of {self.horizon:g} s', key="stretch.at")
