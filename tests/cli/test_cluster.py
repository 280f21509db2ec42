"""Failure maps and sweeps on a Dask cluster: a real scheduler and real workers on the loopback interface."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import dask.config
import distributed
import numpy as np
import pytest
from maps import map_of
from processes import ENDS, SMALL_CHUNKS, Process, Run, half_done, until

from dielast.base.errors import InputError
from dielast.commands.actuate import run as actuate
from dielast.commands.registry import read_cases
from dielast.io.files import Inputs
from dielast.io.table import to_csv
from dielast.sharing import cluster
from dielast.sharing.execution import Execution

MAP = map_of(2)
PATIENCE = 3  # s, within which a busy machine can connect
IMPATIENT = ("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", f"{PATIENCE}s")
SWEEP = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "10 min"
[[step]]
voltage = "3 kV"
duration = "10 s"
[[step]]
hold = "10 s"
[breakdown]
field = "48 MV/m"
[uncertainty]
draws = 19
breakdown_field = { law = "weibull", shape = 20 }
[sweep]
"step.0.voltage" = ["1 kV", "3 kV", "4.5 kV"]
"""
TABLES = ("failure-map.csv", "fit.csv", "summary.toml")
MAPPING = ("failure-map", "m.toml", "--plot", "none")


@contextmanager
def node(role: str, file: Path, **environment: str) -> Iterator[Process]:
    """A Dask scheduler or worker that is up, and gone afterwards."""
    command = [sys.executable, "-m", "dask", role, "--scheduler-file", str(file), "--host", "127.0.0.1"]
    command += ["--dashboard-address", "127.0.0.1:0"]
    command += ["--port", "0"] if role == "scheduler" else ["--nthreads", "1", "--no-nanny"]
    path = file.parent / f"{role}.log"
    before = connections(path)
    with open(path, "a") as log:
        process = subprocess.Popen(command, cwd=file.parent, env=dict(os.environ, **environment), stdout=log, stderr=log, text=True)
    try:
        until(lambda: is_whole(file) if role == "scheduler" else connections(path) > before)
        yield process
    finally:
        process.kill()
        process.wait()


def connections(log: Path) -> int:
    """How many workers that write this log have found the scheduler."""
    return log.read_text().count("Starting established connection") if log.exists() else 0


def is_whole(file: Path) -> bool:
    """Whether a scheduler has written its file to the end."""
    with suppress(OSError, ValueError):
        return "address" in json.loads(file.read_text())
    return False


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Little patience, here and in what is started here."""
    monkeypatch.setenv(*IMPATIENT)
    with dask.config.set({"distributed.comm.timeouts.connect": f"{PATIENCE}s"}):
        yield


def lost(file: Path) -> str:
    return f"{file}: the scheduler was lost; what is solved is kept, and the same command goes on from there\n"


def test_a_lost_worker_or_scheduler_changes_no_byte(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(map_of(30) + '[stretch]\nat = ["1 ms", "5 s"]\n')
    with ExitStack() as stack:
        file = tmp_path / "scheduler.json"
        stack.enter_context(node("scheduler", file))
        workers = [stack.enter_context(node("worker", file)) for _ in range(2)]
        assert dielast(*MAPPING, "-o", "here").returncode == 0
        with half_done(tmp_path, "killed", "--scheduler", str(file)) as run:
            workers[0].send_signal(signal.SIGKILL)
            (tmp_path / "go").touch()
            assert run.communicate(timeout=ENDS)[1] == ""
            assert run.returncode == 0
        with half_done(tmp_path, "left", "--scheduler", str(file)) as run:
            workers[1].send_signal(signal.SIGSTOP)
            stack.close()
            (tmp_path / "go").touch()
            assert run.communicate(timeout=ENDS)[1] == lost(file)
            assert run.returncode == 2
    # what a cluster has solved is of use without it
    assert (tmp_path / "left/.unfinished").stat().st_size > 1000
    assert dielast(*MAPPING, "-o", "left", prelude=SMALL_CHUNKS).returncode == 0
    for name in TABLES:
        whole = (tmp_path / "here" / name).read_bytes()
        for out in ("killed", "left"):
            assert (tmp_path / out / name).read_bytes() == whole, (out, name)


@pytest.mark.trust
def test_an_interrupted_map_leaves_nothing_on_the_cluster_and_a_scheduler_that_stands_still_is_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def tasks(dask_scheduler: distributed.Scheduler) -> int:
        return len(dask_scheduler.tasks)

    (tmp_path / "m.toml").write_text(map_of(125))
    file = tmp_path / "scheduler.json"
    with node("scheduler", file) as scheduler, node("worker", file):
        with half_done(tmp_path, "interrupted", "--scheduler", str(file)) as run:
            run.send_signal(signal.SIGINT)
            assert run.communicate(timeout=ENDS)[1].startswith("interrupted: ")
            assert run.returncode == 130
        assert (tmp_path / "interrupted/.unfinished").stat().st_size > 1000
        with distributed.Client(scheduler_file=str(file)) as client:
            assert client.run_on_scheduler(tasks) == 0
        with monkeypatch.context() as impatient:
            impatient.setenv(*IMPATIENT)
            with half_done(tmp_path, "frozen", "--scheduler", str(file)) as run:
                scheduler.send_signal(signal.SIGSTOP)
                (tmp_path / "go").touch()
                assert run.communicate(timeout=ENDS)[1] == lost(file)
                assert run.returncode == 2
        scheduler.send_signal(signal.SIGCONT)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The file of a Dask scheduler, without workers at first."""
    file = tmp_path_factory.mktemp("cluster") / "scheduler.json"
    with node("scheduler", file):
        yield file


