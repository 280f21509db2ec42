"""Failure maps and sweeps in several processes: whoever is killed, no process stays behind and no traceback is printed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from maps import map_of
from processes import DIELAST, ENDS, Process, alive, half_done, until

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are found in /proc")

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


@contextmanager
def shared_out(folder: Path) -> Iterator[Process]:
    """A map that two workers have solved in part."""
    (folder / "m.toml").write_text(map_of(1500))
    with half_done(folder, "m", "--jobs", "2") as run:
        yield run


def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    with shared_out(tmp_path) as run:
        assert len(alive(run.pid)) == 3
        run.kill()
        until(lambda: not alive(run.pid))
        assert run.communicate()[1] == ""


def test_a_killed_worker_is_one_line(tmp_path: Path) -> None:
    with shared_out(tmp_path) as run:
        os.kill(next(process for process in alive(run.pid) if process != run.pid), signal.SIGKILL)
        said = run.communicate(timeout=ENDS)[1]
        assert said == (
            "m.toml: a worker process was killed, for want of memory perhaps; "
            "what is solved is kept, and the same command goes on from there\n"
        )
        assert run.returncode == 3
        assert not alive(run.pid)
    assert (tmp_path / "m/.unfinished").exists()


def test_a_group_that_is_terminated_is_one_line(tmp_path: Path) -> None:
    with shared_out(tmp_path) as run:
        os.killpg(run.pid, signal.SIGTERM)
        said = run.communicate(timeout=ENDS)[1]
        assert re.fullmatch(r"interrupted: \d+ of \d+ cells are kept: the same command goes on from there, .*\n", said)
        assert run.returncode == 130
        assert not alive(run.pid)
    assert (tmp_path / "m/.unfinished").exists()


def test_a_sweep_has_workers_too(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(SWEEP)
    command = [*DIELAST, "actuate", "s.toml", "-q", "--plot", "none", "--jobs", "2"]
    for lost, said, code in (
        (signal.SIGKILL, "s.toml: a worker process was killed, for want of memory perhaps\n", 3),
        (signal.SIGTERM, "interrupted: nothing is kept or written; the same command begins anew\n", 130),
    ):
        with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True) as run:
            until(lambda run=run: len(alive(run.pid)) == 3 or run.poll() is not None)
            workers = [process for process in alive(run.pid) if process != run.pid]
            os.kill(workers[0] if lost is signal.SIGKILL else run.pid, lost)
            assert (run.communicate(timeout=ENDS)[1], run.returncode) == (said, code)
            assert not alive(run.pid)
    assert not (tmp_path / "s").exists()
