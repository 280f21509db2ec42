"""Run the command line as a user does: a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from processes import ENDS, Process, answer

Run = Callable[..., subprocess.CompletedProcess[str]]
PYTHON = (sys.executable, "-W", "error::SyntaxWarning")


@pytest.fixture(scope="session")
def server() -> Iterator[Process]:
    """The process of server.py."""
    command = [*PYTHON, str(Path(__file__).with_name("server.py"))]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield process
        assert process.stdin is not None
        process.stdin.close()


@pytest.fixture(scope="session")
def command(tmp_path_factory: pytest.TempPathFactory, server: Process) -> Run:
    """Run `dielast` in a folder with these arguments, after `prelude` (Python); in an interpreter of its own if `fresh`."""

    def run(
        folder: Path, *arguments: str | Path, prelude: str = "", fresh: bool = False, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        words, environment = [str(argument) for argument in arguments], {**os.environ, "COLUMNS": "200", **variables}
        if fresh:
            program = [*PYTHON, "-c", f"{prelude}\nfrom dielast.cli import main; main()", *words]
            return subprocess.run(program, cwd=folder, env=environment, capture_output=True, text=True, timeout=ENDS, check=False)
        streams = [tmp_path_factory.mktemp("streams") / name for name in ("stdout", "stderr")]
        request = {"arguments": words, "folder": str(folder), "environment": environment, "prelude": prelude}
        code = answer(server, json.dumps({**request, "stdout": str(streams[0]), "stderr": str(streams[1])}))
        return subprocess.CompletedProcess(words, int(code), *(stream.read_text("utf-8") for stream in streams))

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
