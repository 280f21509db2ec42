"""A command registered from outside is a command like the others: its folder and one line are all that it takes."""

from __future__ import annotations

import json
import subprocess
import tomllib
from pathlib import Path

import pytest
from processes import Run

from dielast.commands.registry import COMMANDS

REGISTER = """
import sys
sys.path.insert(0, "")
from dielast.commands.registry import COMMANDS
from toy import TOY
COMMANDS.register(TOY)
"""
PACKAGE = {
    "__init__.py": """
from dielast.commands.command import Command

TOY = Command("toy", __name__, "Numbers -> their squares.", "Numbers -> squares.", ("squares.csv", "more.csv"), True)
""",
    "recipe.py": '''
from typing import Literal

from pydantic import Field

from dielast.recipe.base import RecipeBase
from dielast.recipe.file_fields import InputFile


class ToyRecipe(RecipeBase):
    """Numbers -> their squares."""

    kind: Literal["toy"] = Field(description="The subcommand that runs this recipe.")
    numbers: InputFile = Field(description="The numbers.")
    power: int = Field(2, ge=1, description="Of the numbers.")
''',
    "run.py": """
import numpy as np
from matplotlib.figure import Figure

from dielast.base.errors import InputError, reached_by
from dielast.io.table import Column, parse_csv
from dielast.report.report import RunReport


def prepared(cases, inputs):
    name = cases[0].recipe.numbers
    with reached_by("numbers"):
        numbers = parse_csv(inputs.read(name), name)["x [1]"]
        if not numbers:
            raise InputError("no numbers", file=name)
    return np.array(numbers, dtype=float)


def run(cases, inputs, execution):
    x = prepared(cases, inputs)
    table = [Column("x", "1", x), Column("square", "1", x ** cases[0].recipe.power)]
    return RunReport({"squares.csv": table}, {"toy": {"largest_Pa": float(table[1].values.max())}}, Figure)
""",
    "starters/toy.toml": '# a starter\nkind = "toy"\nnumbers = "x.csv"   # a table\n',
    "starters/toy.short.toml": 'kind = "toy"\nnumbers = "x.csv"\n',
}


@pytest.fixture
def toy(dielast: Run, tmp_path: Path) -> Run:
    for name, text in PACKAGE.items():
        path = tmp_path / "toy" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "x.csv").write_text("x [1]\n1\n3\n")

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return dielast(*arguments, prelude=REGISTER)

    (tmp_path / "r.toml").write_text(run("new", "toy").stdout)
    return run


def test_it_runs_and_its_result_is_compared(toy: Run, tmp_path: Path) -> None:
    done = toy("toy", "r.toml", "-o", "out", "--depfile", "r.d")
    assert (done.returncode, done.stdout, done.stderr) == (0, "toy.largest_Pa = 9\n", "")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"squares.csv", "toy.png", "summary.toml"}
    assert (tmp_path / "out/squares.csv").read_text() == "x [1],square [1]\n1,1\n3,9\n"
    assert "x.csv" in (tmp_path / "r.d").read_text()
    assert toy("toy", "r.toml", "-o", "again", "--golden", "out", "-q").returncode == 0
    cubes = toy("toy", "r.toml", "-o", "again", "--golden", "out", "-q", "--set", "power=3", "--set", f"numbers='{tmp_path}/x.csv'")
    assert cubes.returncode == 4
    assert "squares.csv: square [1]: 1 of 2 cells differs: row 3: 27; golden 9" in cubes.stderr
    summary = tomllib.loads((tmp_path / "again/summary.toml").read_text())
    assert summary["set"] == ["power = 3", 'numbers = "x.csv"']  # of an absolute path, the name


def test_what_another_run_left_is_known_by_its_command(toy: Run, dielast: Run, tmp_path: Path) -> None:
    assert toy("toy", "r.toml", "-o", "out", "-q").returncode == 0
    (tmp_path / "out/more.csv").write_text("")
    again = toy("toy", "r.toml", "-o", "out", "-q", "--plot", "none")
    assert again.stderr == "warning: out: more.csv, toy.png are from an earlier run and were not renewed\n"
    (tmp_path / "relax.toml").write_text(dielast("new", "relax").stdout)
    other = toy("relax", "relax.toml", "-o", "out", "-q", "--plot", "none")
    assert other.stderr == "warning: out: holds results of toy, too: summary.toml is now that of this run\n"


def test_its_mistakes_are_found(toy: Run, tmp_path: Path) -> None:
    assert toy("validate", "r.toml").stdout == "r.toml: ok\n"
    (tmp_path / "x.csv").write_text("x [1]\n")
    (tmp_path / "wrong.toml").write_text('kind = "toy"\nnumbers = "squares.csv"\npowr = 0\nstep = 3\n')
    done = toy("validate", "r.toml", "wrong.toml")
    assert done.returncode == 2
    first, *others = done.stderr.splitlines()
    assert first == "r.toml: numbers: x.csv: no numbers"
    assert others == [
        'wrong.toml: numbers: "squares.csv" does not exist; run the recipe that makes it (dielast toy)',
        'wrong.toml: powr: unknown key; did you mean "power"?',
        "wrong.toml: step: unknown key; step belongs to relax, creep, actuate",
    ]
    assert toy("tyo", "r.toml").stderr == 'dielast: no command "tyo": did you mean "toy"? (see dielast --help)\n'
    assert toy("relax", "r.toml").stderr == 'r.toml: kind: the recipe is for "toy": run it with "dielast toy"\n'


def test_it_is_listed_and_described(toy: Run) -> None:
    assert "\n  toy          Numbers -> squares.\n" in toy("--help").stdout
    page = toy("toy", "--help").stdout
    assert "Numbers -> their squares." in page
    assert '  kind = "toy"\n  numbers = "x.csv"\n' in page
    assert "design or toy" in " ".join(toy("new", "--help").stdout.split())
    schema = json.loads(toy("schema").stdout)
    assert schema["$defs"]["ToyRecipe"]["properties"]["power"]["description"] == "Of the numbers."
    assert len(schema["oneOf"]) == len(COMMANDS) + 1


def test_a_registered_command_holds_what_its_line_says() -> None:
    for name, command in COMMANDS.items():
        assert command.name == name
        assert len(command.short_help) <= 61
        assert command.model.model_fields["kind"].annotation.__args__ == (name,)  # type: ignore[union-attr]
        assert callable(command.run)
        assert callable(command.prepared)
