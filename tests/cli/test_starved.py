"""Runs on a machine that gives them too little: what was there stays, and one line says why."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

Run = Callable[..., subprocess.CompletedProcess[str]]


def limited(arguments: list[str], folder: Path, what: int, least: int) -> subprocess.CompletedProcess[str]:
    """Run the command line with a resource limit."""
    call = f"import resource; resource.setrlimit({what}, ({least}, {least})); from dielast.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-c", call, *arguments],
        cwd=folder,
        env=dict(os.environ, MPLCONFIGDIR=str(folder / ".matplotlib"), PYTHONDONTWRITEBYTECODE="1"),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_limit_on_file_sizes_leaves_the_older_result(dielast: Run, starter: Callable[[str], Path], tmp_path: Path) -> None:
    recipe = starter("relax")
    arguments = ["relax", str(recipe), "-q", "--plot", "none", "-o", "out"]
    assert dielast(*arguments).returncode == 0
    before = contents(tmp_path / "out")
    done = limited([*arguments, "--set", "temperature='0 degC'"], tmp_path, resource.RLIMIT_FSIZE, 4096)
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
