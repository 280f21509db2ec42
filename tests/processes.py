"""What the tests that start processes share."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

Process = subprocess.Popen[str]
Run = Callable[..., subprocess.CompletedProcess[str]]
"""The command line, run with some arguments."""
PYTHON = (sys.executable, "-W", "error::SyntaxWarning")
DIELAST = (sys.executable, "-c", "from dielast.cli import main; main()")
# many chunks, though few cells: what is left to itself for a while is not at its end
SMALL_CHUNKS = """
from dielast.sharing import study
from dielast.commands.grids import failure_map as maps
from dielast.commands.grids import design as designs
from dielast.commands.simulation import cases
study.PAUSE, maps.CHUNK, designs.CHUNK, cases.PART = 0.0, 128, 8, 400
"""
# a run that has kept its first chunk goes on once there is a file named go: none is finished before its test says so
HELD = f"""
import time
from pathlib import Path
{SMALL_CHUNKS}
save = study.Study.save
def save_and_wait(*given):
    study.Study.save = save
    save(*given)
    while not Path("go").exists():
        time.sleep(0.01)
study.Study.save = save_and_wait
from dielast.cli import main; main()
"""
ENDS = 600.0  # s in which whatever is started ends, however busy the machine


def until(happened: Callable[[], bool]) -> None:
    """Wait for what happens, though not for ever."""
    deadline = time.monotonic() + ENDS
    while not happened():
        assert time.monotonic() < deadline, f"it did not happen within {ENDS:g} s"
        time.sleep(0.01)


@contextmanager
def half_done(folder: Path, out: str, *arguments: str, kind: str = "failure-map") -> Iterator[Process]:
    """A run of the recipe m.toml, in a session of processes of its own, that has kept some cells and waits for `go`."""
    (folder / "go").unlink(missing_ok=True)
    command = [sys.executable, "-c", HELD, kind, "m.toml", "-q", "--plot", "none", "-o", out, *arguments]
    with subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as run:
        try:
            until(lambda: (folder / out / ".unfinished").exists() or run.poll() is not None)
            assert run.poll() is None, run.communicate()[1]
            yield run
        finally:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)


def alive(session: int) -> list[int]:
    """The processes of a session, but for those that are dead and not yet buried."""
    found: list[int] = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            state, _, _, of_session, *_ = (entry / "stat").read_text().rpartition(")")[2].split()
            found += [int(entry.name)] if int(of_session) == session and state not in "ZX" else []
    return found


def workers(session: int) -> list[int]:
    """The processes of a session that share the work of a run."""
    return [process for process in alive(session) if b"spawn_main" in Path(f"/proc/{process}/cmdline").read_bytes()]
