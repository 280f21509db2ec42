"""Runs on a machine that gives them too little: what was there stays, and one line says why."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import Run

from dielast.base.errors import NumericsError
from dielast.commands.grids.films import check_cells
from dielast.commands.registry import read_cases
from dielast.commands.simulation.run import check_series
from dielast.io.files import Inputs
from dielast.sharing import memory


def limited(what: str, least: int) -> str:
    """Code that sets a resource limit."""
    return f"import resource; resource.setrlimit(resource.{what}, ({least}, {least}))"


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_limit_on_file_sizes_leaves_the_older_result(dielast: Run, starter: Callable[[str], Path], tmp_path: Path) -> None:
    recipe = starter("relax")
    arguments = ["relax", str(recipe), "-q", "--plot", "none", "-o", "out"]
    assert dielast(*arguments).returncode == 0
    before = contents(tmp_path / "out")
    done = dielast(*arguments, "--set", "temperature='0 degC'", prelude=limited("RLIMIT_FSIZE", 4096))
    assert (done.returncode, done.stderr) == (2, "out: cannot write here: file too large\n")
    assert contents(tmp_path / "out") == before


def test_a_folder_that_cannot_be_made_is_one_line(dielast: Run, starter: Callable[[str], Path]) -> None:
    recipe = starter("relax")
    done = dielast("relax", recipe, "--plot", "none", "-o", "/proc/nothing/out")
    assert done.returncode == 2
    assert done.stderr.startswith("/proc/nothing/out: cannot write here: ")
    assert done.stderr.count("\n") == 1


def test_a_table_that_vanishes_is_one_line(dielast: Run, starter: Callable[[str], Path], tmp_path: Path) -> None:
    recipe = starter("mastercurve")
    recipe.write_text(recipe.read_text().replace("example:relaxation-test.csv", "gone.csv"))
    done = dielast("mastercurve", recipe)
    assert done.returncode == 2
    assert "gone.csv" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "mastercurve").exists()


MANY = [f"{k} degC" for k in range(40)]
GIBIBYTE = 1 << 30


@pytest.mark.parametrize(
    ("kind", "keys", "told"),
    [
        (
            "relax",
            ["output.points_per_decade=10000", f"sweep={{ temperature = {MANY} }}"],
            r"40 cases of 90200 rows need about 1.3 GB of memory, and \d+ MB are free: state fewer rows "
            r"\(output.points_per_decade or output.times\) or cases",
        ),
        pytest.param(
            "actuate",
            ["output.points_per_decade=10000", f"sweep={{ temperature = {MANY} }}"],
            r"40 cases of 360400 rows need about 8.82 GB of memory, and \d+ MB are free: state fewer rows .* or cases",
            marks=pytest.mark.trust,
        ),
        (
            "failure-map",
            ["voltage.points=100000", f"temperature={MANY}"],
            r"8000000 cells need about 1.6 GB of memory, and \d+ MB are free: state fewer voltages, .* or draws",
        ),
    ],
)
def test_what_does_not_fit_in_memory_is_refused_before_it_begins(
    kind: str, keys: list[str], told: str, dielast: Run, starter: Callable[[str], Path], tmp_path: Path
) -> None:
    settings = [word for key in keys for word in ("--set", key)]
    arguments = [kind, str(starter(kind)), "--plot", "none", "-q", "-o", "out", *settings]
    done = dielast(*arguments, prelude=limited("RLIMIT_AS", GIBIBYTE))
    assert done.returncode == 3
    assert re.fullmatch(rf"\S*{kind}.toml: {told}\n", done.stderr), done.stderr
    assert not (tmp_path / "out").exists()


def test_draws_count_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "r.toml").write_text(
        'kind = "relax"\nmaterial = "example:vhb4905.toml"\nstep = [{ hold = "1 s" }]\n[uncertainty]\ndraws = 1000\n'
    )
    cases = read_cases(tmp_path / "r.toml")
    monkeypatch.setattr(memory, "available_memory", lambda: 60e6)
    with pytest.raises(NumericsError, match=r"^1 case of 280 rows, each drawn 1000 times, need about"):
        check_series(cases, 10, Inputs(tmp_path), 1, 1)
    monkeypatch.setattr(memory, "available_memory", lambda: 200e6)
    check_series(cases, 10, Inputs(tmp_path), 1, 1)
    monkeypatch.setattr(memory, "available_memory", lambda: 60e6)
    with pytest.raises(NumericsError, match=r"^100 cells of 5000 draws each need about 100 MB"):
        check_cells(100, 5000)


def test_fewer_cycles_can_be_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    wave = 'step = [{ waveform = "sine", high = 1.5, period = "1 s", cycles = 100000 }]\n'
    (tmp_path / "r.toml").write_text(f'kind = "relax"\nmaterial = "example:vhb4905.toml"\n{wave}[output]\ncycles = "all"\n')
    monkeypatch.setattr(memory, "available_memory", lambda: 1e6)
    fewer = r"state fewer rows \(output.points_per_decade, output.cycles or output.times\)$"
    with pytest.raises(NumericsError, match=fewer):
        check_series(read_cases(tmp_path / "r.toml"), 10, Inputs(tmp_path), 1, 1)


def test_a_limit_on_the_address_space_is_known() -> None:
    code = "import resource; resource.setrlimit(resource.RLIMIT_AS, (1 << 29, 1 << 29));"
    code += "from dielast.sharing.memory import available_memory; print(available_memory())"
    free = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert 1e8 < float(free) < 2**29


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_running_out_of_memory_is_one_line(jobs: str, dielast: Run, starter: Callable[[str], Path], tmp_path: Path) -> None:
    lost = (
        "import dielast.commands.simulation.cases as cases\ndef solve(self):\n    raise MemoryError('Unable to allocate')\n"
        "cases.SimulationBatch.solve = solve"
    )
    sweep = "--set", 'sweep={ "step.0.rate" = ["1 %/s", "2 %/s"], "step.1.hold" = ["1 s", "2 s"], mode = "zip" }'
    done = dielast("relax", starter("relax"), "--plot", "none", "-o", "out", "--jobs", jobs, *sweep, prelude=lost)
    assert (done.returncode, done.stderr) == (3, "out of memory: state fewer cases, cells, rows or draws\n")
    assert not (tmp_path / "out").exists()
