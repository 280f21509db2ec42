"""Progress of a run: a bar on standard error, on a terminal only."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress


class Bar:
    """A bar with the remaining time for cases, cells or draws; none if standard error is not a terminal."""

    def __init__(self, quiet: bool, jobs: int) -> None:
        """Label the bar with the number of processes, `jobs`, if there are several."""
        self._seen = not quiet and sys.stderr is not None and sys.stderr.isatty()
        self._shared = f" in {jobs} processes" if jobs > 1 else ""
        self._bar: Progress | None = None

    def __call__(self, done: int, total: int, what: str) -> None:
        """Show that `done` of `total` are finished; `what` is their plural, such as cells, and may change during a run."""
        if not self._seen:
            return
        if self._bar is None:
            self._bar = _bar(what + self._shared, total)
            self._bar.start()
        self._bar.update(self._bar.task_ids[0], completed=done, total=total, description=what + self._shared)
        if done == total:
            self.stop()

    def stop(self) -> None:
        """Take the bar away, so that the next line to be printed begins on an empty line."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None


def _bar(counted: str, total: int) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (MofNCompleteColumn(), TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(), TextColumn("left"))
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    bar.add_task(counted, total=total)
    return bar
