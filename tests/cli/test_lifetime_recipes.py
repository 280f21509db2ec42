"""`dielast lifetime`: tables of all kinds, what its results do in other commands, and bad input."""

import tomllib
from pathlib import Path
from shutil import copytree

import numpy as np
import pandas as pd
import pytest
from processes import Run

RECIPE = """\
kind = "lifetime"
material = "example:tensile/start.toml"
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
[life]
values = ["5.4 kV", "5.8 kV"]
horizon = "30 d"
"""
TABLE = RECIPE.replace(RECIPE[RECIPE.index("columns") : RECIPE.index("[fit]")], "")  # of columns with their usual names
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


@pytest.fixture(scope="module")
def fitted(command: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a result l of the table."""
    folder = tmp_path_factory.mktemp("fitted")
    (folder / "failures.csv").write_text(table())
    (folder / "l.toml").write_text(RECIPE + '[plan]\nlife = "100 h"\nvoltage = "4 kV"\n')
    done = command(folder, "lifetime", "l.toml", "--plot", "none")
    assert (done.returncode, done.stderr) == (0, "")
    return folder


def test_areas_of_two_sizes_give_the_truth_and_a_material_for_maps(fitted: Path, dielast: Run, tmp_path: Path) -> None:
    copytree(fitted, tmp_path, dirs_exist_ok=True)
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
    (tmp_path / "l.toml").write_text(TABLE.replace('law = "inverse-power"', 'law = "table"').replace("draws = 40", "draws = 0"))
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


def test_films_that_do_not_reach_their_failure_are_refused(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(
        'kind = "actuate"\nmaterial = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\n'
        '[[step]]\nvoltage = "3 kV"\nduration = "10 s"\n[[step]]\nhold = "1 min"\n'
    )
    (tmp_path / "failures.csv").write_text("specimen,recipe,time [s],suspended\nlate,p.toml,100,no\ngood,p.toml,50,yes\n")
    (tmp_path / "l.toml").write_text(TABLE)
    done = dielast("lifetime", "l.toml")
    assert done.returncode == 2
    assert "specimen late: its end after 100 s lies after the end of its programme at 70 s" in done.stderr
    (tmp_path / "failures.csv").write_text("specimen,voltage [kV],time [s]\nthin,4.3,600\nother,3,60\n")
    (tmp_path / "l.toml").write_text(TABLE.replace('boundary = "clamped"', 'relax = "1.5 h"\nboundary = "dead-load"'))
    done = dielast("lifetime", "l.toml")
    assert done.returncode == 2
    assert "line 2: specimen thin: its film pulls in after" in done.stderr
    (tmp_path / "failures.csv").write_text("specimen,voltage [kV],time [s],suspended\na,5,60,\nb,5.2,60,yes\nc,5.3,60,no\n")
    (tmp_path / "l.toml").write_text(TABLE)
    done = dielast("lifetime", "l.toml")
    assert done.stderr == (
        "warning: failures.csv: suspended is empty for specimen a, which counts as no, failed: write no or yes\n"
        "l.toml: fit.law: inverse-power: 3 parameters (field, exponent, log_scatter) need as many failures, not 2\n"
    )


OPEN = [
    # all failures are of one batch, one voltage or one prestretch: what they do not determine has no verdict
    ("table", "voltage [kV],ramp [V/s],batch,suspended\n6,100,A,\n6.3,100,A,\n6.1,100,A,\n6.5,100,B,yes\n6.5,100,B,yes\n",
     {"breakdown.field": "lower bound", "batch.A": "upper bound", "breakdown.shape": "determined"}),
    ("inverse-power", "voltage [kV],time [h]\n6,1\n6,2\n6,0.4\n6,1.3\n6,3\n",
     {"damage.field": "undetermined", "damage.exponent": "undetermined", "damage.shape": "determined"}),
    ("power", "voltage [kV],ramp [V/s]\n6,100\n6.3,100\n6.1,100\n6.5,100\n6.2,100\n",
     {"breakdown.field": "undetermined", "breakdown.stretch_exponent": "undetermined", "breakdown.shape": "determined"}),
]  # fmt: skip
PLAIN = TABLE.replace('reference_area = "1 cm^2"\n', "")
PLAIN = PLAIN.replace("draws = 40", "draws = 0")


@pytest.mark.trust  # tests/unit/test_failures.py has a level ridge
@pytest.mark.parametrize(("law", "rows", "verdicts"), OPEN)
def test_what_the_failures_do_not_determine_is_not_called_determined(
    law: str, rows: str, verdicts: dict[str, str], dielast: Run, tmp_path: Path
) -> None:
    (tmp_path / "failures.csv").write_text(rows)
    (tmp_path / "l.toml").write_text(PLAIN.replace("inverse-power", law))
    done = dielast("lifetime", "l.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    found = pd.read_csv(tmp_path / "l" / "parameters.csv").set_index("parameter")
    assert found["verdict"].to_dict() == verdicts
    assert found.loc[found["verdict"] == "undetermined", "value"].isna().all()


def test_failures_without_scatter_or_voltage_are_refused(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "failures.csv").write_text("voltage [kV],ramp [V/s]\n" + "6,100\n" * 4)
    (tmp_path / "l.toml").write_text(PLAIN.replace("inverse-power", "table"))
    done = dielast("lifetime", "l.toml", "--plot", "none")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "the failures do not scatter about the law: state the scatter" in done.stderr
    (tmp_path / "p.toml").write_text(
        'kind = "actuate"\nmaterial = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\n'
        '[[step]]\nwaveform = "triangle"\nlow = "0 V"\nhigh = "3 kV"\nperiod = "10 s"\ncycles = 20\n'
    )
    (tmp_path / "failures.csv").write_text("specimen,recipe,time [s]\nthird,p.toml,30\nother,p.toml,42\n")
    (tmp_path / "l.toml").write_text(PLAIN)
    done = dielast("lifetime", "l.toml", "--plot", "none")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "specimen third: it fails after 30 s, when there is no voltage: if it was found failed then, state when" in done.stderr


def test_daily_looks_in_a_climate_are_of_one_kind_and_each_temperature_has_its_line(dielast: Run, tmp_path: Path) -> None:
    random, rows = np.random.default_rng(7), ["voltage [kV],time [d],intact [d],suspended,temperature [degC],humidity [%]"]
    for k in range(48):
        volt, degrees, humid = (6.0, 6.6, 7.2)[k % 3], (20, 50)[k // 3 % 2], (30, 80)[k // 6 % 2]
        field = volt * 1e3 * 1.9**2 / 0.5e-3
        slower = np.exp(5e4 / 8.314462618 * (1 / (degrees + 273.15) - 1 / 293.15)) * (humid / 50) ** -2.5
        hours = (60e6 / field) ** 10 * random.exponential() ** (1 / 1.8) * slower
        looked = 2 * np.floor(hours / 2)
        rows.append(f"{volt},{min(looked + 2, 60) / 24:.6g},{looked / 24:.6g},{'yes' if hours > 60 else ''},{degrees},{humid}")
    (tmp_path / "failures.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "l.toml").write_text(PLAIN.replace("[fit]\n", '[fit]\nreference_humidity = "50 %"\n'))
    done = dielast("lifetime", "l.toml", "--plot", "none")
    assert (done.returncode, done.stderr) == (0, "")
    found = pd.read_csv(tmp_path / "l" / "parameters.csv").set_index("parameter")
    truth = {"damage.field": 60e6, "damage.exponent": 10, "damage.shape": 1.8, "damage.activation_energy": 5e4}
    for name, value in (truth | {"humidity_exponent": 2.5}).items():
        assert abs(found.loc[name, "value"] - value) < 3.9 * found.loc[name, "standard_error"]
    lines = pd.read_csv(tmp_path / "l" / "lines.csv")
    assert lines.groupby("temperature [degC]")["law"].count().to_dict() == {20.0: 6, 50.0: 6}
    colder = lines[(lines["temperature [degC]"] == 20) & (lines["law"] == "inverse-power")].set_index("parameter")["value"]
    name = next(name for name in colder.index if name.startswith("time_at"))
    at = float(name.split("_")[2])
    life = pd.read_csv(tmp_path / "l" / "life.csv").iloc[0]
    expected = colder[name] * (life["voltage [V]"] / at) ** -colder["exponent"] * (-np.log(0.9)) ** (1 / colder["shape"])
    assert life["inverse_power_time_b10 [s]"] == pytest.approx(expected, rel=2e-3)  # by the four digits of the voltage
    material = tomllib.loads((tmp_path / "l" / "material.toml").read_text())
    assert material["origin"]["damage.field"] == "fitted: failures.csv"
    assert material["origin"]["damage.time"] == "stated"
    assert tomllib.loads((tmp_path / "l" / "summary.toml").read_text())["lifetime"]["reference_humidity"] == 0.5


def test_lives_that_a_share_exceeds_with_a_confidence(fitted: Path, dielast: Run, tmp_path: Path) -> None:
    copytree(fitted, tmp_path, dirs_exist_ok=True)
    film = 'material = "l/material.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.9\nboundary = "clamped"\n'
    required = '[uncertainty]\ndraws = 40\nfailure_share = "10 %"\nconfidence = 0.8\n'
    (tmp_path / "m.toml").write_text(f'kind = "failure-map"\nhorizon = "365 d"\n{film}[voltage]\nvalues = ["5.4 kV"]\n{required}')
    assert dielast("failure-map", "m.toml", "--plot", "none").returncode == 0
    row = pd.read_csv(tmp_path / "m" / "failure-map.csv").iloc[0]
    draws = pd.read_csv(tmp_path / "l" / "draws.csv")
    field, exponent, shape = (draws[name].to_numpy() for name in ("damage.field [V/m]", "damage.exponent [1]", "damage.shape [1]"))
    lives = 3600 * (field / (5.4e3 * 1.9**2 / 0.5e-3)) ** exponent * (-np.log(0.9)) ** (1 / shape)
    assert row["assured_life [s]"] == pytest.approx(np.sort(lives)[7], rel=1e-6)  # of 40 draws, 0.2 x 41 lie below
    # an hour of cycles and an hour of rest, which does not count, before a constant voltage
    waves = (
        '[[step]]\nwaveform = "triangle"\nlow = "0 V"\nhigh = "5 kV"\nperiod = "600 s"\ncycles = 6\n'
        '[[step]]\nhold = "1 h"\n[[step]]\nvoltage = "5.6 kV"\n[[step]]\nhold = "50 h"\n'
    )
    (tmp_path / "a.toml").write_text(f'kind = "actuate"\n{film}{waves}[breakdown]\nfield = "1 GV/m"\n{required}')
    done = dielast("actuate", "a.toml", "--plot", "none")
    assert done.returncode == 0, done.stderr
    event = pd.read_csv(tmp_path / "a" / "events.csv").set_index("event").loc["damage"]
    for prefix, life in (("", "time [s]"), ("assured_", "assured_life [s]")):
        assert event[f"{prefix}cycles [1]"] == pytest.approx(6)
        assert event[f"{prefix}actuated_time [s]"] == pytest.approx(event[life] - 3600, rel=1e-9)
    (tmp_path / "m.toml").write_text((tmp_path / "m.toml").read_text().replace('failure_share = "10 %"\n', ""))
    done = dielast("failure-map", "m.toml")
    assert done.returncode == 2
    assert 'm.toml: uncertainty.confidence: needs failure_share, such as "5 %"' in done.stderr
