"""recipes/README.md says what the recipes give; recipes/ci.md does what it says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from processes import ENDS

RECIPES = Path(__file__).parents[2] / "recipes"
CLAIMS = RECIPES / "claims.toml"


def claims(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, RECIPES / "claims.py", *arguments]
    return subprocess.run(command, capture_output=True, encoding="utf-8", check=False)


def test_the_page_holds_the_numbers_of_the_golden_files() -> None:
    done = claims(CLAIMS, RECIPES / "golden", "--compare", RECIPES / "README.md")
    assert done.returncode == 0, done.stderr


def test_a_number_that_moved_is_found(tmp_path: Path) -> None:
    page = tmp_path / "README.md"
    text = (RECIPES / "README.md").read_text(encoding="utf-8")
    now = re.search(r"(\d+\.\d) kPa \| \*\*agrees", text)
    assert now is not None
    stress = float(now[1])
    for value, code in ((stress + 0.1, 0), (stress + 0.2, 1)):
        page.write_text(text.replace(f"{stress:.1f} kPa |", f"{value:.1f} kPa |"), encoding="utf-8")
        done = claims(CLAIMS, RECIPES / "golden", "--compare", page)
        assert done.returncode == code
        assert ("not what the recipes give now" in done.stderr) == bool(code)


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [("expected = 52.0", "expected = 65.0", "differs"), ("expected = 255.0", "expected = 127.0", "agrees")],
)
def test_no_claim_can_say_otherwise_than_the_numbers(tmp_path: Path, before: str, after: str, verdict: str) -> None:
    text = CLAIMS.read_text(encoding="utf-8")
    assert text.count(before) == 1
    (tmp_path / "claims.toml").write_text(text.replace(before, after), encoding="utf-8")
    done = claims(tmp_path / "claims.toml", RECIPES / "golden")
    assert done.returncode == 1
    assert done.stdout == ""
    assert f"{verdict}, the claim says otherwise" in done.stderr


def test_every_recipe_is_shown_and_every_picture_is_there_and_small() -> None:
    figures = tomllib.loads(CLAIMS.read_text(encoding="utf-8"))["figure"]
    shown = {source for figure in figures for source in figure["sources"]}
    assert {path.name for path in RECIPES.glob("*.toml") if "kind" in tomllib.loads(path.read_text())} <= shown
    text = (RECIPES / "README.md").read_text(encoding="utf-8")
    targets = {target for target in re.findall(r"\]\(([^)#]+)\)", text) if not target.startswith("http")}
    assert shown <= targets
    assert all((RECIPES / target).exists() for target in targets)
    assert all((RECIPES / target).stat().st_size < 100_000 for target in targets if target.startswith("gallery/"))


def test_the_stress_that_cannot_agree_is_said_so() -> None:
    lines = (RECIPES / "README.md").read_text(encoding="utf-8").splitlines()
    (row,) = [line for line in lines if line.startswith("|") and "255 kPa" in line]
    assert "**differs**" in row
    assert "no spectrum with" in row


def block(language: str) -> str:
    (text,) = re.findall(rf"```{language}\n(.*?)```", (RECIPES / "ci.md").read_text(), re.DOTALL)
    return str(text)


def test_the_shell_example_runs_word_for_word(tmp_path: Path, environment: Path, variables: dict[str, str]) -> None:
    done = subprocess.run(
        ["sh", "-c", block("sh")],
        cwd=tmp_path,
        env={**variables, "PATH": f"{environment / 'bin'}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        timeout=ENDS,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "film.toml: ok\n"
    assert re.search(r"^actuate\.csv: stretch_1 \[1\]: .*; golden ", done.stderr, re.MULTILINE)
    assert re.search(r"differences from golden/film beyond a relative 1e-06", done.stderr)


def test_the_workflow_runs_what_the_shell_example_runs() -> None:
    runs = re.findall(r"^ +- run: (dielast .*)$", block("yaml"), re.MULTILINE)
    assert len(runs) == 2
    assert set(runs) <= set(block("sh").splitlines())
