"""Solve the chunks of a plan in this process, in several processes or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from dielast.sharing.chunks import Chunk, Plan, Solve, Solved

Progress = Callable[[int, int, str], None]
"""Called with the finished number, the total number, and what they count: cells, cases or draws."""
NOTHING_KEPT = "nothing is kept or written; the same command begins anew"


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


def share_out(
    solve: Solve[Plan, Solved], plan: Plan, chunks: Sequence[Chunk], execution: Execution
) -> Generator[Solved, None, None]:
    """`solve(plan, first, end)` of each chunk, in the order in which they are finished.

    `solve` is a function of a module; its arguments and results can be pickled. Raises `NumericsError` if a process is killed, and
    `InputError` if the cluster cannot be used.
    """
    if execution.scheduler is not None and chunks:
        from dielast.sharing.cluster import solve_on

        yield from solve_on(execution.scheduler, solve, plan, chunks)
    elif execution.jobs > 1 and len(chunks) > 1:
        from dielast.sharing.processes import solve_in_processes

        yield from solve_in_processes(execution.jobs, solve, plan, chunks)
    else:
        for first, end in chunks:
            yield solve(plan, first, end)
