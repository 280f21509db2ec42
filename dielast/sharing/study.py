"""Studies: independent cases, solved in chunks wherever the execution says, and kept in a file until all of them are done.

An interrupted run goes on from the file. It holds the results of whole chunks, under a key of all that they depend on.
"""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from dielast.base.errors import DielastError, InputError, NumericsError
from dielast.io.files import KEPT, STORE, write_files
from dielast.numerics.integrate import KEEPER, Keeper
from dielast.sharing.execution import NOTHING_KEPT, Chunk, Execution, Plan, Solve, Solved
from dielast.sharing.kept import LARGEST, Kept, Overfull, fingerprint, load, outermost, restored, size

if TYPE_CHECKING:
    from dielast.io.files import Inputs
    from dielast.recipe.cases import Case

Result = TypeVar("Result")
Result_co = TypeVar("Result_co", covariant=True)
PAUSE = 1.0  # s between two saves: a large cluster works faster than a disk saves
STATE = 10.0  # s between two states of a simulation
SAVING = 0.05  # fraction of the time of a run that goes into saving, at most
GOES_ON = "{} are kept: the same command goes on from there, a changed recipe begins anew"
HERE = Execution()


@dataclass(frozen=True, slots=True)
class Work(Generic[Plan, Solved]):
    """How the chunks of a plan are solved: `solve` does one, `many` names what is counted, such as "cells", and `holds` says
    whether a kept result still holds; without it, all do.
    """

    solve: Solve[Plan, Solved]
    many: str
    holds: Callable[[Plan, Solved], bool] | None = None


class Batch(Protocol[Result_co]):
    """Cases that are solved together: `members` are their numbers in a list.

    A batch holds all its data, so that any process can solve it; solving neither reads files nor warns.
    """

    @property
    def members(self) -> Sequence[int]:
        """The number of each case."""

    def solve(self) -> Sequence[Result_co]:
        """The result of each member."""


@dataclass(frozen=True, slots=True, eq=False)
class Draws(Generic[Result]):
    """A batch of the case `member` alone, whose result `of_draws` makes from the results of its draws, which are in `parts`."""

    member: int
    parts: Sequence[Batch[Any]]
    of_draws: Callable[[Sequence[Any]], Result]

    @property
    def members(self) -> list[int]:
        """The number of the case."""
        return [self.member]

    def solve(self) -> list[Result]:
        """The result of the case."""
        return self.joined([part.solve() for part in self.parts])

    def joined(self, solved: Sequence[Sequence[Any]]) -> list[Result]:
        """The result of the case, from those of all its parts."""
        return [self.of_draws(_by_number(self.parts, solved))]


