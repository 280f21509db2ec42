"""A master curve shifted by density and temperature, and the simulations with the material made of it: one statement."""

from __future__ import annotations

import csv
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from processes import Run

TIMES, MODULI, LEVEL, EXPANSION = np.array([1e3, 10.0, 0.1]), np.array([3e5, 1e6, 3e6]), 2e5, 6e-4
CURVE = """\
kind = "mastercurve"
[data]
file = "dma.csv"
columns = { temperature = "temperature", time = "time", modulus = "modulus" }
[shift]
reference_temperature = "20 degC"
vertical = "density-temperature"
thermal_expansion = "6e-4 /K"
[uncertainty]
draws = 20
"""
SPECTRUM = """\
kind = "spectrum"
mastercurve = "curve"
[fit]
method = "nnls"
branches = 12
[material]
permittivity = "4e-11 F/m"
"""
RELAX = """\
kind = "relax"
material = "spectrum/material.toml"
temperature = "80 degC"
[[step]]
stretch = 1.001
[[step]]
hold = "30 s"
[output]
times = ["1 s", "10 s", "30 s"]
[uncertainty]
draws = 20
"""


def modulus(temperature: float, time: np.ndarray) -> np.ndarray:
    """Young's modulus in Pa of the film that was measured."""
    factor = (temperature + 273.15) / 293.15 / (1 + EXPANSION * (temperature - 20))
    reduced = time * 10 ** (10 * (temperature - 20) / (150 + temperature - 20))
    return np.asarray(factor * (LEVEL + np.exp(-reduced[:, None] / TIMES) @ MODULI))


@pytest.fixture(scope="module")
def made(command: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a master curve, a spectrum made of it, and their draws."""
    folder = tmp_path_factory.mktemp("made")
    time, noise = np.geomspace(0.3, 300, 25), np.random.default_rng(0)
    lines = ["temperature [degC],time [s],modulus [Pa]"]
    for temperature in (-20.0, 0.0, 20.0, 40.0, 60.0, 80.0):
        values = modulus(temperature, time) * (1 + 1e-3 * noise.standard_normal(time.size))
        lines += [f"{temperature:g},{t!r},{value!r}" for t, value in zip(time.tolist(), values.tolist(), strict=True)]
    (folder / "dma.csv").write_text("\n".join(lines))
    for name, text in (("curve", CURVE), ("spectrum", SPECTRUM), ("relax", RELAX)):
        (folder / f"{name}.toml").write_text(text)
    for kind, name in (("mastercurve", "curve"), ("spectrum", "spectrum")):
        done = command(folder, kind, f"{name}.toml", "-o", name, "--plot", "none")
        assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    """The folder of the test, with a copy of what was made."""
    return Path(shutil.copytree(made, tmp_path, dirs_exist_ok=True))


def test_a_material_made_with_a_vertical_shift_simulates_with_it(folder: Path, dielast: Run) -> None:
    assert tomllib.loads((folder / "curve/summary.toml").read_text())["shift"]["thermal_expansion"] == "0.0006 /K"
    material = folder / "spectrum/material.toml"
    stated = tomllib.loads(material.read_text())["temperature"]
    assert stated == {"equilibrium": "entropic", "nonequilibrium": "entropic", "thermal_expansion": "0.0006 1/K"}

    def simulated() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        done = dielast("relax", "relax.toml", "-o", "relax", "--plot", "none")
        assert done.returncode == 0, done.stderr
        with (folder / "relax/relax.csv").open() as file:
            rows = list(csv.DictReader(file))
        names = ("relaxation_modulus [Pa]", "nominal_stress_1_lower [Pa]", "nominal_stress_1_upper [Pa]")
        first, second, third = (np.array([float(row[name]) for row in rows]) for name in names)
        return first, second, third

    found, lower, upper = simulated()
    assert found == pytest.approx(modulus(80.0, np.array([1.0, 10.0, 30.0])), rel=0.02)  # what 12 branches leave
    assert np.all((lower < upper) & (lower < 1.02e-3 * found) & (upper > 0.98e-3 * found))
    summary = folder / "spectrum/summary.toml"
    summary.write_text('changed = ["material.toml"]\n' + summary.read_text())
    material.write_text(material.read_text().replace('"entropic"', '"constant"').replace('thermal_expansion = "0.0006 1/K"', ""))
    assert simulated()[0] == pytest.approx(found * 293.15 / 353.15 * (1 + EXPANSION * 60), rel=1e-6)


def test_a_summary_that_was_edited_is_refused_in_one_line(folder: Path, dielast: Run) -> None:
    summary = folder / "curve/summary.toml"
    whole = summary.read_text()
    for value in ("3", '"6e-4 m"', "[]"):
        summary.write_text(whole.replace('"0.0006 /K"', value))
        done = dielast("spectrum", "spectrum.toml", "-o", "again", "--plot", "none")
        assert done.returncode == 2
        assert done.stderr.count("\n") == 1
        assert "curve/summary.toml" in done.stderr
        assert "thermal_expansion" in done.stderr
