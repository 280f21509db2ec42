"""Standard streams that are closed, full or broken: results are written all the same, and the exit code does not change."""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import Any


class _Unheard(io.RawIOBase):
    """The stream `raw`, but what it cannot write is swallowed: no reason to fail."""

    def __init__(self, raw: io.RawIOBase) -> None:
        self._raw = raw

    def write(self, data: Any) -> int:
        try:
            written = self._raw.write(data)
        except OSError:
            written = None
        return len(data) if written is None else written

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._raw.fileno()

    def isatty(self) -> bool:
        return self._raw.isatty()


def mend_streams() -> None:
    """Open closed streams, and let writing to standard error never fail; for the start of a program only."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number, which is this `number`
    if sys.stdout is None:
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(io.FileIO(1, "w", closefd=False)), encoding="utf-8")
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")  # a pipe of Windows knows 256 characters
    encoding = "utf-8" if sys.stderr is None else sys.stderr.encoding
    # the console of Windows takes text by functions of its own, not as bytes for stream 2
    raw = getattr(getattr(sys.stderr, "buffer", None), "raw", None) or io.FileIO(2, "w", closefd=False)
    buffer = io.BufferedWriter(_Unheard(raw))
    sys.stderr = io.TextIOWrapper(buffer, encoding=encoding, errors="backslashreplace", line_buffering=True)


def is_unread(error: OSError) -> bool:
    """Whether the program that reads standard output has gone; Windows calls that an invalid argument."""
    return isinstance(error, BrokenPipeError) or (os.name == "nt" and error.errno == errno.EINVAL and error.filename is None)


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
