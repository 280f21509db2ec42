"""The photographs of a recipe, measured one by one, and the arrays in which an interrupted run keeps them."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.commands.unfinished import Arrays, Work, finish
from dielast.errors import InputError
from dielast.io.files import read_file, resolve, sha256
from dielast.photographs.camera import Camera
from dielast.photographs.decode import read_picture, taken
from dielast.photographs.ellipse import Ellipse
from dielast.photographs.find import averaged, reduced
from dielast.photographs.outline import Outline, find_outline
from dielast.sharing.execution import Chunk, Execution

CHUNK = 4  # photographs, about half a second
THUMBNAIL = 200  # px: the longer side of a photograph in the contact sheet is at most this
NUMBERS = ("seen", "width", "roughness", "level", "holes", "inside")


@dataclass(frozen=True, slots=True)
class PhotographPlan:
    """What is measured: `pictures` are the names of files in `folder` and the numbers of pictures in them."""

    folder: Path
    pictures: tuple[tuple[str, int], ...]
    dark: bool
    region: tuple[int, int, int, int] | None
    camera: Camera | None
    colour: str
    dated: bool


@dataclass(frozen=True, slots=True, eq=False)
class Photograph:
    """A photograph with its outline, a small picture of it (`factor` pixels a pixel), the file's SHA-256 and its time by EXIF."""

    outline: Outline
    thumbnail: NDArray[np.uint8]
    factor: int
    digest: str
    moment: float


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """The photographs of a chunk, from the number `first` on."""

    first: int
    photographs: list[Photograph]

    @property
    def size(self) -> int:
        """Their number."""
        return len(self.photographs)


def measure_pictures(plan: PhotographPlan, first: int, end: int) -> Measured:
    """The photographs from the number `first` to before `end`; a file that cannot be read is a photograph without an electrode."""
    return Measured(first, [_measured(plan, *picture) for picture in plan.pictures[first:end]])


def _measured(plan: PhotographPlan, name: str, number: int) -> Photograph:
    digest, moment, nothing = "", np.nan, np.zeros((0, 0), dtype=np.uint8)
    try:
        content = read_file(resolve(plan.folder, name), name)
        digest = sha256(content)
        grey = read_picture(content, name, number, plan.colour)
        if plan.dated:
            with suppress(InputError):  # whoever needs the time says what is missing
                moment = taken(content, name)
        outline = find_outline(grey, dark=plan.dark, region=plan.region, camera=plan.camera)
        return Photograph(outline, *_small(grey), digest, moment)
    except InputError as error:
        return Photograph(Outline(reason=error.problems[0].text), nothing, 1, digest, moment)


def _small(grey: NDArray[Any]) -> tuple[NDArray[np.uint8], int]:
    """The picture between its darkest and its lightest grey value, and how many times smaller it is."""
    small, factor = reduced(grey)
    further = max(1, -(-max(small.shape) // THUMBNAIL))
    small = averaged(small, further)
    low, high = np.percentile(small, [1, 99])
    return np.clip((small - low) / max(high - low, 1e-9) * 255, 0, 255).astype(np.uint8), factor * further


def measure_all(plan: PhotographPlan, key: str, execution: Execution) -> list[Photograph]:
    """Every photograph of the plan; they are kept in the folder of the execution until all are measured."""
    count = len(plan.pictures)
    chunks = [(first, min(first + CHUNK, count)) for first in range(0, count, CHUNK)]
    return [entry for measured in finish(PHOTOGRAPHS, plan, chunks, key, execution) for entry in measured.photographs]


def _arrays(results: Sequence[Measured]) -> dict[str, Any]:
    entries = [entry for measured in results for entry in measured.photographs]
    outlines = np.full((len(entries), 2, 31), np.nan)
    for row, entry in zip(outlines, entries, strict=True):
        for place, ellipse in zip(row, (entry.outline.ellipse, entry.outline.flat), strict=True):
            if ellipse is not None and ellipse.covariance is not None:
                place[:] = np.concatenate([ellipse.centre, ellipse.shape.ravel(), ellipse.covariance.ravel()])
    return {
        "outline": outlines,
        "numbers": np.array([[float(getattr(entry.outline, name)) for name in NUMBERS] for entry in entries]),
        "reason": np.array([entry.outline.reason for entry in entries]),
        "digest": np.array([entry.digest for entry in entries]),
        "moment": np.array([entry.moment for entry in entries]),
        "factor": np.array([entry.factor for entry in entries]),
        "shape": np.array([entry.thumbnail.shape for entry in entries]),
        "thumbnail": np.concatenate([entry.thumbnail.ravel() for entry in entries]),
    }


def _results(arrays: Arrays, chunks: Sequence[Chunk], plan: PhotographPlan) -> Iterator[Measured]:
    """The chunks whose files have not changed since."""
    digest = cache(lambda name: _digest(plan, name))
    ends = np.cumsum(np.prod(arrays["shape"], axis=1))
    row = 0
    for first, end in chunks:
        photographs = []
        for name, _ in plan.pictures[first:end]:
            place, row = row, row + 1
            kept = str(arrays["digest"][place])
            if kept != digest(name):
                continue
            ellipse, flat = (
                None if np.isnan(values[0]) else Ellipse(values[:2], values[2:6].reshape(2, 2), values[6:].reshape(5, 5))
                for values in arrays["outline"][place]
            )
            state: dict[str, Any] = dict(zip(NUMBERS, arrays["numbers"][place].tolist(), strict=True))
            state |= {"inside": bool(state["inside"]), "reason": str(arrays["reason"][place])}
            shape = arrays["shape"][place]
            small = arrays["thumbnail"][ends[place] - np.prod(shape) : ends[place]].reshape(shape)
            factor, moment = int(arrays["factor"][place]), float(arrays["moment"][place])
            photographs.append(Photograph(Outline(ellipse, flat, **state), small, factor, kept, moment))
        if len(photographs) == end - first:
            yield Measured(first, photographs)


def _digest(plan: PhotographPlan, name: str) -> str | None:
    """The SHA-256 of a file; None if it cannot be read."""
    try:
        return sha256(read_file(resolve(plan.folder, name), name))
    except InputError:
        return None


PHOTOGRAPHS = Work(measure_pictures, "photograph", "photographs", "measured", _arrays, _results)
