"""The photographs of a recipe, measured one by one, and what an interrupted run keeps of them."""

import io
import os
import time
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError
from dielast.io.files import STORE, read_file, resolve, sha256, write_files
from dielast.photographs.camera import Camera
from dielast.photographs.decode import read_picture, taken
from dielast.photographs.ellipse import Ellipse
from dielast.photographs.find import reduced
from dielast.photographs.outline import Outline, find_outline
from dielast.sharing.batches import share_out
from dielast.sharing.execution import NOTHING_KEPT, Execution

CHUNK = 4  # photographs, about half a second
PAUSE = 1.0  # s between two saves
THUMBNAIL = 200  # px: the longer side of a photograph in the contact sheet is at most this
NUMBERS = ("seen", "width", "roughness", "level", "holes", "inside")
_GOES_ON = "{} of {} photographs are kept: the same command goes on from there, a changed recipe begins anew"


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


def measure_pictures(plan: PhotographPlan, first: int, end: int) -> tuple[int, list[Photograph]]:
    """The photographs from the number `first` to before `end`; a file that cannot be read is a photograph without an electrode."""
    return first, [_measured(plan, *picture) for picture in plan.pictures[first:end]]


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
    small = small[::further, ::further]
    low, high = np.percentile(small, [1, 99])
    return np.clip((small - low) / max(high - low, 1e-9) * 255, 0, 255).astype(np.uint8), factor * further


def measure_all(plan: PhotographPlan, key: str, execution: Execution) -> list[Photograph]:
    """Every photograph of the plan, which are kept in the folder of the execution until all are measured."""
    store = None if execution.folder is None else execution.folder / STORE
    note, keep = (tell or (lambda line: None) for tell in (execution.note, execution.keep))
    count = len(plan.pictures)
    kept = {} if store is None or not os.path.isfile(store) else _load(store, key, plan)
    if kept:
        note(f"goes on from an interrupted run, which measured {len(kept)} of {count} photographs")
    chunks = [(first, min(first + CHUNK, count)) for first in range(0, count, CHUNK)]
    waiting = [chunk for chunk in chunks if not all(number in kept for number in range(*chunk))]
    saved, due = len(kept), time.monotonic() + PAUSE

    def save() -> None:
        nonlocal saved
        if store is not None and saved < len(kept) < count:
            write_files(store.parent, {store.name: _stored(key, kept)})
            saved = len(kept)
            keep(_GOES_ON.format(saved, count))

    keep(_GOES_ON.format(saved, count) if saved else NOTHING_KEPT)
    try:
        with closing(share_out(measure_pictures, plan, waiting, execution)) as done:
            for first, photographs in done:
                kept.update(enumerate(photographs, start=first))
                if time.monotonic() >= due:
                    save()
                    due = time.monotonic() + PAUSE
                if execution.progress is not None:
                    execution.progress(len(kept), count, "photographs")
    finally:
        save()
    return [kept[number] for number in range(count)]


def _stored(key: str, kept: dict[int, Photograph]) -> bytes:
    """The photographs as the bytes of an archive of arrays."""
    numbers = sorted(kept)
    entries = [kept[number] for number in numbers]
    outlines = np.full((len(entries), 2, 31), np.nan)
    for row, entry in zip(outlines, entries, strict=True):
        for place, ellipse in zip(row, (entry.outline.ellipse, entry.outline.flat), strict=True):
            if ellipse is not None and ellipse.covariance is not None:
                place[:] = np.concatenate([ellipse.centre, ellipse.shape.ravel(), ellipse.covariance.ravel()])
    arrays: dict[str, Any] = {
        "key": np.array(key),
        "number": np.array(numbers),
        "outline": outlines,
        "numbers": np.array([[float(getattr(entry.outline, name)) for name in NUMBERS] for entry in entries]),
        "reason": np.array([entry.outline.reason for entry in entries]),
        "digest": np.array([entry.digest for entry in entries]),
        "moment": np.array([entry.moment for entry in entries]),
        "factor": np.array([entry.factor for entry in entries]),
        "shape": np.array([entry.thumbnail.shape for entry in entries]),
        "thumbnail": np.concatenate([entry.thumbnail.ravel() for entry in entries]),
    }
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def _load(store: Path, key: str, plan: PhotographPlan) -> dict[int, Photograph]:
    """The photographs of an interrupted run of the same recipe whose files have not changed since, by number."""
    kept = {}
    digests: dict[str, str] = {}
    try:
        with store.open("rb") as file, np.load(file) as saved:
            if str(saved["key"]) != key:
                return {}
            arrays = {name: saved[name] for name in saved.files}
        ends = np.cumsum(np.prod(arrays["shape"], axis=1))
        for row, number in enumerate(arrays["number"].tolist()):
            name = plan.pictures[number][0]
            if name not in digests:
                digests[name] = sha256(read_file(resolve(plan.folder, name), name))
            if digests[name] != str(arrays["digest"][row]):
                continue
            ellipse, flat = (
                None if np.isnan(values[0]) else Ellipse(values[:2], values[2:6].reshape(2, 2), values[6:].reshape(5, 5))
                for values in arrays["outline"][row]
            )
            state: dict[str, Any] = dict(zip(NUMBERS, arrays["numbers"][row].tolist(), strict=True))
            state |= {"inside": bool(state["inside"]), "reason": str(arrays["reason"][row])}
            outline = Outline(ellipse, flat, **state)
            shape = arrays["shape"][row]
            small = arrays["thumbnail"][ends[row] - np.prod(shape) : ends[row]].reshape(shape)
            kept[number] = Photograph(outline, small, int(arrays["factor"][row]), digests[name], float(arrays["moment"][row]))
    except Exception:  # zipfile and numpy raise many kinds of errors for a damaged file
        return {}
    return kept
