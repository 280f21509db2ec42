"""`dielast lifetime`: tables of all kinds, what its results do in other commands, and bad input."""

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from conftest import Run

RECIPE = """\
kind = "lifetime"
material = "example:vhb4905.toml"
[film]
thickness = "0.5 mm"
prestretch = 1.9
boundary = "clamped"
[data]
file = "failures.csv"
columns = { voltage = "V [kV]", time = "t [min]", suspended = "running", specimen = "name", area = "area [cm^2]" }
[fit]
law = "inverse-power"
reference_area = "1 cm^2"
[uncertainty]
draws = 40
"""
FIELD, EXPONENT, SHAPE = 40e6, 12.0, 1.5  # for 1 h and 1 cm^2


def table(count: int = 30, **more: str) -> str:
    """Clamped films, whose field is constant: lives by the inverse power law, with the weakest link of areas of 0.1 and 10 cm^2."""
    random = np.random.default_rng(3)
    voltage = np.array([5.0, 5.4, 5.8])[np.arange(count) % 3]
    area = np.where(np.arange(count) % 2, 0.1, 10.0)
    field = voltage * 1e3 * 1.9**2 / 0.5e-3
    life = 60 * (FIELD / field) ** EXPONENT * (random.exponential(size=count) / area) ** (1 / SHAPE)
    rows = ["name,V [kV],t [min],running,area [cm^2]" + "".join(f",{key}" for key in more)]
    for k in range(count):
        at = min(life[k], 120.0)
        extra = "".join(f",{value}" for value in more.values())
        rows.append(f"S{k},{voltage[k]:g},{at:.6g},{'yes' if at == 120 else ''},{area[k]:g}{extra}")
    return "\n".join(rows) + "\n"


