"""A material file with no branches is an elastic material, in every simulation: closed forms, whatever the time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dielast.cli.run import compute
from dielast.commands.registry import read_cases
from dielast.io.table import number_columns, parse_csv
from dielast.sharing.execution import Execution

MODULUS, PERMITTIVITY, THICKNESS, LIMIT = 26e3, 4e-11, 5e-4, 30.0
BRANCHLESS = "[nonequilibrium]\nrelaxation_time_s = []\nshear_modulus_Pa = []\n"
UP_AND_DOWN = [("2.0", 'rate = "5 %/s"'), ("3.0", ""), ("1.5", 'duration = "1 s"')]


def run(folder: Path, kind: str, text: str, J_lim: str = "") -> dict[str, bytes]:
    """Every file of a run, its figure too, that nothing is warned of."""
    law = '[shift]\nlaw = "wlf"\nC1 = 13.7\nC2 = "187.1 K"\n[dielectric]\npermittivity = "4e-11 F/m"\n'
    equilibrium = f'reference_temperature = "20 degC"\n[equilibrium]\nshear_modulus = "26 kPa"\n{J_lim}\n'
    (folder / "elastic.toml").write_text(equilibrium + BRANCHLESS + law)
    path = folder / "recipe.toml"
    path.write_text(f'kind = "{kind}"\nmaterial = "elastic.toml"\n{text}')
    files, _, _, doubts = compute(kind, read_cases(path), path, ("png",), Execution())
    assert doubts == []
    assert files[f"{kind}.png"].startswith(b"\x89PNG")
    return files


def stress(stretch: np.ndarray) -> np.ndarray:
    """Nominal stress in Pa of an incompressible Gent solid pulled along one axis."""
    invariant = stretch**2 + 2 / stretch - 3
    return np.asarray(MODULUS * LIMIT / (LIMIT - invariant) * (stretch - stretch**-2))


def test_relaxation_is_none(tmp_path: Path) -> None:
    steps = "".join(f'[[step]]\nstretch = {target}\n{pace}\n[[step]]\nhold = "10 min"\n' for target, pace in UP_AND_DOWN)
    files = run(tmp_path, "relax", 'temperature = "0 degC"\n' + steps, f"J_lim = {LIMIT}")
    stretch, nominal = number_columns(files["relax.csv"], "relax.csv", ["stretch_1 [1]", "nominal_stress_1 [Pa]"])
    assert (stretch.max(), stretch[-1]) == (3, 1.5)
    np.testing.assert_allclose(nominal, stress(stretch), rtol=1e-6, atol=1e-3)  # the solver's tolerance, and 9 digits


def test_creep_is_none(tmp_path: Path) -> None:
    up, down = '[[step]]\nstress = "60 kPa"\nrate = "5 kPa/s"\n', '[[step]]\nstress = "10 kPa"\n'
    steps = f'{up}[[step]]\nhold = "1 d"\n{down}[[step]]\nhold = "1 s"\n'
    files = run(tmp_path, "creep", steps, J_lim=f"J_lim = {LIMIT}")
    stretch, nominal = number_columns(files["creep.csv"], "creep.csv", ["stretch_1 [1]", "nominal_stress_1 [Pa]"])
    assert (nominal.max(), nominal[-1]) == (60e3, 10e3)
    np.testing.assert_allclose(stress(stretch), nominal, rtol=1e-6, atol=3 * MODULUS * 1e-6)  # the solver's tolerance of stretch


@pytest.mark.parametrize("timescale", ["1 %", "1 s", "0 s"])
def test_a_neo_hookean_film_pulls_in_at_the_cube_root_of_two(tmp_path: Path, timescale: str) -> None:
    film = f'[film]\nthickness = "0.5 mm"\n[pull_in]\ntimescale = "{timescale}"\n[stop]\nat = "pull-in"\n'
    files = run(tmp_path, "actuate", film + '[[step]]\nvoltage = "20 kV"\nduration = "10 s"\n')
    assert parse_csv(files["events.csv"], "events.csv")["event"] == ["pull-in"]
    stretch, voltage = number_columns(files["events.csv"], "events.csv", ["stretch_1 [1]", "voltage [V]"])
    critical = 2 ** (1 / 3)
    np.testing.assert_allclose(stretch, critical, rtol=2e-5)
    field = np.sqrt(MODULUS / PERMITTIVITY * (critical**-2 - critical**-8))  # nominal; Zhao and Suo, 10.1063/1.2768641
    np.testing.assert_allclose(voltage, field * THICKNESS, rtol=1e-6)


def test_a_map_has_one_threshold(tmp_path: Path) -> None:
    critical = 2 ** (1 / 3)
    threshold = np.sqrt(MODULUS / PERMITTIVITY * (critical**-2 - critical**-8)) * THICKNESS
    volts = ", ".join(f'"{share * threshold:.9g} V"' for share in (0.9, 0.999, 1.001, 1.1))
    text = f'horizon = "24 h"\n[film]\nthickness = "0.5 mm"\nprestretch = [1.0]\n[voltage]\nvalues = [{volts}]\n'
    files = run(tmp_path, "failure-map", text + '[breakdown]\nfield = ["900 MV/m"]\n[pull_in]\ntimescale = "1 %"\n')
    assert parse_csv(files["failure-map.csv"], "map")["failure_mode"] == ["none", "none", "pull-in", "pull-in"]
