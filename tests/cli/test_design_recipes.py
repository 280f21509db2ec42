"""`dielast design`, and maps with the stretch of their films, as a user runs them."""

from __future__ import annotations

import csv
import io
import tomllib
from pathlib import Path

import numpy as np
import pytest
from flat import actuate

from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.handover.material_file import read_material
from dielast.io.table import parse_csv
from dielast.mechanics.load import VoltageStep
from dielast.sharing.execution import Execution

FILM = '[film]\nthickness = "0.5 mm"\nprestretch = [1.7, 1.9]\nrelax = "10 min"\n'
GOAL = '[goal]\nrelative_stretch = [1.1, 1.6]\nat = "10 min"\nhorizon = "1 d"\n'
SCATTER = '[uncertainty]\ndraws = 20\nthickness = "2 %"\nbreakdown_field = { law = "weibull", shape = 20 }\n'
HEAD = 'material = "example:vhb4905.toml"\n'
MAP = f'kind = "failure-map"\n{HEAD}horizon = "1 h"\n{FILM}[voltage]\nvalues = ["1 kV", "3.4 kV", "6 kV"]\n'


def files_of(folder: Path, text: str) -> tuple[dict[str, bytes], list[str]]:
    """Every file of a run, and what it warns of."""
    path = folder / "recipe.toml"
    path.write_text(text)
    kind = tomllib.loads(text)["kind"]
    files, _, _, doubts = compute(kind, read_cases(path), path, ("png",), Execution())
    return files, doubts


def test_a_design_is_a_table_the_best_film_first(tmp_path: Path) -> None:
    files, doubts = files_of(tmp_path, f'kind = "design"\n{HEAD}{FILM}{GOAL}{SCATTER}')
    assert doubts == []
    header, *rows = csv.reader(io.StringIO(files["design.csv"].decode()))
    assert header == [
        *("temperature [degC]", "prestretch_1 [1]", "prestretch_2 [1]", "relative_stretch [1]"),
        *("voltage [V]", "voltage_lower [V]", "voltage_upper [V]"),
        *("time_to_failure [s]", "time_to_failure_lower [s]", "time_to_failure_upper [s]", "failure_mode", "reached"),
        *("failure_probability [1]", "safe_life [s]"),
    ]
    assert [row[11] for row in rows] == ["yes", "yes", "no: fails first", "no: fails first"]
    assert [row[10] for row in rows[2:]] == ["breakdown", "breakdown"]
    for row in rows[:2]:
        assert float(row[5]) < float(row[4]) < float(row[6])
    assert all(row[4:10] == [""] * 6 and row[12:] == ["", ""] for row in rows[2:])
    summary = tomllib.loads(files["summary.toml"].decode())
    assert summary["design"]["reach_the_goal"] == summary["design"]["fail_first"] == 2
    assert summary["design"]["rounds"] <= 8
    assert summary["best_for_1.1"]["voltage_V"] == float(rows[0][4])
    assert summary["best_for_1.6"]["because"] == "breakdown"
    assert summary["uncertainty"]["draws"] == 20


def test_why_a_goal_is_out_of_reach_is_said(tmp_path: Path) -> None:
    creeping = FILM.replace("10 min", "0 s") + GOAL.replace("[1.1, 1.6]", "1.001")
    files, doubts = files_of(tmp_path, f'kind = "design"\n{HEAD}{creeping}')
    assert "2 of 2 films: out of reach: creeps to the goal without a voltage" in doubts
    assert tomllib.loads(files["summary.toml"].decode())["best"]["because"] == "creeps to the goal without a voltage"


def test_a_map_has_the_stretch_after_stated_times(tmp_path: Path) -> None:
    files, _ = files_of(tmp_path, f'{MAP}[stretch]\nat = ["1 s", "60 min"]\n')
    assert files["operating-map.png"].startswith(b"\x89PNG")
    table = parse_csv(files["failure-map.csv"], "failure-map.csv")
    plain, _ = files_of(tmp_path, MAP)
    assert "operating-map.png" not in plain
    for name, column in parse_csv(plain["failure-map.csv"], "failure-map.csv").items():
        assert table[name] == column
    after = [table[f"relative_stretch_1 after {when} [1]"] for when in ("1 s", "60 min")]
    assert "relative_stretch_2 after 1 s [1]" not in table
    material = read_material(Path(__file__).parents[2] / "dielast/examples/vhb4905.toml")
    for row, (prestretch, volts, life) in enumerate(
        zip(table["prestretch_1 [1]"], table["voltage [V]"], table["time_to_failure [s]"], strict=True)
    ):
        steps = [VoltageStep(float(volts)), VoltageStep.hold(3600.0)]
        film = {"thickness": 5e-4, "relax": 600.0, "prestretch": float(prestretch)}
        run = actuate(material, steps, times=[1.0, 3600.0], **film)
        for column, time, stretch in zip(after, (1.0, 3600.0), run.relative_stretch_1[0], strict=True):
            lives = life in ("", None) or not float(life) < time
            if lives:
                assert float(column[row]) == pytest.approx(stretch, rel=1e-6)
            else:
                assert column[row] in ("", None) or np.isnan(float(column[row]))


def test_axes_that_differ_and_draws_have_columns_of_their_own(tmp_path: Path) -> None:
    text = MAP.replace("[1.7, 1.9]", "[[1.7, 1.5]]") + '[stretch]\nat = "1 min"\n' + SCATTER
    files, _ = files_of(tmp_path, text)
    header = files["failure-map.csv"].decode().splitlines()[0].split(",")
    named = [f"relative_stretch_{axis}{side} after 1 min [1]" for axis in (1, 2) for side in ("", "_lower", "_upper")]
    assert header[-7:] == [*named, "failure_probability [1]"]
