"""What the README shows is what happens: its commands, their output, its Python, its links."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def session() -> list[tuple[str, list[str]]]:
    """(command, lines of output) of every console block, in order."""
    steps: list[tuple[str, list[str]]] = []
    for block in re.findall(r"```console\n(.*?)```", README, re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ "):
                steps.append((line[2:], []))
            else:
                steps[-1][1].append(line)
    return steps


def same(shown: str, real: str) -> bool:
    """Whether two lines agree, numbers to three digits."""
    if NUMBER.sub("#", shown) != NUMBER.sub("#", real):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(real), strict=True)
    return all(float(a) == pytest.approx(float(b), rel=1e-3) for a, b in pairs)


def test_the_walk_runs_as_shown(tmp_path: Path) -> None:
    launcher = tmp_path / "bin" / "dielast"
    launcher.parent.mkdir()
    launcher.write_text(f"#!/bin/sh\nexec {shlex.quote(sys.executable)} -c 'from dielast.cli import main; main()' \"$@\"\n")
    launcher.chmod(0o755)
    environment = dict(os.environ, PATH=f"{launcher.parent}:{os.environ['PATH']}", MPLCONFIGDIR=str(tmp_path / ".matplotlib"))
    walked = 0
    for command, shown in session():
        if not command.startswith("dielast"):
            continue
        done = subprocess.run(
            command,
            shell=True,
            cwd=tmp_path,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        real = done.stdout.splitlines()
        assert len(real) == len(shown), f"{command}: {done.stdout}"
        assert all(map(same, shown, real)), f"{command}: {done.stdout}"
        walked += 1
    assert walked >= 5


def test_the_python_runs() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(code, "README.md", "exec"), {})
    assert printed.getvalue() == "[ 1. -1.] True\n"


def test_pictures_and_files_are_there() -> None:
    targets = [target for target in re.findall(r"\]\(([^)]+)\)", README) if not target.startswith("http")]
    assert targets
    assert all((ROOT / target).exists() for target in targets)


def test_the_two_commands_are_the_makefiles() -> None:
    commands = [command for command, _ in session()]
    assert commands[:2] == ["make -C recipes", "make -C tests"]
    assert (ROOT / "recipes/Makefile").is_file()
    assert (ROOT / "tests/Makefile").is_file()
