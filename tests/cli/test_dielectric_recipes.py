"""Permittivities over temperature and stretch, from files to events, maps and intervals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from processes import Run
from tables import rows

MATERIAL = """\
name = "film"
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
J_lim = 110
[nonequilibrium]
J_lim = 55
relaxation_time_s = [100.0, 1.0]
shear_modulus_Pa = [20000.0, 90000.0]
[shift]
law = "wlf"
C1 = 13.7
C2 = "187.1 K"
[breakdown]
field = "30 MV/m"
[dielectric]
"""
FILM = """\
kind = "actuate"
material = "film.toml"
temperature = "40 degC"
[film]
thickness = "0.5 mm"
prestretch = 1.5
relax = "1 min"
[[step]]
voltage = "6 kV"
rate = "100 V/s"
[stop]
at = "breakdown"
"""
COARSE = "[solver]\nrtol = 1e-4\n"
MAP = """\
kind = "failure-map"
material = "film.toml"
temperature = ["0 degC", "40 degC"]
horizon = "1 h"
[film]
thickness = "0.5 mm"
prestretch = [1.5]
relax = "1 min"
[voltage]
values = ["4.4 kV", "4.8 kV", "5.2 kV"]
"""


def breakdown_time(folder: Path, dielectric: str, dielast: Run, *options: str) -> float:
    (folder / "film.toml").write_text(MATERIAL + dielectric)
    (folder / "run.toml").write_text(FILM)
    done = dielast("actuate", "run.toml", "-o", "out", "--plot", "none", *options)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    (event,) = [row for row in rows(folder / "out/events.csv") if row["event"] == "breakdown"]
    return float(event["time [s]"])


def measured(path: Path) -> dict[float, float]:
    """Relative permittivity at the lowest measured frequency by temperature in K."""
    table = pd.read_csv(path, sep=";", decimal=",", encoding="latin-1")
    lowest = table.loc[table.groupby("temp")["freq"].idxmin()]
    return dict(zip(lowest["temp"].tolist(), lowest["dielec"].tolist(), strict=True))


def test_a_measured_table_of_permittivities_is_used(tmp_path: Path, dielast: Run, shared_data: Callable[[str], Path]) -> None:
    found = measured(shared_data("vhb4905/5-dielectric.csv"))
    assert len(found) == 5
    temperatures = ", ".join(f'"{temperature:g} K"' for temperature in found)
    table = f"temperature = [{temperatures}]\nrelative_permittivity = {list(found.values())}\n"
    by_table = breakdown_time(tmp_path, table, dielast)
    by_number = breakdown_time(tmp_path, f"relative_permittivity = {found[313.15]}", dielast)
    assert by_table == pytest.approx(by_number, rel=1e-8)
    assert by_table != pytest.approx(breakdown_time(tmp_path, f"relative_permittivity = {found[273.15]}", dielast), rel=1e-4)
    (tmp_path / "film.toml").write_text(MATERIAL + table)
    assert dielast("validate", "film.toml").returncode == 0
    for temperature, options in (("90", ()), ("-0.5", ("--json",))):
        done = dielast("actuate", "run.toml", "--set", f"temperature='{temperature} degC'", "--plot", "none", *options)
        assert done.returncode == 2
        (line,) = [line for line in done.stderr.splitlines() if "temperature" in line]
        wanted = f"run.toml: temperature: {temperature} degC is outside the permittivity table, which is for 0 to 80 degC: state"
        assert wanted in line


def test_a_permittivity_that_falls_with_stretch_breaks_down_later(tmp_path: Path, dielast: Run) -> None:
    times = [
        breakdown_time(tmp_path, f'permittivity = "4e-11 F/m"\n{line}', dielast)
        for line in ("", "stretch_coefficient = 0.0", "stretch_coefficient = -0.053")
    ]
    assert times[0] == pytest.approx(times[1], rel=1e-9)
    assert times[2] > 1.001 * times[0]


def test_maps_and_draws_take_every_law(tmp_path: Path, dielast: Run) -> None:
    (tmp_path / "map.toml").write_text(MAP + COARSE)
    (tmp_path / "run.toml").write_text(FILM + COARSE + '[uncertainty]\ndraws = 20\nthickness = "2 %"\n')
    found = []
    for dielectric in (
        'permittivity = "4e-11 F/m"',
        'permittivity = "4e-11 F/m"\nstretch_coefficient = -0.053',
        'temperature = ["0 degC", "40 degC"]\nrelative_permittivity = [4.8, 4.2]',
    ):
        (tmp_path / "film.toml").write_text(MATERIAL + dielectric)
        done = dielast("failure-map", "map.toml", "-o", "map", "--plot", "none")
        assert done.returncode == 0, done.stderr
        found.append([float(row["time_to_failure [s]"] or "inf") for row in rows(tmp_path / "map/failure-map.csv")])
        done = dielast("actuate", "run.toml", "-o", "out", "--plot", "svg" if "stretch" in dielectric else "none")
        assert done.returncode == 0, done.stderr
    constant, softening, table = found
    assert len(constant) == 6
    assert all(b >= a for a, b in zip(constant, softening, strict=True))
    assert softening != constant != table
