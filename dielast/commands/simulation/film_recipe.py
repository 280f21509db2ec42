"""The film under voltage as recipes of one experiment and of a map state it."""

from __future__ import annotations

from sys import float_info
from typing import Annotated, Any

from pydantic import Field, PlainValidator, WithJsonSchema

from dielast.errors import InputError, shown
from dielast.recipe.fields import Length, Section, StrainRate, Time
from dielast.units import STRAIN, TIME, parse

BOUNDARIES = ("dead-load", "clamped")


def _boundary(value: Any) -> tuple[str, str]:
    """What holds axes 1 and 2."""
    pair = value if isinstance(value, list) else [value, value]
    if len(pair) != 2 or any(entry not in BOUNDARIES for entry in pair):
        raise InputError(f'{shown(value)}: "dead-load" or "clamped" is needed, or a pair of them, one a direction')
    return pair[0], pair[1]


def prestretch_of(value: Any) -> tuple[float, float]:
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


ONE_PRESTRETCH = {"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}]}
_ONE_BOUNDARY = {"enum": list(BOUNDARIES)}
Boundary = Annotated[
    tuple[str, str],
    PlainValidator(_boundary),
    WithJsonSchema({"anyOf": [_ONE_BOUNDARY, {"type": "array", "items": _ONE_BOUNDARY, "minItems": 2, "maxItems": 2}]}),
]
Prestretch = Annotated[tuple[float, float], PlainValidator(prestretch_of), WithJsonSchema(ONE_PRESTRETCH)]


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


class PullInSection(Section):
    """The pull-in criterion: det H = 0 with branches weighted by how much of them outlasts the time scale."""

    timescale: TimeScale = Field(
        default_factory=lambda: (0.01, True),
        description="How long a disturbance is watched: a share of the time since the size of the voltage last began to rise, "
        "after a hold or a fall; or a time; 0 s is det H = 0 to the letter.",
        json_schema_extra={"default": "1 %"},
    )


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

    @property
    def prestretches(self) -> tuple[tuple[float, float], ...]:
        """The prestretch of axes 1 and 2 of each film."""
        raise NotImplementedError
