"""`[uncertainty] specimens`: bands of the next specimen, against closed forms of a neo-Hookean material."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import t as student
from tables import columns

from dielast import draw_sample, read_material
from dielast.material.intervals import interval

Run = Callable[..., subprocess.CompletedProcess[str]]
MODULUS, PERMITTIVITY, THICKNESS = 4e4, 4e-11, 5e-4
SEEN = "specimen_scatter = 0.05\nmodel_error = 0.02\nscatter_freedom = 9\n"
SIZE = np.hypot(0.05, 0.02)
MATERIAL = f"""
reference_temperature = "20 degC"
[equilibrium]
law = "neo-hookean"
shear_modulus = "{MODULUS} Pa"
[dielectric]
permittivity = "{PERMITTIVITY} F/m"
[calibrated]
modes = ["equibiaxial", "uniaxial"]
largest_I1 = 100
time = ["0.1 s", "1e6 s"]
temperature = ["20 degC", "20 degC"]
{SEEN}"""
FILM = f"""
[film]
thickness = "{THICKNESS} m"
prestretch = 1.0
"""
RECIPES = {
    "relax": "[[step]]\nstretch = 2.0\n",
    "creep": '[[step]]\nstress = "20 kPa"\nduration = "1 s"\n',
    "actuate": FILM + '[[step]]\nvoltage = "4 kV"\nduration = "1 s"\n',
    "design": f'temperature = ["20 degC"]\n{FILM}[goal]\nrelative_stretch = 1.1\nat = "1 h"\nhorizon = "1 d"\n',
}
DRAWS = "[uncertainty]\ndraws = 60\n"


def voltage(stretch: float, factor: float = 1.0) -> float:
    """The voltage of an equibiaxial neo-Hookean film: mu (l^2 - l^-4) = eps V^2 l^4 / h^2 (Suo 2010)."""
    return float(THICKNESS * np.sqrt(factor * MODULUS / PERMITTIVITY * (stretch**-2 - stretch**-8)))


def expected(kind: str, factor: float) -> float:
    """The result of a specimen with this factor on its modulus."""
    if kind == "relax":
        return factor * MODULUS * (2 - 2**-2)
    if kind == "creep":
        return float(brentq(lambda stretch: factor * MODULUS * (stretch - stretch**-2) - 20e3, 1, 3))
    if kind == "actuate":
        return float(brentq(lambda stretch: voltage(stretch, factor) - 4e3, 1, 2 ** (1 / 3)))
    return voltage(1.1, factor)


RESULTS = {
    "relax": ("nominal_stress_1", "Pa"),
    "creep": ("stretch_1", "1"),
    "actuate": ("stretch_1", "1"),
    "design": ("voltage", "V"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of the test, with the material."""
    (tmp_path / "m.toml").write_text(MATERIAL)
    (tmp_path / "plain.toml").write_text(MATERIAL.replace(SEEN, ""))
    return tmp_path


