"""Ctrl-C: a `KeyboardInterrupt` while cases are solved or files written; at any other time the process ends at once."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType


class Leave:
    """Handler that ends the process at once: an exception while modules are loaded or torn down would print a traceback."""

    kept = ""
    """What an interrupt leaves at present, for the message; empty before a run begins."""

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Handle the signal."""
        with suppress(OSError):
            os.write(2, f"{self.message()}\n".encode("utf-8", "backslashreplace"))
        os._exit(130)

    def message(self) -> str:
        """The message about the interrupt, below the ^C that a terminal shows."""
        line_begun = sys.stderr is not None and sys.stderr.isatty()
        return "\n" * line_begun + "interrupted" + (f": {self.kept}" if self.kept else "")


leave = Leave()
"""The handler of SIGINT while the command line runs."""


@contextmanager
def working() -> Iterator[None]:
    """Let Ctrl-C raise `KeyboardInterrupt` in this context, if its handler is `leave`."""
    before = signal.getsignal(signal.SIGINT)
    if before is not leave:
        yield
        return
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
