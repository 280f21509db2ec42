"""Ctrl-C outside of a command's work: while modules are loaded, and after the result is written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

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


def run(prelude: str, folder: Path) -> subprocess.CompletedProcess[str]:
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
