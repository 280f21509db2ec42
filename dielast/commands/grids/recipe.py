"""Recipes of `failure-map` and `design`, whose films are a grid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema, field_validator

from dielast.base.errors import InputError
from dielast.base.units import LENGTH, STRAIN
from dielast.commands.simulation.film_recipe import (
    ONE_PRESTRETCH,
    SHARE_TEXT,
    FilmBase,
    FilmSolver,
    PullInSection,
    Shares,
    prestretch_of,
)
from dielast.commands.simulation.recipe import MaterialRecipe
from dielast.commands.simulation.uncertainty_recipe import SENSITIVITY_TEXT, FilmUncertainty
from dielast.handover.law_section import BreakdownField, breakdown
from dielast.material.intervals import fewest_draws
from dielast.recipe.fields import NamedTimes, Numbers, PositiveTime, Section, Temperatures, Time, Voltage, Voltages, WithUnit
from dielast.simulate.options import Failure, Solver

if TYPE_CHECKING:
    from dielast.material.scatter import Sample
    from dielast.simulate.film_setup import Film

Value = TypeVar("Value")


def _prestretches(value: Any) -> tuple[tuple[float, float], ...]:
    """The prestretches of a grid; a list is its axis."""
    entries = value if isinstance(value, list) else [value]
    if not entries:
        raise InputError("a list of prestretches is needed, such as [1.7, 1.9]")
    return tuple(prestretch_of(entry) for entry in entries)


def _spelled(pair: tuple[float, float]) -> str:
    return f"{pair[0]:.9g}" if pair[0] == pair[1] else f"{pair[0]:.9g} x {pair[1]:.9g}"


def distinct(spelled: Callable[[Value], str]) -> AfterValidator:
    """The axis of a grid, whose values differ in the digits that tables show, in which they are `spelled`."""

    def check(values: tuple[Value, ...]) -> tuple[Value, ...]:
        texts = set[str]()
        for text in map(spelled, values):
            if text in texts:
                raise InputError(f"{text} is stated twice: the values of a list must differ")
            texts.add(text)
        return values

    return AfterValidator(check)


Prestretches = Annotated[
    tuple[tuple[float, float], ...],
    PlainValidator(_prestretches),
    distinct(_spelled),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "array", "items": ONE_PRESTRETCH, "minItems": 1}]}),
]
GridTemperatures = Annotated[Temperatures, distinct("{:.9g} degC".format)]
GridShares = Annotated[Shares, distinct("{:.9g}".format)]
Thicknesses = Annotated[tuple[float, ...], WithUnit(LENGTH, above=0.0, many=True), distinct("{:.9g} m".format)]
Stretches = Annotated[tuple[float, ...], Numbers(above=1.0), distinct("{:.9g}".format)]
Strains = Annotated[tuple[float, ...], WithUnit(STRAIN, above=0.0, many=True), distinct("{:.9g}".format)]


class GridFilm(FilmBase):
    """The films of a grid."""

    prestretch: Prestretches = Field(description="Equibiaxial prestretches, or pairs; a list is an axis of the grid.")
    electrode_share: GridShares | None = Field(None, description=SHARE_TEXT + " A list is an axis of the grid.")

    @property
    def sizes(self) -> tuple[int, int, int]:
        """The numbers of thicknesses, prestretches and electrode shares."""
        return len(self.thicknesses), len(self.prestretch), len(self.shares or (1,))

    def at(self, temperatures: Sequence[float]) -> Film:
        """The films at temperatures in degC."""
        shares = None if self.shares is None else np.array(self.shares)
        sizes = {"thickness": np.array(self.thickness), "prestretch": np.array(self.prestretch), "electrode_share": shares}
        return self.setup(**sizes, temperature=np.array(temperatures))


class GridSolver(FilmSolver):
    """How exactly the equations of a grid of films are solved."""

    rtol: float = Field(
        1e-6,
        ge=1e-12,
        le=1e-2,
        description="Relative tolerance of each time step. Default: 1e-6; for draws of [uncertainty] 5e-4, which leaves an error "
        "of 0.1 % in their times: state rtol where the bounds are closer together than that.",
    )


class GridRecipe(MaterialRecipe):
    """The keys of failure-map and design."""

    temperature: GridTemperatures | None = Field(
        None, description="Temperatures of the films; a list is an axis of the grid. Default: the material's reference temperature."
    )
    breakdown: BreakdownField | None = Field(None, description="Law of the breakdown field. Default: that of the material.")
    pull_in: PullInSection = Field(default_factory=PullInSection, description="The pull-in criterion.")
    solver: GridSolver = Field(GridSolver(), description="How exactly the equations are solved.")
    uncertainty: FilmUncertainty | None = Field(
        None, description="Intervals of all results, from draws of the material and of films."
    )

    def solving(self, sample: Sample | None) -> dict[str, Any]:
        """The arguments by which the films of the grid and those of a `sample` are solved."""
        # without [uncertainty] a sample is one of slight changes, which needs the full accuracy
        stated = "rtol" in self.solver.model_fields_set or self.uncertainty is None
        return {
            "failure": Failure(breakdown(self.breakdown), self.pull_in.criterion),
            "solver": Solver(self.solver.rtol, self.solver.mesh_rtol, self.solver.rtol if stated else None),
            "sample": sample,
        }


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


class DesignFilm(GridFilm):
    """The films of a design."""

    thickness: Thicknesses = Field(description="Undeformed thickness; a list is an axis of the grid.")  # type: ignore[assignment]


class GoalSection(Section):
    """The goal of each film: a relative stretch, or an area strain."""

    relative_stretch: Stretches | None = Field(
        None, description="Stretch of axis 1 over its prestretch; a list is an axis of the grid."
    )
    area_strain: Strains | None = Field(
        None,
        description="Area strain of the active part against its prestretched area, instead of relative_stretch; a list is an axis "
        "of the grid.",
    )
    at: PositiveTime = Field(description="Time after which the goal is reached under a constant voltage.")
    horizon: PositiveTime = Field(description="Time for which the voltage stays on; a film that lives longer survives.")
    failure_probability: float | None = Field(
        None,
        gt=0,
        lt=0.5,
        description="With [uncertainty]: designs are ranked by the life that this share of their films does not reach. Default: "
        "0.05.",
    )

    def _check(self) -> None:
        if self.relative_stretch is not None and self.area_strain is not None:
            raise InputError("relative_stretch and area_strain are two goals: state one of them")
        if self.relative_stretch is None and self.area_strain is None:
            raise InputError('a goal is needed: relative_stretch, such as 1.1, or area_strain, such as "20 %"')
        if self.at > self.horizon:
            raise InputError(f"{self.at:g} s is longer than the horizon of {self.horizon:g} s", key="at")


class DesignRecipe(GridRecipe):
    """Which film and which voltage reach a goal, and how long that lasts."""

    ELSEWHERE: ClassVar = {
        "voltage": "design finds the voltage; failure-map has an axis of voltages",
        "horizon": "belongs to the goal: write goal.horizon",
    }

    kind: Literal["design"] = Field(description="The subcommand that runs this recipe.")
    film: DesignFilm = Field(
        description="The films, one for every combination of the lists, and their prestretch before the voltage."
    )
    goal: GoalSection = Field(description="The goal of each film.")

    def _check(self) -> None:
        self.film.check_boundary(self.solver)
        if self.film.boundary == ("clamped", "clamped"):
            raise InputError("both axes are clamped: no voltage moves the film", key="film.boundary")
        if self.film.boundary[0] == "clamped" and self.goal.relative_stretch is not None:
            raise InputError("axis 1 is clamped: state goal.area_strain instead", key="goal.relative_stretch")
        share = self.goal.failure_probability
        if share is None:
            return
        if self.uncertainty is None:
            raise InputError("needs [uncertainty], which states what scatters", key="goal.failure_probability")
        if self.uncertainty.draws < (fewest := fewest_draws(1 - 2 * share)):
            text = f"{self.uncertainty.draws} draws are too few for this probability: at least {fewest} are needed"
            raise InputError(text, key="goal.failure_probability")
