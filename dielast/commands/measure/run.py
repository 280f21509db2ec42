"""`measure`: photographs of an electrode -> stretches over time."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dielast.base import units
from dielast.base.errors import InputError, Problem, located, warn
from dielast.commands.measure.photographs import Photograph, PhotographPlan, measure_all
from dielast.commands.measure.recipe import MeasureRecipe
from dielast.io.files import Inputs, resolve
from dielast.io.text_table import read_measured
from dielast.numerics.arrays import Floats
from dielast.readings.photographs.camera import Camera
from dielast.readings.photographs.decode import CHANNELS, MEAN, count_pictures, read_picture
from dielast.readings.photographs.find import reduced, separability
from dielast.readings.photographs.outline import Outline, find_outline
from dielast.readings.photographs.series import BREAKDOWN, DOUBTFUL, LOST, OK, WRINKLES, Stretches, stretches
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution
from dielast.sharing.study import Study

STACKS = (".gif", ".tif", ".tiff")
MOST_LINES = 20  # of an error
_NUMBER = r"([+-]?\d+(?:\.\d+)?)"
_FACTORS = {"{ms}": 1e-3, "{s}": 1.0, "{min}": 60.0, "{h}": 3600.0}


class PreparedPhotographs:
    """The photographs of a recipe, as far as they are known before they are measured."""

    def __init__(self, recipe: MeasureRecipe, inputs: Inputs) -> None:
        """Reads the reference and the times; raises `InputError`."""
        self.electrode = electrode = recipe.electrode
        self.pictures, self.names = _pictures(recipe, inputs)
        self.time = _times(recipe, self.pictures, inputs)
        region = None
        if electrode.region is not None:
            left, top, right, bottom = electrode.region
            region = left, top, right, bottom
        name = electrode.reference or recipe.files[0]
        try:
            content = inputs.read(name)
            size = read_picture(content, name).shape[::-1]
        except InputError:
            if electrode.diameter is None:
                raise
            content, size = b"", None  # a damaged photograph in a series that needs no reference
        with located(key="camera"):
            self.camera = _camera(recipe, size)
        colour: str = electrode.colour
        if colour == "auto":
            colour = _colour(content, name, region) if content else MEAN
        dated = recipe.times == "exif"
        self.plan = PhotographPlan(inputs.folder, self.pictures, electrode.dark, region, self.camera, colour, dated)
        self.reference: Outline | float
        if electrode.diameter is not None:
            self.reference = electrode.diameter / _scale(recipe, self.camera)
        else:
            grey = read_picture(content, name, 0, colour)
            self.reference = find_outline(grey, dark=electrode.dark, region=region, camera=self.camera)
            if self.reference.flat is None:
                key = "electrode.reference" if electrode.reference else None
                raise InputError(Problem(f"the reference: {self.reference.reason}", file=name, key=key))


def _pictures(recipe: MeasureRecipe, inputs: Inputs) -> tuple[tuple[tuple[str, int], ...], tuple[str, ...]]:
    """File and number of each picture, and the name of each: that of the file, and in a stack the number (from 0)."""
    pictures, names = [], []
    for name in recipe.files:
        count = 1
        if name.lower().endswith(STACKS):
            try:
                count = count_pictures(inputs.read(name), name)
            except InputError:
                if len(recipe.files) == 1:
                    raise
        pictures += [(name, number) for number in range(count)]
        names += [name if count == 1 else f"{name}#{number}" for number in range(count)]
    return tuple(pictures), tuple(names)


def _times(recipe: MeasureRecipe, pictures: Sequence[tuple[str, int]], inputs: Inputs) -> Floats | None:
    """The time of each picture in s; None for those of EXIF, which stand in the photographs."""
    if recipe.interval is not None:
        return recipe.start + recipe.interval * np.arange(len(pictures), dtype=float)
    stated = recipe.times or ""
    if stated == "exif":
        return None
    with located(key="times"):
        marks = [mark for mark in _FACTORS if mark in stated]
        time = _of_names(stated, marks, pictures) if marks else _of_table(stated, pictures, inputs)
        _check_order(time, pictures)
    return time


def _of_names(pattern: str, marks: Sequence[str], pictures: Sequence[tuple[str, int]]) -> Floats:
    """The times that the names of the files state."""
    expression, names = re.escape(pattern), [name for name, _ in pictures]
    if len(marks) > 1 or pattern.count(marks[0]) > 1:
        raise InputError(f'"{pattern}": one of {", ".join(_FACTORS)} is needed, once')
    expression = expression.replace(re.escape(marks[0]), _NUMBER)
    matches = [re.fullmatch(expression, Path(name).name) for name in names]
    for name, match in zip(names, matches, strict=True):
        if match is None:
            raise InputError(f'the name does not fit times = "{pattern}"', file=name)
    return np.array([float(match[1]) * _FACTORS[marks[0]] for match in matches if match is not None])


def _of_table(name: str, pictures: Sequence[tuple[str, int]], inputs: Inputs) -> Floats:
    """The times of a table with the columns file and time, by the names of the files; a stack has a row for each picture."""
    table = read_measured(inputs.read(name), name)
    time = table.column("time", "times", units.TIME)
    listed: dict[str, list[float]] = {}
    for cell, value in zip(table.cells[table.find("file", "times")], time.tolist(), strict=True):
        listed.setdefault(Path(cell.strip()).name, []).append(value)
    times = []
    for file in dict.fromkeys(file for file, _ in pictures):
        count, rows = sum(other == file for other, _ in pictures), listed.get(Path(file).name, [])
        if len(rows) != count:
            raise InputError(f"has {len(rows)} rows for {file}, which has {count} pictures", file=name)
        times += rows
    return np.array(times)


def _check_order(time: Floats, pictures: Sequence[tuple[str, int]]) -> None:
    for number in np.flatnonzero(np.diff(time) <= 0)[:1] + 1:
        before = f"{time[number]:g} s is not after the {time[number - 1]:g} s of {pictures[number - 1][0]}"
        raise InputError(f"{before}: list the files in the order of their times", file=pictures[number][0])


def _camera(recipe: MeasureRecipe, size: tuple[int, ...] | None) -> Camera | None:
    if recipe.camera is None:
        return None
    if recipe.camera.circle is not None:
        return Camera.of_circle(recipe.camera.circle)
    return Camera.of_square(recipe.camera.square or [], None if size is None else (size[0], size[1]))


def _scale(recipe: MeasureRecipe, camera: Camera | None) -> float:
    """The length of a pixel in m."""
    electrode = recipe.electrode
    if electrode.mark is not None and electrode.mark_length is not None:
        ends = np.array(electrode.mark, dtype=float)
        if camera is not None:
            ends = camera.flattened(ends)
        return electrode.mark_length / float(np.hypot(*(ends[1] - ends[0])))
    if recipe.camera is not None and recipe.camera.length is not None and camera is not None:
        return recipe.camera.length / camera.side
    return electrode.scale or 1.0


def _colour(content: bytes, name: str, region: tuple[int, ...] | None) -> str:
    """The colour whose grey values fall best into two classes."""

    def parted(colour: str) -> float:
        grey = read_picture(content, name, 0, colour)
        if region is not None:
            grey = grey[region[1] : region[3], region[0] : region[2]]
        return separability(reduced(grey)[0]) if grey.size else 0.0

    return max((MEAN, *CHANNELS), key=parted)


def run(cases: Sequence[Case[MeasureRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Measure every photograph, put them together, report."""
    recipe = cases[0].recipe
    ready = prepared(cases, inputs)
    photographs = measure_all(ready.plan, Study.of(cases, inputs, execution))
    for (name, _), photograph in zip(ready.pictures, photographs, strict=True):
        if photograph.digest:
            inputs.record(name, resolve(inputs.folder, name), photograph.digest)
    result = _together(recipe, ready, photographs)
    _warn(result)

    def figure() -> Any:
        from dielast.plots.measure import plot_stretches

        return plot_stretches(result, recipe.title)

    def sheet() -> Any:
        from dielast.plots.measure import plot_photographs

        return plot_photographs(result, [(entry.thumbnail, entry.factor) for entry in photographs], recipe.title)

    figures: dict[str, Callable[[], Any]] = {"photographs": sheet}
    return RunReport({"electrode.csv": result.columns()}, headline(result, ready), figure, figures=figures)


