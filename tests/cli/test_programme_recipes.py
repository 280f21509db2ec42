"""Recipes of edges and electrodes: generators, springs, tests under voltage, and what they refuse."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from processes import Run

from dielast.commands.simulation.naming import TIMES
from dielast.io.table import number_columns
from dielast.plots.texts import FIXED

MATERIAL = """
name = "m"
reference_temperature = "20 degC"
density = "960 kg/m^3"
[equilibrium]
law = "neo-hookean"
shear_modulus = "30 kPa"
[nonequilibrium]
law = "neo-hookean"
relaxation_time_s = [1.0]
shear_modulus_Pa = [2e4]
[shift]
law = "none"
[dielectric]
permittivity = "4e-11 F/m"
"""
GENERATOR = """
kind = "actuate"
material = "m.toml"
[film]
thickness = "1 mm"
prestretch = 1.5
width = "20 mm"
[[step]]
stretch = 3.0
rate = "100 %/s"
[[step]]
voltage = "2 kV"
duration = "0.1 s"
[[step]]
circuit = "open"
stretch = [2.5, 2.0]
duration = "1 s"
[[step]]
voltage = "0 V"
duration = "0.1 s"
[[step]]
force = ["0.5 N", "0.4 N"]
duration = "1 s"
[breakdown]
field = "90 MV/m"
[output]
points_per_decade = 2
[plot]
x = "stretch_1 [1]"
y = "voltage [V]"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "m.toml").write_text(MATERIAL)
    return tmp_path


def test_a_generator_runs_and_its_cycles_are_counted(dielast: Run, folder: Path) -> None:
    (folder / "g.toml").write_text(
        GENERATOR + '[repeat]\ntimes = 2\nsteps = [0, 3]\n[sweep]\n"step.1.voltage" = ["1 kV", "2 kV"]\n'
    )
    done = dielast("actuate", "g.toml", "--plot", "png")
    assert done.returncode == 0, done.stderr
    assert (folder / "g/actuate.png").exists()
    names = ["case", "cycle", "electrical_energy [J/m^3]", "mechanical_work [J/m^3]", "energy_per_mass [J/kg]", "efficiency [1]"]
    case, cycle, energy, work, per_mass, efficiency = number_columns((folder / "g/cycles.csv").read_bytes(), "g", names)
    assert case.tolist() == [0, 0, 1, 1]
    assert cycle.tolist() == [1, 2] * 2
    # both axes are held: C V^2/2 at each charge
    wanted = 0.5 * 4e-11 * 3.0**4 * (np.array([1e6, 2e6])) ** 2 * ((9.0 / 5.0) ** 2 - 1)
    assert -energy == pytest.approx(np.repeat(wanted, 2), rel=1e-6)
    assert per_mass == pytest.approx(-energy / 960, rel=1e-6)
    assert efficiency == pytest.approx(-energy / work, rel=1e-6)
    names = ["case", "time [s]", "nominal_stress_1 [Pa]", "nominal_stress_2 [Pa]", "dissipated_energy [J/m^3]", "stability [1]"]
    case, time, first, second, dissipated, margin = number_columns((folder / "g/actuate.csv").read_bytes(), "g", names)
    last = np.flatnonzero(np.append(np.diff(case) != 0, True))
    assert time[last] == pytest.approx([1.5 + 1.2 + 1.0 + 1.2 + 1.0] * 2)
    assert first[last] == pytest.approx(0.5 / (20e-3 * 1e-3))
    assert second[last] == pytest.approx(0.4 / (20e-3 * 1e-3))
    assert (np.diff(dissipated)[np.diff(case) == 0] > -1e-3).all()
    assert 0 < margin.min() <= margin.max() <= 1


