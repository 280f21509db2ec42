"""Run the command line as a user does: a process of its own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from client import ask
from processes import ENDS, PYTHON, Run


@pytest.fixture(scope="session")
def command(tmp_path_factory: pytest.TempPathFactory, server: str) -> Run:
    """Run `dielast` in a folder with these arguments, after `prelude` (Python); in an interpreter of its own if `fresh`.

    `to` and `errors_to` are descriptors in place of the files whose content is returned.
    """
    written = tmp_path_factory.mktemp("streams")

    def run(
        folder: Path,
        *arguments: str | Path,
        prelude: str = "",
        fresh: bool = False,
        to: int | None = None,
        errors_to: int | None = None,
        **variables: str,
    ) -> subprocess.CompletedProcess[str]:
        words, environment = [str(argument) for argument in arguments], {**os.environ, "COLUMNS": "200", **variables}
        if fresh:
            program = [*PYTHON, "-c", f"{prelude}\nfrom dielast.cli import main; main()", *words]
            out, err = to or subprocess.PIPE, errors_to or subprocess.PIPE
            return subprocess.run(
                program, cwd=folder, env=environment, stdout=out, stderr=err, text=True, timeout=ENDS, check=False
            )
        printed, said = written / "stdout", written / "stderr"
        with open(os.devnull, "rb") as nothing, printed.open("wb") as stdout, said.open("wb") as stderr:
            streams = nothing.fileno(), to or stdout.fileno(), errors_to or stderr.fileno()
            code = ask(server, words, str(folder), environment, streams, prelude, within=ENDS)
        return subprocess.CompletedProcess(words, code, printed.read_text("utf-8"), said.read_text("utf-8"))

    return run


@pytest.fixture
def dielast(tmp_path: Path, command: Run) -> Run:
    """Run `dielast` in the folder of the test."""
    return partial(command, tmp_path)


@pytest.fixture
def starter(tmp_path: Path, dielast: Run) -> Callable[[str], Path]:
    """Write the starter recipe of a kind and return its path."""

    def write(kind: str) -> Path:
        path = tmp_path / f"{kind}.toml"
        path.write_text(dielast("new", kind).stdout)
        return path

    return write
