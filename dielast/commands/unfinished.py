"""Long work that is kept in a file, chunk by chunk, until all of it is done: an interrupted run goes on from there."""

import hashlib
import io
import os
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, NumericsError
from dielast.io.files import KEPT, STORE, Inputs, write_files
from dielast.recipe.base import RecipeBase
from dielast.recipe.cases import Case
from dielast.sharing.batches import share_out
from dielast.sharing.execution import NOTHING_KEPT, Chunk, Execution, Plan, Solve
from dielast.sharing.versions import VERSIONS

PAUSE = 1.0  # s between two saves: a large cluster works faster than a disk saves
CHANGED = "the {} {} of an interrupted run are discarded: the recipe, a file that it names, or dielast has changed since"
UNREADABLE = "an interrupted run is discarded: its file is damaged, or of another version of dielast"
GOES_ON = "{} of {} {} are kept: the same command goes on from there, a changed recipe begins anew"
NONE_DONE = "no {} was {} yet; the same command begins anew"
# of arrays that are whole, but are not those of today's version
_UNFIT = (KeyError, ValueError, IndexError, TypeError)

Arrays = Mapping[str, NDArray[Any]]


class Part(Protocol):
    """The results of a chunk: of so many (`size`) cells from the number `first` on."""

    @property
    def first(self) -> int:
        """The number of the first one."""

    @property
    def size(self) -> int:
        """How many there are."""


Result = TypeVar("Result", bound=Part)


@dataclass(frozen=True, slots=True)
class Work(Generic[Plan, Result]):
    """How the chunks of a plan are done and kept.

    `solve` does one, `one`, `many` and `done` name in messages what is counted: "cell", "cells", "solved". `arrays` are those that
    results are kept in, and `results` makes these of them again, given the chunks; it leaves out what no longer holds, and raises
    `ValueError` if the arrays do not fit the plan.
    """

    solve: Solve[Plan, Result]
    one: str
    many: str
    done: str
    arrays: Callable[[Sequence[Result]], Arrays]
    results: Callable[[Arrays, Sequence[Chunk], Plan], Iterable[Result]]


def fingerprint(case: Case[RecipeBase], inputs: Inputs) -> str:
    """A digest of the versions, recipe and inputs, which an unfinished run must share with this run to be resumed."""
    recipe = case.recipe
    # stating the default of a key may have an effect
    stated = f"{VERSIONS}\n{recipe!r}\n{recipe.model_dump(exclude_unset=True)}\n{case.of_material!r}\n{sorted(inputs.digests)}"
    return hashlib.sha256(stated.encode()).hexdigest()


def finish(work: Work[Plan, Result], plan: Plan, chunks: Sequence[Chunk], key: str, execution: Execution) -> list[Result]:
    """The results of all chunks, in their order; they are kept in the folder of the execution until all are done.

    Chunks that an earlier run with the same `key` has kept are not done again.
    """
    store = None if execution.folder is None else execution.folder / STORE
    note, keep = (tell or (lambda line: None) for tell in (execution.note, execution.keep))
    count = sum(end - first for first, end in chunks)
    kept, discarded = load(work, store, key, plan, chunks)
    done = sum(result.size for result in kept.values())
    if kept:
        note(f"goes on from an interrupted run, which {work.done} {done} of {count} {work.many}")
    elif discarded:
        note(discarded)
    waiting = [chunk for chunk in chunks if chunk[0] not in kept]
    saved, due = len(kept), 0.0

    def save_new() -> None:
        nonlocal saved
        if store is not None and len(kept) > saved and done < count:
            save(work, store, key, list(kept.values()))
            saved = len(kept)
            keep(GOES_ON.format(done, count, work.many))

    keep(GOES_ON.format(done, count, work.many) if kept else NONE_DONE.format(work.one, work.done))
    try:
        with closing(_done(work, plan, waiting, execution)) as results:
            for result in results:
                kept[result.first] = result
                done += result.size
                if time.monotonic() >= due:
                    save_new()
                    due = time.monotonic() + PAUSE
                if execution.progress is not None:
                    execution.progress(done, count, work.many)
    finally:
        save_new()
    if not saved:  # there was too little to be saved in between
        keep(NOTHING_KEPT)
    return [kept[first] for first, _ in chunks]


def _done(work: Work[Plan, Result], plan: Plan, chunks: Sequence[Chunk], execution: Execution) -> Generator[Result, None, None]:
    begun = False
    try:
        with closing(share_out(work.solve, plan, chunks, execution)) as results:
            for result in results:
                begun = True
                yield result
    except (InputError, NumericsError) as error:
        if not begun:
            raise
        raise error.adding(f"; {KEPT}") from None


def save(work: Work[Plan, Result], store: Path, key: str, results: Sequence[Result]) -> None:
    """Keep the results in the file `store`, which is written whole or not at all."""
    chunks = [(result.first, result.first + result.size) for result in results]
    arrays: dict[str, Any] = {"key": np.array(key), "chunks": np.array(chunks), **work.arrays(results)}
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    write_files(store.parent, {store.name: buffer.getvalue()})


def load(
    work: Work[Plan, Result], store: Path | None, key: str, plan: Plan, chunks: Sequence[Chunk]
) -> tuple[dict[int, Result], str]:
    """The results that an earlier run has kept, by their first number; or why they are discarded, empty if there are none."""
    if store is None or not os.path.isfile(store):
        return {}, ""
    try:
        with store.open("rb") as file, np.load(file) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception:  # of damaged files numpy, zipfile and zlib raise kinds that they do not list, down to SyntaxError
        return {}, UNREADABLE
    try:
        known = [(int(first), int(end)) for first, end in arrays["chunks"]]
        if str(arrays["key"]) != key:
            return {}, CHANGED.format(sum(end - first for first, end in known), work.many)
        if not set(known) <= set(chunks):
            return {}, UNREADABLE
        return {result.first: result for result in work.results(arrays, known, plan)}, ""
    except _UNFIT:
        return {}, UNREADABLE
