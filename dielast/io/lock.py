"""A lock by which only one process at a time writes into a folder; Windows locks only files, so a file stands for the folder."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

LONGEST_WAIT = 5.0  # s until another process has written its files; it takes milliseconds
LOCK = ".lock"
"""The file that is locked where folders cannot be; it is removed afterwards."""
Locking = Callable[[int], None]


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[bool]:
    """Wait until no other process writes into `folder`, at most `LONGEST_WAIT`; True if this process is then the only one.

    False if the file system has no locks, or if another process keeps its lock, as a suspended process does. Ctrl-C just as this
    process gets the lock may leave it locked, too.
    """
    locking, of_file = _locking()
    if locking is None:
        yield False
        return
    try:
        handle = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT) if of_file else os.open(folder, os.O_RDONLY)
    except OSError:
        yield False
        return
    try:
        yield _acquired(locking, handle)
    finally:
        os.close(handle)  # releases the lock
        if of_file:
            with contextlib.suppress(OSError):  # another process has opened the file, and will remove it
                os.unlink(folder / LOCK)


def _acquired(locking: Locking, handle: int) -> bool:
    deadline = time.monotonic() + LONGEST_WAIT
    while time.monotonic() < deadline:
        try:
            locking(handle)
        except (BlockingIOError, PermissionError):  # another process has the lock (POSIX, Windows)
            time.sleep(0.01)
        except OSError:  # the file system has no locks
            return False
        else:
            return True
    return False


def _locking() -> tuple[Locking | None, bool]:
    """A function that locks an open file or raises `OSError` at once (None if there is none), and whether it locks only files."""
    with contextlib.suppress(ImportError):
        import fcntl

        return lambda handle: fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB), False
    with contextlib.suppress(ImportError):
        import msvcrt

        first_byte = 1
        return lambda handle: msvcrt.locking(handle, msvcrt.LK_NBLCK, first_byte), True  # type: ignore[attr-defined, unused-ignore]
    return None, False
