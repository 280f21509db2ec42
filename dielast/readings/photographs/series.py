"""The stretches of an electrode in a series of photographs, and which photographs are doubtful."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.base.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.numerics.arrays import Floats
from dielast.readings.photographs.camera import Camera
from dielast.readings.photographs.ellipse import Ellipse
from dielast.readings.photographs.outline import WELL_SEEN, Outline, find_outline

OK, DOUBTFUL, LOST = "ok", "doubtful", "lost"
WRINKLES, BREAKDOWN = "wrinkles", "breakdown"
RISE = 3.0  # times the roughness of the reference: a ratio of variances of 9 has a probability of 1e-7 by chance
LEAST_ROUGHNESS = 0.003  # of the radius: less is not visible
ALONE = 4.0  # times the difference between the neighbours of a photograph
FAR = 10.0  # standard errors of a stretch off the line between its neighbours
JUMP = 0.012  # of a stretch: what is nearer to its neighbours is no other object
HOLES = 0.02  # of the electrode's area that becomes as light as the film and stays so
LIGHTER = 0.2  # by which the electrode's grey value over the film's changes and stays so


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Stretches(TabularResult):
    """The stretches of the electrode in n photographs, called `file`, at `time` (n,) in s.

    `stretch` and `stderr` (n, 2) are along the axes 1 and 2 of the film, over the reference; NaN where the electrode is lost.
    `doubts` say why a photograph is doubtful or lost, by its number. `events` are what happens to the electrode: the kind
    (wrinkles, breakdown) and the number of the first photograph that shows it.
    """

    file: tuple[str, ...]
    time: Floats
    outlines: tuple[Outline, ...]
    stretch: Floats
    stderr: Floats
    area_strain: Floats
    doubts: dict[int, str]
    events: dict[str, int]

    @property
    def state(self) -> tuple[str, ...]:
        """ok, doubtful or lost, of each photograph."""
        return tuple(
            LOST if outline.flat is None else DOUBTFUL if number in self.doubts else OK
            for number, outline in enumerate(self.outlines)
        )

    def columns(self) -> Table:
        """The table of the stretches, as `electrode.csv` has it."""
        rows = np.full((5, len(self.file)), np.nan)
        for number, outline in enumerate(self.outlines):
            if outline.flat is not None and outline.ellipse is not None:
                minor, major = 2 * outline.flat.semi_axes
                rows[:, number] = (*outline.ellipse.centre, major, minor, outline.flat.angle)
        names = (("centre_x", "px"), ("centre_y", "px"), ("major_axis", "px"), ("minor_axis", "px"), ("angle", "deg"))
        stretches = [
            Column(f"relative_stretch_{axis + 1}{ending}", "1", values[:, axis])
            for axis in (0, 1)
            for ending, values in (("", self.stretch), ("_stderr", self.stderr))
        ]
        return [
            Column("file", None, self.file),
            Column("time", "s", self.time),
            *(Column(name, unit, row) for (name, unit), row in zip(names, rows, strict=True)),
            *stretches,
            Column("area_strain", "1", self.area_strain),
            Column("state", None, self.state),
        ]

    def __repr__(self) -> str:
        counts = ", ".join(f"{self.state.count(name)} {name}" for name in (OK, DOUBTFUL, LOST))
        return f"Stretches({len(self.file)} photographs: {counts})"


def measure_electrode(
    pictures: Sequence[NDArray[np.float64]],
    time: ArrayLike,
    *,
    reference: int | NDArray[np.float64] = 0,
    diameter: float | None = None,
    dark: bool = True,
    axis_1: float = 0.0,
    region: tuple[int, int, int, int] | None = None,
    camera: Camera | None = None,
) -> Stretches:
    """The stretches of an electrode in `pictures`, arrays (height, width) of grey values, at `time` (n,) in s.

    The stretches are over those of the picture `reference`, a number (from 0) or another array, or over a circle with the
    `diameter` in pixels. `dark`: the electrode is darker than the film. `axis_1` is the direction of the film's first axis in the
    picture, in degrees, anticlockwise from the horizontal to the right. `region` is left, top, right, bottom in pixels. `camera`
    corrects its tilt and lens. Raises `InputError` if the reference shows no electrode.
    """
    outlines = [find_outline(picture, dark=dark, region=region, camera=camera) for picture in pictures]
    first: Outline | float
    if diameter is not None:
        first = diameter
    elif isinstance(reference, int):
        if not 0 <= reference < len(outlines):
            raise InputError(f"the pictures have numbers from 0 to {len(outlines) - 1}", argument="reference")
        first = outlines[reference]
    else:
        first = find_outline(reference, dark=dark, region=region, camera=camera)
    names = tuple(f"picture {number}" for number in range(len(outlines)))
    return stretches(names, np.asarray(time, dtype=float), outlines, first, axis_1=axis_1, camera=camera)


def stretches(
    file: Sequence[str],
    time: Floats,
    outlines: Sequence[Outline],
    reference: Outline | float,
    *,
    axis_1: float = 0.0,
    camera: Camera | None = None,
) -> Stretches:
    """The stretches of the `outlines` over the `reference`, an outline or a diameter in pixels, as `measure_electrode` has them.

    An electrode whose rim is the image of the unit circle under A0 at first and under F A0 later has the shapes B0 = A0 A0^T and
    B = F B0 F^T. For a film that is stretched along its axes F is diagonal there, and the stretch along the axis a is
    sqrt(a.B a / a.B0 a): half the width of the outline along a over that of the reference, whatever the shape of the reference and
    whichever way its own axes point. Raises `InputError` for times that do not ascend, or a reference without an electrode.
    """
    if time.shape != (len(outlines),) or not np.isfinite(time).all() or np.any(np.diff(time) <= 0):
        raise InputError("a time for each picture is needed, ascending", argument="time")
    if isinstance(reference, Outline):
        if reference.flat is None or reference.ellipse is None:
            raise InputError(reference.reason, argument="reference")
        first, at = reference.flat, reference.ellipse.centre
    else:
        first = Ellipse(np.zeros(2), 0.5 * reference * np.eye(2))
        at = next((outline.ellipse.centre for outline in outlines if outline.ellipse is not None), np.zeros(2))
    angles = np.deg2rad([axis_1, axis_1 + 90.0])
    axes = np.stack([np.cos(angles), -np.sin(angles)], axis=1)  # rows count downwards
    if camera is not None:
        axes = np.stack([camera.turned(axis, at) for axis in axes])
    values, errors = np.full((2, len(outlines), 2), np.nan)
    strains = np.full(len(outlines), np.nan)
    for number, outline in enumerate(outlines):
        if outline.flat is None:
            continue
        strains[number] = np.linalg.det(outline.flat.shape) / np.linalg.det(first.shape) - 1
        for index, axis in enumerate(axes):
            (width, of_width), (width_0, of_width_0) = outline.flat.extent(axis), first.extent(axis)
            values[number, index] = width / width_0
            # the reference over itself is 1 by definition
            same = outline is reference
            errors[number, index] = 0.0 if same else width / width_0 * np.hypot(of_width / width, of_width_0 / width_0)
    events = _events(outlines, reference)
    doubts = _doubts(outlines, values, errors, events)
    return Stretches(tuple(file), time, tuple(outlines), values, errors, strains, doubts, events)


def _events(outlines: Sequence[Outline], reference: Outline | float) -> dict[str, int]:
    """The numbers of the first photographs with wrinkles, and after the breakdown."""
    there = [number for number, outline in enumerate(outlines) if outline.flat is not None]
    if not there:
        return {}
    smooth = reference if isinstance(reference, Outline) else outlines[there[0]]
    events = {}
    rough = [n for n in there if outlines[n].roughness > max(RISE * smooth.roughness, LEAST_ROUGHNESS)]
    if rough:
        events[WRINKLES] = rough[0]
    for before, after in pairwise(there):
        # a flash or a hand passes, a breakdown stays
        later = [outlines[n] for n in there if n >= after]
        holes = min(outline.holes for outline in later) - outlines[before].holes
        level = min(abs(outline.level - outlines[before].level) for outline in later)
        if holes > HOLES or level > LIGHTER:
            events[BREAKDOWN] = after
            break
    else:
        if there[-1] < len(outlines) - 1:
            events[BREAKDOWN] = there[-1] + 1
    return events


def _doubts(outlines: Sequence[Outline], values: Floats, errors: Floats, events: dict[str, int]) -> dict[int, str]:
    """Why photographs are doubtful or lost, by their numbers."""
    doubts = {}
    there = [number for number, outline in enumerate(outlines) if outline.flat is not None]
    smooth = events.get(WRINKLES)
    for number, outline in enumerate(outlines):
        if outline.flat is None:
            doubts[number] = outline.reason
        elif not outline.inside:
            doubts[number] = "the electrode reaches beyond the picture"
        elif outline.seen < WELL_SEEN:
            doubts[number] = f"only {outline.seen:.0%} of the electrode's edge is seen"
        elif smooth is not None and number >= smooth and outline.roughness > LEAST_ROUGHNESS:
            doubts[number] = f"the edge is wrinkled by {outline.roughness:.1%} of the radius"
        elif number >= events.get(BREAKDOWN, len(outlines)):
            doubts[number] = "the electrode has changed: breakdown"
    for before, number, after in zip(there, there[1:], there[2:], strict=False):
        course = np.log(values[[before, number, after]])
        off = np.abs(course[1] - 0.5 * (course[0] + course[2]))
        between = np.abs(course[2] - course[0])
        if np.any((off > ALONE * between) & (off > FAR * errors[number]) & (off > JUMP)):
            doubts.setdefault(number, "the stretches differ from those before and after")
    for before, number in pairwise(there):
        was, now = outlines[before].ellipse, outlines[number].ellipse
        if was is not None and now is not None and np.hypot(*(now.centre - was.centre)) > was.semi_axes[1]:
            doubts.setdefault(number, "the electrode is elsewhere than before")
    return dict(sorted(doubts.items()))
