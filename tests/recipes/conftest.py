"""The recipes of this checkout, copied to where a test may change and build them, with the dielast that is under test."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import ENDS

RECIPES = Path(__file__).parents[2] / "recipes"
Make = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def environment(tmp_path: Path, server: str) -> Path:
    """A folder with `bin/dielast` and `bin/python` as in a virtual environment, of the running interpreter.

    The run that writes to build/KILL kills itself; the one that writes to build/SLOW leaves a note and sleeps. The shell leaves the
    note itself: had it a command for that, an interrupt just as the command ends would be lost, and the shell would go on.
    """
    folder = tmp_path / "environment"
    (folder / "bin").mkdir(parents=True)
    python, client = shlex.quote(sys.executable), shlex.quote(f"{Path(__file__).parents[1]}/client.py")
    before = 'case "$*" in *"build/$KILL "*) kill -9 $$;; *"build/$SLOW "*) true >asleep; exec sleep 600;; esac'
    launchers = {"python": "", "dielast": f'{before}\nset -- -I -S {client} {server} "$@"\n'}
    for name, lines in launchers.items():
        path = folder / "bin" / name
        path.write_text(f'#!/bin/sh\n{lines}exec {python} "$@"\n')
        path.chmod(0o755)
    return folder


@pytest.fixture
def kitchen(tmp_path: Path) -> Callable[..., Path]:
    """Copy the recipes, or only the named files and folders of theirs, and return where they are."""

    def copy(*names: str) -> Path:
        folder = tmp_path / "recipes"
        folder.mkdir()
        for name in names or [path.name for path in RECIPES.iterdir() if path.name not in ("build", "gallery")]:
            source, target = RECIPES / name, folder / name
            if source.is_dir():
                shutil.copytree(source, target)
            else:
                target.parent.mkdir(exist_ok=True)
                shutil.copyfile(source, target)
        return folder

    return copy


@pytest.fixture
def variables(tmp_path: Path) -> dict[str, str]:
    """The environment variables of a build: nothing of the make that may have started the tests."""
    own = {name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS", "VENV", "READY")}
    return {
        **own,
        "KILL": "nothing",
        "SLOW": "nothing",
        "LC_ALL": "C",
        "OPENBLAS_NUM_THREADS": "1",
    }


@pytest.fixture
def make(tmp_path: Path, environment: Path, variables: dict[str, str]) -> Make:
    """Run make in the copied recipes; `kill` names a recipe whose run is killed."""

    def run(*arguments: str, kill: str = "nothing") -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["make", f"VENV={environment}", "READY=", *arguments],
            cwd=tmp_path / "recipes",
            env={**variables, "KILL": kill},
            capture_output=True,
            text=True,
            timeout=ENDS,
            check=False,
        )

    return run
