"""Solve the chunks of a plan in several processes of this machine, which all end with the run."""

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from typing import Any

from dielast.errors import NumericsError
from dielast.registry import adopt, adopted
from dielast.sharing.execution import Chunk, Plan, Solve, Solved

FROM_OUTSIDE = (signal.SIGINT, signal.SIGTERM)
MOST = 61 if sys.platform == "win32" else 10_000  # Windows waits for no more processes in one call
PAUSE = 0.2  # s between two checks for Ctrl-C, which does not interrupt an endless wait on Windows

_given: tuple[Callable[[Any, int, int], Any], Any] | None = None  # in a worker process: the function and the plan


def solve_in_processes(jobs: int, solve: Solve[Plan, Solved], plan: Plan, chunks: Sequence[Chunk]) -> Generator[Solved, None, None]:
    """`solve(plan, first, end)` of each chunk by `jobs` processes, in the order in which chunks are finished.

    Raises `NumericsError` if a process is killed.
    """
    others = multiprocessing.active_children()
    futures: list[Future[Solved]] = []
    # spawned, not forked: a fork would copy locks that the threads of a notebook hold
    started = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(jobs, len(chunks), MOST), started, initializer=_receive, initargs=(solve, plan, adopted()))
    try:
        # the handler is set before signals are unblocked, so that it handles a signal that came in between
        with _terminated_as_interrupted():
            with _undisturbed():
                futures += [pool.submit(_solve_given, *chunk) for chunk in chunks]
            for future in _finished(futures):
                yield future.result()
        # the thread of the pool closes a pipe that the interpreter would otherwise write to at exit, perhaps just then
        pool.shutdown(wait=True)
    except BrokenProcessPool:
        # the pool would end its other workers by SIGTERM, which they ignore, and wait for them
        for child in set(multiprocessing.active_children()).difference(others):
            child.kill()
        pool.shutdown(wait=True)
        raise NumericsError("a worker process was killed, perhaps for lack of memory") from None
    except BaseException:
        # one by one, as a pool without a reference to it ignores `cancel_futures`
        for future in futures:
            future.cancel()
        # the caller keeps what is solved first; the interpreter waits at exit for the chunks that are being solved
        pool.shutdown(wait=False)
        raise


def _finished(futures: Sequence[Future[Solved]]) -> Iterator[Future[Solved]]:
    """The futures in the order in which they finish; Ctrl-C interrupts the wait on every system."""
    finished: SimpleQueue[Future[Solved]] = SimpleQueue()
    for future in futures:
        future.add_done_callback(finished.put)
    left = len(futures)
    while left:
        try:
            future = finished.get(timeout=PAUSE)
        except Empty:
            continue
        left -= 1
        yield future


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Block signals while worker processes start, until they ignore them; where the system can."""
    if hasattr(signal, "pthread_sigmask"):
        before = signal.pthread_sigmask(signal.SIG_BLOCK, FROM_OUTSIDE)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
    elif console := _console():
        console.SetConsoleCtrlHandler(None, True)  # ignored by this process for now, and by the processes that it starts for good
        try:
            yield
        finally:
            console.SetConsoleCtrlHandler(None, False)
    else:
        yield


def _console() -> Any:
    """The functions of the Windows console, None on other systems."""
    import ctypes

    return getattr(getattr(ctypes, "windll", None), "kernel32", None)


@contextmanager
def _terminated_as_interrupted() -> Iterator[None]:
    """Let SIGTERM interrupt the run as Ctrl-C does, so that no worker process is left behind."""
    try:
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    except ValueError:  # only the main thread may set handlers
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _receive(solve: Callable[[Any, int, int], Any], plan: Any, packages: Sequence[tuple[str, str, str]]) -> None:
    global _given
    for group, name, _ in packages:
        adopt(name, group)
    for number in FROM_OUTSIDE:  # the parent handles them
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _given = solve, plan


def _end_with_parent() -> None:
    """End this process when its parent ends; otherwise it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _solve_given(first: int, end: int) -> Any:
    assert _given is not None
    solve, plan = _given
    return solve(plan, first, end)
