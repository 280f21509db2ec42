"""Material files with springs of each law go through every command, sweeps and draws, and wrong constants are refused by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from processes import Run
from tables import rows

from dielast import Yeoh, write_material
from dielast.handover.material_draws import draw_columns
from dielast.handover.material_file import parse_material
from dielast.io.table import to_csv
from dielast.material.springs import NeoHookean

TEMPLATE = """\
name = "film"
reference_temperature = "20 degC"
[equilibrium]
{equilibrium}
[nonequilibrium]
{branches}
relaxation_time_s = [100.0, 1.0]
shear_modulus_Pa = [20000.0, 90000.0]
[shift]
law = "wlf"
C1 = 13.7
C2 = "187.1 K"
[dielectric]
permittivity = "3.98e-11 F/m"
[breakdown]
field = "40 MV/m"
"""
LAWS = {
    "yeoh": (
        'law = "yeoh"\nshear_modulus = "26 kPa"\nC20 = "-130 Pa"\nC30 = "2.6 Pa"',
        'law = "yeoh"\nC10 = "1 Pa"\nC20 = "0.01 Pa"',
    ),
    "arruda-boyce": (
        'law = "arruda-boyce"\nshear_modulus = "26 kPa"\nlocking_stretch = 6.0',
        'law = "arruda-boyce"\nlocking_stretch = 4.0',
    ),
    "mooney-rivlin": ('law = "mooney-rivlin"\nC10 = "12 kPa"\nC01 = "1 kPa"', 'law = "mooney-rivlin"\nC10 = "8 Pa"\nC01 = "1 Pa"'),
    "ogden": (
        'law = "ogden"\nmu = ["18 kPa", "-2 kPa"]\nalpha = [1.6, -2.5]',
        'law = "ogden"\nmu = ["3 Pa", "0.01 Pa"]\nalpha = [1.8, 5.0]',
    ),
    "gent-i2": (
        'law = "gent-i2"\nshear_modulus = "26 kPa"\nJ_lim = 100.0\nI2_share = 0.4\nI2_exponent = 0.9',
        'law = "gent-i2"\nI2_share = 0.2',
    ),
}
INITIAL = {"ogden": 16900.0}
FILM = '[film]\nthickness = "0.5 mm"\nprestretch = 1.7\nrelax = "1 min"\n[solver]\nrtol = 1e-4\n'


def text(equilibrium: str, branches: str = "") -> str:
    return TEMPLATE.format(equilibrium=equilibrium, branches=branches)


@pytest.mark.parametrize("name", LAWS)
def test_a_material_file_is_read_and_written(name: str) -> None:
    material = parse_material(text(*LAWS[name]).encode(), "film.toml")
    assert (material.equilibrium_law.name, material.nonequilibrium_law.name) == (name, name)
    assert material.equilibrium_modulus == pytest.approx(INITIAL.get(name, 26e3), rel=1e-12)
    written = write_material(material)
    again = parse_material(written, "again.toml")
    assert write_material(again) == written
    squared = np.array([[4.0], [0.7]])
    for one, other in ((material.equilibrium_law, again.equilibrium_law), (material.nonequilibrium_law, again.nonequilibrium_law)):
        assert one.stress(squared) == pytest.approx(other.stress(squared), rel=1e-12)


def test_a_spring_that_carries_nothing_is_written_without_constants() -> None:
    material = parse_material(text(*LAWS["ogden"]).encode(), "film.toml")
    object.__setattr__(material, "equilibrium_modulus", 0.0)
    again = parse_material(write_material(material), "again.toml")
    assert again.equilibrium_modulus == 0
    assert isinstance(again.equilibrium_law, NeoHookean)


def test_yeoh_may_state_c10_for_the_shear_modulus() -> None:
    material = parse_material(text('law = "yeoh"\nC10 = "13 kPa"\nC20 = "-130 Pa"').encode(), "film.toml")
    assert material.equilibrium_modulus == 26e3
    assert isinstance(material.equilibrium_law, Yeoh)
    assert material.equilibrium_law.C20 == -130.0


def test_every_command_takes_every_law(tmp_path: Path, dielast: Run) -> None:
    for name, (equilibrium, branches) in LAWS.items():
        (tmp_path / f"{name}.toml").write_text(text(equilibrium, branches))
    files = ", ".join(f'"{name}.toml"' for name in LAWS)
    swept = f"[sweep]\nmaterial = [{files}]\n"
    recipes = {
        "relax": '[[step]]\nstretch = 2.0\nrate = "1 /s"\n[[step]]\nhold = "1 min"\n',
        "creep": '[[step]]\nstress = "30 kPa"\nduration = "1 s"\n[[step]]\nhold = "1 min"\n',
        "actuate": FILM + '[[step]]\nvoltage = "4 kV"\nduration = "1 s"\n[[step]]\nhold = "1 min"\n',
    }
    for kind, steps in recipes.items():
        (tmp_path / f"{kind}.toml").write_text(f'kind = "{kind}"\nmaterial = "yeoh.toml"\n{steps}{swept}')
        done = dielast(kind, f"{kind}.toml", "-o", kind, "--plot", "svg" if kind == "actuate" else "none")
        assert done.returncode == 0, done.stderr
        found = rows(tmp_path / kind / f"{kind}.csv")
        assert {row["case"] for row in found} == {str(case) for case in range(len(LAWS))}
        # the last law alone
        done = dielast(kind, f"{kind}.toml", "-o", "alone", "--plot", "none", "--set", 'sweep.material=["gent-i2.toml"]')
        assert done.returncode == 0, done.stderr
        own = [{key: value for key, value in row.items() if key != "case"} for row in rows(tmp_path / f"alone/{kind}.csv")]
        assert own == [
            {key: value for key, value in row.items() if key != "case"} for row in found if row["case"] == str(len(LAWS) - 1)
        ]
    assert (tmp_path / "actuate/actuate.svg").stat().st_size > 1000
    for name in tuple(LAWS)[::3]:
        (tmp_path / "map.toml").write_text(
            f'kind = "failure-map"\nmaterial = "{name}.toml"\ntemperature = ["20 degC"]\nhorizon = "1 h"\n{FILM}'
            '[voltage]\nvalues = ["4 kV", "6 kV"]\n'
        )
        done = dielast("failure-map", "map.toml", "-o", f"map-{name}", "--plot", "none")
        assert done.returncode == 0, done.stderr


def test_draws_scale_the_constants_of_a_law(tmp_path: Path, dielast: Run) -> None:
    """Draws move the modulus, and the ratios of the constants stay."""
    material = parse_material(text(*LAWS["ogden"]).encode(), "film.toml")
    rng = np.random.default_rng(0)
    drawn = []
    for factor in rng.uniform(0.8, 1.2, 20):
        doubled = parse_material(text(*LAWS["ogden"]).encode(), "film.toml")
        object.__setattr__(doubled, "equilibrium_modulus", material.equilibrium_modulus * float(factor))
        drawn.append(doubled)
    (tmp_path / "draws.csv").write_bytes(to_csv(draw_columns(np.arange(20), drawn)))
    (tmp_path / "film.toml").write_text('draws = "draws.csv"\n' + text(*LAWS["ogden"]))
    (tmp_path / "creep.toml").write_text(
        'kind = "creep"\nmaterial = "film.toml"\n[[step]]\nstress = "30 kPa"\nduration = "1 s"\n[[step]]\nhold = "1 min"\n'
        "[uncertainty]\ndraws = 20\n"
    )
    done = dielast("creep", "creep.toml", "-o", "out", "--plot", "none")
    assert done.returncode == 0, done.stderr
    last = rows(tmp_path / "out/creep.csv")[-1]
    bounds = [float(value) for key, value in last.items() if key.startswith("stretch_1_")]
    assert len(bounds) >= 2
    assert min(bounds) < float(last["stretch_1 [1]"]) < max(bounds)


def test_a_run_beyond_the_stable_range_is_warned_of(tmp_path: Path, dielast: Run) -> None:
    (tmp_path / "film.toml").write_text(text('law = "yeoh"\nshear_modulus = "26 kPa"\nC20 = "-260 Pa"'))
    recipe = 'kind = "relax"\nmaterial = "film.toml"\n[[step]]\nstretch = {}\nrate = "1 /s"\n[[step]]\nhold = "1 min"\n'
    (tmp_path / "far.toml").write_text(recipe.format(3.5))
    done = dielast("relax", "far.toml", "-o", "far", "--plot", "none")
    assert done.returncode == 0, done.stderr
    assert "the Yeoh law of the equilibrium spring is unstable" in done.stderr
    assert "in uniaxial loading it is stable above 0.1071 and below 3.148 only" in done.stderr
    (tmp_path / "near.toml").write_text(recipe.format(2.5))
    done = dielast("relax", "near.toml", "-o", "near", "--plot", "none")
    assert "unstable" not in done.stderr
