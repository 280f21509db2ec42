"""Wide tables: columns of their own for each temperature, which the headers, or a row above them, state."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import exports
import numpy as np
import pytest
from hypothesis import given, strategies as st
from readings import expect_sweeps, read

from dielast.base.errors import InputError
from dielast.io.header import temperature_in
from dielast.material.measurement import RelaxationCurve

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


def test_empty_columns_between_the_pairs(tmp_path: Path) -> None:
    above = "20 °C,,,30 °C,,,-10 °C,,\ntime [s],E [kPa],,time [s],E [kPa],,time [s],E [kPa],"
    expect(tmp_path, f"{above}\n{pairs([], spacer=True).lstrip()}", POINTS, columns=KNOWN)


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


def test_triples_are_sweeps(tmp_path: Path) -> None:
    names = [
        f"{name} ({T:g} °C) [{unit}]" for T in exports.TEMPERATURES for name, unit in (("w", "rad/s"), ("E'", "Pa"), ("E''", "Pa"))
    ]
    rows = np.concatenate([exports.sweep(T) for T in exports.TEMPERATURES], axis=1)
    text = ",".join(names) + "\n" + "\n".join(",".join(map(repr, map(float, row))) for row in rows) + "\n"
    (tmp_path / "wide.csv").write_text(text)
    expect_sweeps(read(tmp_path, file="wide.csv", columns={"angular_frequency": "w", "storage": "E'", "loss": "E''"}).measurements)
    expect_sweeps(read(tmp_path, file="wide.csv").measurements)  # their names tell


def test_a_long_table_is_not_taken_for_a_wide_one(tmp_path: Path) -> None:
    (tmp_path / "long.csv").write_text("T [degC],time [s],E 20C [Pa],E 60C [Pa]\n20,1,2,3\n20,2,2,3\n40,1,2,3\n40,2,1,3\n")
    found = read(tmp_path, file="long.csv", columns={"temperature": "T", "modulus": "E 20C"}).measurements
    assert [one.temperature for one in found] == [20, 40]


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


@given(st.text(max_size=400))
def test_any_header_is_read_or_refused(text: str) -> None:
    try:
        found = temperature_in(text, "degC")
    except InputError:
        return
    assert found is None or np.isfinite(found[0])


@pytest.mark.parametrize("text", ["E20C", "E1.20 Cm", "G'", "time [s]", "20", "T20", "2C-rate", "20 Cal", "C20", "20 %", "1 kPa"])
def test_what_is_no_temperature(text: str) -> None:
    assert temperature_in(text) is None
