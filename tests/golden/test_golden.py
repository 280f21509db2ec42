"""Every golden recipe gives its expected tables and summary, through the comparison that `--golden` makes.

A folder here holds `recipe.toml` and, in `expected`, what it gave when last looked at; `pytest --update-golden` refreshes them.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.io.files import write_files
from dielast.report.golden import differences
from dielast.sharing.execution import Execution

HERE = Path(__file__).resolve().parent
RTOL = 1e-6  # where rounding or a fit amplifies it, a folder's tolerance.toml says so
NAMES = sorted(path.parent.name for path in HERE.glob("*/recipe.toml"))


def results(name: str) -> dict[str, bytes]:
    recipe = HERE / name / "recipe.toml"
    kind = tomllib.loads(recipe.read_text())["kind"]
    return compute(kind, read_cases(recipe, kind, ()), recipe, (), Execution())[0]


@pytest.mark.parametrize("name", NAMES)
def test_the_numbers_are_what_they_were(name: str, request: pytest.FixtureRequest) -> None:
    found, expected = results(name), HERE / name / "expected"
    if request.config.getoption("--update-golden"):
        for old in expected.glob("*"):
            if old.name not in found and old.name != "tolerance.toml":
                old.unlink()
        write_files(expected, {own: content for own, content in found.items() if own.endswith((".csv", ".toml"))})
        return
    lines = differences(found, expected, RTOL)
    assert not lines, "\n".join([f"{len(lines)} differences", *lines[:20]])
    now, then = (tomllib.loads(text) for text in (found["summary.toml"].decode(), (expected / "summary.toml").read_text()))
    assert len(now.get("warnings", [])) == len(then.get("warnings", [])), now.get("warnings")


def test_every_subcommand_is_held() -> None:
    assert {name.split("-")[0] for name in NAMES} == {"mastercurve", "spectrum", "relax", "creep", "actuate", "failure", "design"}
