"""Files that need no columns: those of RepTate, and wide tables with columns of their own for each temperature."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import exports
import numpy as np
import pytest
from hypothesis import given, strategies as st
from readings import read

from dielast.base.errors import InputError
from dielast.base.units import ANGULAR_FREQUENCY, STRESS
from dielast.commands.spectrum.sources import read_curve
from dielast.io.files import Inputs
from dielast.io.header import temperature_in
from dielast.io.text_table import read_measured
from dielast.material.measurement import CreepCurve, FrequencySweep, RelaxationCurve
from dielast.material.measurement_kind import RELAXATION
from dielast.readings.instruments import recognise
from dielast.readings.recipe import CurveData
from dielast.recipe.validate import check

NAMES = "w\tG'\tG\"\tTemp\tg\td\th*\tTorque\td\ttan(d)\tNormalStress"
UNITS = "rad/s\tPa\tPa\t°C\t%\t°\tPa-s\tN-m\t°\t \tPa"


def sweep_text(temperature: float, header: str = f"{NAMES}\n{UNITS}\n", columns: int = 11) -> str:
    """An export as RepTate keeps it: names and units between tabs, numbers aligned by blanks."""
    lines = [f"T={temperature:g};Mw=33.6;chem=X;label=model;PDI=1.03;"]
    for omega, storage, loss in exports.sweep(temperature):
        cells = (omega, storage, loss, temperature + 0.01, 1.97, 26.9, 2851.4, 0.0011, 26.9, loss / storage, 5.0)
        lines.append("".join(f"{cell:>17.8g}" for cell in cells[:columns]))
    return "\n".join([lines[0], header + "\n".join(lines[1:])]) + "\n"


@pytest.mark.parametrize("columns", [11, 6, 3])
@pytest.mark.parametrize("header", [f"{NAMES}\n{UNITS}\n", "w\tG'\tG''\n", "#w  G'(w)  G\"(w)\n", ""])
def test_sweeps_need_no_columns(tmp_path: Path, header: str, columns: int) -> None:
    for temperature in exports.TEMPERATURES:
        (tmp_path / f"model_{temperature:g}C.osc").write_text(sweep_text(temperature, header, columns))
    reading = read(tmp_path, files="*.osc")
    assert reading.summary == {"measurement": "oscillation", "test": "shear", "format": "RepTate"}
    for one, temperature in zip(reading.measurements, exports.TEMPERATURES, strict=True):
        assert isinstance(one, FrequencySweep)
        assert one.temperature == temperature
        assert one.source == f"model_{temperature:g}C.osc"
        found = np.array([one.angular_frequency, one.storage_modulus / 3, one.loss_modulus / 3])
        np.testing.assert_allclose(found, exports.sweep(temperature).T, rtol=1e-6)


@pytest.mark.parametrize(
    ("head", "scale"), [("T=20;gamma=0.05;\nt sxy\n", 0.05), ("T=20;Mw=0;gamma=0;\n", 1.0), ("T=20;\nt\tGt\ns\tPa\n", 1.0)]
)
def test_relaxation_is_over_its_strain(tmp_path: Path, head: str, scale: float) -> None:
    rows = exports.relaxation(20.0)
    (tmp_path / "model.gt").write_text(head + "\n".join(f"{t}\t{scale * g}" for t, g in rows) + "\n")
    curve = read_curve(check(CurveData, {"file": "model.gt"}, "r", tmp_path), Inputs(tmp_path))
    np.testing.assert_allclose(curve.columns, [rows[:, 0], 3 * rows[:, 1]], rtol=1e-12)
    assert curve.kind is RELAXATION


@pytest.mark.parametrize("column", [True, False])
def test_creep_has_its_stress_in_a_column_or_in_its_first_line(tmp_path: Path, column: bool) -> None:
    time = np.geomspace(0.01, 100, 20)
    head = "T=150;stress=10;\n" + ("t\tstrain\tstress\tT\ns\t-\tPa\tC\n" if column else "t\tstrain\ns\t-\n")
    rows = [f"{t}\t{1e-3 * t**0.5}" + ("\t10\t149.9" if column else "") for t in time]
    (tmp_path / "model.creep").write_text(head + "\n".join(rows) + "\n")
    (one,) = read(tmp_path, files=["model.creep"]).measurements
    assert isinstance(one, CreepCurve)
    assert one.temperature == 150
    np.testing.assert_allclose(one.compliance, 1e-4 * time**0.5 / 3, rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("x.osc", "T=20;Mw=3;\nw\tG'\tG''\n1 2 3\n4 5 6 7\n8 9\n", "x.osc: line 5: 2 cells, but step"),
        ("x.dat", "T=20;Mw=3;\n1 2 3\n4 5 6\n", "x.dat: a RepTate file without names of columns, and not called .osc, .tts, .gt"),
        ("x.osc", "Mw=3;\n1 2 3\n4 5 6\n", 'x.osc: step "oscillation, oscillation" has no temperature: export it'),
    ],
)
def test_what_lacks_is_said(tmp_path: Path, name: str, text: str, message: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        read(tmp_path, files=[name])
    assert str(caught.value).startswith(message)


def test_a_table_of_one_s_own_is_no_such_file() -> None:
    for text in (
        "T=20;sample=3\ntime [s]\tE [MPa]\n1\t2\n2\t3\n",
        "T=20;sample=3;\n1 2\n2 3\n",
        "time=s;E=MPa;\n1;2\n2;3\n",
        "w\tG'\n1\t2\n",
    ):
        assert recognise(text) is None


def test_as_a_plain_table_blank_cells_keep_their_place() -> None:
    table = read_measured(sweep_text(20.0).encode(), "model.osc")
    assert table.units == ("rad/s", "Pa", "Pa", "°C", "%", "°", "Pa-s", "N-m", "°", None, "Pa")
    np.testing.assert_allclose(table.column("w", "angular_frequency", ANGULAR_FREQUENCY), exports.OMEGA, rtol=1e-6)
    np.testing.assert_allclose(table.column('G"', "loss", STRESS), exports.sweep(20.0)[:, 2], rtol=1e-6)


def test_units_between_blanks_of_which_one_lacks_are_not_guessed() -> None:
    with pytest.raises(InputError, match='column "E" has no unit'):
        read_measured(b"w  tan_d  E\nHz  Pa\n1 2 3\n2 3 4\n", "x.txt").column("E", "modulus", STRESS)


TIME = np.geomspace(1, 1000, 8)
TEMPERATURES = (20.0, 30.0, -10.0)
POINTS = (8, 5, 3)  # of each temperature
KNOWN = {"modulus": "E"}


def modulus(temperature: float) -> np.ndarray:
    return np.asarray(1e6 * (1 + TIME * 10 ** (temperature / 20)) ** -0.1)


def pairs(header: list[str], separator: str = ",", spacer: bool = False) -> str:
    """Pairs of columns, time and modulus in kPa, the later ones shorter."""
    rows = [separator.join(header)] if isinstance(header, list) else []
    for row in range(TIME.size):
        cells: list[str] = []
        for temperature, points in zip(TEMPERATURES, POINTS, strict=True):
            filled = row < points
            cells += [repr(float(TIME[row])) if filled else "", repr(float(modulus(temperature)[row] / 1e3)) if filled else ""]
            cells += [""] if spacer else []
        rows.append(separator.join(cells))
    return "\n".join(rows) + "\n"


def shared(header: str) -> str:
    columns = np.column_stack((TIME, *(modulus(temperature) / 1e3 for temperature in TEMPERATURES)))
    return header + "\n" + "\n".join(",".join(map(repr, map(float, row))) for row in columns) + "\n"


def expect(folder: Path, text: str, points: tuple[int, ...], **options: Any) -> None:
    (folder / "wide.csv").write_text(text)
    reading = read(folder, file="wide.csv", **options)
    assert [one.temperature for one in reading.measurements] == sorted(TEMPERATURES)
    for one in reading.measurements:
        assert isinstance(one, RelaxationCurve)
        count = points[TEMPERATURES.index(one.temperature)]
        np.testing.assert_allclose(one.time, TIME[:count], rtol=1e-12)
        np.testing.assert_allclose(one.modulus, modulus(one.temperature)[:count], rtol=1e-12)


@pytest.mark.parametrize(
    "header",
    [
        [f"{name} {T:g} degC" for T in TEMPERATURES for name in ("time [s]", "E [kPa]")],
        [f"{name} {T:g}°C {unit}" for T in TEMPERATURES for name, unit in (("time", "(s)"), ("E", "(kPa)"))],
        [f"{name} ({T:g} °C) [{unit}]" for T in TEMPERATURES for name, unit in (("time", "s"), ("E", "kPa"))],
        [f"{name} @ {T + 273.15:.2f} K / {unit}" for T in TEMPERATURES for name, unit in (("time", "s"), ("E", "kPa"))],
        [f"{name} [{unit}] T = {T:g} deg C" for T in TEMPERATURES for name, unit in (("time", "s"), ("E", "kPa"))],
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_pairs_of_columns_with_their_temperature_in_the_header(tmp_path: Path, header: list[str], separator: str) -> None:
    expect(tmp_path, pairs(header, separator), POINTS, columns=KNOWN)


@pytest.mark.parametrize(
    "above",
    [
        "20 °C,,30 °C,,-10 °C,\ntime [s],E [kPa],time [s],E [kPa],time [s],E [kPa]",
        "20 °C,20 °C,30 °C,30 °C,-10 °C,-10 °C\ntime,E,time,E,time,E\ns,kPa,s,kPa,s,kPa",
        "time,E,time,E,time,E\n20 degC,,30 degC,,-10 degC,\ns,kPa,s,kPa,s,kPa",
        "Sample 3,,,,,\n293.15 K,,303.15 K,,263.15 K,\ntime [s],E [kPa],time [s],E [kPa],time [s],E [kPa]",
    ],
)
def test_pairs_of_columns_below_a_row_of_temperatures(tmp_path: Path, above: str) -> None:
    expect(tmp_path, f"{above}\n{pairs([]).lstrip()}", POINTS, columns=KNOWN)


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("time [s],E 20 °C [kPa],E 30 °C [kPa],E -10 °C [kPa]", {"columns": KNOWN}),
        ("time [s],20 °C [kPa],30 °C [kPa],-10 °C [kPa]", {}),
        ("time [s],20 °C,30 °C,-10 °C", {"units": {"modulus": "kPa"}}),
        ("Step time [s],20C (kPa),30C (kPa),-10C (kPa)", {}),
        ("time [s],20,30,-10", {"units": {"modulus": "kPa", "temperature": "degC"}, "layout": "wide"}),
        ("T [°C],20,30,-10\ntime [s],E [kPa],E [kPa],E [kPa]", {"columns": KNOWN}),
        ("Temperature / °C,20,30,-10\ntime / s,E / kPa,E / kPa,E / kPa", {"columns": KNOWN}),
        (",20 °C,30 °C,-10 °C", {"columns": {"time": 1, "modulus": "modulus"}, "units": {"time": "s", "modulus": "kPa"}}),
        (",20 °C,30 °C,-10 °C\ntime,E,E,E\ns,kPa,kPa,kPa", {"columns": KNOWN}),
    ],
)
def test_one_time_for_all(tmp_path: Path, header: str, options: dict[str, Any]) -> None:
    expect(tmp_path, shared(header), (8, 8, 8), **options)


def test_a_gap_within_a_pair_names_its_line(tmp_path: Path) -> None:
    lines = pairs([f"{name} {T:g} degC" for T in TEMPERATURES for name in ("time [s]", "E [kPa]")]).splitlines()
    cells = lines[3].split(",")
    cells[1] = ""
    (tmp_path / "wide.csv").write_text("\n".join([*lines[:3], ",".join(cells), *lines[4:]]) + "\n")
    with pytest.raises(InputError, match=r'wide.csv: line 4: column "E": the cell is empty'):
        read(tmp_path, file="wide.csv", columns=KNOWN)


@given(st.integers(-150, 300), st.sampled_from(["{} °C", "{}°C", "{} degC", "{}C", "{} ℃", "({} °C)", "T = {} °C", "@{} deg C"]))
def test_any_temperature_is_read_out_of_a_name(temperature: int, form: str) -> None:
    for name, rest in (("E {}", "E"), ("storage modulus {} [MPa]", "storage modulus [MPa]"), ("{}", "")):
        assert temperature_in(name.format(form.format(temperature))) == (temperature, rest)


@pytest.mark.parametrize("text", ["E20C", "E1.20 Cm", "G'", "time [s]", "20", "T20", "2C-rate", "20 Cal", "C20", "20 %", "1 kPa"])
def test_what_is_no_temperature(text: str) -> None:
    assert temperature_in(text) is None
