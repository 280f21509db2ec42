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
from processes import ENDS, SMALL_CHUNKS, alive, until, workers

pytestmark = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="processes are found in /proc")

# a worker that begins anything but the first chunk waits for a file named go: no run ends before its test says so
HELD = f"""
import time
from pathlib import Path
{SMALL_CHUNKS}
from dielast.sharing import processes
solve_now = processes._solve_given
def solve_when_told(first, end):
    while first > 0 and not Path("go").exists():
        time.sleep(0.01)
    return solve_now(first, end)
"""
CODE = "import held; held.processes._solve_given = held.solve_when_told; from dielast.cli import main; main()"
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
points = 100
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
draws = 40
thickness = "2 %"
[sweep]
"step.0.voltage" = ["1 kV", "2 kV", "3 kV", "3.2 kV"]
"""


@contextmanager
def running(folder: Path, kind: str, recipe: str) -> Iterator[subprocess.Popen[str]]:
    """A run whose two workers are at work."""
    (folder / "held.py").write_text(HELD)
    (folder / "r.toml").write_text(recipe)
    command = [sys.executable, "-c", CODE, kind, "r.toml", "-q", "--plot", "none", "--jobs", "2"]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True, start_new_session=True) as run:
        try:
            until(lambda: len(workers(run.pid)) == 2 or run.poll() is not None)
            assert run.poll() is None, run.communicate()[1]
            yield run
        finally:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)


@contextmanager
def half_done(folder: Path, kind: str = "failure-map", recipe: str = MAP) -> Iterator[subprocess.Popen[str]]:
    """A map, or another run, that two workers have solved in part."""
    with running(folder, kind, recipe) as run:
        until(lambda: (folder / "r/.unfinished").exists() or run.poll() is not None)
        assert run.poll() is None, run.communicate()[1]
        yield run


@pytest.mark.trust
def test_workers_end_with_a_parent_that_is_killed(tmp_path: Path) -> None:
    with half_done(tmp_path) as run:
        run.kill()
        until(lambda: not alive(run.pid))
        # Python cleans up after it, and says so
        assert all("resource_tracker" in line for line in run.communicate()[1].splitlines()[::2])


def test_a_killed_worker_is_one_line(tmp_path: Path) -> None:
    with half_done(tmp_path) as run:
        os.kill(workers(run.pid)[0], signal.SIGKILL)
        said = run.communicate(timeout=ENDS)[1]
        assert said == (
            "r.toml: a worker process was killed, perhaps for lack of memory; "
            "what is solved is kept, and the same command goes on from there\n"
        )
        assert run.returncode == 3
        until(lambda: not alive(run.pid))
    assert (tmp_path / "r/.unfinished").exists()


@pytest.mark.trust
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_group_that_is_told_to_end_is_one_line(name: str, tmp_path: Path) -> None:
    number = signal.Signals[name]
    with half_done(tmp_path) as run:
        os.killpg(run.pid, number)
        said = run.communicate(timeout=ENDS)[1]
        assert re.fullmatch(r"interrupted: \d+ of \d+ cells are kept: the same command goes on from there, .*\n", said)
        assert run.returncode == 128 + number
        until(lambda: not alive(run.pid))
    assert (tmp_path / "r/.unfinished").exists()


# one worker starts, and before another does a signal comes; workers themselves only wait
STARTING = """
import os, signal, sys
from multiprocessing import popen_spawn_posix
launch, blow = popen_spawn_posix.Popen._launch, signal.Signals[sys.argv.pop()]
def launch_and_strike(self, process):
    launch(self, process)
    print("worker", self.pid, flush=True)
    os.killpg(0, blow)
popen_spawn_posix.Popen._launch = launch_and_strike
from dielast.cli import main; main()
"""


@pytest.mark.parametrize(
    "name", ["SIGINT", "SIGKILL", *(pytest.param(name, marks=pytest.mark.trust) for name in ("SIGTERM", "SIGHUP"))]
)
def test_nothing_stays_of_a_run_that_ends_as_its_workers_start(name: str, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(MAP.replace("points = 100", "points = 1000"))
    (tmp_path / "temporary").mkdir()
    command = [sys.executable, "-c", STARTING, "failure-map", "r.toml", "-q", "--plot", "none", "--jobs", "2", name]
    environment, number = os.environ | {"TMPDIR": str(tmp_path / "temporary")}, signal.Signals[name]
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as run:
        printed, said = run.communicate(timeout=ENDS)
        assert "worker" in printed
        until(lambda: not alive(run.pid))
    assert not list((tmp_path / "temporary").iterdir())
    if number is not signal.SIGKILL:
        assert (run.returncode, said) == (128 + number, "interrupted: nothing is kept or written; the same command begins anew\n")


@pytest.mark.trust
def test_the_draws_of_a_sweep_have_workers_too(tmp_path: Path) -> None:
    with half_done(tmp_path, "actuate", SWEEP) as run:
        os.kill(run.pid, signal.SIGTERM)
        said = run.communicate(timeout=ENDS)[1]
        assert re.fullmatch(r"interrupted: 4 of 4 cases and \d+ of 160 draws are kept: the same command goes on.*\n", said)
        assert run.returncode == 128 + signal.SIGTERM
        until(lambda: not alive(run.pid))


# the plan is larger than a pipe holds; a worker imports the script, and ends before the function is defined, or as it would start
# workers itself
SCRIPT = """
from multiprocessing import current_process
from dielast.base.errors import DielastError
from dielast.sharing.processes import solve_in_processes
{end}
def solve(plan, first, end):
    return len(plan)
try:
    list(solve_in_processes(2, solve, bytes(10**6), [(0, 1), (1, 2)]))
except DielastError as error:
    print(error)
"""
UNGUARDED = 'worker processes import the script that starts them: put its calls below `if __name__ == "__main__":`\n'


@pytest.mark.parametrize(
    ("end", "message"),
    [
        (
            "if current_process().name != 'MainProcess': raise SystemExit(1)",
            "a worker process was killed, perhaps for lack of memory\n",
        ),
        ("if current_process().name != 'MainProcess': raise SystemExit", UNGUARDED),
        ("", UNGUARDED),
    ],
    ids=["ends", "sys.exit", "unguarded"],
)
def test_workers_that_end_as_they_start_are_one_error(end: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT.format(end=end))
    (tmp_path / "temporary").mkdir()
    environment = os.environ | {"TMPDIR": str(tmp_path / "temporary")}
    command = [sys.executable, "script.py"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=ENDS, check=True)
    assert done.stdout == message
    assert not list((tmp_path / "temporary").iterdir())


@pytest.mark.trust
def test_a_script_may_run_the_command_line_at_its_top_level(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(f"{SMALL_CHUNKS}\nfrom dielast.cli import main\nmain()\n")
    (tmp_path / "r.toml").write_text(MAP)
    command = [sys.executable, "script.py", "failure-map", "r.toml", "-q", "--plot", "none", "--jobs", "2"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=ENDS, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "r/failure-map.csv").exists()
