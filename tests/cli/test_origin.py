"""A material file says where its constants are from, and branches are numbered as the user has them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from processes import Run

from dielast import WLF, Material, Spectrum, read_material, write_material
from dielast.calibration.parameters import Free, parameter_space
from dielast.io.table import parse_csv
from dielast.plots.calibration import _symbol

START = """
name = "start"
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "20 kPa"
J_lim = 100.0
[nonequilibrium]
J_lim = 50.0
relaxation_time_s = [1.0, 300.0, 20.0]
shear_modulus_Pa = [9e3, 1e3, 3e3]
[shift]
law = "none"
[origin]
"equilibrium.J_lim" = "measured"
"""
CALIBRATE = """
kind = "calibrate"
[material]
file = "start.toml"
name = "VHB 4910, lot 7"
[[test]]
file = "example:tensile/fast.csv"
specimen = { gauge_length = "80 mm", width = "22 mm", thickness = "1 mm" }
temperature = "20 degC"
[free]
"equilibrium.shear_modulus" = {}
"nonequilibrium.shear_modulus[1]" = {}
[fit]
starts = 1
[uncertainty]
draws = 0
"""


def test_calibrate_names_the_material_keeps_the_order_of_branches_and_says_what_is_fitted(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "start.toml").write_text(START)
    (tmp_path / "fit.toml").write_text(CALIBRATE)
    done = dielast("calibrate", "fit.toml", "-o", "out", "--plot", "none")
    assert done.returncode == 0, done.stderr
    fitted = tomllib.loads((tmp_path / "out/material.toml").read_text())
    assert fitted["name"] == "VHB 4910, lot 7"
    assert fitted["nonequilibrium"]["relaxation_time_s"] == [1.0, 300.0, 20.0]
    parameters = parse_csv((tmp_path / "out/parameters.csv").read_bytes(), "parameters.csv")
    assert parameters["parameter"] == ["equilibrium.shear_modulus", "nonequilibrium.shear_modulus[1]"]
    start, value = (float(parameters[column][1]) for column in ("start", "value"))
    assert start == 1e3
    assert fitted["nonequilibrium"]["shear_modulus_Pa"] == [9e3, pytest.approx(value), 3e3]
    origin = fitted["origin"]
    assert origin["nonequilibrium.shear_modulus[1]"] == "fitted: fast"
    # one test does not tell the equilibrium spring from the slow branch
    at_most = f"{float(parameters['upper'][0]):.4g} Pa"
    assert origin["equilibrium.shear_modulus"] == f"fitted: not determined, at most {at_most} at 90 %, by fast"
    assert (origin["equilibrium.J_lim"], origin["nonequilibrium.J_lim"]) == ("measured", "stated")
    assert _symbol("nonequilibrium.shear_modulus[1]").endswith("branch 1")
    assert _symbol("film: electrode_share") == "film: electrode share"


def test_origins_are_carried_on_and_unknown_constants_warned_of(dielast: Run, tmp_path: Path) -> None:
    more = '"nonequilibrium.shear_modulus" = "fitted: a.csv"\n"equilibrium.colour" = "stated"\n'
    (tmp_path / "m.toml").write_text(START + more)
    with pytest.warns(Warning, match=r'origin: the material has no "equilibrium\.colour"'):
        material = read_material(tmp_path / "m.toml")
    assert tomllib.loads(write_material(material).decode())["origin"]["nonequilibrium.shear_modulus"] == "fitted: a.csv"
    done = dielast("validate", "m.toml")
    assert done.returncode == 0
    assert '"equilibrium.colour"' in done.stderr
    (tmp_path / "m.toml").write_text(START.replace('"measured"', "3"))
    assert 'origin: equilibrium.J_lim: 3: "stated", "measured" or' in dielast("validate", "m.toml").stderr


def test_spectrum_says_what_the_curve_and_what_the_recipe_states(dielast: Run, tmp_path: Path) -> None:
    recipe = (
        'kind = "spectrum"\nmastercurve = "example:mastercurve"\n[material]\nrelative_permittivity = 4.5\n[fit]\nmethod = "nnls"\n'
    )
    (tmp_path / "s.toml").write_text(recipe)
    assert dielast("spectrum", "s.toml", "-o", "out", "--plot", "none").returncode == 0
    origin = tomllib.loads((tmp_path / "out/material.toml").read_text())["origin"]
    assert origin["nonequilibrium.shear_modulus"] == origin["equilibrium.shear_modulus"] == origin["shift.C1"] == "measured"
    assert origin["dielectric.permittivity"] == "stated"


def test_neighbouring_branches_are_those_next_in_time_in_any_order() -> None:
    material = Material("m", 1e4, Spectrum(np.array([1.0, 300.0, 20.0]), np.ones(3)), WLF(20.0, 13.0, 180.0))
    found = parameter_space(material, {"nonequilibrium.relaxation_time": Free()}).parameters
    assert [parameter.start for parameter in found] == [1.0, 300.0, 20.0]
    assert found[2].lower == pytest.approx(np.sqrt(20.0))
    assert found[2].upper == pytest.approx(np.sqrt(6000.0))
