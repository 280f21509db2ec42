"""Failure maps and sweeps in several processes: whoever is killed, no process stays behind and no traceback is printed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from processes import until

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are found in /proc")

LAUNCH = (sys.executable, "-c", "from dielast.cli import main; main()", "failure-map", "m.toml", "-q", "--plot", "none")
MAP = """
kind = "failure-map"
material = "example:vhb4905.toml"
horizon = "10 s"
[film]
thickness = "0.5 mm"
prestretch = [1.7, 1.8, 1.9]
relax = "10 min"
[voltage]
from = "1 kV"
to = "5 kV"
points = 3000
[breakdown]
field = "45 MV/m"
"""
SWEEP = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
[[step]]
voltage = "3 kV"
duration = "10 s"
[[step]]
hold = "1 h"
[breakdown]
field = "48 MV/m"
[uncertainty]
draws = 200
thickness = "2 %"
[sweep]
"step.0.voltage" = ["1 kV", "2 kV", "3 kV", "3.2 kV"]
"""


def alive(session: int) -> list[int]:
    """The processes of a session, but for those that are dead and not yet buried."""
    found: list[int] = []
    for entry in Path("/proc").iterdir():
        with suppress(OSError):
            if entry.name.isdigit():
                state, _, _, own, *_ = (entry / "stat").read_text().rpartition(")")[2].split()
                found += [int(entry.name)] if int(own) == session and state not in "ZX" else []
    return found


@contextmanager
def half_done(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A map that two workers have solved in part."""
    (folder / "m.toml").write_text(MAP)
    command = [*LAUNCH, "--jobs", "2"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True, start_new_session=True) as run:
        try:
            until(lambda: (folder / "m/.unfinished").exists() or run.poll() is not None)
            assert run.poll() is None, run.communicate()[1]
            yield run
        finally:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)


def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    with half_done(tmp_path) as run:
        assert len(alive(run.pid)) == 3
        run.kill()
        until(lambda: not alive(run.pid))
        assert run.communicate()[1] == ""


def test_a_killed_worker_is_one_line(tmp_path: Path) -> None:
    with half_done(tmp_path) as run:
        os.kill(next(process for process in alive(run.pid) if process != run.pid), signal.SIGKILL)
        said = run.communicate(timeout=60)[1]
        assert said == (
            "m.toml: a worker process was killed, for want of memory perhaps; "
            "what is solved is kept, and the same command goes on from there\n"
        )
        assert run.returncode == 3
        assert not alive(run.pid)
    assert (tmp_path / "m/.unfinished").exists()


def test_a_group_that_is_terminated_is_one_line(tmp_path: Path) -> None:
    with half_done(tmp_path) as run:
        os.killpg(run.pid, signal.SIGTERM)
        said = run.communicate(timeout=60)[1]
        assert re.fullmatch(r"interrupted: \d+ of \d+ cells are kept: the same command goes on from there, .*\n", said)
        assert run.returncode == 130
        assert not alive(run.pid)
    assert (tmp_path / "m/.unfinished").exists()


def test_a_sweep_has_workers_too(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(SWEEP)
    command = [*LAUNCH[:3], "actuate", "s.toml", "-q", "--plot", "none", "--jobs", "2"]
    for lost, said, code in (
        (signal.SIGKILL, "s.toml: a worker process was killed, for want of memory perhaps\n", 3),
        (signal.SIGTERM, "interrupted: nothing is kept or written; the same command begins anew\n", 130),
    ):
        with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True) as run:
            until(lambda run=run: len(alive(run.pid)) == 3 or run.poll() is not None)
            workers = [process for process in alive(run.pid) if process != run.pid]
            os.kill(workers[0] if lost is signal.SIGKILL else run.pid, lost)
            assert (run.communicate(timeout=60)[1], run.returncode) == (said, code)
            assert not alive(run.pid)
    assert not (tmp_path / "s").exists()
