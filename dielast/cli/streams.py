"""Standard streams that are closed, full or broken: they change neither the results nor the exit code."""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import Any


class _Unheard(io.RawIOBase):
    """The stream `raw` without its errors: text that it cannot write is lost."""

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
    """Open closed streams, and make standard error ignore errors of writing; for the start of a program only."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the system takes the lowest free descriptor, which is `number`
    if sys.stdout is None:
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(io.FileIO(1, "w", closefd=False)), encoding="utf-8")
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")  # a pipe on Windows may have a code page of 256 characters
    encoding = "utf-8" if sys.stderr is None else sys.stderr.encoding
    # Python writes text to the console of Windows by other functions than to file descriptor 2
    raw = getattr(getattr(sys.stderr, "buffer", None), "raw", None) or io.FileIO(2, "w", closefd=False)
    buffer = io.BufferedWriter(_Unheard(raw))
    sys.stderr = io.TextIOWrapper(buffer, encoding=encoding, errors="backslashreplace", line_buffering=True)


def is_unread(error: OSError) -> bool:
    """Whether the error means that the reader of standard output has gone; on Windows it is an invalid argument."""
    return isinstance(error, BrokenPipeError) or (os.name == "nt" and error.errno == errno.EINVAL and error.filename is None)


def give_up_output() -> None:
    """Discard the rest of standard output, which would fail again when the process ends."""
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