class Study:
    """The work of one run: each stage of it is solved, and kept in the folder of the execution until all stages are done."""

    def __init__(self, execution: Execution = HERE, key: str = "", held: Callable[[Any], Any] = lambda solved: solved) -> None:
        """Go on from what an earlier run with the same `key` has kept; `held` is how a chunk's result is held until the end."""
        self.execution, self.key, self.held = execution, key, held
        self.store = None if execution.folder is None else execution.folder / STORE
        self.note, self.keep = (tell or (lambda line: None) for tell in (execution.note, execution.keep))
        self.kept, self.totals = Kept(), dict[str, int]()
        self.new = self.saved = False  # whether there are results that are not in the file, and any that are
        self.due = time.monotonic() + PAUSE
        if self.store is not None and os.path.isfile(self.store):
            self.kept, discarded = load(self.store, key, held)
            self.saved = bool(self.kept.results or self.kept.states)
            if discarded:
                self.note(discarded)

    @classmethod
    def of(cls, cases: Sequence[Case[Any]], inputs: Inputs, execution: Execution, *held: Callable[[Any], Any]) -> Study:
        """The study of the cases of a recipe, all of whose `inputs` have been read."""
        return cls(execution, fingerprint(cases, inputs), *held)

    def batches(self, batches: Sequence[Batch[Result]], what: str = "cases") -> list[Result]:
        """The result of every case, by number; `what` names what is counted. Draws of one case in several parts are shared out.

        If several batches raise errors, that of the first one in the list is raised, whichever batch is finished first.
        """
        plan: dict[Chunk, Batch[Any]] = {}
        joins: dict[Chunk, tuple[list[Chunk], Draws[Any]]] = {}
        every, end = [], 0
        for batch in batches:
            begin, own, parts = end, [], batch.parts if isinstance(batch, Draws) else [batch]
            for part in parts:
                own.append((end, end + len(part.members)))
                end += len(part.members)
            every.append((begin, end))
            if isinstance(batch, Draws) and len(parts) > 1:
                plan.update(zip(own, parts, strict=True))
                joins[begin, end] = own, batch
            else:
                plan[begin, end] = batch
        work: Work[Any, Any] = Work(_solve_batch, what)
        return _by_number(batches, self.solve(work, plan, list(plan), joins))

    def solve(
        self,
        work: Work[Plan, Solved],
        plan: Plan,
        chunks: Sequence[Chunk],
        joins: Mapping[Chunk, tuple[Sequence[Chunk], Draws[Any]]] = {},
    ) -> list[Solved]:
        """The results of all chunks in their order, with those of `joins` joined. Chunks that are kept are not solved again.

        The division into chunks may be another one than that of an interrupted run. Raises the first error of the chunks.
        """
        total = self.totals[work.many] = size(chunks)
        kept = self.kept.results[work.many] = {
            chunk: result
            for chunk, result in self.kept.results.get(work.many, {}).items()
            if work.holds is None or work.holds(plan, result)
        }
        join_of = {part: whole for whole, (parts, _) in joins.items() for part in parts}
        for whole in joins:
            self._join(kept, whole, joins)
        waiting = _left(chunks, outermost(kept))
        undone, failed, done = set(waiting), dict[Chunk, DielastError](), total - size(waiting)
        parts = [f"{done} of {total} {work.many}"] * bool(done)
        parts += [f"the states of {work.many} under way"] * any(many == work.many for many, _, _ in self.kept.states)
        if parts:
            self.note(f"goes on from an interrupted run, which kept {' and '.join(parts)}")
        self.keep(self.state() or NOTHING_KEPT)
        solve = work.solve if self.store is None or is_shared(self.execution, waiting) else partial(self._solve_here, work)
        try:
            with closing(share_out(_tried, (solve, plan), waiting, self.execution)) as outcomes:
                for chunk, outcome in outcomes:
                    self.kept.states = {place: state for place, state in self.kept.states.items() if place[1] != chunk}
                    undone.discard(chunk)
                    if isinstance(outcome, DielastError):
                        failed[chunk] = outcome
                    else:
                        self.new = True
                        if chunk in join_of:
                            kept[chunk] = outcome
                            self._join(kept, join_of[chunk], joins)
                        else:
                            kept[chunk] = self.held(outcome)
                    if failed and not (undone and min(undone) < min(failed)):
                        raise failed[min(failed)]
                    done += chunk[1] - chunk[0]
                    if time.monotonic() >= self.due and (undone or self.saved):
                        self.save()
                    if self.execution.progress is not None and len(chunks) > 1:
                        self.execution.progress(done, total, work.many)
        except (InputError, NumericsError) as error:
            # what a case raises would be raised again
            if failed or not self.save():
                raise
            raise error.adding(f"; {KEPT}") from None
        except BaseException:
            self.save()
            raise
        return [kept[chunk] for chunk in outermost(kept)]

    def _solve_here(self, work: Work[Plan, Solved], plan: Plan, first: int, end: int) -> Solved:
        """Solve a chunk in this process, and keep the states of its simulations as they go."""
        token = KEEPER.set(_States(self, work.many, (first, end)))
        try:
            return work.solve(plan, first, end)
        finally:
            KEEPER.reset(token)

    def _join(self, kept: dict[Chunk, Any], whole: Chunk, joins: Mapping[Chunk, tuple[Sequence[Chunk], Draws[Any]]]) -> None:
        """Replace the results of draws by that of their case, once they are all there."""
        parts, draws = joins[whole]
        if whole not in kept and all(part in kept for part in parts):
            kept[whole] = self.held(draws.joined([kept[part] for part in parts]))
            for part in parts:
                del kept[part]

    def state(self) -> str:
        """What the file holds, for the message about an interrupt; empty if it holds nothing."""
        counts = {many: size(outermost(self.kept.results[many])) for many in self.totals} if self.saved else {}
        kept = [f"{count} of {self.totals[many]} {many}" for many, count in counts.items() if count]
        kept += [f"the states of {many} under way" for many in dict.fromkeys(place[0] for place in self.kept.states)]
        return GOES_ON.format(" and ".join(kept)) if kept else ""

    def save(self) -> bool:
        """Keep all results so far in the file, which is written whole or not at all; returns whether there are any."""
        if self.store is not None and self.new:
            begin = time.monotonic()
            try:
                write_files(self.store.parent, {self.store.name: self.kept.pieces(self.key)})
            except Overfull:  # what an earlier save has kept stays
                self.store = None
                self.note(f"results of more than {LARGEST >> 30} GiB: an interrupt keeps no more of them than until now")
                return self.saved
            self.new, self.saved = False, True
            self.due = time.monotonic() + max(PAUSE, (time.monotonic() - begin) / SAVING)
        if self.saved:
            self.keep(self.state())
        return self.saved


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
    elif is_shared(execution, chunks):
        from dielast.sharing.processes import solve_in_processes

        yield from solve_in_processes(execution.jobs, solve, plan, chunks)
    else:
        for first, end in chunks:
            yield solve(plan, first, end)


