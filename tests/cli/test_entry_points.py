"""An installed package adds to every registry: laws, a criterion, an instrument, a card and a command, loaded by name alone."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from toy_package import install
from toys import MATERIAL

from dielast.base.registry import GROUPS

TESTS = Path(__file__).parents[1]
FILM_MATERIAL = (
    MATERIAL
    + """\
[damage]
law = "twice"
field = "20 MV/m"
time = "1 h"
exponent = 9
"""
)
FILM = """\
kind = "actuate"
material = "toy.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.5
relax = "1 min"
[[step]]
voltage = "6 kV"
rate = "100 V/s"
[stop]
at = "wide"
[sweep]
temperature = ["20 degC", "30 degC"]
"""
Dielast = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(tmp_path_factory.mktemp("toy"), TESTS)


@pytest.fixture
def dielast(command: Dielast, site: Path, tmp_path: Path) -> Dielast:
    def run(*words: str, expected: int = 0) -> subprocess.CompletedProcess[str]:
        done = command(tmp_path, *words, prelude=f"import sys; sys.path.insert(0, {str(site)!r})")
        assert done.returncode == expected, done.stderr
        return done

    return run


def packages(folder: Path) -> Sequence[str]:
    found: Sequence[str] = tomllib.loads((folder / "summary.toml").read_text()).get("packages", ())
    return found


def test_a_film_of_installed_laws_ends_at_an_installed_criterion(dielast: Dielast, tmp_path: Path) -> None:
    (tmp_path / "toy.toml").write_text(FILM_MATERIAL)
    (tmp_path / "film.toml").write_text(FILM)
    assert dielast("validate", "film.toml", "toy.toml").stdout == "film.toml: ok\ntoy.toml: ok\n"
    dielast("actuate", "film.toml", "-o", "one", "-q", "--plot", "svg")
    with (tmp_path / "one/events.csv").open() as file:
        events = [row for row in csv.DictReader(file) if row["event"] == "wide"]
    assert len(events) == 2
    for event in events:
        assert float(event["stretch_1 [1]"]) * float(event["stretch_2 [1]"]) == pytest.approx(3.7, rel=1e-4)
    families = ("breakdown", "criteria", "damage", "dielectric", "shift", "springs")
    assert [line.split(" of dielast.")[1] for line in packages(tmp_path / "one")] == list(families)
    assert "toy-laws 1.2: varga of dielast.springs" in packages(tmp_path / "one")
    dielast("actuate", "film.toml", "-o", "two", "-q", "--plot", "none", "--jobs", "2")
    assert (tmp_path / "two/events.csv").read_bytes() == (tmp_path / "one/events.csv").read_bytes()


def test_an_export_a_fitted_law_and_a_card_of_the_package(dielast: Dielast, tmp_path: Path) -> None:
    lines = ["TOYMETER 3", "temperature;frequency;storage modulus;loss modulus", "°C;Hz;Pa;Pa"]
    for celsius in (10, 20, 30):
        for k in range(12):
            reduced = 10 ** (-2 + 0.35 * k - 0.05 * (celsius - 20))
            lines.append(f"{celsius};{10 ** (-2 + 0.35 * k):.9g};{1e6 * reduced**0.2:.9g};{3.2e5 * reduced**0.2:.9g}")
    (tmp_path / "meter.txt").write_text("\n".join(lines) + "\n")
    told = dielast("new", "--data", "meter.txt").stdout
    assert told.startswith("meter.txt: Toymeter, 1 step, 36 rows\n")
    recipe = dielast("new", "mastercurve", "--data", "meter.txt").stdout.replace('law = "wlf"', 'law = "linear"')
    (tmp_path / "m.toml").write_text(recipe)
    dielast("mastercurve", "m.toml", "-q", "--plot", "none")
    summary = tomllib.loads((tmp_path / "m/summary.toml").read_text())
    assert summary["shift"]["slope_1_per_K"] == pytest.approx(0.05, rel=1e-3)
    assert packages(tmp_path / "m") == ["toy-laws 1.2: toymeter of dielast.instruments", "toy-laws 1.2: linear of dielast.shift"]
    card = 'kind = "spectrum"\nmastercurve = "m"\n[fit]\nbranches = 5\n'
    limits = "[material]\nJ_lim = { equilibrium = 100, nonequilibrium = 50 }\n"
    (tmp_path / "s.toml").write_text(card + limits + '[export]\nformats = ["plain"]\n')
    dielast("spectrum", "s.toml", "-q", "--plot", "none")
    assert (tmp_path / "s/material.txt").exists()
    assert "toy-laws 1.2: plain of dielast.cards" in packages(tmp_path / "s")


def test_a_command_of_the_package_is_a_command(dielast: Dielast, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(dielast("new", "squares").stdout)
    assert dielast("validate", "s.toml").stdout == "s.toml: ok\n"
    dielast("squares", "s.toml", "-q", "--plot", "none")
    assert (tmp_path / "s/squares.csv").read_text().split() == ["x", "[1],square", "[1]", "1,1", "2,4", "3,9"]
    assert packages(tmp_path / "s") == ["toy-laws 1.2: squares of dielast.commands"]
    assert "Numbers -> their squares." in dielast("squares", "--help").stdout
    assert "squares" not in dielast("--help").stdout


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("absent", "toylaws.absent:Law cannot be loaded: ModuleNotFoundError: No module named 'toylaws.absent'"),
        ("leaves", "toylaws.leaves:Law cannot be loaded: SystemExit: 7"),
        ("wrong", "toylaws.laws:Linear: a SpringLaw is needed"),
        ("other", 'toylaws.laws:Varga: it is called "varga"'),
    ],
)
def test_what_is_broken_is_refused_with_one_line(law: str, message: str, dielast: Dielast, tmp_path: Path) -> None:
    (tmp_path / "toy.toml").write_text(FILM_MATERIAL.replace('law = "varga"', f'law = "{law}"'))
    done = dielast("validate", "toy.toml", expected=2)
    assert done.stderr == f"toy-laws 1.2: entry point {law} of dielast.springs: {message}\n"


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("raises", "toy-laws 1.2: raises of dielast.springs: ZeroDivisionError: division by zero (more.py:"),
        ("shapeless", "varga of dielast.springs: perhaps what one of these gives cannot be used: ValueError: "),
    ],
)
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_law_that_fails_in_use_is_named_in_one_line(law: str, message: str, jobs: str, dielast: Dielast, tmp_path: Path) -> None:
    springs = '[equilibrium]\nlaw = "varga"'
    (tmp_path / "toy.toml").write_text(MATERIAL.replace(springs, springs.replace("varga", law)))
    (tmp_path / "film.toml").write_text(FILM.replace('at = "wide"', 'at = "end"'))
    done = dielast("actuate", "film.toml", "-q", "--plot", "none", "--jobs", jobs, expected=2)
    (line,) = done.stderr.splitlines()
    assert message in line
    assert f"toy-laws 1.2: {law} of dielast.springs" in line
    assert not (tmp_path / "film").exists()


def test_a_command_that_is_none_is_refused_and_unknown_names_stay_unknown(dielast: Dielast, tmp_path: Path) -> None:
    done = dielast("hollow", "x.toml", expected=2)
    assert len(done.stderr.splitlines()) == 1
    assert "hollow of dielast.commands: toylaws.more:nothing cannot be loaded: AttributeError" in done.stderr
    (tmp_path / "toy.toml").write_text(FILM_MATERIAL.replace('law = "varga"', 'law = "vargas"'))
    assert 'equilibrium.law: "vargas": one of' in dielast("validate", "toy.toml", expected=2).stderr


def test_nothing_is_loaded_for_names_of_dielast(site: Path) -> None:
    code = (
        "import sys; from dielast import read_material; read_material('example:vhb4905');"
        "from dielast.commands.registry import COMMANDS; COMMANDS['relax'].model;"
        "print('toylaws' in sys.modules, __import__('dielast.base.registry').base.registry.adopted())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(site)}, capture_output=True, text=True, check=True
    )
    assert done.stdout == "False []\n"
    assert len(GROUPS) == 9
