"""`sensitivity = true`: what it writes, that it moves nothing else, and what it says where it cannot be known."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.io.table import parse_csv
from dielast.sharing.execution import Execution

FILM = """
material = "example:vhb4905.toml"
sensitivity = true
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "10 min"
[breakdown]
field = "48 MV/m"
"""
DRAWS = """
[uncertainty]
draws = 20
breakdown_field = { law = "normal", relative = "3 %" }
thickness = "2 %"
"""
MAP = f'kind = "failure-map"\nhorizon = "30 d"\n{FILM}[voltage]\nvalues = ["3.8 kV", "4.2 kV"]\n'
STEPS = '[[step]]\nvoltage = "3.8 kV"\n[[step]]\nhold = "30 d"\n[sweep]\n"step.0.voltage" = ["3.8 kV", "4.2 kV"]\n'
ACTUATE = f'kind = "actuate"\n{FILM}{STEPS}'


def run(folder: Path, recipe: str, jobs: int = 1, plots: tuple[str, ...] = ()) -> dict[str, bytes]:
    path = folder / "r.toml"
    path.write_text(recipe)
    kind = tomllib.loads(recipe)["kind"]
    return compute(kind, read_cases(path), path, plots, Execution(jobs))[0]


def warnings_of(files: dict[str, bytes]) -> list[str]:
    return list(tomllib.loads(files["summary.toml"].decode())["warnings"])


def table(files: dict[str, bytes]) -> dict[str, list[str]]:
    return parse_csv(files["sensitivity.csv"], "sensitivity.csv")


def numbers(cells: dict[str, list[str]], header: str) -> np.ndarray:
    return np.array([float(cell) if cell else np.nan for cell in cells[header]])


@pytest.mark.trust
def test_a_map_and_films_tell_the_same_shares_and_nothing_else_moves(tmp_path: Path) -> None:
    mapped = run(tmp_path, MAP + DRAWS, plots=("png",))
    plain = run(tmp_path, (MAP + DRAWS).replace("sensitivity = true", "sensitivity = false"))
    assert all(mapped[name] == plain[name] for name in ("failure-map.csv", "fit.csv"))
    assert mapped["sensitivity.png"].startswith(b"\x89PNG")
    assert "sensitivity.csv" not in plain
    assert tomllib.loads(mapped["summary.toml"].decode())["sensitivity"] == {"cells": 2, "left_out": 0}
    assert run(tmp_path, MAP + DRAWS, jobs=2)["sensitivity.csv"] == mapped["sensitivity.csv"]
    found = table(mapped)
    assert found["source"] == ["breakdown field", "thickness"] * 2
    assert [float(volt) for volt in found["voltage [V]"]] == [3800.0] * 2 + [4200.0] * 2
    films = run(tmp_path, ACTUATE + DRAWS, plots=("png",))
    assert films["sensitivity.png"].startswith(b"\x89PNG")
    swept = table(films)
    assert swept["case"] == ["0", "0", "1", "1"]
    assert tomllib.loads(films["summary.toml"].decode())["sensitivity"] == {"cases": 2, "left_out": 0}
    # draws of a map are solved to 5e-4, those of films to 1e-6
    for header in ("first_order [1]", "first_order_stderr [1]", "total [1]", "total_stderr [1]", "spread [1]"):
        assert numbers(swept, header) == pytest.approx(numbers(found, header), abs=5e-3)
    assert np.all(numbers(found, "censored [1]") == 0)


def test_without_draws_it_is_the_derivatives(tmp_path: Path) -> None:
    mapped, films = table(run(tmp_path, MAP)), table(run(tmp_path, ACTUATE))
    assert mapped["source"] == films["source"]
    assert mapped["source"][-2:] == ["breakdown field", "thickness"]
    assert "equilibrium.J_lim" in mapped["source"]
    one, other = (numbers(cells, "elasticity [1]") for cells in (mapped, films))
    assert one == pytest.approx(other, rel=2e-2, abs=1e-3)


def test_films_that_live_on_are_left_out_and_said_to_be(tmp_path: Path) -> None:
    files = run(tmp_path, MAP.replace("30 d", "60 s") + DRAWS)
    assert any("sensitivity: 1 of 2 cells have no sensitivity: some of their draws survive" in line for line in warnings_of(files))
    found = table(files)
    assert found["total [1]"][:2] == ["", ""]
    assert 0 < float(found["censored [1]"][0]) <= 1
    assert all(found["total [1]"][2:])
    files = run(tmp_path, ACTUATE.replace("30 d", "1 s"), plots=("png",))
    assert any(
        "sensitivity: 2 of 2 cases have no sensitivity: some of their changes survive" in line for line in warnings_of(files)
    )
    assert files["sensitivity.png"].startswith(b"\x89PNG")
