"""Recipes of `measure`."""

import math
import re
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, PlainValidator, WithJsonSchema

from dielast.base.errors import InputError, shown
from dielast.recipe.base import RecipeBase
from dielast.recipe.fields import Length, Pair, PositiveTime, Section, Time
from dielast.recipe.file_fields import InputFile, PhotographFiles

_ANGLE = re.compile(r"\s*([+-]?\d+(?:\.\d*)?|[+-]?\.\d+)\s*(deg|°|rad)\s*")


def _angle(value: Any) -> float:
    """The degrees of an angle."""
    match = _ANGLE.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        raise InputError(f'{shown(value)}: an angle with its unit is needed, such as "30 deg"')
    return math.degrees(float(match[1])) if match[2] == "rad" else float(match[1])


Angle = Annotated[
    float,
    PlainValidator(_angle),
    WithJsonSchema({"type": "string", "description": 'An angle with its unit, such as "30 deg".', "examples": ["30 deg"]}),
]
Pixel = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Point = Pair[Pixel]


class ElectrodeSection(Section):
    """The electrode, and what its stretches are over: a photograph, or a diameter and the scale of the photographs."""

    dark: bool = Field(True, description="Whether the electrode is darker than the film around it; false: lighter.")
    reference: InputFile | None = Field(None, description="Photograph with stretch 1. Default: the first photograph.")
    diameter: Length | None = Field(
        None, description="Diameter of the electrode at stretch 1, instead of a reference; needs scale, mark or camera.length."
    )
    scale: Length | None = Field(None, description="Length of a pixel in the plane of the film.")
    mark: Pair[Point] | None = Field(
        None, description="Two points [x, y] in pixels at a distance of mark_length in the plane of the film, instead of scale."
    )
    mark_length: Length | None = Field(None, description="Distance of the two points of mark.")
    axis_1: Angle = Field(
        0.0,
        validate_default=False,
        description="Direction of the film's axis 1 in the photograph, from the horizontal to the right, counted anticlockwise. "
        "Stretches are those of the outline's width along the film's axes.",
    )
    region: Annotated[list[int], Field(min_length=4, max_length=4)] | None = Field(
        None, description="Part of the photograph that is looked at: left, top, right, bottom in pixels."
    )
    colour: Literal["auto", "mean", "red", "green", "blue"] = Field(
        "auto", description="Colour whose brightness is measured. auto: the one in which electrode and film differ most at first."
    )

    def _check(self) -> None:
        if self.reference is not None and self.diameter is not None:
            raise InputError("reference and diameter both say what has stretch 1: state one of them")
        if (self.mark is None) != (self.mark_length is None):
            raise InputError("mark and mark_length belong together: two points, and their distance")
        if self.mark is not None and (self.scale is not None or self.mark[0] == self.mark[1]):
            raise InputError("two different points are needed, without scale", key="mark")
        if self.diameter is None and (self.scale is not None or self.mark is not None):
            raise InputError("a scale acts only with diameter: state it, or leave the scale out")
        if self.region is not None and not (0 <= self.region[0] < self.region[2] and 0 <= self.region[1] < self.region[3]):
            raise InputError("left, top, right, bottom are needed, left < right and top < bottom", key="region")


class CameraSection(Section):
    """The camera: its tilt, and its lens, from a mark of known shape in the plane of the film."""

    square: Annotated[list[Point], Field(min_length=4, max_length=400)] | None = Field(
        None,
        description="Corners [x, y] in pixels of a square mark, in order around it: corrects the tilt. Further points lie anywhere "
        "on its sides, and correct the lens.",
    )
    circle: Annotated[list[Point], Field(min_length=8, max_length=400)] | None = Field(
        None, description="Points [x, y] in pixels around a circular mark, instead of square, for a camera that is far away."
    )
    length: Length | None = Field(None, description="Side of the square or diameter of the circle: the scale of the photographs.")

    def _check(self) -> None:
        if (self.square is None) == (self.circle is None):
            raise InputError("either square or circle is needed")


class MeasureRecipe(RecipeBase):
    """Photographs of an electrode -> stretches over time."""

    ELSEWHERE: ClassVar = {"reference": "belongs to the electrode: write electrode.reference"}

    kind: Literal["measure"] = Field(description="The subcommand that runs this recipe.")
    files: PhotographFiles = Field(
        description="Photographs (PNG, JPEG, TIFF, GIF; also stacks) in the order of their times: a folder, a glob pattern, whose "
        "files are sorted by name and number, or a list."
    )
    interval: PositiveTime | None = Field(None, description="Time from one photograph to the next.")
    times: str | None = Field(
        None,
        description='Times instead of an interval: a table with the columns "file" and "time [s]"; "exif"; or a pattern of file '
        'names with {ms}, {s}, {min} or {h} in place of the number, such as "photo-{s}s.png".',
    )
    start: Time = Field(0.0, validate_default=False, description="Time of the first photograph; not with a table or a pattern.")
    electrode: ElectrodeSection = Field(ElectrodeSection(), description="The electrode.")
    camera: CameraSection | None = Field(None, description="Marks that correct tilt and lens. Default: no correction.")

    def _check(self) -> None:
        if self.interval is None and self.times is None:
            raise InputError('times are needed: either interval, such as "8 s", or times')
        if self.interval is not None and self.times is not None:
            raise InputError("interval and times are both stated: leave one out", key="interval")
        stated = self.times not in (None, "exif")
        if stated and "start" in self.model_fields_set:
            raise InputError("times states when the first photograph was taken: leave start out", key="start")
        electrode, length = self.electrode, None if self.camera is None else self.camera.length
        scales = sum(value is not None for value in (electrode.scale, electrode.mark, length))
        if electrode.diameter is not None and scales != 1:
            raise InputError("one of scale, mark and camera.length is needed with it", key="electrode.diameter")
