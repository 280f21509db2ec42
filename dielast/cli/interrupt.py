"""Ctrl-C: a `KeyboardInterrupt` while cells are solved or files written; else, with nothing to put in order, the end at once."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType


def leave(number: int, frame: FrameType | None) -> None:
    """End the process, whatever Python is doing: an exception would surface as a traceback of whatever is loaded or torn down."""
    with suppress(OSError):
        os.write(2, b"\ninterrupted\n" if os.isatty(2) else b"interrupted\n")  # after the ^C that a terminal shows
    os._exit(130)


@contextmanager
def working() -> Iterator[None]:
    """Let Ctrl-C raise `KeyboardInterrupt` in here, if it would `leave` otherwise."""
    before = signal.getsignal(signal.SIGINT)
    if before is not leave:
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