def test_areas_of_two_sizes_give_the_truth_and_a_material_for_maps(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "failures.csv").write_text(table())
    (tmp_path / "l.toml").write_text(RECIPE + '[plan]\nlife = "100 h"\nvoltage = "4 kV"\n')
    done = dielast("lifetime", "l.toml", "--plot", "none")
    assert (done.returncode, done.stderr) == (0, "")
    found = pd.read_csv(tmp_path / "l" / "parameters.csv").set_index("parameter")
    assert list(found.columns) == ["value", "standard_error", "lower", "upper", "verdict", "unit"]
    for name, truth in (("damage.field", FIELD), ("damage.exponent", EXPONENT), ("damage.shape", SHAPE)):
        # of three normal estimates, one lies farther away with a probability of 3e-4
        assert abs(found.loc[name, "value"] - truth) < 3.9 * found.loc[name, "standard_error"]
        assert found.loc[name, "lower"] < found.loc[name, "value"] < found.loc[name, "upper"]
    specimens = pd.read_csv(tmp_path / "l" / "specimens.csv")
    assert set(specimens["suspended"]) <= {"yes", "no"}
    assert specimens["rank"].notna().sum() == (specimens["suspended"] == "no").sum()
    assert specimens["true_field [V/m]"].to_numpy() == pytest.approx(specimens["voltage [V]"].to_numpy() * 1.9**2 / 0.5e-3)
    life = pd.read_csv(tmp_path / "l" / "life.csv")
    ordered = life[["time_b1 [s]", "time_b10 [s]", "time_b50 [s]"]].to_numpy()
    assert np.all(np.diff(ordered, axis=1) > 0)
    assert np.all(life["time_b10_lower [s]"] < life["time_b10 [s]"])
    assert np.all(pd.read_csv(tmp_path / "l" / "plan.csv")["specimens"].diff().dropna() <= 0)
    material = tomllib.loads((tmp_path / "l" / "material.toml").read_text())
    assert material["draws"] == "draws.csv"
    assert material["damage"]["reference_area"] == "0.0001 m^2"
    # one tenth of the films of the material fail before B10
    (tmp_path / "m.toml").write_text(
        'kind = "failure-map"\nmaterial = "l/material.toml"\nhorizon = "365 d"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\n'
        'boundary = "clamped"\n[voltage]\nvalues = ["5.4 kV"]\n[uncertainty]\ndraws = 40\nfailure_share = "10 %"\n'
    )
    done = dielast("failure-map", "m.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    row = pd.read_csv(tmp_path / "m" / "failure-map.csv").iloc[0]
    b10 = life.set_index("voltage [V]").loc[5400.0]
    assert row["time_to_failure_lower [s]"] == pytest.approx(b10["time_b10_lower [s]"], rel=0.5)
    assert row["time_to_failure_lower [s]"] < b10["time_b10 [s]"] < row["time_to_failure_upper [s]"]


def test_ramps_looks_and_kinds_of_failure_are_fitted_together(dielast: Run, tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    rows = ["voltage [kV],ramp [V/s],time [s],intact [s],mode,batch,suspended"]
    field = 60e6 * random.weibull(15, 18)
    for k, one in enumerate(field):
        rows.append(f"{one * 0.5e-3 / 1.9**2 / 1e3:.6g},100,,,{'edge' if k % 6 == 0 else 'bulk'},{'AB'[k % 2]},")
    rows += ["6,,0,,bulk,A,no", "4,100,3600,,,B,yes", "8.5,100,85,80,bulk,B,no"]
    (tmp_path / "failures.csv").write_text("\n".join(rows) + "\n")
    text = RECIPE.replace(RECIPE[RECIPE.index("columns") : RECIPE.index("[fit]")], "").replace(
        'law = "inverse-power"', 'law = "table"'
    )
    (tmp_path / "l.toml").write_text(text)
    done = dielast("lifetime", "l.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    # all failures by edge are of batch A
    assert "the likelihood of the failures by edge has no maximum" in done.stderr
    assert "failures by bulk has no maximum" not in done.stderr
    found = pd.read_csv(tmp_path / "l" / "parameters.csv")
    assert set(found["mode"]) == {"edge", "bulk"}
    bulk = found[found["mode"] == "bulk"].set_index("parameter")
    for name, truth in (("breakdown.field", 60e6 * (6 / 5) ** (1 / 15)), ("batch.A", 1.0)):
        assert abs(bulk.loc[name, "value"] - truth) < 3.9 * bulk.loc[name, "standard_error"]
    assert tomllib.loads((tmp_path / "l" / "material.toml").read_text())["breakdown"]["shape"] > 5


def test_survivors_alone_give_a_bound(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "failures.csv").write_text("name,V [kV],t [min],running,area [cm^2]\na,5,600,yes,1\nb,5,60,yes,1\n")
    (tmp_path / "l.toml").write_text(RECIPE)
    done = dielast("lifetime", "l.toml", "--plot", "none")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "nothing has failed: a lower bound needs fit.exponent and fit.shape" in done.stderr
    assert dielast("lifetime", "l.toml", "--plot", "none", "--set", "fit.shape=2.0", "--set", "fit.exponent=12.0").returncode == 0
    found = pd.read_csv(tmp_path / "l" / "parameters.csv").set_index("parameter").loc["damage.field"]
    # sum D^b = -ln(1 - 0.9) with D = (E/E_0)^n t/t_0
    hours = np.sqrt((10.0**2 + 1.0) / -np.log(0.1))
    assert found["lower"] == pytest.approx(5e3 * 1.9**2 / 0.5e-3 * hours ** (1 / 12), rel=1e-6)
    assert (found["verdict"], np.isnan(found["value"])) == ("lower bound", True)


MISTAKES = [
    ("t [min]", "t", 'column "t" has no unit: call it "t [s]" or state units = { time = "s" }'),
    ("S1,5.4", "S0,5.4", "line 2: specimen S0: 2 rows have this name"),
    ("S2,5.8", "S2,-", '"-" is not a finite number'),
    ("S2,5.8", "S2,0", "line 4: specimen S2: a voltage above 0 is needed"),
]


@pytest.mark.parametrize(("right", "wrong", "message"), MISTAKES)
def test_mistakes_in_the_table_name_the_specimen(right: str, wrong: str, message: str, dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "failures.csv").write_text(table(6).replace(right, wrong))
    (tmp_path / "l.toml").write_text(RECIPE.replace(right, wrong) if right.startswith("t ") else RECIPE)
    for command in ("lifetime", "validate"):
        done = dielast(command, "l.toml")
        assert done.returncode == 2
        assert message in done.stderr
        assert "Traceback" not in done.stderr
    assert not (tmp_path / "l").exists()


def test_films_that_do_not_reach_their_failure_are_refused(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(
        'kind = "actuate"\nmaterial = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\n'
        '[[step]]\nvoltage = "3 kV"\nduration = "10 s"\n[[step]]\nhold = "1 min"\n'
    )
    (tmp_path / "failures.csv").write_text("specimen,recipe,time [s],suspended\nlate,p.toml,100,no\ngood,p.toml,50,yes\n")
    text = RECIPE.replace(RECIPE[RECIPE.index("columns") : RECIPE.index("[fit]")], "")
    (tmp_path / "l.toml").write_text(text)
    done = dielast("lifetime", "l.toml")
    assert done.returncode == 2
    assert "specimen late: its end after 100 s lies after the end of its programme at 70 s" in done.stderr
    (tmp_path / "failures.csv").write_text("specimen,voltage [kV],time [s]\nthin,4.3,600\nother,3,60\n")
    (tmp_path / "l.toml").write_text(text.replace('boundary = "clamped"', 'relax = "1.5 h"\nboundary = "dead-load"'))
    done = dielast("lifetime", "l.toml")
    assert done.returncode == 2
    assert "line 2: specimen thin: its film pulls in after" in done.stderr
    (tmp_path / "failures.csv").write_text("specimen,voltage [kV],time [s],suspended\na,5,60,no\nb,5.2,60,yes\n")
    (tmp_path / "l.toml").write_text(text)
    done = dielast("lifetime", "l.toml")
    assert done.stderr == "l.toml: fit.law: inverse-power: 1 failures are too few for 3 parameters: field, exponent, log_scatter\n"