def test_waveforms_tables_and_a_spring(dielast: Run, folder: Path) -> None:
    head = GENERATOR[: GENERATOR.index("[[step]]")]
    tail = GENERATOR[GENERATOR.index("[breakdown]") : GENERATOR.index("[plot]")]
    wave = """
[[step]]
stretch = 2.0
[[step]]
waveform = "sine"
stretch = { low = 2.0, high = 2.5 }
high = "2 kV"
period = "1 s"
cycles = 2
phase = "90 deg"
[[step]]
table = "t.csv"
columns = { voltage = "voltage", stretch = "stretch" }
[[step]]
waveform = "triangle"
stretch = { low = 2.3, high = 2.5 }
voltage = "500 V"
period = "1 s"
cycles = 2
[[step]]
waveform = "triangle"
stretch = 2.6
low = "0.5 kV"
high = "1 kV"
period = "1 s"
cycles = 2
"""
    time = np.linspace(0.0, 1.0, 21)
    rows = [f"{at},{1000 + 500 * at},{2.0 + 0.3 * at}" for at in time]
    (folder / "t.csv").write_text("time [s],voltage [V],stretch [1]\n" + "\n".join(rows) + "\n")
    spring = 'spring = { stiffness = "50 N/m", axis = 1, length = "20 mm" }\n'
    (folder / "w.toml").write_text(head.replace('width = "20 mm"\n', "") + wave + tail)
    (folder / "s.toml").write_text(head + spring + '[[step]]\nvoltage = "1 kV"\nduration = "1 s"\n' + tail)
    for name in "ws":
        done = dielast("actuate", f"{name}.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr
    names = ["time [s]", "voltage [V]", "stretch_1 [1]", "stretch_2 [1]"]
    time, voltage, first, second = number_columns((folder / "w/actuate.csv").read_bytes(), "w", names)
    in_wave, in_table = (time > 1e-6) & (time < 2), (time > 2 + 1e-9) & (time <= 3)
    for begin, stretches, volts in ((3, (2.3, 0, 0.2), (1500, -1000, 0)), (5, (2.3, 0.3, 0), (500, 0, 500))):
        here = (time > begin) & (time <= begin + 2)
        share, up = (time[here] - begin) / 2, 1 - np.abs(2 * ((time[here] - begin) % 1) - 1)
        assert first[here] == pytest.approx(stretches[0] + stretches[1] * share + stretches[2] * up, rel=1e-8)
        assert voltage[here] == pytest.approx(volts[0] + volts[1] * share + volts[2] * up, rel=1e-6)
    assert first[in_wave] == pytest.approx(2.25 - 0.25 * np.cos(2 * np.pi * time[in_wave]), rel=1e-8)
    assert voltage[in_wave] == pytest.approx(1000 - 1000 * np.cos(2 * np.pi * time[in_wave] + np.pi / 2), rel=1e-6)
    assert first[in_table] == pytest.approx(2.0 + 0.3 * (time[in_table] - 2), rel=1e-8)
    assert voltage[in_table] == pytest.approx(1000 + 500 * (time[in_table] - 2), rel=1e-8)
    assert (first == second).all()
    stress, stretch = number_columns((folder / "s/actuate.csv").read_bytes(), "s", ["nominal_stress_1 [Pa]", "stretch_1 [1]"])
    # 50 N/m over 20 mm of film, 20 mm x 1 mm across
    assert np.diff(stress) == pytest.approx(-50e3 * np.diff(stretch), abs=1e-2)


@pytest.mark.trust
def test_tension_under_voltage_is_compared_and_calibrated(dielast: Run, folder: Path, shared_data: Callable[[str], Path]) -> None:
    """Of the measured pull under 6 kV: the same film as a specimen in a constant field, which `calibrate` follows."""
    (folder / "m.toml").write_text(MATERIAL.replace('"neo-hookean"', '"gent"\nJ_lim = 60.0'))
    lines = shared_data("vhb4905/6-coupled.csv").read_text(encoding="latin-1").splitlines()
    cells = [line.replace(",", ".").split(";") for line in lines if line.startswith("703;")]
    points = [(float(row[-2]), float(row[-1])) for row in cells]
    top = int(np.argmax([stretch > 2.0 for stretch, _ in points])) - 1
    table = "\n".join(f"{(stretch - 1) / 0.2!r},{stretch!r},{stress!r}" for stretch, stress in points[1 : top + 1])
    (folder / "pull.csv").write_text("time [s],stretch,stress [Pa]\n" + table + "\n")
    recipe = """
kind = "actuate"
material = "m.toml"
mode = "uniaxial"
[film]
thickness = "0.5 mm"
[[step]]
voltage = "6 kV"
[[step]]
stretch = 2.0
rate = "20 %/s"
[[compare]]
file = "pull.csv"
x = "stretch_1 [1]"
y = "nominal_stress_1 [Pa]"
x_column = "stretch"
y_column = "stress [Pa]"
[stop]
at = "end"
"""
    (folder / "pull.toml").write_text(recipe)
    free = '[free]\n"equilibrium.shear_modulus" = {}\n[fit]\nstarts = 1\n[uncertainty]\ndraws = 0\n'
    fit = 'kind = "calibrate"\nmaterial = "m.toml"\n[[test]]\nrecipe = "pull.toml"\n'
    (folder / "fit.toml").write_text(fit + free)
    done = dielast("actuate", "pull.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    assert "misfit" in done.stdout or "rms" in done.stdout
    done = dielast("calibrate", "fit.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("film", "step", "title"),
    [
        ('boundary = "clamped"', 'circuit = "open"\nstretch = 1.5', "film 1 mm, prestretch 3, up to 4 kV"),
        ('spring = { stiffness = "5 kPa", axis = 1 }', 'voltage = "0 V"', f"spring{TIMES}dead load, up to 1 kV"),
    ],
)
def test_title_states_what_holds_the_edges_and_the_voltage_of_an_open_circuit(
    dielast: Run, folder: Path, film: str, step: str, title: str
) -> None:
    """Half the stretch of both axes is 16 times the voltage; a quarter of it at the start."""
    text = f"""
kind = "actuate"
material = "m.toml"
[film]
thickness = "1 mm"
prestretch = 3.0
{film}
[[step]]
voltage = "{0.25 if "open" in step else 1} kV"
[[step]]
{step}
duration = "1 s"
[output]
points_per_decade = 1
[breakdown]
field = "90 MV/m"
"""
    (folder / "t.toml").write_text(text)
    done = dielast("actuate", "t.toml", "--plot", "svg")
    assert done.returncode == 0, done.stderr
    drawn = " ".join(re.findall(r"<!-- (.*?) -->", (folder / "t/actuate.svg").read_text(encoding="utf-8")))
    assert title in drawn.replace(FIXED, " "), drawn
