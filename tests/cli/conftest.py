"""Run the command line as a user does: a process of its own."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from client import ask
from processes import ENDS

Run = Callable[..., subprocess.CompletedProcess[str]]
PYTHON = (sys.executable, "-W", "error::SyntaxWarning")


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    """The address of server.py: a short one, since a socket's has at most some hundred characters."""
    with tempfile.TemporaryDirectory(prefix="dielast") as folder, socket.socket(socket.AF_UNIX) as listener:
        address = f"{folder}/server"
        listener.bind(address)
        listener.listen()
        program = [*PYTHON, str(Path(__file__).with_name("server.py")), str(listener.fileno())]
        with subprocess.Popen(program, stdin=subprocess.PIPE, pass_fds=[listener.fileno()]) as process:
            yield address
            assert process.stdin is not None
            process.stdin.close()


@pytest.fixture(scope="session")
def command(tmp_path_factory: pytest.TempPathFactory, server: str) -> Run:
    """Run `dielast` in a folder with these arguments, after `prelude` (Python); in an interpreter of its own if `fresh`."""
    written = tmp_path_factory.mktemp("streams")

    def run(
        folder: Path, *arguments: str | Path, prelude: str = "", fresh: bool = False, **variables: str
    ) -> subprocess.CompletedProcess[str]:
        words, environment = [str(argument) for argument in arguments], {**os.environ, "COLUMNS": "200", **variables}
        if fresh:
            program = [*PYTHON, "-c", f"{prelude}\nfrom dielast.cli import main; main()", *words]
            return subprocess.run(program, cwd=folder, env=environment, capture_output=True, text=True, timeout=ENDS, check=False)
        out, err = written / "stdout", written / "stderr"
        with open(os.devnull, "rb") as nothing, out.open("wb") as stdout, err.open("wb") as stderr:
            streams = nothing.fileno(), stdout.fileno(), stderr.fileno()
            code = ask(server, words, str(folder), environment, streams, prelude, within=ENDS)
        return subprocess.CompletedProcess(words, code, out.read_text("utf-8"), err.read_text("utf-8"))

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