def prepared(cases: Sequence[Case[MeasureRecipe]], inputs: Inputs) -> PreparedPhotographs:
    """The reference, and the times: a photograph of the series that cannot be read does not stop a run."""
    return PreparedPhotographs(cases[0].recipe, inputs)


def _together(recipe: MeasureRecipe, ready: PreparedPhotographs, photographs: Sequence[Photograph]) -> Stretches:
    """The stretches of all photographs; raises `InputError` if no photograph shows the electrode, or has no time."""
    outlines = [entry.outline for entry in photographs]
    if all(outline.flat is None for outline in outlines):
        lines = [Problem(entry.reason, file=name) for name, entry in zip(ready.names, outlines, strict=True)]
        raise InputError(*lines[:MOST_LINES])
    time = ready.time
    if time is None:
        moments = np.array([entry.moment for entry in photographs])
        for number in np.flatnonzero(np.isnan(moments))[:1]:
            reason = outlines[number].reason or "EXIF does not say when it was taken"
            raise InputError(f'{reason}; times = "exif" needs a time of each photograph', file=ready.names[number])
        time = recipe.start + moments - moments[0]
        _check_order(time, ready.pictures)
    reference, name = ready.reference, recipe.electrode.reference or recipe.files[0]
    if isinstance(reference, Outline) and (name, 0) in ready.pictures:
        reference = outlines[ready.pictures.index((name, 0))]
    return stretches(ready.names, time, outlines, reference, axis_1=recipe.electrode.axis_1, camera=ready.camera)


