"""Solve the chunks of a plan in several processes of this machine, which all end with the run."""

import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import Any

from dielast.base.errors import InputError, NumericsError
from dielast.base.registry import adopt, adopted
from dielast.sharing.execution import Chunk, Plan, Solve, Solved

FROM_OUTSIDE = (signal.SIGINT, signal.SIGTERM)
MOST = 61 if sys.platform == "win32" else 10_000  # Windows waits for no more processes in one call
PAUSE = 0.2  # s between two checks for Ctrl-C, which does not interrupt an endless wait on Windows

# in a worker process: the file that holds the function and the plan, and both once they are read
_file = ""
_given: tuple[Callable[[Any, int, int], Any], Any] | None = None


def solve_in_processes(jobs: int, solve: Solve[Plan, Solved], plan: Plan, chunks: Sequence[Chunk]) -> Generator[Solved, None, None]:
    """`solve(plan, first, end)` of each chunk by `jobs` processes, in the order in which chunks are finished.

    Raises `NumericsError` if a process is killed, `InputError` if the plan cannot be written to a temporary file.
    """
    file = _written(pickle.dumps((solve, plan)))
    try:
        yield from _solve_written(jobs, file, chunks)
    finally:
        _remove(file)


def _written(content: bytes) -> str:
    """The name of a new temporary file of this user alone.

    Workers read it with their first chunk. If it came with their start and were larger than a pipe holds, a worker that ends before
    it has read all would let this process wait forever.
    """
    name = ""
    try:
        handle, name = tempfile.mkstemp(prefix="dielast-")
        with open(handle, "wb") as file:
            file.write(content)
    except OSError as error:
        _remove(name)
        raise InputError(f"worker processes need a temporary file: {(error.strerror or str(error)).lower()}") from None
    return name


def _remove(file: str) -> None:
    with suppress(OSError):  # another process has removed it, or reads it (Windows)
        os.unlink(file)


def _solve_written(jobs: int, file: str, chunks: Sequence[Chunk]) -> Generator[Any, None, None]:
    others = multiprocessing.active_children()
    futures: list[Future[Any]] = []
    # spawned, not forked: a fork would copy locks that the threads of a notebook hold
    started = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(jobs, len(chunks), MOST), started, initializer=_receive, initargs=(file, adopted()))
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


def _receive(file: str, packages: Sequence[tuple[str, str, str]]) -> None:
    global _file
    _file = file
    for group, name, _ in packages:
        adopt(name, group)
    for number in FROM_OUTSIDE:  # the parent handles them
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when its parent ends; otherwise it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        _remove(_file)
        os._exit(1)


def _solve_given(first: int, end: int) -> Any:
    global _given
    if _given is None:
        with open(_file, "rb") as file:
            _given = pickle.load(file)
    solve, plan = _given
    return solve(plan, first, end)
