"""Standard streams that are closed, full or broken: results are written all the same, and the exit code does not change."""

from __future__ import annotations

import io
import os
import sys
from typing import Any


class _Unheard(io.FileIO):
    """A stream that swallows what it cannot write: no reason to fail."""

    def write(self, data: Any) -> int:
        try:
            written = super().write(data)
        except OSError:
            written = None
        return len(data) if written is None else written


def mend_streams() -> None:
    """Open closed streams, and let writing to standard error never fail; for the start of a program only."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number, which is this `number`
    if sys.stdout is None:
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(io.FileIO(1, "w", closefd=False)), encoding="utf-8")
    encoding = "utf-8" if sys.stderr is None else sys.stderr.encoding
    buffer = io.BufferedWriter(_Unheard(2, "w", closefd=False))
    sys.stderr = io.TextIOWrapper(buffer, encoding=encoding, errors="backslashreplace", line_buffering=True)


def give_up_output() -> None:
    """Send the rest of standard output nowhere: it could not be written to, and would fail again at the end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def report_refusal(error: OSError) -> int:
    """Print in one line what the system refused, and return the exit code."""
    reason = error.strerror.lower() if error.strerror else str(error)
    if error.filename is not None:
        line = f"{error.filename}: {reason}"
    elif isinstance(error, FileNotFoundError):
        line = "the current folder is no longer there"
    else:
        line = f"cannot write: {reason}"
    print(line, file=sys.stderr)
    give_up_output()
    return 2
