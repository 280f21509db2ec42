"""Solve the chunks of a plan, or batches of cases, in this process, in several processes or on a cluster."""

from collections.abc import Generator, Sequence
from contextlib import closing
from typing import Protocol, TypeVar

from dielast.errors import InputError, NumericsError
from dielast.sharing.execution import Chunk, Execution, Plan, Solve, Solved

Result = TypeVar("Result")
Result_co = TypeVar("Result_co", covariant=True)
LOCAL = Execution()


class Batch(Protocol[Result_co]):
    """Cases that are solved together: `members` are their numbers in a list.

    A batch holds all its data, so that any process can solve it; solving neither reads files nor warns.
    """

    @property
    def members(self) -> Sequence[int]:
        """The number of each case."""

    def solve(self) -> Sequence[Result_co]:
        """The result of each member."""


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


def solve_batches(batches: Sequence[Batch[Result]], execution: Execution = LOCAL, what: str = "cases") -> list[Result]:
    """The result of every case, by number. `what` names the cases in reports of progress.

    If several batches raise errors, that of the first one in the list is raised, whichever batch is finished first.
    """
    count = sum(len(batch.members) for batch in batches)
    results: dict[int, Result] = {}
    waiting: dict[int, Sequence[Result] | InputError | NumericsError] = {}
    done = following = 0
    chunks = [(place, place + 1) for place in range(len(batches))]
    with closing(share_out(_solve_batch, tuple(batches), chunks, execution)) as solved:
        for place, solution in solved:
            waiting[place] = solution
            done += len(batches[place].members)
            while following in waiting:
                ready = waiting.pop(following)
                if isinstance(ready, Exception):
                    raise ready
                results.update(zip(batches[following].members, ready, strict=True))
                following += 1
            if execution.progress is not None and len(batches) > 1:
                execution.progress(done, count, what)
    return [results[number] for number in range(count)]


def _solve_batch(
    batches: Sequence[Batch[Result]], place: int, end: int
) -> tuple[int, Sequence[Result] | InputError | NumericsError]:
    """The place of a batch, and its results or the error that it raised."""
    try:
        return place, batches[place].solve()
    except (InputError, NumericsError) as error:
        return place, error.with_traceback(None)
