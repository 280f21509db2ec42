"""Sections of `actuate` beside its steps: springs at the edges of the film, cycles of steps, and the map of its states."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from pydantic import Field

from dielast.base.errors import InputError
from dielast.base.units import STIFFNESS, STRESS
from dielast.commands.simulation.film_recipe import FilmBase
from dielast.commands.simulation.step_recipe import AnyOf, HistoryStep
from dielast.recipe.fields import Length, Section

Stiffness = Annotated[tuple[float, str], AnyOf((STIFFNESS, STRESS), "a stiffness")]


class SpringSection(Section):
    """A spring between the edges of the film and a wall. The film's nominal stress when the programme begins is that of the dead
    load; from then on it falls as the film stretches. A stress or a force in a step is that of the spring at the stretch at which
    the programme began.
    """

    stiffness: Stiffness = Field(
        description="Force over displacement, which needs length and film.width; or nominal stress over the change of stretch."
    )
    length: Length | None = Field(None, description="Undeformed length of the film between its edges along the axis of the spring.")
    axis: Literal[1, 2] | None = Field(None, description="Axis along which it acts. Default: both.")

    def check_film(self, film: FilmBase) -> None:
        """`InputError` for a spring that cannot hold this film."""
        if self.stiffness[1] == STRESS.unit and self.length is not None:
            raise InputError("has no effect beside a stiffness in Pa: leave it out", key="film.spring.length")
        if self.stiffness[1] != STRESS.unit and self.length is None:
            instead = f"{STIFFNESS.unit} needs the length of the film between its edges, or state a stiffness in Pa"
            raise InputError(instead, key="film.spring.length")
        if self.stiffness[1] != STRESS.unit and film.width is None:
            raise InputError(f"a spring in {STIFFNESS.unit} needs the width of the film", key="film.width")
        if self.stiffness[0] <= 0:
            raise InputError(f"{self.stiffness[0]:g}: it must be positive", key="film.spring.stiffness")
        if film.shares is not None:
            raise InputError(f'boundary = "{film.boundary[0]}" holds the film: leave it out', key="film.spring")
        for axis in self.axes:
            if film.boundary[axis] != "dead-load":
                raise InputError(f'a spring along axis {axis + 1} is for boundary "dead-load" alone', key="film.spring")

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes, from 0, along which it acts."""
        return (0, 1) if self.axis is None else (self.axis - 1,)

    def in_pascal(self, thickness: float, widths: Sequence[float]) -> tuple[float | None, float | None]:
        """The stiffness in Pa along both axes, of a film of this undeformed thickness and widths in m."""
        found: list[float | None] = [None, None]
        for axis in self.axes:
            stiffness, unit = self.stiffness
            if unit != STRESS.unit and self.length is not None:
                stiffness *= self.length / (thickness * width_along(widths, axis))
            found[axis] = stiffness
        return found[0], found[1]


def width_along(widths: Sequence[float], axis: int) -> float:
    """The undeformed width in m across an axis; the only one, if one is stated."""
    return widths[min(axis, len(widths) - 1)]


class Repetition(Section):
    """Steps that run again and again; cycles.csv has a row for each time."""

    times: int = Field(ge=1, le=1_000_000, description="How many times the cycle runs.")
    steps: Annotated[list[int], Field(min_length=2, max_length=2)] | None = Field(
        None, description="First and last step of the cycle, counted from 0. Default: all steps."
    )

    def mistakes(self, steps: Sequence[HistoryStep]) -> Iterator[tuple[str, str]]:
        """The keys that do not suit the steps, and what is wrong with them."""
        if self.steps is not None and not 0 <= self.steps[0] <= self.steps[1] < len(steps):
            yield "steps", f"{self.steps}: two numbers in order are needed, from 0 to {len(steps) - 1}"
        if any(step.waveform is not None for step in steps):
            yield "times", "a waveform has cycles of its own: state its cycles, or leave repeat out"


class LimitsSection(Section):
    """limits.csv and limits.png: the voltages over stretch at which the relaxed film breaks down, pulls in or loses tension, with
    the cycle of the programme.
    """

    stretch: Annotated[list[float], Field(min_length=2, max_length=2)] = Field(
        description="Smallest and largest stretch of axis 1 that are shown."
    )
    points: int = Field(200, ge=2, le=100_000, description="Number of stretches.")
    rupture_stretch: float | None = Field(None, gt=1, description="Stretch at which the film tears. Default: unknown.")

    def _check(self) -> None:
        if not 1 <= self.stretch[0] < self.stretch[1] < float("inf"):
            raise InputError(f"{self.stretch}: two stretches in order, of at least 1, are needed", key="stretch")
