"""Recipes of charges, of sources with a resistance and of leaks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from processes import Run

from dielast.io.table import number_columns, parse_csv

CHARGE = """
kind = "actuate"
material = "example:vhb4905.toml"
control = "charge"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "60 s"
electrode_diameter = "10 mm"
[[step]]
charge = "30 nC"
duration = "1 s"
[[step]]
hold = "100 s"
[leakage]
conductivity = "3e-14 S/m"
[output]
points_per_decade = 2
"""
SOURCE = """
kind = "actuate"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
relax = "60 s"
electrode_diameter = "10 mm"
[[step]]
waveform = "sine"
high = "2 kV"
period = "1 s"
cycles = 2
[source]
resistance = "0 ohm"
[stop]
at = "end"
"""
AREA = np.pi * 0.01**2 / 4 / 1.9**2


def test_charges_sweep_and_draw(dielast: Run, tmp_path: Path) -> None:
    density = f"{30e-9 / AREA:.15g} C/m^2"
    (tmp_path / "q.csv").write_text("time [s],charge_density [mC/m^2]\n0,0\n1," + f"{30e-6 / AREA:.15g}\n")
    sweep = f"""
[sweep]
"step.0" = [
    {{ charge = "30 nC", duration = "1 s" }},
    {{ charge = "{density}", rate = "{density.replace("m^2", "m^2/s")}" }},
    {{ table = "q.csv" }},
]
[uncertainty]
draws = 19
thickness = "1 %"
"""
    (tmp_path / "a.toml").write_text(CHARGE + sweep)
    done = dielast("actuate", "a.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    content = (tmp_path / "a/actuate.csv").read_bytes()
    names = ["case", "time [s]", "charge [C]", "charge_density [C/m^2]", "current [A]", "leaked_energy [J/m^3]"]
    case, time, charge, charge_density, current, leaked = number_columns(content, "a", names)
    assert charge == pytest.approx(charge_density * AREA, rel=1e-8)
    assert charge.max() == pytest.approx(30e-9, rel=1e-3)
    ends = np.flatnonzero(time == time.max())
    assert case[ends].tolist() == [0, 1, 2]
    # three ways to say the same
    assert charge[ends] == pytest.approx(charge[ends[0]], rel=1e-6)
    assert (current[time > 1.001] == 0).all()
    assert leaked[ends[0]] > 0
    cells = parse_csv(content, "a")
    assert "voltage_lower [V]" in cells
    assert "current_lower [A]" not in cells


def test_a_source_without_resistance_is_none_and_its_cycles_have_an_efficiency(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(SOURCE + '[sweep]\n"source.resistance" = ["0 ohm", "10 GΩ"]\n')
    (tmp_path / "b.toml").write_text(SOURCE.replace('[source]\nresistance = "0 ohm"\n', ""))
    for name in "ab":
        done = dielast("actuate", f"{name}.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr
    plain, wired = (parse_csv((tmp_path / name / "actuate.csv").read_bytes(), name) for name in "ba")
    rows = len(plain["time [s]"])
    assert [cells[:rows] for header, cells in wired.items() if header in plain] == list(plain.values())
    assert wired["source_voltage [V]"][:rows] == plain["voltage [V]"]
    cycles = parse_csv((tmp_path / "a/cycles.csv").read_bytes(), "cycles")
    efficiency = [float(cell) for cell in cycles["efficiency [1]"]]
    assert 1 > efficiency[1] > 0.9 > 0.5 > efficiency[3] > 0
    # nothing is written that nobody asked for
    assert "efficiency [1]" not in parse_csv((tmp_path / "b/cycles.csv").read_bytes(), "cycles")
    assert not any("charge" in header or "energy" in header for header in plain)
