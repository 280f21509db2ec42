"""Steps of `actuate` that move the edges of the film or open its circuit, the springs at its edges, and cycles of steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from math import isfinite, radians
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from pydantic import Field, PlainValidator, WithJsonSchema

from dielast.commands.simulation.step_recipe import AnyOf
from dielast.errors import InputError, shown
from dielast.recipe.fields import Length, Section
from dielast.units import FORCE, NUMBER, STIFFNESS, STRESS, Dimension, parse

if TYPE_CHECKING:
    from dielast.commands.actuate.recipe import FilmSection, SourceStep

ELECTRODES = ("voltage", "charge", "circuit")
EDGES = ("stretch", "stress", "force")


class Ends(NamedTuple):
    """What the edges go to, one value or one for each axis; or, of a waveform, the `low` and `high` values."""

    low: tuple[float, ...] | None
    high: tuple[float, ...]


def _ends_of(dimension: Dimension) -> Callable[[Any], Ends]:
    """Reads what the edges go to as a quantity of this dimension; a stretch is a number."""

    def one(value: Any) -> float:
        if dimension is not NUMBER:
            if (number := parse(value, dimension)) < 0:
                raise InputError(f"{shown(value)}: a film bears no compression; at least 0 is needed")
            return number
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < float("inf"):
            raise InputError(f"{shown(value)}: a stretch above 0 is needed (1 is undeformed), or a pair such as [3.0, 1.5]")
        return float(value)

    def pair(value: Any) -> tuple[float, ...]:
        if not isinstance(value, list):
            return (one(value),)
        if len(value) != 2:
            raise InputError(f"{shown(value)}: one value, or a pair, one for each axis, is needed")
        return one(value[0]), one(value[1])

    def read(value: Any) -> Ends:
        if not isinstance(value, dict):
            return Ends(None, pair(value))
        if set(value) != {"low", "high"}:
            raise InputError(f"{shown(value)}: {{ low = ..., high = ... }} is needed for a waveform")
        low, high = pair(value["low"]), pair(value["high"])
        if len(low) != len(high):
            raise InputError(f"{shown(value)}: low and high need one value each, or both a pair")
        return Ends(low, high)

    return read


def _schema(one: dict[str, Any]) -> WithJsonSchema:
    either = {"anyOf": [one, {"type": "array", "items": one, "minItems": 2, "maxItems": 2}]}
    waveform = {"type": "object", "required": ["low", "high"]}
    return WithJsonSchema({"anyOf": [*either["anyOf"], waveform]})


def _phase(value: Any) -> float:
    """An angle in rad."""
    for unit, factor in (("deg", radians(1)), ("\N{DEGREE SIGN}", radians(1)), ("rad", 1.0)):
        if isinstance(value, str) and value.strip().endswith(unit):
            with suppress(ValueError):
                if isfinite(number := float(value.strip().removesuffix(unit))):
                    return number * factor
    raise InputError(f'{shown(value)}: an angle is needed, such as "90 deg"')


_TEXT = {"type": "string"}
Stretch = Annotated[Ends, PlainValidator(_ends_of(NUMBER)), _schema({"type": "number", "exclusiveMinimum": 0})]
Stress = Annotated[Ends, PlainValidator(_ends_of(STRESS)), _schema(_TEXT | {"examples": [STRESS.example]})]
Force = Annotated[Ends, PlainValidator(_ends_of(FORCE)), _schema(_TEXT | {"examples": [FORCE.example]})]
Phase = Annotated[float, PlainValidator(_phase), WithJsonSchema(_TEXT | {"examples": ["90 deg"]})]
Stiffness = Annotated[tuple[float, str], AnyOf((STIFFNESS, STRESS), "a stiffness")]


def check_programme(step: SourceStep) -> None:
    """`InputError` unless the keys of a step that moves the edges, or states the circuit, go together."""
    edges, electrodes = ([key for key in keys if getattr(step, key) is not None] for keys in (EDGES, ELECTRODES))
    if len(edges) > 1:
        raise InputError(f"{edges[0]} and {edges[1]} both say what holds the edges: one of them is needed")
    if step.circuit is not None and len(electrodes) > 1:
        if step.circuit == "open":
            raise InputError(f"an open circuit keeps its charge: leave out {electrodes[0]}, or circuit", key=electrodes[0])
        instead = "a closed circuit has the voltage of its source" if step.charge is not None else "a stated voltage closes it"
        raise InputError(f"{instead}: leave out {electrodes[0]}, or circuit", key=electrodes[0])
    if len(electrodes) > 1:
        raise InputError("voltage and charge do not go together: one of them is needed")
    if step.hold is not None:
        raise InputError(
            f"does not go with {(edges or electrodes)[0]}: state duration, the time in which the step reaches it", key="hold"
        )
    if step.waveform is not None:
        for key in ("rate", "duration", "voltage", "charge"):
            if getattr(step, key) is not None:
                instead = ": low and high state those of the waveform" if key in ELECTRODES else ""
                raise InputError(f"{key} does not go with waveform{instead}")
        if step.circuit is not None and step.high is not None:
            raise InputError("a waveform of the voltage or charge is stated: leave circuit out", key="circuit")
        return
    if step.phase is not None:
        raise InputError("goes with waveforms of edges and electrodes", key="phase")
    if step.rate is not None and step.duration is not None:
        raise InputError("rate and duration do not go together")
    if step.rate is not None and step.stretch is None and step.circuit is None:
        raise InputError("the rate of a stress or a force is not known beforehand: state duration", key="rate")
    if step.rate is not None and step.circuit is not None and not edges:
        raise InputError("does not go with circuit alone: state duration", key="rate")


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

    def check_film(self, film: FilmSection) -> None:
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

    def mistakes(self, steps: Sequence[SourceStep]) -> Iterator[tuple[str, str]]:
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