def _warn(result: Stretches) -> None:
    """A line for each photograph that is lost or doubtful; for one of several in a row with the same doubt."""
    before = ""
    for number, doubt in result.doubts.items():
        state = result.state[number]
        # the figures in a doubt vary from one photograph to the next
        kind = re.sub(r"[\d.]+", "", doubt)
        if state == LOST or kind != before or number - 1 not in result.doubts:
            following = 0
            while state == DOUBTFUL and re.sub(r"[\d.]+", "", result.doubts.get(number + following + 1, "")) == kind:
                following += 1
            more = f" (and {following} after it)" if following else ""
            warn(f"{state}: {doubt}{more}", file=result.file[number])
        before = kind


def headline(result: Stretches, ready: PreparedPhotographs) -> dict[str, dict[str, Any]]:
    """The numbers of photographs by state, the reference, the largest stretches, and what happened when."""
    state, there = result.state, np.isfinite(result.stretch[:, 0])
    largest = int(np.nanargmax(result.area_strain))
    first = ready.reference
    diameter = float(2 * np.sqrt(np.prod(first.flat.semi_axes))) if isinstance(first, Outline) and first.flat else first
    sections: dict[str, dict[str, Any]] = {
        "photographs": {
            "measured": len(state),
            **{name: state.count(name) for name in (OK, DOUBTFUL, LOST)},
            "colour": ready.plan.colour,
            "reference_diameter_px": diameter if isinstance(diameter, float) else None,
        },
        "stretch": {
            "largest_relative_stretch_1": float(result.stretch[largest, 0]),
            "largest_relative_stretch_2": float(result.stretch[largest, 1]),
            "largest_area_strain": float(result.area_strain[largest]),
            "at_time_s": float(result.time[largest]),
            "median_stderr": float(np.median(result.stderr[there])),
        },
    }
    spoken = {WRINKLES: "wrinkles_from_s", BREAKDOWN: "breakdown_before_s"}
    events = {spoken[kind]: float(result.time[number]) for kind, number in result.events.items()}
    return sections | ({"events": events} if events else {})
