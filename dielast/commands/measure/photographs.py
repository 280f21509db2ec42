"""The photographs of a recipe, measured one by one."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.io.files import read_file, resolve, sha256
from dielast.readings.photographs.camera import Camera
from dielast.readings.photographs.decode import read_picture, taken
from dielast.readings.photographs.find import averaged, reduced
from dielast.readings.photographs.outline import Outline, find_outline
from dielast.sharing.study import Study, Work

CHUNK = 4  # photographs, about half a second
THUMBNAIL = 200  # px: the longer side of a photograph in the contact sheet is at most this


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


def measure_all(plan: PhotographPlan, study: Study) -> list[Photograph]:
    """Every photograph of the plan."""
    count = len(plan.pictures)
    chunks = [(first, min(first + CHUNK, count)) for first in range(0, count, CHUNK)]
    work = Work(measure_pictures, "photographs", partial(_unchanged, digest=cache(partial(_digest, plan))))
    return [photograph for measured in study.solve(work, plan, chunks) for photograph in measured.photographs]


def _unchanged(plan: PhotographPlan, measured: Measured, digest: Callable[[str], str | None]) -> bool:
    """Whether no file has changed since it was measured."""
    names = [name for name, _ in plan.pictures[measured.first :][: len(measured.photographs)]]
    return [digest(name) for name in names] == [photograph.digest for photograph in measured.photographs]


def _digest(plan: PhotographPlan, name: str) -> str | None:
    """The SHA-256 of a file; None if it cannot be read."""
    try:
        return sha256(read_file(resolve(plan.folder, name), name))
    except InputError:
        return None
