"""What the process shares with its terminal: standard streams, which may be closed, full or broken, signals, and a progress bar."""

import errno
import io
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Any

from dielast.base.signals import ENDING

if TYPE_CHECKING:
    from rich.progress import Progress


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


class Leave:
    """Handler that ends the process at once: an exception while modules are loaded or torn down would print a traceback."""

    kept = ""
    """What an interrupt leaves at present, for the message; empty before a run begins."""
    code = 128 + signal.SIGINT
    """The exit code after an interrupt: 128 and the number of the signal, as shells report a process that a signal has ended."""

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Handle the signal."""
        with suppress(OSError):
            os.write(2, f"{self.message()}\n".encode("utf-8", "backslashreplace"))
        os._exit(128 + number)

    def interrupt(self, number: int, frame: FrameType | None) -> None:
        """Handle the signal while a command works: raise `KeyboardInterrupt`."""
        self.code = 128 + number
        raise KeyboardInterrupt

    def keep(self, what: str) -> None:
        """Set what an interrupt leaves from now on, for its message."""
        self.kept = what

    def message(self) -> str:
        """The message about the interrupt, below the ^C that a terminal shows."""
        line_begun = sys.stderr is not None and sys.stderr.isatty()
        return "\n" * line_begun + "interrupted" + (f": {self.kept}" if self.kept else "")


leave = Leave()
"""The handler of signals that end the process, while the command line runs."""


def handle_signals() -> None:
    """Let `leave` handle the signals that end the process, but for those that whoever started it lets it ignore."""
    for number in ENDING:
        if signal.getsignal(number) not in (signal.SIG_IGN, None):
            signal.signal(number, leave)


@contextmanager
def working() -> Iterator[None]:
    """Let the signals that end the process raise `KeyboardInterrupt` in this context, if their handler is `leave`."""
    handled = [number for number in ENDING if signal.getsignal(number) is leave]
    for number in handled:
        signal.signal(number, leave.interrupt)
    try:
        yield
    finally:
        for number in handled:
            signal.signal(number, leave)


MINUTE = 60.0  # s between two lines of progress where there is no terminal


class Bar:
    """A bar with the remaining time for cases, cells or draws; a line a minute if standard error is not a terminal."""

    def __init__(self, quiet: bool, jobs: int) -> None:
        """Label the bar with the number of processes, `jobs`, if there are several."""
        self._seen = not quiet and sys.stderr is not None and sys.stderr.isatty()
        self._shared = f" in {jobs} processes" if jobs > 1 else ""
        self._bar: Progress | None = None
        self._told = not quiet and not self._seen and sys.stderr is not None
        self._state: tuple[int, int, str] | None = None
        self._begun = self._since = time.monotonic()
        self._ended = threading.Event()
        if self._told:
            threading.Thread(target=self._tell, daemon=True).start()

    def _tell(self) -> None:
        """Print a line a minute until the run ends."""
        while not self._ended.wait(MINUTE):
            print(f"progress: {self._line()}", file=sys.stderr, flush=True)

    def _line(self) -> str:
        now = time.monotonic()
        running = f"{(now - self._begun) / 60:.0f} min"
        if self._state is None:
            return f"running for {running}"
        done, total, what = self._state
        left = f", about {max((now - self._since) * (total - done) / done / 60, 1):.0f} min left" if 0 < done < total else ""
        return f"{done} of {total} {what}{self._shared} after {running}{left}"

    def __call__(self, done: int, total: int, what: str) -> None:
        """Show that `done` of `total` are finished; `what` is their plural, such as cells, and may change during a run."""
        if self._state is None or self._state[2].partition(",")[0] != what.partition(",")[0]:
            self._since = self._begun if self._state is None else time.monotonic()
        self._state = (done, total, what)
        if not self._seen:
            return
        if self._bar is None:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            columns = MofNCompleteColumn(), TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), TextColumn("left")
            self._bar = Progress(*columns, console=Console(stderr=True), transient=True)
            self._bar.add_task(what, total=total)
            self._bar.start()
        self._bar.update(self._bar.task_ids[0], completed=done, total=total, description=what + self._shared)
        if done == total:
            self._remove()

    def stop(self) -> None:
        """Take the bar away, so that the next line to be printed begins on an empty line."""
        self._ended.set()
        self._remove()

    def _remove(self) -> None:
        if self._bar is not None:
            self._bar.stop()
            self._bar = None
