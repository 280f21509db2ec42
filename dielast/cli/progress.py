"""How far a run is: a bar on standard error, on a terminal only, and what an interrupted run leaves."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress

NOTHING_KEPT = "nothing is kept or written; the same command begins anew"


class Bar:
    """A bar for each sort of thing that is counted, one after the other, with the time left; none where nobody would see it."""

    def __init__(self, quiet: bool, jobs: int) -> None:
        """Say that `jobs` processes share the work, if they are more than one."""
        self._seen = not quiet and sys.stderr is not None and sys.stderr.isatty()
        self._shared = f" in {jobs} processes" if jobs > 1 else ""
        self._bar: Progress | None = None

    def __call__(self, done: int, of: int, what: str) -> None:
        """So many are `done`, of how many, and of `what`, such as cells."""
        if not self._seen:
            return
        if self._bar is None:
            self._bar = _bar(what + self._shared, of)
            self._bar.start()
        self._bar.update(self._bar.task_ids[0], completed=done)
        if done == of:
            self.stop()

    def stop(self) -> None:
        """Take the bar away, so that what is printed next has a line of its own."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None


def interrupted(kept: str = "") -> str:
    """What is said of an interrupt, on a line of its own though the terminal shows ^C, and of what is `kept`."""
    begun = sys.stderr is not None and sys.stderr.isatty()
    return "\n" * begun + "interrupted" + (f": {kept}" if kept else "")


def _bar(counted: str, of: int) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (MofNCompleteColumn(), TextColumn(counted), BarColumn(), TimeRemainingColumn(), TextColumn("left"))
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    bar.add_task("", total=of)
    return bar
