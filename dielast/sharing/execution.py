"""How a run is carried out, and what it is divided into: the chunks of a plan, which are independent of each other."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

Plan = TypeVar("Plan")
Solved = TypeVar("Solved")
Solve = Callable[[Plan, int, int], Solved]
"""Solves a chunk of a plan, which is independent of the other chunks."""
Chunk = tuple[int, int]
"""Where a chunk begins and ends: the number of its first cell, and the number after its last cell."""
Progress = Callable[[int, int, str], None]
"""Called with the finished number, the total number, and what they count: cells, cases or draws."""
NOTHING_KEPT = "nothing is kept or written; the same command begins anew"
EARLIER = "nothing new is kept or written; the same command goes on from what an earlier run has kept"


@dataclass(frozen=True, slots=True)
class Execution:
    """How a run is carried out, without any influence on its results.

    `jobs` is the number of processes, `folder` takes unfinished work, `progress` is called as cases are solved, `scheduler` is the
    address of a Dask scheduler that is used instead of processes, `note` is called with notes for the user, and `keep` with what an
    interrupt leaves from then on.
    """

    jobs: int = 1
    folder: Path | None = None
    progress: Progress | None = None
    scheduler: str | None = None
    note: Callable[[str], None] | None = None
    keep: Callable[[str], None] | None = None
