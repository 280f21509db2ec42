"""Help that can be copied from: a recipe that runs, commands, exit codes, in 80 columns."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from processes import Run

from dielast.commands.registry import COMMANDS


@pytest.fixture
def help_of(dielast: Run) -> Callable[..., str]:
    """The help of a command on 80 columns."""
    return lambda *arguments: dielast(*arguments, "--help", COLUMNS="80").stdout


def recipe_in(text: str) -> str:
    """The recipe that a help page shows."""
    after = text.split("which runs as it is:\n\n")[1]
    return after.split("\n\n")[0]


@pytest.mark.parametrize("kind", COMMANDS)
def test_the_recipe_in_the_help_is_one(kind: str, dielast: Run, help_of: Callable[..., str], tmp_path: Path) -> None:
    text = help_of(kind)
    assert text.startswith(f"Usage: dielast {kind} RECIPE.toml [OPTIONS]\n")
    shown = recipe_in(text)
    assert [line.strip() for line in shown.splitlines()] == COMMANDS[kind].short_recipe().splitlines()
    (tmp_path / "my.toml").write_text(shown)
    done = dielast("validate", "my.toml")
    assert (done.returncode, done.stdout[:11], done.stderr) == (0, "my.toml: ok", "")


# a starter has all that its short form has, and runs in test_commands.py
@pytest.mark.parametrize("kind", [pytest.param(kind, marks=[] if kind == "creep" else pytest.mark.trust) for kind in COMMANDS])
def test_the_recipe_in_the_help_runs(kind: str, dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "my.toml").write_text(COMMANDS[kind].short_recipe())
    done = dielast(kind, "my.toml", "-o", "here", "-q", "--plot", "none")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (tmp_path / "here/summary.toml").is_file()


@pytest.mark.parametrize("kind", COMMANDS)
def test_the_help_says_where_to_go_on(kind: str, help_of: Callable[..., str]) -> None:
    text = help_of(kind)
    pointers = (f"dielast new {kind} >", f"dielast {kind} my.toml -o out", "dielast validate my.toml", "dielast schema")
    assert all(pointer in text for pointer in pointers)
    assert "Exit codes: 0 done" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("arguments", [(), ("new",), ("validate",), ("report",), ("schema",)])
def test_every_page_fits_and_is_not_cut(arguments: tuple[str, ...], help_of: Callable[..., str]) -> None:
    text = help_of(*arguments)
    assert max(map(len, text.splitlines())) <= 80
    assert "..." not in text.replace("FILE...", "").replace("FOLDER...", "").replace("[ARGS]...", "")


def described(node: Any, path: str) -> Iterator[str]:
    """Every key of a schema that nothing describes."""
    for name, field in node.get("properties", {}).items():
        if not (field.get("description") or "$ref" in field or "allOf" in field):
            yield f"{path}.{name}"
    for name, inner in node.get("$defs", {}).items():
        yield from described(inner, name)


def test_the_schema_describes_every_key(dielast: Run) -> None:
    schema = json.loads(dielast("schema").stdout)
    assert not list(described(schema, "recipe"))
    # a default is written as a recipe would write it
    film = schema["$defs"]["GridFilm"]["properties"]
    assert film["relax"]["default"] == "0 s"
