"""`dielast new --data`: a recipe for these files that runs as it is, or names what to fill in; never a guessed unit."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from processes import Run

ROOT = Path(__file__).resolve().parents[2]
EXPORTS = sorted((ROOT / "tests/instruments").iterdir())
SHORT = (
    "eplexor-sweeps.txt",
    "proteus-sweeps.csv",
    "rheocompass-relaxation.csv",
    "trios-sweeps.txt",
    "universal-analysis-sweeps.txt",
)
GOLDEN = ROOT / "tests/golden/data"
LEVELS, TIMES = (10.0, 20.0, 30.0, 40.0), np.geomspace(1, 1000, 12)


def modulus(celsius: float, time: np.ndarray) -> np.ndarray:
    """A power law that shifts by a decade in 20 K, in Pa."""
    return 1e6 * (time * 10 ** ((celsius - 20) / 20)) ** -0.2


def table(
    head: str, columns: str = "Tte", separator: str = ",", decimal: str = ".", *, fahrenheit: bool = False, minutes: bool = False
) -> str:
    """A table of relaxation tests whose columns T, t and e stand in this order."""
    lines = [head]
    for celsius in LEVELS:
        for time, stress in zip(TIMES, modulus(celsius, TIMES), strict=True):
            cells = {"T": 1.8 * celsius + 32 if fahrenheit else celsius, "t": time / 60 if minutes else time, "e": stress / 1e6}
            lines.append(separator.join(f"{cells[column]:.9g}".replace(".", decimal) for column in columns))
    return "\n".join(lines) + "\n"


def made(dielast: Run, kind: str, *files: str) -> tuple[dict[str, object], str, str]:
    """The recipe of a kind for files: its keys, its text, and the warnings."""
    done = dielast("new", kind, "--data", *files)
    assert done.returncode == 0, done.stderr
    return tomllib.loads(done.stdout), done.stdout, done.stderr


def shift(dielast: Run, tmp_path: Path, text: str, kind: str = "mastercurve") -> dict[str, object]:
    """The summary of the run of a recipe."""
    (tmp_path / "r.toml").write_text(text)
    done = dielast(kind, "r.toml", "--plot", "none", "-q")
    assert done.returncode == 0, done.stderr
    return tomllib.loads((tmp_path / "r/summary.toml").read_text())


@pytest.mark.parametrize(
    "export",
    # one of each program; what all of them hold is read by tests/unit/test_instruments.py
    [pytest.param(path, marks=[] if path.name in SHORT else pytest.mark.trust) for path in EXPORTS],
    ids=lambda path: path.name,
)
def test_every_layout_of_an_instrument_gives_a_recipe_that_runs(export: Path, dielast: Run, tmp_path: Path) -> None:
    shutil.copy(export, tmp_path)
    recipe, text, _ = made(dielast, "mastercurve", export.name)
    assert "FILL IN" not in text
    assert "columns" not in recipe["data"]
    summary = shift(dielast, tmp_path, text)
    assert summary["data"]["temperatures"] == 3  # type: ignore[index]
    told = dielast("new", "--data", export.name).stdout
    assert ("dielast new mastercurve --data takes it as it is" in told and "0, 20, 40 degC" in told) or "step" in told


@pytest.mark.parametrize(
    ("name", "measurement"),
    [("relaxation.csv", "relaxation"), ("creep.csv", "creep"), ("sweeps.csv", "oscillation"), ("stress.csv", "relaxation")],
)
def test_tables_with_units_give_recipes_that_run(name: str, measurement: str, dielast: Run, tmp_path: Path) -> None:
    shutil.copy(GOLDEN / name, tmp_path)
    _, text, _ = made(dielast, "mastercurve", name)
    assert "FILL IN" not in text
    assert shift(dielast, tmp_path, text)["data"]["measurement"] == measurement  # type: ignore[index]


def test_temperatures_and_the_shear_come_from_names(dielast: Run, tmp_path: Path) -> None:
    for path in GOLDEN.glob("shear_*.txt"):
        shutil.copy(path, tmp_path)
    recipe, text, _ = made(dielast, "mastercurve", "shear_*.txt")
    data = recipe["data"]
    assert data == {
        "files": "shear_*.txt",
        "columns": {"time": "t [s]", "modulus": "G [Pa]"},
        "temperature_in_name": "shear_{degC}C.txt",
        "test": "shear",
    }
    assert shift(dielast, tmp_path, text)["data"]["test"] == "shear"  # type: ignore[index]
    one_by_one = made(dielast, "mastercurve", *sorted(path.name for path in tmp_path.glob("shear_*.txt")))[0]
    assert len(one_by_one["data"]["files"]) == 5  # type: ignore[index]


@pytest.mark.parametrize(
    "content",
    [
        table("T [degC],time [s],E [MPa]"),
        table("E [MPa];time [s];T [°C]", "etT", ";", ","),
        table("time [min]\tE (MPa)\tT [degC]", "teT", "\t", minutes=True),
        table("Temperatur in °F,Zeit / min,Relaxationsmodul [MPa]", fahrenheit=True, minutes=True),
        table("a [degF],b [min],modulus [MPa]", fahrenheit=True, minutes=True),
    ],
    ids=["plain", "swapped", "minutes", "german-fahrenheit", "by-unit"],
)
def test_the_same_measurement_in_any_order_and_unit_is_the_same(content: str, dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text(content)
    _, text, _ = made(dielast, "mastercurve", "d.csv")
    assert "FILL IN" not in text
    summary = shift(dielast, tmp_path, text)
    assert summary["data"]["temperatures"] == 4  # type: ignore[index]
    rows = (tmp_path / "r/shift-factors.csv").read_text().splitlines()[1:]
    factors = np.array([[float(cell) for cell in row.split(",")[:2]] for row in rows])
    assert np.diff(factors[:, 1]) == pytest.approx(-0.5, abs=1e-3)


def test_a_table_with_columns_for_each_temperature_is_recognised(dielast: Run, tmp_path: Path) -> None:
    rows = np.column_stack([TIMES, *(modulus(celsius, TIMES) for celsius in LEVELS)])
    head = ",".join(["time [s]", *(f"E {celsius:g} °C [Pa]" for celsius in LEVELS)])
    (tmp_path / "w.csv").write_text("\n".join([head, *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]))
    _, text, _ = made(dielast, "mastercurve", "w.csv")
    assert "FILL IN" not in text
    assert "4 temperatures" in text
    assert shift(dielast, tmp_path, text)["data"]["temperatures"] == 4  # type: ignore[index]


def test_no_unit_is_guessed_and_what_is_missing_is_a_key(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text(table("temperature,time,modulus"))
    recipe, text, _ = made(dielast, "mastercurve", "d.csv")
    units = recipe["data"]["units"]  # type: ignore[index]
    assert units == dict.fromkeys(("temperature", "time", "modulus"), "FILL IN")
    (tmp_path / "r.toml").write_text(text)
    refused = dielast("mastercurve", "r.toml")
    assert refused.returncode == 2
    assert "data.units: time" in refused.stderr
    assert "FILL IN" in refused.stderr
    filled = text.replace('reference_temperature = "FILL IN"', 'reference_temperature = "20 degC"')
    for role, unit in (("temperature", "degC"), ("time", "s"), ("modulus", "MPa")):
        filled = filled.replace(f'{role} = "FILL IN"', f'{role} = "{unit}"')
    summary = shift(dielast, tmp_path, filled)
    assert summary["data"]["points"] == 48  # type: ignore[index]


def test_names_that_contradict_their_units_are_not_believed(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text(table("T [degC],time [MPa],E [s]"))
    recipe, _, warnings = made(dielast, "mastercurve", "d.csv")
    assert recipe["data"]["columns"] == {"time": "FILL IN", "modulus": "FILL IN", "temperature": "T [degC]"}  # type: ignore[index]
    swapped = 'columns "time" [MPa] and "E" [s] have the unit of each other: are their names, or their units, swapped?'
    assert swapped in warnings
    assert swapped in dielast("new", "--data", "d.csv").stderr
    (tmp_path / "d.csv").write_text(table("T [degC],time [MPa],E [kPa]"))
    contradiction = 'column "time" is called a time, but its unit, MPa, is that of a stress or modulus'
    for arguments in ((), ("calibrate",)):
        assert contradiction in dielast("new", *arguments, "--data", "d.csv").stderr


def test_numbers_that_contradict_their_names_are_named(dielast: Run, tmp_path: Path) -> None:
    rows = [f"{time},{celsius},{2 - 0.1 * time**0.1}" for celsius in (-10, 10, 30) for time in (1, 10, 100, 1000)]
    (tmp_path / "d.csv").write_text("\n".join(["T [degC],time [s],E [MPa]", *rows]))
    said = dielast("new", "--data", "d.csv").stderr
    assert 'column "time [s]" has times below 0, down to -10 s' in said
    assert 'column "T [degC]" holds 1 to 1000 degC, outside the usual range' in said


def test_the_sheet_with_the_table_is_found_and_stated(dielast: Run, tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    made_of = openpyxl.Workbook()
    made_of.active.append(["Operator", "A. N. Other"])
    specimens = made_of.create_sheet("Specimens")  # tables, but of no measurement
    for row in (
        ["specimen", "width [mm]", "T [degC]"],
        ["A", 22, 20],
        ["B", 22, 40],
        ["Parameter", "Value", "Unit"],
        ["Speed", 5, "mm/s"],
    ):
        specimens.append(row)
    sheet = made_of.create_sheet("Results")
    for line in table("T [degC],time [min],E [MPa]").splitlines():
        sheet.append([float(cell) if cell[-1].isdigit() else cell for cell in line.split(",")])
    made_of.save(tmp_path / "d.xlsx")
    recipe, _, _ = made(dielast, "mastercurve", "d.xlsx")
    assert recipe["data"]["sheet"] == "Results"  # type: ignore[index]
    told = dielast("new", "--data", "d.xlsx").stdout
    assert 'd.xlsx: table in sheet "Results" of a workbook, 48 rows\n  other sheets: "Sheet", "Specimens"' in told
    made_of.remove(sheet)
    made_of.save(tmp_path / "d.xlsx")
    assert 'd.xlsx: table in sheet "Specimens" of a workbook' in dielast("new", "--data", "d.xlsx").stdout


def test_ratios_of_areas_and_recipes_are_recognised(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "film.csv").write_text("U,A / A0\nkV,%\n0,100\n1,104\n2,117\n3,145\n")
    assert "area strain        100 to 145 %" in dielast("new", "--data", "film.csv").stdout
    (tmp_path / "r.toml").write_text('kind = "relax"\n')
    assert "r.toml: a recipe or a material, not a table" in dielast("new", "--data", "r.toml").stderr


@pytest.mark.parametrize(
    ("names", "stated"),
    [
        (["a-20C.csv", "a-40C.csv"], ["-20 degC FILL IN", "-40 degC FILL IN"]),
        (["a--20C.csv", "a-40C.csv"], ["-20 degC", "40 degC"]),
        (["ps130.csv", "ps145.csv"], ["130 FILL IN", "145 FILL IN"]),
        (["a68F.csv", "a86F.csv"], ["68 degF", "86 degF"]),
        (["one.csv", "other.csv"], ["FILL IN", "FILL IN"]),
    ],
)
def test_a_temperature_in_a_name_needs_its_unit_and_its_sign(
    names: list[str], stated: list[str], dielast: Run, tmp_path: Path
) -> None:
    for name in names:
        (tmp_path / name).write_text("time [s],E [MPa]\n1,3\n2,2\n4,1.5\n8,1.2\n")
    data = made(dielast, "mastercurve", *names)[0]["data"]
    assert data.get("temperatures") == stated or data.get("temperature_in_name") == "a-{degC}C.csv"  # type: ignore[attr-defined]


def test_a_machine_s_table_states_specimen_ramp_and_what_is_held(dielast: Run, tmp_path: Path) -> None:
    rows = [(0.1 * k, min(k, 20) * 0.4, 0.3 * min(k, 20) / 20 * (1 if k < 20 else (k / 20) ** -0.1)) for k in range(60)]
    text = "Specimen A\nGauge length: 80 mm\nWidth [mm];22\nThickness: 1,5 mm\n\n" + "Zeit [s];Standardweg [mm];Standardkraft [N]\n"
    (tmp_path / "hold 20 °C.csv").write_text(
        text + "\n".join(";".join(f"{cell:.6g}".replace(".", ",") for cell in row) for row in rows)
    )
    data = made(dielast, "spectrum", "hold 20 °C.csv")[0]["data"]
    assert data == {  # type: ignore[comparison-overlap]
        "file": "hold 20 °C.csv",
        "columns": {"time": "Zeit [s]", "extension": "Standardweg [mm]", "force": "Standardkraft [N]"},
        "measurement": "relaxation",
        "test": "tension",
        "specimen": {"gauge_length": "80 mm", "width": "22 mm", "thickness": "1.5 mm"},
        "ramp": "2 s",
        "reference_temperature": "20 degC",
    }
    for kind in ("spectrum", "relax"):
        recipe, text, _ = made(dielast, kind, "hold 20 °C.csv")
        assert "FILL IN" not in text
        shift(dielast, tmp_path, text, kind)
    assert recipe["temperature"] == "20 degC"
    assert len(recipe["compare"]) == 1
    test = made(dielast, "calibrate", "hold 20 °C.csv")[0]["test"][0]  # type: ignore[index]
    assert test["specimen"] == data["specimen"]
    assert test["temperature"] == "20 degC"
    (tmp_path / "c.toml").write_text(made(dielast, "calibrate", "hold 20 °C.csv")[1])
    assert dielast("validate", "c.toml").returncode == 0


def test_what_no_file_states_is_listed_and_named_by_the_refusal(dielast: Run, tmp_path: Path) -> None:
    for kind, file, named in (
        ("lifetime", "example:lifetime/failures.csv", "film.thickness"),
        ("measure", "example:photographs/photo-*.png", "interval"),
        ("calibrate", "example:tensile/slow.csv", "test[0].specimen.gauge_length"),
        ("creep", "example:tensile/slow.csv", "specimen.gauge_length"),
        ("actuate", "example:lifetime/failures.csv", "film.boundary"),
    ):
        _, text, _ = made(dielast, kind, file)
        first = text.splitlines()[1]
        assert "to fill in" in first
        assert named in first
        (tmp_path / "r.toml").write_text(text)
        done = dielast(kind, "r.toml", "--plot", "none")
        assert done.returncode == 2, done.stderr
        assert named in done.stderr


def test_filled_recipes_for_films_and_photographs_run(dielast: Run, tmp_path: Path) -> None:
    text = made(dielast, "measure", "example:photographs/photo-*.png")[1]
    summary = shift(dielast, tmp_path, text.replace('interval = "FILL IN"', 'interval = "8 s"'), "measure")
    assert summary["dielast"]["kind"] == "measure" if "dielast" in summary else summary
    text = made(dielast, "lifetime", "example:lifetime/failures.csv")[1]
    for key, value in (("temperature", "20 degC"), ("thickness", "0.5 mm"), ("relax", "1.5 h"), ("boundary", "dead-load")):
        text = text.replace(f'\n{key} = "FILL IN"', f'\n{key} = "{value}"')
    assert "FILL IN" not in "".join(line.partition("#")[0] for line in text.splitlines())
    (tmp_path / "r.toml").write_text(text)
    assert dielast("validate", "r.toml").returncode == 0


@pytest.mark.parametrize(
    ("header", "measure", "scale"), [("U [kV],stretch", "stretch", 1e-3), ("area strain (%),Voltage / V", "area_strain", 1.0)]
)
def test_a_table_of_voltages_and_stretches_is_a_test_of_a_film(
    header: str, measure: str, scale: float, dielast: Run, tmp_path: Path
) -> None:
    volts, stretch = (0, 2200, 3700, 5000, 6400), (2, 2.016, 2.049, 2.1, 2.19)
    numbers = stretch if measure == "stretch" else [100 * ((value / 2) ** 2 - 1) for value in stretch]
    rows = [
        (f"{volt * scale:g}", f"{number:.6g}")[:: 1 if header.startswith("U") else -1]
        for volt, number in zip(volts, numbers, strict=True)
    ]
    (tmp_path / "film.csv").write_text("\n".join([header, *map(",".join, rows)]) + "\n")
    recipe, text, _ = made(dielast, "calibrate", "film.csv")
    assert set(recipe["test"][0]["columns"]) == {"voltage", measure}  # type: ignore[index]
    filled = text.replace('thickness = "FILL IN"', 'thickness = "1 mm"').replace('prestretch = "FILL IN"', "prestretch = 2.0")
    filled = filled.replace('relax = "FILL IN"', 'relax = "30 min"').replace('boundary = "FILL IN"', 'boundary = "dead-load"')
    filled = filled.replace('ramp = "FILL IN"', 'ramp = "100 V/s"').replace('temperature = "FILL IN"', 'temperature = "20 degC"')
    (tmp_path / "r.toml").write_text(filled)
    done = dielast("validate", "r.toml")
    assert done.returncode == 0, done.stderr
    (tmp_path / "history.csv").write_text("t [s],U [kV],stretch\n0,0,2\n1,3,2.01\n60,3,2.05\n")
    done = dielast("new", "calibrate", "--data", "history.csv")
    assert done.returncode == 2
    assert "history.csv: voltage and stretch over time: dielast new actuate takes it" in done.stderr


def test_curves_of_one_table_are_tests_of_their_own(dielast: Run, shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    shutil.copy(shared_data("vhb4905/4-loading.csv"), tmp_path / "loading.csv")
    tests = made(dielast, "calibrate", "loading.csv")[0]["test"]
    assert len(tests) == 31  # type: ignore[arg-type]
    assert tests[0] == {  # type: ignore[index]
        "file": "loading.csv",
        "where": {"id": 100},
        "columns": {"stretch": "stretch", "stress": "stress"},
        "units": {"stress": "FILL IN"},
        "rate": "0.1 FILL IN",
        "temperature": "253.15 FILL IN",
    }


def test_measured_melts_need_their_units_and_then_run(dielast: Run, shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    for path in shared_data("polystyrene").glob("stressrelaxation*.csv"):
        shutil.copy(path, tmp_path)
    recipe, text, _ = made(dielast, "mastercurve", "stressrelaxation*.csv")
    assert recipe["data"]["temperatures"] == [f"{level} FILL IN" for level in (130, 145, 160, 175, 190)]  # type: ignore[index]
    text = (
        text.replace(" FILL IN", " degC").replace('time = "FILL IN"', 'time = "s"').replace('modulus = "FILL IN"', 'modulus = "Pa"')
    )
    text = text.replace('reference_temperature = "FILL IN"', 'reference_temperature = "160 degC"')
    assert shift(dielast, tmp_path, text)["data"]["temperatures"] == 5  # type: ignore[index]


@pytest.mark.parametrize("law", [True, False])
def test_a_card_is_asked_for_the_scale_of_its_temperatures_if_it_has_a_shift_law(dielast: Run, tmp_path: Path, law: bool) -> None:
    card = "*ELASTIC\n 3.0, 0.5\n*VISCOELASTIC, TIME=PRONY\n 0.5, , 1.0\n" + "*TRS\n 20., 13., 187.\n" * law
    (tmp_path / "job.inp").write_text(card)
    _, text, _ = made(dielast, "spectrum", "job.inp")
    assert "prony_units" in text
    assert ("prony_temperature_scale" in text) is law
    told = dielast("new", "--data", "job.inp")
    assert told.returncode == 0, told.stderr
    assert "dielast new spectrum --data takes it" in told.stdout


def test_a_measured_sweep_of_a_glass_takes_a_reference_whose_shift_is_known(
    dielast: Run, shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    shutil.copy(shared_data("ansys_prony/freq_user_raw.csv"), tmp_path / "f.csv")
    _, text, _ = made(dielast, "mastercurve", "f.csv")
    (tmp_path / "r.toml").write_text(text)
    done = dielast("mastercurve", "r.toml", "--plot", "svg", "-q")
    assert done.returncode == 0, done.stderr
    assert tomllib.loads((tmp_path / "r/summary.toml").read_text())["data"]["temperatures"] == 21
    # the coldest are below the pole of the fitted law, which is drawn above it
    assert "cannot be drawn" not in done.stderr
    assert (tmp_path / "r/mastercurve.svg").exists()


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ("time [min],E [MPa]", None),
        ("time,E [MPa]", "b_40C.csv: the header of the time states no unit, but that of a_20C.csv does: write it into the header"),
        ("t [min],E [MPa]", 'b_40C.csv: the time is called "t [min]", but in a_20C.csv "time [s]": one name is needed'),
        (
            "f [Hz],E [MPa]",
            "b_40C.csv: no column of the time was recognised, which a_20C.csv has: tests of one kind make one recipe",
        ),
    ],
)
def test_files_of_several_headers_make_one_recipe_or_none(other: str, message: str | None, dielast: Run, tmp_path: Path) -> None:
    for name, head, celsius, minute, scale in (("a_20C.csv", "time [s],E [kPa]", 20, 1, 1e3), ("b_40C.csv", other, 40, 60, 1e6)):
        rows = [f"{time / minute:.9g},{modulus(celsius, time) / scale:.9g}" for time in TIMES]
        (tmp_path / name).write_text("\n".join([head, *rows]) + "\n")
    if message is None:
        recipe, text, _ = made(dielast, "mastercurve", "*.csv")
        assert recipe["data"]["columns"] == {"time": "time", "modulus": "E"}  # type: ignore[index]
        assert shift(dielast, tmp_path, text)["data"]["temperatures"] == 2  # type: ignore[index]
    else:
        done = dielast("new", "mastercurve", "--data", "a_20C.csv", "b_40C.csv")
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(message)
        assert "dielast new mastercurve" not in dielast("new", "--data", "a_20C.csv", "b_40C.csv").stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("masterkurve", "--data", "example:relaxation-test.csv"),
            'masterkurve: no such file, and no kind of recipe: did you mean "mastercurve"?',
        ),
        (("spectrum", "--data", "example:relaxation-test.csv"), "mastercurve takes them, and dielast spectrum its result\n"),
        (
            ("design", "--data", "example:relaxation-test.csv"),
            "design takes no measured data: dielast new design; mastercurve would take it",
        ),
        (("measure", "--data", "example:relaxation-test.csv"), "no photograph: one of .png"),
        (("--data", "nothing-*.csv"), "nothing-*.csv: no such file"),
        (("relax", "calibrate"), "relax and calibrate are stated: one kind is needed"),
        ((), "a kind is needed: mastercurve"),
    ],
)
def test_what_cannot_be_is_one_line(arguments: tuple[str, ...], message: str, dielast: Run) -> None:
    done = dielast("new", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not done.stdout


def test_a_number_that_overflows_in_its_unit_is_no_python_warning(dielast: Run, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("temperature [degC],time [s],modulus [MPa]\n20,1,1\n20,2,1e305\n20,3,0.8\n")
    assert "RuntimeWarning" not in dielast("new", "--data", "t.csv").stderr