@pytest.mark.trust
@pytest.mark.usefixtures("impatient")
def test_a_cluster_of_no_use_is_named_in_one_line(dielast: Run, tmp_path: Path, scheduler: Path) -> None:
    (tmp_path / "m.toml").write_text(MAP)
    other = tmp_path / "other/dielast-9.9.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: dielast\nVersion: 9.9\n")

    def refused() -> str:
        done = dielast(*MAPPING, "--scheduler", scheduler)
        assert (done.returncode, done.stdout) == (2, "")
        assert not (tmp_path / "m").exists()
        return done.stderr

    assert refused() == f"{scheduler}: the scheduler has no workers, after {PATIENCE} s of waiting\n"
    with node("worker", scheduler, PYTHONPATH=str(other.parent)) as worker:
        said = refused()
        assert worker.poll() is None
    assert said.startswith(f"{scheduler}: worker tcp://127.0.0.1:")
    assert said.endswith(f": dielast {cluster.VERSIONS['dielast']} is needed, 9.9 is installed\n")


@pytest.mark.trust
def test_a_sweep_with_draws_outlives_a_worker(tmp_path: Path, scheduler: Path) -> None:
    recipe = tmp_path / "s.toml"
    recipe.write_text(SWEEP)
    cases = read_cases(recipe)
    here = actuate.run(cases, Inputs(tmp_path), Execution()).tables
    with ExitStack() as stack:
        workers = [stack.enter_context(node("worker", scheduler)) for _ in range(2)]

        def kill(done: int, of: int, what: str) -> None:
            if done < of and workers[0].poll() is None:
                workers[0].send_signal(signal.SIGKILL)

        there = actuate.run(cases, Inputs(tmp_path), Execution(progress=kill, scheduler=str(scheduler))).tables
        assert workers[0].wait(timeout=ENDS) == -signal.SIGKILL
        assert {name: to_csv(table) for name, table in there.items()} == {name: to_csv(table) for name, table in here.items()}


def test_who_is_no_scheduler_is_named_in_one_line() -> None:
    def refused(scheduler: str) -> str:
        with pytest.raises(InputError) as caught:
            list(cluster.solve_on(scheduler, pow, 2, [(3, 5)]))
        (line,) = caught.value.messages
        assert line.startswith(f"{scheduler}: ")
        return line.removeprefix(f"{scheduler}: ")

    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        nobody = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        # where nobody answers, no machine is too busy for a short wait
        with dask.config.set({"distributed.comm.timeouts.connect": "0.3s"}):
            assert refused(nobody) == "no Dask scheduler answers at this address within 0.3 s"
            silent.listen()
            assert refused(nobody) == "no Dask scheduler answers at this address within 0.3 s"
    assert refused("localhost") == "no Dask scheduler can be reached at this address: missing port number in address 'localhost'"
    assert "unknown address scheme 'abc'" in refused("abc://localhost:1")
    assert refused("inproc://x").startswith("an address within another process cannot be reached")
    assert refused("ucx://localhost:1").startswith("no Dask scheduler can be reached at this address: ")


def test_a_scheduler_file_is_checked(dielast: Run, tmp_path: Path) -> None:
    file = tmp_path / "s.json"
    for content in ("", "[]", "{}", "\xff"):
        file.write_text(content, encoding="latin-1")
        with pytest.raises(InputError, match="not the file that a Dask scheduler writes"):
            list(cluster.solve_on(str(file), pow, 2, [(3, 5)]))
    (tmp_path / "m.toml").write_text(MAP)
    done = dielast(*MAPPING, "--scheduler", "none.json")
    assert (done.returncode, done.stderr) == (2, "none.json: no such file\n")


def test_without_dask_it_is_said_how_to_install_it(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(MAP)
    done = dielast(*MAPPING, "--scheduler", "tcp://127.0.0.1:8786", prelude="import sys; sys.modules['distributed'] = None")
    expected = "tcp://127.0.0.1:8786: a scheduler needs Dask, which is not installed: pip install 'dielast[cluster]'\n"
    assert (done.returncode, done.stderr) == (2, expected)


def test_dask_is_loaded_for_a_scheduler_only(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(map_of(2))
    loaded = "import atexit, sys; atexit.register(lambda: print({'dask', 'distributed'} & set(sys.modules)))"
    done = dielast(*MAPPING, "-q", prelude=loaded, fresh=True)
    assert (done.returncode, done.stdout) == (0, "set()\n")


def test_options_that_exclude_each_other(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(MAP)
    done = dielast(*MAPPING, "--scheduler", "tcp://127.0.0.1:8786", "--jobs", "2")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert done.stderr.startswith("--jobs and --scheduler exclude each other")
    done = dielast("spectrum", "m.toml", "--scheduler", "tcp://127.0.0.1:8786")
    expected = "--scheduler: only measure, relax, creep, actuate, failure-map and design can run on a cluster: "
    assert (done.returncode, done.stderr) == (2, f"{expected}leave the option out for spectrum\n")


def test_a_worker_of_another_version_computes_nothing() -> None:
    own = {"dielast": cluster.VERSIONS["dielast"], "numpy": np.__version__}
    assert cluster._solve_there(3, 5, solve=pow, plan=2, versions=own, packages=()) == 2**3 % 5
    with pytest.raises(cluster.OtherVersion, match=r"^numpy 1\.0 is needed, .* is installed$"):
        cluster._solve_there(3, 5, solve=pow, plan=2, versions=own | {"numpy": "1.0"}, packages=())
