"""Solve the chunks of a plan in several processes of this machine, which all end with the run."""

import mmap
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
from contextlib import contextmanager
from functools import partial
from multiprocessing import resource_tracker
from multiprocessing.context import get_spawning_popen
from queue import Empty, SimpleQueue
from typing import IO, Any

from dielast.base.errors import InputError, NumericsError
from dielast.base.registry import adopt, adopted
from dielast.base.signals import ENDING
from dielast.sharing.execution import Chunk, Plan, Solve, Solved

MOST = 61 if sys.platform == "win32" else 10_000  # Windows waits for no more processes in one call
PAUSE = 0.2  # s between two checks for Ctrl-C, which does not interrupt an endless wait on Windows
UNGUARDED = 87  # exit code of a worker process that begins to start workers itself
GUARD = 'worker processes import the script that starts them: put its calls below `if __name__ == "__main__":`'

# in a worker process: the file that holds the function and the plan, and both once they are read
_file = -1
_given: tuple[Callable[[Any, int, int], Any], Any] | None = None


def solve_in_processes(jobs: int, solve: Solve[Plan, Solved], plan: Plan, chunks: Sequence[Chunk]) -> Generator[Solved, None, None]:
    """`solve(plan, first, end)` of each chunk by `jobs` processes, in the order in which chunks are finished.

    Raises `NumericsError` if a process is killed, `InputError` if the plan cannot be written to a temporary file, if no process
    can be started, or if a script calls this at its top level.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # in a worker process that imports such a script
        os._exit(UNGUARDED)
    with _written(pickle.dumps((solve, plan))) as file:
        yield from _solve_written(jobs, _Handle(file), chunks)


def _written(content: bytes) -> IO[bytes]:
    """A temporary file without a name, or one that Windows deletes: the system removes it with the last process that has it open.

    Workers read it with their first chunk. If it came with their start and were larger than a pipe holds, a worker that ends before
    it has read all would let this process wait forever.
    """
    try:
        file = tempfile.TemporaryFile()  # noqa: SIM115, the caller closes it
        try:
            file.write(content)
            file.flush()
        except BaseException:
            file.close()
            raise
    except OSError as error:
        raise InputError(f"worker processes need a temporary file: {(error.strerror or str(error)).lower()}") from None
    return file


class _Handle:
    """An open file that a process hands to those that it starts, which get its descriptor instead of this object."""

    def __init__(self, file: IO[bytes]) -> None:
        self.file = file

    def __reduce__(self) -> tuple[Callable[[int], int], tuple[int]]:
        own = self.file.fileno()
        if sys.platform == "win32":
            import msvcrt

            own = msvcrt.get_osfhandle(own)
        return _descriptor, (get_spawning_popen().duplicate_for_child(own),)  # type: ignore[union-attr]


def _descriptor(inherited: int) -> int:
    if sys.platform == "win32":
        import msvcrt

        return msvcrt.open_osfhandle(inherited, os.O_RDONLY)
    return inherited


def _solve_written(jobs: int, file: _Handle, chunks: Sequence[Chunk]) -> Generator[Any, None, None]:
    others = multiprocessing.active_children()
    # spawned, not forked: a fork would copy locks that the threads of a notebook hold
    started = multiprocessing.get_context("spawn")
    if hasattr(signal, "pthread_sigmask"):
        # Python's tracker of semaphores is started apart, as Python then lets signals through
        with _undisturbed():
            resource_tracker.ensure_running()
    pool = ProcessPoolExecutor(min(jobs, len(chunks), MOST), started, initializer=partial(_receive, file, adopted()))
    workers: set[Any] = set()
    futures: list[Future[Any]] = []
    try:
        with _undisturbed():
            for chunk in chunks:
                futures.append(_submitted(pool, chunk))
                # after each: those that end before the last has started are no longer active
                workers.update(set(multiprocessing.active_children()).difference(others))
        for future in _finished(futures):
            yield future.result()
        # the thread of the pool closes a pipe that the interpreter would otherwise write to at exit, perhaps just then
        pool.shutdown(wait=True)
    except BaseException as error:
        # the pool would end its workers by SIGTERM, which they ignore, or wait until they have solved what they have begun
        workers.update(set(multiprocessing.active_children()).difference(others))
        for worker in workers:
            worker.kill()
        pool.shutdown(wait=True, cancel_futures=True)
        if not isinstance(error, BrokenProcessPool):
            raise
        # a worker that imports a script with sys.exit(main()) at its top level ends as if all were well
        if any(worker.exitcode in (UNGUARDED, 0) for worker in workers):
            raise InputError(GUARD) from None
        raise NumericsError("a worker process was killed, perhaps for lack of memory") from None


def _submitted(pool: ProcessPoolExecutor, chunk: Chunk) -> Future[Any]:
    """The future of a chunk, for which the pool may start a process; raises `InputError` if the system lets it start none."""
    try:
        return pool.submit(_solve_given, *chunk)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"cannot start worker processes: {reason}; fewer need less (--jobs)") from None


def _finished(futures: list[Future[Solved]]) -> Iterator[Future[Solved]]:
    """The futures in the order in which they finish; Ctrl-C interrupts the wait on every system.

    The list is emptied, as a future holds its result.
    """
    finished: SimpleQueue[Future[Solved]] = SimpleQueue()
    for future in futures:
        future.add_done_callback(finished.put)
    left = len(futures)
    futures.clear()
    while left:
        try:
            future = finished.get(timeout=PAUSE)
        except Empty:
            continue
        left -= 1
        yield future


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Block signals while other processes start, which inherit this and never see any; where the system can."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _receive(file: Any, packages: Sequence[tuple[str, str, str]]) -> None:
    global _file
    _file = file  # its descriptor in this process
    for number in ENDING:  # the parent handles them
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    for group, name, _ in packages:
        adopt(name, group)


def _end_with_parent() -> None:
    """End this process when its parent ends; otherwise it would wait for work forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _solve_given(first: int, end: int) -> Any:
    global _given
    if _given is None:
        with mmap.mmap(_file, 0, access=mmap.ACCESS_READ) as content:
            _given = pickle.loads(content)
    solve, plan = _given
    return solve(plan, first, end)
