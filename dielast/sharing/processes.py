"""Share work out to several processes of this machine, none of which outlives the run."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, TypeVar

from dielast.errors import NumericsError

FROM_OUTSIDE = (signal.SIGINT, signal.SIGTERM)

Plan = TypeVar("Plan")
Solved = TypeVar("Solved")

_given: tuple[Callable[[Any, int, int], Any], Any] | None = None  # of a worker process: how to solve what


def solve_in_processes(
    jobs: int, solve: Callable[[Plan, int, int], Solved], plan: Plan, chunks: Sequence[tuple[int, int]]
) -> Generator[Solved, None, None]:
    """`solve(plan, first, end)` of each chunk, in the order in which they are finished, by so many processes.

    Raises `NumericsError` if one of them is killed.
    """
    others = multiprocessing.active_children()
    futures: list[Future[Solved]] = []
    pool = ProcessPoolExecutor(min(jobs, len(chunks)), initializer=_receive, initargs=(solve, plan))
    try:
        # the handler stands before signals are let through again: one that came meanwhile is answered
        with _cancelled(futures), _terminated_as_interrupted():
            with _undisturbed():
                futures += [pool.submit(_solve_given, *chunk) for chunk in chunks]
            for future in as_completed(futures):
                yield future.result()
    except BrokenProcessPool:
        # it would end its other workers with a signal that they ignore, and wait for them
        for child in set(multiprocessing.active_children()).difference(others):
            child.kill()
        # the thread that looks after them closes what the interpreter would write to as it ends
        pool.shutdown(wait=True)
        raise NumericsError("a worker process was killed, for want of memory perhaps") from None
    finally:
        pool.shutdown(wait=False)


@contextmanager
def _cancelled(futures: Sequence[Future[Any]]) -> Iterator[None]:
    """If results are no longer wanted, what is not begun never is."""
    try:
        yield
    except BrokenProcessPool:  # in which nothing is begun any more
        raise
    except BaseException:
        # one by one: a pool that nobody holds any more forgets that it was to cancel what it has not begun
        for future in futures:
            future.cancel()
        raise


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Start processes that no signal meets before they can ignore it, where the system can hold signals back."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, FROM_OUTSIDE)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Let a SIGTERM interrupt as Ctrl-C does, so that no process is left working for nobody."""
    try:
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    except ValueError:  # not the main thread, which alone may say so
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _receive(solve: Callable[[Any, int, int], Any], plan: Any) -> None:
    global _given
    for number in FROM_OUTSIDE:  # which are the parent's to answer
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _given = solve, plan


def _end_with_parent() -> None:
    """End this process once its parent is gone, whatever ended that: it would wait for work for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _solve_given(first: int, end: int) -> Any:
    assert _given is not None
    solve, plan = _given
    return solve(plan, first, end)
