"""Ctrl-C outside of a command's work: while modules are loaded, and after the result is written."""

from __future__ import annotations

import io
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dielast.cli.terminal import Bar, Leave
from dielast.sharing.execution import EARLIER

Ran = subprocess.CompletedProcess[str]
LOADING = """
import os, signal, sys
class Press:
    def find_spec(self, name, path=None, target=None):
        if name == "typer":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Press())
"""
LEAVING = "import atexit, os, signal; atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT));"
IGNORED = "import os, signal; signal.signal(signal.SIGINT, signal.SIG_IGN);" + LOADING


def run(prelude: str, folder: Path) -> Ran:
    command = f"{prelude}\nfrom dielast.cli import main; main()"
    return subprocess.run([sys.executable, "-c", command, "schema"], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("prelude", [LOADING, LEAVING], ids=["loading", "leaving"])
def test_an_interrupt_outside_of_the_work_is_one_line_and_130(prelude: str, tmp_path: Path) -> None:
    ran = run(prelude, tmp_path)
    assert (ran.returncode, ran.stderr) == (130, "interrupted\n")
    assert bool(ran.stdout) == (prelude is LEAVING)


def test_an_ignored_interrupt_stays_ignored(tmp_path: Path) -> None:
    ran = run(IGNORED, tmp_path)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.startswith("{")


MAP = """
kind = "failure-map"
material = "example:vhb4905.toml"
horizon = "10 s"
film = {{ thickness = "0.5 mm", prestretch = 1.9, relax = "10 min" }}
voltage = {{ from = "1 kV", to = "5 kV", points = {points} }}
breakdown = {{ field = "45 MV/m" }}
"""
PRESS = """
import os, signal, time, dielast.{module} as module
from dielast.sharing import study
study.PAUSE = 0.0
module.{function} = lambda *_: (os.kill(os.getpid(), signal.SIGINT), time.sleep(600))
"""
KEPT = r"interrupted: 10\d\d of 1030 cells are kept: the same command goes on from there, .*\n"


@pytest.mark.parametrize(
    ("module", "function", "points", "message"),
    [
        ("report.report", "_saved", 1030, KEPT),
        pytest.param("cli.run", "write_files", 1030, KEPT, marks=pytest.mark.trust),
        ("report.report", "_saved", 3, "interrupted: nothing is kept or written; the same command begins anew\n"),
        ("cli.run", "print_summary", 3, "interrupted: the results are written\n"),
    ],
    ids=["drawing", "writing", "small", "written"],
)
def test_an_interrupt_after_the_last_cell_says_what_is_kept(
    module: str, function: str, points: int, message: str, dielast: Callable[..., Ran], tmp_path: Path
) -> None:
    (tmp_path / "m.toml").write_text(MAP.format(points=points))
    ran = dielast("failure-map", "m.toml", prelude=PRESS.format(module=module, function=function))
    assert ran.returncode == 130
    assert re.fullmatch(message, ran.stderr)
    assert (tmp_path / "m/.unfinished").exists() == (message == KEPT)
    assert (tmp_path / "m/summary.toml").exists() == (function == "print_summary")
    if message == KEPT:
        again = dielast("failure-map", "m.toml", "--plot", "none")
        assert re.fullmatch(r"note: goes on from an interrupted run, which kept 10\d\d of 1030 cells\n", again.stderr)


def test_an_interrupt_before_the_first_cell_leaves_what_an_earlier_run_kept(dielast: Callable[..., Ran], tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(MAP.format(points=3))
    (tmp_path / "m").mkdir()
    (tmp_path / "m/.unfinished").write_bytes(b"of an earlier run")
    ran = dielast("failure-map", "m.toml", prelude=PRESS.format(module="commands.grids.failure_map", function="prepared"))
    assert (ran.returncode, ran.stderr) == (130, f"interrupted: {EARLIER}\n")
    assert (tmp_path / "m/.unfinished").read_bytes() == b"of an earlier run"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_says_what_is_counted_and_how_long_it_takes_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sys, "stderr", screen := Terminal())
    bar = Bar(False, 4)
    bar(10, 40, "cells")
    bar(20, 40, "cells")
    bar.stop()
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    assert "20/40 cells in 4 processes" in plain
    assert re.search(r"\d:\d\d left", plain)
    assert screen.getvalue().endswith("\x1b[2K")  # what comes next has the line for itself
    bar(1, 1, "draws")
    assert "1/1 draws in 4 processes" in re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())
    # the terminal shows ^C where the cursor is
    handler = Leave()
    handler.kept = "3 of 9 cells are kept"
    assert handler.message() == "\ninterrupted: 3 of 9 cells are kept"


def test_no_progress_where_nobody_would_see_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for quiet, stream in ((True, Terminal()), (False, io.StringIO())):
        monkeypatch.setattr(sys, "stderr", stream)
        bar = Bar(quiet, 1)
        bar(1, 2, "cases")
        bar.stop()
        assert stream.getvalue() == ""
    assert Leave().message() == "interrupted"
