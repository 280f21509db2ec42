"""Sweeps and --set of a material's keys give what material files with these values give; mistakes name the key that states them."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from processes import Run
from tables import rows

MATERIAL = """\
name = "film"
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
J_lim = 110.0
[nonequilibrium]
J_lim = 55.0
relaxation_time_s = [100.0, 1.0]
shear_modulus_Pa = [20000.0, 90000.0]
[shift]
law = "none"
[dielectric]
permittivity = "3.98e-11 F/m"
"""
RELAX = """\
kind = "relax"
material = "m.toml"
mode = "uniaxial"
[[step]]
stretch = 2.0
duration = "10 s"
[output]
times = ["5 s", "10 s"]
"""
ACTUATE = """\
kind = "actuate"
material = "m.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.7
relax = "5 min"
[[step]]
voltage = "4 kV"
rate = "500 V/s"
[[step]]
hold = "10 s"
[stop]
at = "end"
[output]
points_per_decade = 2
"""
MAP = """\
kind = "failure-map"
material = "m.toml"
horizon = "1 h"
[film]
thickness = "0.5 mm"
prestretch = [1.7, 1.9]
[voltage]
values = ["4 kV"]
"""
POWER = '[breakdown]\nlaw = "power"\nfield = "30.6 MV/m"\nstretch_exponent = 1.13\n'


@pytest.fixture
def run(tmp_path: Path, dielast: Run) -> Callable[..., subprocess.CompletedProcess[str]]:
    (tmp_path / "m.toml").write_text(MATERIAL)

    def run(text: str, *arguments: str, out: str = "out") -> subprocess.CompletedProcess[str]:
        (tmp_path / "r.toml").write_text(text)
        kind = text.split('"')[1]
        return dielast(kind, "r.toml", "-q", "--plot", "none", "-o", out, *arguments)

    return run


def alone(path: Path, case: int) -> list[list[str]]:
    """The rows of one case without its number."""
    return [list(row.values())[1:] for row in rows(path) if row["case"] == str(case)]


def test_a_sweep_of_the_material_is_a_sweep_of_material_files(
    tmp_path: Path, run: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    tables = """
[sweep]
mode = "zip"
equilibrium = [
    { shear_modulus = "26 kPa", law = "arruda-boyce", locking_stretch = 4.0 }, { law = "ogden", mu = ["26 kPa"], alpha = [2] },
]
"nonequilibrium.J_lim" = [55, 30]
"""
    done = run(RELAX + tables)
    assert (done.returncode, done.stderr) == (0, "")
    files = (
        MATERIAL.replace("J_lim = 110.0", 'law = "arruda-boyce"\nlocking_stretch = 4.0'),
        MATERIAL.replace('shear_modulus = "26 kPa"\nJ_lim = 110.0', 'law = "ogden"\nmu = ["26 kPa"]\nalpha = [2]').replace(
            "55.0", "30"
        ),
    )
    for case, text in enumerate(files):
        (tmp_path / "m.toml").write_text(text)
        assert run(RELAX, out="file").returncode == 0
        assert alone(tmp_path / "out/relax.csv", case) == alone(tmp_path / "file/relax.csv", 0)
    (tmp_path / "m.toml").write_text(MATERIAL)
    # the law alone, and its constant for all cases from the command line
    laws = '[sweep]\n"equilibrium.law" = ["arruda-boyce"]\n'
    assert run(RELAX + laws, "--set", "equilibrium.locking_stretch=4.0", out="set").returncode == 0
    assert alone(tmp_path / "set/relax.csv", 0) == alone(tmp_path / "out/relax.csv", 0)
    assert rows(tmp_path / "set/cases.csv") == [{"case": "0", "equilibrium.law": "arruda-boyce"}]


def test_what_films_take_from_the_material_can_be_swept(
    tmp_path: Path, run: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    sweep = '[sweep]\n"dielectric.permittivity" = ["3e-11 F/m", "5e-11 F/m"]\n"breakdown.field" = ["20 MV/m", "24 MV/m"]\n'
    done = run(ACTUATE.replace("[output]", POWER + "[output]") + sweep)
    assert (done.returncode, done.stderr) == (0, "")
    cases = rows(tmp_path / "out/cases.csv")
    assert [float(row["dielectric.permittivity [F/m]"]) for row in cases] == [3e-11, 3e-11, 5e-11, 5e-11]
    for case, row in enumerate(rows(tmp_path / "out/events.csv")):
        limit = float(cases[case]["breakdown.field [V/m]"]) * float(row["stretch_1 [1]"]) ** 1.13
        assert (row["case"], row["event"]) == (str(case), "breakdown")
        assert float(row["true_field [V/m]"]) == pytest.approx(limit, rel=1e-6)
    # a map takes them from the command line, and its [breakdown] every law, too
    setting = ("--set", "dielectric.permittivity='5e-11 F/m'")
    assert run(MAP + POWER, *setting, out="set").returncode == 0
    (tmp_path / "m.toml").write_text(MATERIAL.replace("3.98e-11", "5e-11") + POWER)
    assert run(MAP, out="file").returncode == 0
    assert (tmp_path / "set/failure-map.csv").read_bytes() == (tmp_path / "file/failure-map.csv").read_bytes()


def test_draws_take_a_change_that_they_share_and_refuse_one_of_their_own(
    tmp_path: Path, run: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    header = "draw,equilibrium_shear_modulus [Pa],shear_modulus_1 [Pa],shear_modulus_2 [Pa]\n"
    table = header + "".join(f"{k},{26000 + 100 * k},20000,90000\n" for k in range(4))
    (tmp_path / "draws.csv").write_text(table)
    (tmp_path / "m.toml").write_text(f'draws = "draws.csv"\n{MATERIAL}')
    draws = RELAX + "[uncertainty]\ndraws = 4\nlevel = 0.5\n"
    done = run(f'{draws}[sweep]\n"equilibrium.J_lim" = [20, 110]\n')
    assert (done.returncode, done.stderr) == (0, "")
    (tmp_path / "m.toml").write_text(f'draws = "draws.csv"\n{MATERIAL.replace("110.0", "20")}')
    assert run(draws, out="file").returncode == 0
    assert alone(tmp_path / "out/relax.csv", 0) == alone(tmp_path / "file/relax.csv", 0)
    assert "nominal_stress_1_lower [Pa]" in rows(tmp_path / "out/relax.csv")[0]
    done = run(f'{draws}[sweep]\n"equilibrium.shear_modulus" = ["20 kPa"]\n')
    said = "r.toml: uncertainty: the draws of m.toml differ in the equilibrium modulus, which "
    assert (done.returncode, done.stderr.strip()) == (2, said + "equilibrium.shear_modulus cannot change")
