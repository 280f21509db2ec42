"""Run the command line as a user does: a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def dielast(tmp_path: Path) -> Run:
    def run(*arguments: str | Path, prelude: str = "") -> subprocess.CompletedProcess[str]:
        program = f"{prelude}\nfrom dielast.cli import main; main()"
        return subprocess.run(
            [sys.executable, "-W", "error::SyntaxWarning", "-c", program, *map(str, arguments)],
            cwd=tmp_path,
            env=dict(os.environ, COLUMNS="200", MPLCONFIGDIR=str(tmp_path / ".matplotlib")),
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )

    return run


@pytest.fixture
def starter(tmp_path: Path, dielast: Run) -> Callable[[str], Path]:
    """Write the starter recipe of a kind and return its path."""

    def write(kind: str) -> Path:
        path = tmp_path / f"{kind}.toml"
        path.write_text(dielast("new", kind).stdout)
        return path

    return write
