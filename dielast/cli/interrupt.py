"""Ctrl-C: a `KeyboardInterrupt` while cases are solved or files written; at any other time the process ends at once."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType


class Leave:
    """Ends the process, whatever Python is doing: an exception would surface as a traceback of whatever is loaded or torn down."""

    kept = ""
    """What the run leaves if it is interrupted now; empty before a run begins."""

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Handle the signal."""
        with suppress(OSError):
            os.write(2, f"{self.message()}\n".encode("utf-8", "backslashreplace"))
        os._exit(130)

    def message(self) -> str:
        """The line about the interrupt; on a terminal the ^C that it shows has a line of its own."""
        line_begun = sys.stderr is not None and sys.stderr.isatty()
        return "\n" * line_begun + "interrupted" + (f": {self.kept}" if self.kept else "")


leave = Leave()
"""The handler of SIGINT from the start of the command line to its end."""


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
