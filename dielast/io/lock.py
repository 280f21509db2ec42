"""One process at a time writes into a folder, on systems that lock folders (POSIX) and on those that lock files only (Windows)."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

LONGEST_WAIT = 5.0  # s until another process has written its files; it takes milliseconds
LOCK = ".lock"
"""The file that stands for its folder where folders cannot be locked; it is gone afterwards."""
Locking = Callable[[int], None]


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[bool]:
    """Wait until no other process writes into `folder`, though not for ever, and say whether this process is the only one.

    False where the file system has no locks, and where another process keeps its lock: one that is stopped does, and this process
    itself if Ctrl-C came as it got the lock.
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
        os.close(handle)  # which gives the lock back
        if of_file:
            with contextlib.suppress(OSError):  # another process has it open by now, and removes it
                os.unlink(folder / LOCK)


def _acquired(locking: Locking, handle: int) -> bool:
    deadline = time.monotonic() + LONGEST_WAIT
    while time.monotonic() < deadline:
        try:
            locking(handle)
        except (BlockingIOError, PermissionError):  # the error of POSIX and that of Windows while another process has the lock
            time.sleep(0.01)
        except OSError:  # a file system without locks
            return False
        else:
            return True
    return False


def _locking() -> tuple[Locking | None, bool]:
    """What locks an open file or raises `OSError` at once, None if the system has nothing; and whether it locks files only."""
    with contextlib.suppress(ImportError):
        import fcntl

        return lambda handle: fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB), False
    with contextlib.suppress(ImportError):
        import msvcrt

        first_byte = 1
        return lambda handle: msvcrt.locking(handle, msvcrt.LK_NBLCK, first_byte), True  # type: ignore[attr-defined, unused-ignore]
    return None, False
