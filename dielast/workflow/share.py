"""Solve here, in several processes or on a cluster, as a run is asked to; no result depends on it."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from dielast.errors import InputError, NumericsError
from dielast.workflow.report import Execution

LOCAL = Execution()

Plan = TypeVar("Plan")
Solved = TypeVar("Solved")
Result = TypeVar("Result")
Result_co = TypeVar("Result_co", covariant=True)


def share_out(
    solve: Callable[[Plan, int, int], Solved], plan: Plan, chunks: Sequence[tuple[int, int]], execution: Execution
) -> Generator[Solved, None, None]:
    """`solve(plan, first, end)` of each chunk, in the order in which they are finished.

    `solve` is a function of a module, and all that it takes and gives can be pickled. Raises `NumericsError` if a process is
    killed, and `InputError` if the cluster is of no use.
    """
    if execution.scheduler is not None and chunks:
        from dielast.workflow.cluster import solve_on

        yield from solve_on(execution.scheduler, solve, plan, chunks)
    elif execution.jobs > 1 and len(chunks) > 1:
        from dielast.workflow.processes import solve_in_processes

        yield from solve_in_processes(execution.jobs, solve, plan, chunks)
    else:
        for first, end in chunks:
            yield solve(plan, first, end)


class Batch(Protocol[Result_co]):
    """Cases that are solved together: `members` says which of a list they are.

    It holds all that is needed, so that it can be solved anywhere, and neither reads files nor warns.
    """

    @property
    def members(self) -> Sequence[int]:
        """The number of each case."""

    def solve(self) -> Sequence[Result_co]:
        """The result of each member."""


def solve_batches(batches: Sequence[Batch[Result]], execution: Execution = LOCAL) -> list[Result]:
    """The result of every case, by number; raises the error of the first batch that has one, whoever comes upon it first."""
    count = sum(len(batch.members) for batch in batches)
    results: dict[int, Result] = {}
    waiting: dict[int, _Solved[Result]] = {}
    done = following = 0
    chunks = [(place, place + 1) for place in range(len(batches))]
    with closing(share_out(_solve_one, tuple(batches), chunks, execution)) as solved:
        for one in solved:
            waiting[one.place] = one
            done += len(batches[one.place].members)
            while following in waiting:
                batch, ready = batches[following], waiting.pop(following)
                if ready.error is not None:
                    raise ready.error
                results.update(zip(batch.members, ready.results, strict=True))
                following += 1
            if execution.progress is not None and len(batches) > 1:
                execution.progress(done, count)
    return [results[number] for number in range(count)]


@dataclass(frozen=True, slots=True, eq=False)
class _Solved(Generic[Result]):
    """What became of the batch in this `place`: its results, or what was wrong."""

    place: int
    results: Sequence[Result]
    error: InputError | NumericsError | None


def _solve_one(batches: Sequence[Batch[Result]], first: int, end: int) -> _Solved[Result]:
    try:
        return _Solved(first, batches[first].solve(), None)
    except (InputError, NumericsError) as error:
        return _Solved(first, (), error.with_traceback(None))
