"""A column of results is stated once: in tables, comparisons, bounds and figures, and one that is added from outside."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from flat import failure_map
from processes import Run

from dielast import read_material
from dielast.commands.simulation.bounds import bounded_map_columns
from dielast.io.table import number_columns
from dielast.material.intervals import DrawIntervals
from dielast.simulate import quantities
from dielast.simulate.quantities import Quantity

FILM = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = [2.0, 1.8]
relax = "10 min"
electrode_diameter = "10 mm"
[[step]]
voltage = "2 kV"
duration = "1 s"
[[step]]
hold = "10 s"
[output]
points_per_decade = 3
"""
TOY = """
from dielast.simulate.quantities import FILMS, Quantity
FILMS.append(Quantity("squeeze", "Pa", lambda film: film.record.field**2 * 4e-11, "pressing", falls=True))
"""
UNCERTAIN = """
[uncertainty]
draws = 20
thickness = "2 %"
"""


def compared(file: str, column: str, header: str, axis: str = "y") -> str:
    other = "x" if axis == "y" else "y"
    return f'[[compare]]\nfile = "{file}"\n{other} = "time [s]"\n{axis} = "{header}"\n{axis}_column = "{column}"\n'


def test_area_thickness_and_capacitance_follow_from_the_stretches(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "film.toml").write_text(FILM)
    assert dielast("actuate", "film.toml", "-o", "out", "--plot", "none").returncode == 0
    headers = [
        "stretch_1 [1]",
        "stretch_2 [1]",
        "area_strain [1]",
        "thickness_stretch [1]",
        "capacitance [F/m^2]",
        "capacitance [F]",
    ]
    first, second, area, thickness, density, whole = number_columns(
        (tmp_path / "out/actuate.csv").read_bytes(), "actuate.csv", headers
    )
    assert area == pytest.approx(first * second / 3.6 - 1, abs=1e-8)
    assert area[0] == pytest.approx(0, abs=1e-12)
    assert area[-1] > 0.01
    assert thickness == pytest.approx(1 / (first * second), rel=1e-8)
    assert density == pytest.approx(3.98e-11 * (first * second) ** 2 / 0.5e-3, rel=1e-8)
    assert whole == pytest.approx(density * np.pi * 0.01**2 / 4 / 3.6, rel=1e-8)


def test_an_area_is_not_compared_with_a_length(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "area.csv").write_text("time [s],A/A0,area strain [%],dA\n1,1.01,1,1\n5,1.02,2,2\n11,1.03,3,3\n")
    runs = {
        name: FILM + compared("area.csv", column, header)
        for name, column, header in (
            ("ratio", "A/A0", "area_strain [1]"),
            ("strain", "area strain", "area_strain [1]"),
            ("length", "A/A0", "relative_stretch_1 [1]"),
            ("areal", "area strain", "stretch_1 [1]"),
        )
    }
    runs["stated"] = FILM + compared("area.csv", "dA", "area_strain [1]") + 'units = { y = "%" }\n'
    errors = {}
    for name, text in runs.items():
        (tmp_path / f"{name}.toml").write_text(text)
        errors[name] = dielast("actuate", f"{name}.toml", "--plot", "none").stderr
    misfits = [
        tomllib.loads((tmp_path / name / "summary.toml").read_text())["compare"]["rms_error"]
        for name in ("ratio", "strain", "stated")
    ]
    assert misfits[0] > 0
    assert misfits == pytest.approx([misfits[0]] * 3, rel=1e-9)
    assert 'column "A/A0" holds areas, and relative_stretch_1 [1] is a length' in errors["length"]
    assert 'column "area strain [%]" holds areas, and stretch_1 [1] is a length' in errors["areal"]


def test_a_column_of_a_map_from_outside_is_written_and_bounded() -> None:
    nominal = Quantity("nominal_field", "V/m", lambda result: np.broadcast_to(result.voltage / 5e-4, result.failure_mode.shape))
    quantities.CELLS.append(nominal)
    try:
        film = {"thickness": 5e-4, "horizon": 10.0, "breakdown_field": 48e6, "rtol": 1e-3}
        found = failure_map(read_material("example:vhb4905.toml"), voltage=[3e3, 4e3], prestretch=[1.9], **film)  # type: ignore[arg-type]
        table = bounded_map_columns(found.columns(), [found] * 20, DrawIntervals(0.9))
    finally:
        quantities.CELLS.remove(nominal)
    values = {column.header: column.values for column in table}
    assert list(values["nominal_field [V/m]"]) == list(values["nominal_field_upper [V/m]"]) == [6e6, 8e6]


def test_a_quantity_from_outside_is_written_compared_bounded_and_drawn(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("time [s],p [kPa]\n2,0.6\n11,0.7\n")
    (tmp_path / "film.toml").write_text(FILM + UNCERTAIN + compared("p.csv", "p", "squeeze [Pa]"))
    done = dielast("actuate", "film.toml", "-o", "out", "--plot", "svg", prelude=TOY)
    assert done.returncode == 0, done.stderr
    voltage, toy, lower, upper = number_columns(
        (tmp_path / "out/actuate.csv").read_bytes(),
        "actuate.csv",
        ["voltage [V]", "squeeze [Pa]", "squeeze_lower [Pa]", "squeeze_upper [Pa]"],
    )
    assert toy == pytest.approx((voltage / 0.5e-3) ** 2 * 4e-11, rel=1e-8)
    assert np.all(lower[-3:] < upper[-3:])
    assert tomllib.loads((tmp_path / "out/summary.toml").read_text())["compare"]["y"] == "squeeze [Pa]"
    assert "pressing" in (tmp_path / "out/actuate.svg").read_text()
    assert '"squeeze [Pa]" is no column of the result' in dielast("actuate", "film.toml").stderr
