"""The cells of a map, solved chunk by chunk, and the arrays in which an interrupted run keeps them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from dielast.commands.unfinished import Arrays, Work, finish
from dielast.numerics.integrate import Status
from dielast.sharing.execution import Chunk, Execution
from dielast.simulate.events import NONE
from dielast.simulate.map_plan import MapPlan, SolvedCells, column_of, solve_cells

CHUNK = 1024  # cells, about a second of work: little is lost by an interrupt, and the shares of processes are even


def solve(plan: MapPlan, key: str, execution: Execution) -> list[SolvedCells]:
    """All cells of the plan, which are kept in the folder of the execution until all are solved."""
    return finish(CELLS, plan, plan.chunks(CHUNK), key, execution)


def _arrays(solved: Sequence[SolvedCells]) -> dict[str, Any]:
    return {
        "mode": np.concatenate([cells.mode for cells in solved]),
        "status": np.concatenate([cells.status for cells in solved]),
        "stretched": np.concatenate([cells.stretched for cells in solved], axis=2),
        **{column_of(name): np.concatenate([cells.times[name] for cells in solved]) for name in solved[0].times},
    }


def _cells(arrays: Arrays, chunks: Sequence[Chunk], plan: MapPlan) -> list[SolvedCells]:
    bounds = np.cumsum([end - first for first, end in chunks])[:-1]
    times = {name: np.split(arrays[column_of(name)], bounds) for name in plan.watched}
    mode, status = (np.split(arrays[name], bounds) for name in ("mode", "status"))
    stretched = np.split(arrays["stretched"], bounds, axis=2)
    solved = [
        SolvedCells(first, {name: parts[k] for name, parts in times.items()}, mode[k], status[k], stretched[k])
        for k, (first, _) in enumerate(chunks)
    ]
    if not all(_belongs(cells, end - first, plan) for cells, (first, end) in zip(solved, chunks, strict=True)):
        raise ValueError("these are not the cells of the map")
    return solved


CELLS = Work(solve_cells, "cell", "cells", "solved", _arrays, _cells)


def _belongs(cells: SolvedCells, size: int, plan: MapPlan) -> bool:
    """Whether the arrays are a valid chunk of the map."""
    times = np.array(list(cells.times.values()))
    lived = np.isnan(times)
    return bool(
        times.shape == (len(cells.times), size)
        and cells.mode.shape == cells.status.shape == (size,)
        and np.array_equal(cells.mode == NONE, np.isnan([cells.times[name] for name in plan.grid.failures]).all(axis=0))
        and np.isin(cells.mode, (NONE, *plan.grid.failures)).all()
        and cells.stretched.shape == (2, len(plan.stretch_at), size)
        and not np.any(cells.stretched <= 0)
        and np.isin(cells.status, list(Status)).all()
        and np.all(lived | ((times >= 0) & (times <= (1 + 1e-9) * plan.horizon)))
        and not np.any(lived.all(axis=0) & (cells.status == Status.STOPPED))
    )