def is_shared(execution: Execution, chunks: Sequence[Chunk]) -> bool:
    """Whether other processes than this one solve the chunks."""
    return execution.scheduler is not None or (execution.jobs > 1 and len(chunks) > 1)


@dataclass(slots=True)
class _States(Keeper):
    """Keeps the states of the simulations of one chunk, which a study solves in this process."""

    study: Study
    many: str
    chunk: Chunk
    number: int = 0
    due: float = field(default_factory=lambda: time.monotonic() + STATE)

    def resumed(self) -> Any:
        """The state that an earlier run has kept of the simulation that now begins, None without one."""
        self.number += 1
        try:
            return restored(self.study.kept.states[self.many, self.chunk, self.number])
        except Exception:  # it has none, or there is a law that dielast does not know
            return None

    def keep(self, state: Any) -> None:
        """Keep the state, if it is time to, and show how far it is."""
        if self.study.execution.progress is not None and self.study.totals[self.many] == size([self.chunk]):
            state.show(self.study.execution.progress)
        if (begin := time.monotonic()) >= self.due:
            self.study.kept.states[self.many, self.chunk, self.number] = pickle.dumps(state, protocol=5)
            self.study.new = True
            self.study.save()
            self.due = time.monotonic() + max(STATE, (time.monotonic() - begin) / SAVING)


def _by_number(batches: Sequence[Batch[Result]], solved: Sequence[Sequence[Result]]) -> list[Result]:
    """The results of all members of batches, from those of each batch."""
    results: dict[int, Result] = {}
    for batch, own in zip(batches, solved, strict=True):
        results.update(zip(batch.members, own, strict=True))
    return [results[number] for number in range(len(results))]


def _left(chunks: Sequence[Chunk], done: Sequence[Chunk]) -> list[Chunk]:
    """The parts of the chunks that are not `done`; both are in order, and none overlap."""
    left, place = [], 0
    for first, last in chunks:
        while place < len(done) and done[place][0] < last:
            begin, end = done[place]
            if begin > first:
                left.append((first, begin))
            first = max(first, end)
            if end > last:
                break
            place += 1
        if first < last:
            left.append((first, last))
    return left


def _tried(work: tuple[Solve[Plan, Solved], Plan], first: int, end: int) -> tuple[Chunk, Solved | DielastError]:
    """A chunk, and its result or the error that it raised."""
    solve, plan = work
    try:
        return (first, end), solve(plan, first, end)
    except (InputError, NumericsError) as error:
        return (first, end), error.with_traceback(None)


def _solve_batch(plan: Mapping[Chunk, Batch[Result]], first: int, end: int) -> Sequence[Result]:
    return plan[first, end].solve()
