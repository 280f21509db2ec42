"""Batches of cases, solved in this process, in several processes or on a cluster."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from dielast.errors import InputError, NumericsError
from dielast.sharing.execution import Execution, share_out

LOCAL = Execution()

Result = TypeVar("Result")
Result_co = TypeVar("Result_co", covariant=True)


class Batch(Protocol[Result_co]):
    """Cases that are solved together: `members` are their numbers in a list.

    A batch holds all its data, so that any process can solve it; solving neither reads files nor warns.
    """

    @property
    def members(self) -> Sequence[int]:
        """The number of each case."""

    def solve(self) -> Sequence[Result_co]:
        """The result of each member."""


def solve_batches(batches: Sequence[Batch[Result]], execution: Execution = LOCAL, what: str = "cases") -> list[Result]:
    """The result of every case, by number. `what` names the cases in reports of progress.

    If several batches raise errors, that of the first one in the list is raised, whichever batch is finished first.
    """
    count = sum(len(batch.members) for batch in batches)
    results: dict[int, Result] = {}
    waiting: dict[int, _Solved[Result]] = {}
    done = following = 0
    chunks = [(place, place + 1) for place in range(len(batches))]
    with closing(share_out(_solve_one, tuple(batches), chunks, execution)) as solved:
        for solution in solved:
            waiting[solution.place] = solution
            done += len(batches[solution.place].members)
            while following in waiting:
                batch, ready = batches[following], waiting.pop(following)
                if ready.error is not None:
                    raise ready.error
                results.update(zip(batch.members, ready.results, strict=True))
                following += 1
            if execution.progress is not None and len(batches) > 1:
                execution.progress(done, count, what)
    return [results[number] for number in range(count)]


@dataclass(frozen=True, slots=True, eq=False)
class _Solved(Generic[Result]):
    """The results of the batch in this `place` of the list, or the error that it raised."""

    place: int
    results: Sequence[Result]
    error: InputError | NumericsError | None


def _solve_one(batches: Sequence[Batch[Result]], first: int, end: int) -> _Solved[Result]:
    try:
        return _Solved(first, batches[first].solve(), None)
    except (InputError, NumericsError) as error:
        return _Solved(first, (), error.with_traceback(None))