@pytest.mark.parametrize("kind", RESULTS)
def test_bands_are_those_of_a_factor_on_the_modulus(dielast: Run, folder: Path, kind: str) -> None:
    (folder / "r.toml").write_text(f'kind = "{kind}"\nmaterial = "m.toml"\n{RECIPES[kind]}{DRAWS}')
    done = dielast(kind, "r.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    table, (name, unit) = columns(folder / "r" / f"{kind}.csv"), RESULTS[kind]
    factors = draw_sample([read_material(folder / "m.toml")], 60).specimen_factor
    assert factors is not None
    bounds = sorted(expected(kind, float(factor)) for factor in interval(factors, 0.9))
    found = [table[f"{name}_{side} [{unit}]"][-1] for side in ("lower", "upper")]
    assert found == pytest.approx(bounds, rel=1e-4)
    assert table[f"{name} [{unit}]"][-1] == pytest.approx(expected(kind, 1.0), rel=1e-4)


def test_a_map_has_the_share_of_specimens_that_pull_in(dielast: Run, folder: Path) -> None:
    volts = voltage(2 ** (1 / 3), 0.97)  # pull-in (Suo 2010) of a specimen with the factor 0.97
    where = f'temperature = ["20 degC"]\nhorizon = "1 h"\n{FILM}[voltage]\nvalues = ["{volts} V"]\n'
    (folder / "r.toml").write_text(f'kind = "failure-map"\nmaterial = "m.toml"\n{where}{DRAWS}')
    assert dielast("failure-map", "r.toml", "--plot", "none").returncode == 0
    factors = draw_sample([read_material(folder / "m.toml")], 60).specimen_factor
    assert columns(folder / "r/failure-map.csv")["failure_probability [1]"][0] == pytest.approx(np.mean(factors < 0.97))


def test_specimens_scatter_by_the_distribution_and_only_if_it_is_known(folder: Path) -> None:
    known, plain = (read_material(folder / name) for name in ("m.toml", "plain.toml"))
    assert draw_sample([plain], 30).specimen_factor is None
    assert draw_sample([known], 30, specimens=False).specimens() == (known,) * 30
    sample = draw_sample([known], 20_000)
    assert sample.specimen_factor is not None
    quantile = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
    assert np.quantile(np.log(sample.specimen_factor), quantile) == pytest.approx(SIZE * student.ppf(quantile, 9), abs=2e-3)
    # draw k depends on k only, and is of the material but for its moduli
    again = draw_sample([known], 10)
    assert np.array_equal(again.specimen_factor, sample.specimen_factor[:10])
    first = again.specimens()[0]
    assert first.equilibrium_modulus == pytest.approx(MODULUS * again.specimen_factor[0], rel=1e-14)
    assert replace(first, equilibrium_modulus=known.equilibrium_modulus, spectrum=known.spectrum) == known
    # a scatter known exactly is log-normal; a share of the films is one of the other scatter
    exact = replace(known, calibrated=replace(known.calibrated, scatter_freedom=None))
    drawn = draw_sample([exact], 20_000, share=0.1).specimen_factor
    assert np.std(np.log(drawn)) == pytest.approx(SIZE, rel=0.02)


def test_without_specimens_results_are_those_of_a_material_that_states_none(dielast: Run, folder: Path) -> None:
    thick = f'{FILM}[[step]]\nvoltage = "4 kV"\nduration = "1 s"\n{DRAWS}thickness = "2 %"\n'
    for name, material, more in (
        ("a", "m", "specimens = false"),
        ("b", "plain", ""),
        ("c", "plain", "specimens = true"),
        ("d", "m", ""),
        ("e", "m", "specimens = true"),
    ):
        (folder / f"{name}.toml").write_text(f'kind = "actuate"\nmaterial = "{material}.toml"\n{thick}{more}\n')
        jobs = ("--jobs", "2") if name == "d" else ()
        done = dielast("actuate", f"{name}.toml", "--plot", "none", *jobs)
        assert done.returncode == 0, done.stderr
        assert ("states no scatter of specimens" in done.stderr) == (name == "c")
        assert ("m.toml names no draws: intervals leave the errors" in done.stderr) == (name in "de")
    tables = [(folder / name / "actuate.csv").read_bytes() for name in "abcde"]
    assert tables[0] == tables[1] == tables[2] != tables[3] == tables[4]


def test_draws_that_cannot_be_prestretched_are_left_out_by_name(dielast: Run, folder: Path) -> None:
    law = MATERIAL.replace('law = "neo-hookean"', "J_lim = 90").replace("\n[equilibrium]", '\ndraws = "d.csv"\n[equilibrium]')
    (folder / "m.toml").write_text(law.replace(SEEN, ""))
    rows = [f"{k},{MODULUS + 10 * k},{14.5 if k < 2 else 90}" for k in range(26)]
    (folder / "d.csv").write_text("\n".join(["draw,equilibrium_shear_modulus [Pa],equilibrium.J_lim [1]", *rows]) + "\n")
    steps = f'{FILM}[[step]]\nvoltage = "1 kV"\nduration = "1 s"\n[uncertainty]\ndraws = 20\n[sweep]\n"film.prestretch" = [2, 3]\n'
    (folder / "r.toml").write_text(f'kind = "actuate"\nmaterial = "m.toml"\n{steps}')
    done = dielast("actuate", "r.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    assert "2 of 26 draws lock below a prestretch of 3; they are left out" in done.stderr
    beside = (folder / "r/actuate.csv").read_text().splitlines()
    (folder / "r.toml").write_text(f'kind = "actuate"\nmaterial = "m.toml"\n{steps.replace("[2, 3]", "[2]")}')
    assert "draws lock" not in dielast("actuate", "r.toml", "--plot", "none").stderr
    alone = (folder / "r/actuate.csv").read_text().splitlines()
    assert alone == [line for line in beside if not line.startswith("1,")]


@pytest.mark.parametrize("kind", ["failure-map", "design"])
def test_draws_that_lock_are_left_out_of_the_films_that_they_cannot_be(kind: str, dielast: Run, folder: Path) -> None:
    law = MATERIAL.replace('law = "neo-hookean"', "J_lim = 90").replace("\n[equilibrium]", '\ndraws = "d.csv"\n[equilibrium]')
    (folder / "m.toml").write_text(law.replace(SEEN, ""))
    rows = [f"{k},{MODULUS + 10 * k},{14.5 if k < 2 else 90}" for k in range(26)]
    (folder / "d.csv").write_text("\n".join(["draw,equilibrium_shear_modulus [Pa],equilibrium.J_lim [1]", *rows]) + "\n")
    asked = {
        "failure-map": 'horizon = "1 h"\n[voltage]\nvalues = ["1 kV", "2 kV", "4 kV"]\n',
        "design": '[goal]\narea_strain = "2 %"\nat = "1 min"\nhorizon = "1 h"\n',
    }[kind]
    tables, said = {}, {}
    for name, prestretch in (("both", "[2, 3]"), ("one", "[2]"), ("other", "[3]")):
        film = FILM.replace("prestretch = 1.0", f"prestretch = {prestretch}")
        (folder / "r.toml").write_text(f'kind = "{kind}"\nmaterial = "m.toml"\n{asked}{film}[uncertainty]\ndraws = 26\n')
        done = dielast(kind, "r.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr
        tables[name], said[name] = sorted((folder / f"r/{kind}.csv").read_text().splitlines()[1:]), done.stderr
    assert "2 of 26 draws lock below a prestretch of 3; they are left out of these films" in said["both"]
    assert "draws lock" not in said["one"]
    assert tables["both"] == sorted(tables["one"] + tables["other"])


def test_the_scatter_of_each_breakdown_law_of_a_sweep_is_its_own(dielast: Run, folder: Path) -> None:
    film = f'{FILM}[[step]]\nvoltage = "4 kV"\nduration = "1 s"\n[uncertainty]\ndraws = 20\n'
    law = '[breakdown]\nlaw = "power"\nfield = "8 MV/m"\nstretch_exponent = 0.5\n[output]\npoints_per_decade = 2\n'
    bounds = {}
    for name, values in (("both", "[0.01, 0.2]"), ("one", "[0.2]")):
        text = f'kind = "actuate"\nmaterial = "plain.toml"\n{film}{law}[sweep]\n"breakdown.relative" = {values}\n'
        (folder / f"{name}.toml").write_text(text)
        done = dielast("actuate", f"{name}.toml", "--plot", "none")
        assert done.returncode == 0, done.stderr
        bounds[name] = (folder / name / "events.csv").read_text().splitlines()[1:]
    first, second = ([row.partition(",")[2]] for row in bounds["both"])
    assert first != second == [bounds["one"][0].partition(",")[2]]
