"""What `[uncertainty]` says of itself: how many draws there really were, which seed matters, what a bound is of."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import Run
from tables import FILM, SCATTER, columns

import dielast as library
from dielast.handover.material_draws import draw_columns
from dielast.handover.material_file import write_material
from dielast.io.files import resolve
from dielast.io.table import to_csv

MEMBERS = 24
RELAX = """
kind = "relax"
material = "material.toml"
[[step]]
stretch = 2.0
duration = "1 s"
[[step]]
hold = "10 s"
[output]
points_per_decade = 3
[uncertainty]
"""
ACTUATE = f"""
kind = "actuate"
{FILM}
[[step]]
voltage = "2.5 kV"
[[step]]
hold = "5 min"
[[step]]
voltage = "3.5 kV"
[[step]]
hold = "20 min"
[breakdown]
field = "48 MV/m"
[uncertainty]
draws = 40
"""
MAP = f"""
kind = "failure-map"
horizon = "1 h"
{FILM}
[voltage]
values = ["3.6 kV", "4 kV"]
[breakdown]
field = "48 MV/m"
[uncertainty]
draws = 24
"""


@pytest.fixture(autouse=True)
def material(tmp_path: Path) -> None:
    """A material with draws, and one whose draws are all the material itself."""
    solid = library.read_material(resolve(Path(), "example:vhb4905.toml"))
    factors = np.linspace(0.97, 1.03, MEMBERS)
    for name, scales in (("", factors), ("same-", np.ones(MEMBERS))):
        members = [replace(solid, equilibrium_modulus=scale * solid.equilibrium_modulus) for scale in scales.tolist()]
        (tmp_path / f"{name}draws.csv").write_bytes(to_csv(draw_columns(np.arange(MEMBERS), members)))
        (tmp_path / f"{name}material.toml").write_bytes(write_material(solid, f"{name}draws.csv"))


def told(folder: Path) -> dict[str, Any]:
    return dict(tomllib.loads((folder / "summary.toml").read_text())["uncertainty"])


def test_no_more_draws_than_there_are(dielast: Run, tmp_path: Path) -> None:
    for name, stated in (("a", "draws = 100"), ("b", ""), ("c", "draws = 24"), ("d", "draws = 20"), ("e", "draws = 24\nseed = 7")):
        (tmp_path / f"{name}.toml").write_text(RELAX + stated)
        done = dielast("relax", f"{name}.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr
        said = "uncertainty.draws: material.toml has 24 draws, and nothing else scatters: 24 draws are used instead of 100"
        assert (said in done.stderr) == (name == "a")
        assert told(tmp_path / name)["draws"] == told(tmp_path / name)["materials"] == (20 if name == "d" else 24)
    tables = {name: (tmp_path / name / "relax.csv").read_bytes() for name in "abcde"}
    assert tables["a"] == tables["b"] == tables["c"] == tables["e"] != tables["d"]


def test_films_that_scatter_are_as_many_as_are_asked_for(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(ACTUATE + SCATTER)
    done = dielast("actuate", "a.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    assert "nothing else scatters" not in done.stderr
    assert (told(tmp_path / "a")["draws"], told(tmp_path / "a")["materials"]) == (40, 24)


def test_levels_that_differ_are_told_of_each_case(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(RELAX + '[sweep]\n"uncertainty.level" = [0.5, 0.9]\n')
    assert dielast("relax", "a.toml", "--plot", "none").returncode == 0
    assert told(tmp_path / "a") == {"draws": 24, "materials": 24, "seed": 1, "level": [0.5, 0.9]}
    (tmp_path / "b.toml").write_text(RELAX + '[sweep]\n"step.0.stretch" = [1.5, 2.0]\n')
    assert dielast("relax", "b.toml", "--plot", "none").returncode == 0
    assert told(tmp_path / "b")["level"] == 0.9


@pytest.mark.parametrize(
    "steps", [pytest.param("", marks=pytest.mark.trust), '[[step]]\nvoltage = "3.4 kV"\n[[step]]\nvoltage = "3.5 kV"\n']
)
def test_bounds_at_the_end_do_not_depend_on_the_output(dielast: Run, tmp_path: Path, steps: str) -> None:
    (tmp_path / "a.toml").write_text(ACTUATE.replace('[[step]]\nvoltage = "3.5 kV"\n', steps) if steps else ACTUATE + SCATTER)
    last = {}
    for points in (3, 30):
        options = ("--set", f"output.points_per_decade={points}", "--set", "uncertainty.level=0.5")
        done = dielast("actuate", "a.toml", "--plot", "none", "-o", f"{points}", *options)
        assert done.returncode == 0, done.stderr
        table, events = columns(tmp_path / f"{points}/actuate.csv"), columns(tmp_path / f"{points}/events.csv")
        last[points] = {header: values[-1] for header, values in table.items()}
        assert last[points]["time [s]"] == events["time [s]"][0]
        # rows before and after a jump have bounds of their own, and one between two jumps at one moment has none
        row = np.flatnonzero(table["time [s]"] == 300)
        low, high = table["true_field_lower [V/m]"][row], table["true_field_upper [V/m]"][row]
        known = ~np.isnan(low)
        assert known.tolist() == ([True, False, True] if steps else [True, True])
        assert np.all((low <= table["true_field [V/m]"][row])[known])
        assert np.all((table["true_field [V/m]"][row] <= high)[known])
        assert high[0] < low[-1]
    for header, value in last[3].items():
        assert value == pytest.approx(last[30][header], rel=1e-8, nan_ok=True), header
    assert 0 < last[30]["surviving [1]"] < 1
    assert last[30]["true_field_lower [V/m]"] < last[30]["true_field [V/m]"]
    # more than a quarter of the films have failed by then
    assert np.isnan(last[30]["true_field_upper [V/m]"])


def test_the_summary_ends_at_the_stop_whatever_times_are_listed(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(ACTUATE.split("[uncertainty]")[0])
    finals = set()
    for name, output in (("a", "points_per_decade=6"), ("b", 'times=["1 s", "310 s"]'), ("c", 'times=["1 s", "2 h"]')):
        done = dielast("actuate", "a.toml", "--plot", "none", "-o", name, "--set", f"output.{output}")
        if name == "c":
            assert "lies after the end of the programme" in done.stderr
            continue
        assert done.returncode == 0, done.stderr
        summary = tomllib.loads((tmp_path / name / "summary.toml").read_text())
        finals.add(summary["actuate"]["final_relative_stretch_1"])
        assert summary["breakdown"]["stretch_1"][0] / 1.9 == pytest.approx(max(finals), rel=1e-8)
    assert len(finals) == 1
    assert columns(tmp_path / "b/actuate.csv")["time [s]"].tolist() == [1, 310]


def test_a_stated_tolerance_is_the_draws_too(dielast: Run, tmp_path: Path) -> None:
    off = {}
    for name, extra in (("loose", ""), ("stated", "[solver]\nrtol = 1e-6\n")):
        (tmp_path / f"{name}.toml").write_text(MAP.replace('"material', '"same-material') + extra)
        assert dielast("failure-map", f"{name}.toml", "--plot", "none").returncode == 0
        table = columns(tmp_path / name / "failure-map.csv")
        time, low = table["time_to_failure [s]"], table["time_to_failure_lower [s]"]
        off[name] = float(np.max(np.abs(low / time - 1)))
    # all draws are the material itself
    assert off["stated"] <= 1e-9 < off["loose"] < 1e-3
