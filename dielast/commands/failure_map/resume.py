"""Solve the cells of a map chunk by chunk, and resume an interrupted run."""

import hashlib
import io
import os
import time
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from dielast.errors import InputError, NumericsError
from dielast.io.files import KEPT, STORE, Inputs, write_files
from dielast.numerics.integrate import Status
from dielast.recipe.base import RecipeBase
from dielast.recipe.cases import Case
from dielast.sharing.batches import share_out
from dielast.sharing.execution import NOTHING_KEPT, Execution
from dielast.sharing.versions import VERSIONS
from dielast.simulate.events import NONE
from dielast.simulate.map_plan import MapPlan, SolvedCells, column_of, solve_cells

CHUNK = 1024  # cells, about a second of work: little is lost by an interrupt, and the shares of processes are even
CHANGED = "the {} cells of an interrupted run are discarded: the recipe, a file that it names, or dielast has changed since"
UNREADABLE = "an interrupted run is discarded: its file is damaged, or of another version of dielast"
GOES_ON = "the same command goes on from there, a changed recipe begins anew"
NONE_SOLVED = "no cell was solved yet; the same command begins anew"
PAUSE = 1.0  # s between two saves: a large cluster solves faster than a disk saves


def fingerprint(case: Case[RecipeBase], inputs: Inputs) -> str:
    """A digest of the versions, recipe and inputs, which an unfinished map must share with this map to be resumed."""
    recipe = case.recipe
    # stating the default of a key may have an effect
    stated = f"{VERSIONS}\n{recipe!r}\n{recipe.model_dump(exclude_unset=True)}\n{case.of_material!r}\n{sorted(inputs.digests)}"
    return hashlib.sha256(stated.encode()).hexdigest()


def solve(plan: MapPlan, key: str, execution: Execution) -> list[SolvedCells]:
    """All cells of the plan, which are kept in the folder of the execution until all are solved."""
    store = None if execution.folder is None else execution.folder / STORE
    note, keep = (tell or (lambda line: None) for tell in (execution.note, execution.keep))
    kept, discarded = _load(store, key, plan)
    done = sum(cells.status.size for cells in kept.values())
    if kept:
        note(f"goes on from an interrupted run, which solved {done} of {plan.cells} cells")
    elif discarded:
        note(discarded)
    waiting = [chunk for chunk in plan.chunks(CHUNK) if chunk[0] not in kept]
    saved, due = len(kept), 0.0

    def save() -> None:
        nonlocal saved
        if store is not None and len(kept) > saved and done < plan.cells:
            _save(store, key, list(kept.values()))
            saved = len(kept)
            keep(f"{done} of {plan.cells} cells are kept: {GOES_ON}")

    keep(f"{done} of {plan.cells} cells are kept: {GOES_ON}" if kept else NONE_SOLVED)
    try:
        with closing(_solved(plan, waiting, execution)) as solved:
            for cells in solved:
                kept[cells.first] = cells
                done += cells.status.size
                if time.monotonic() >= due:
                    save()
                    due = time.monotonic() + PAUSE
                if execution.progress is not None:
                    execution.progress(done, plan.cells, "cells")
    finally:
        save()
    if not saved:  # the map was too small to be saved in between
        keep(NOTHING_KEPT)
    return list(kept.values())


def _solved(plan: MapPlan, chunks: Sequence[tuple[int, int]], execution: Execution) -> Generator[SolvedCells, None, None]:
    begun = False
    try:
        with closing(share_out(solve_cells, plan, chunks, execution)) as solved:
            for cells in solved:
                begun = True
                yield cells
    except (InputError, NumericsError) as error:
        if not begun:
            raise
        raise error.adding(f"; {KEPT}") from None


def _save(store: Path, key: str, solved: Sequence[SolvedCells]) -> None:
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {
        "key": np.array(key),
        "first": np.array([cells.first for cells in solved]),
        "size": np.array([cells.status.size for cells in solved]),
        "mode": np.concatenate([cells.mode for cells in solved]),
        "status": np.concatenate([cells.status for cells in solved]),
        "stretched": np.concatenate([cells.stretched for cells in solved], axis=2),
        **{column_of(name): np.concatenate([cells.times[name] for cells in solved]) for name in solved[0].times},
    }
    np.savez(buffer, **arrays)
    write_files(store.parent, {store.name: buffer.getvalue()})


def _load(store: Path | None, key: str, plan: MapPlan) -> tuple[dict[int, SolvedCells], str]:
    """The chunks of an earlier run of the same map, by first cell; or why a run that was kept is discarded."""
    if store is None or not os.path.isfile(store):
        return {}, ""
    try:
        with store.open("rb") as file, np.load(file) as saved:
            if str(saved["key"]) != key:
                return {}, CHANGED.format(saved["status"].size)
            bounds = np.cumsum(saved["size"])[:-1]
            times = {name: np.split(saved[column_of(name)], bounds) for name in plan.watched}
            mode, status = (np.split(saved[name], bounds) for name in ("mode", "status"))
            stretched = np.split(saved["stretched"], bounds, axis=2)
            kept = {}
            for k, first in enumerate(saved["first"].tolist()):
                of_chunk = {name: parts[k] for name, parts in times.items()}
                kept[int(first)] = SolvedCells(int(first), of_chunk, mode[k], status[k], stretched[k])
        chunks = set(plan.chunks(CHUNK))
        return (kept, "") if all(_belongs(cells, chunks, plan) for cells in kept.values()) else ({}, UNREADABLE)
    except Exception:  # zipfile and numpy raise many kinds of errors for a damaged file
        return {}, UNREADABLE


def _belongs(cells: SolvedCells, chunks: set[tuple[int, int]], plan: MapPlan) -> bool:
    """Whether the arrays are a valid chunk of the map."""
    times = np.array(list(cells.times.values()))
    lived, size = np.isnan(times), cells.status.size
    return bool(
        (cells.first, cells.first + size) in chunks
        and times.shape == (len(cells.times), size)
        and cells.mode.shape == cells.status.shape == (size,)
        and np.array_equal(cells.mode == NONE, np.isnan([cells.times[name] for name in plan.grid.failures]).all(axis=0))
        and np.isin(cells.mode, (NONE, *plan.grid.failures)).all()
        and cells.stretched.shape == (2, len(plan.stretch_at), size)
        and not np.any(cells.stretched <= 0)
        and np.isin(cells.status, list(Status)).all()
        and np.all(lived | ((times >= 0) & (times <= (1 + 1e-9) * plan.horizon)))
        and not np.any(lived.all(axis=0) & (cells.status == Status.STOPPED))
    )
