"""Tables of voltages and of what they do to a film, whose columns and sheet the recipe may name."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.commands.plan import warnings_of
from dielast.commands.registry import read_cases
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs
from dielast.mechanics.load import Track
from dielast.readings.quantities import check_area_strain

FILM = 'kind = "actuate"\nmaterial = "example:vhb4905.toml"\n[film]\nthickness = "0.5 mm"\n[[step]]\n'


def followed(folder: Path, step: str) -> list[tuple[list[float], list[float]]]:
    """Times in s and voltages in V of the tracks."""
    (folder / "r.toml").write_text(FILM + step)
    (case,) = read_cases(folder / "r.toml")
    tracks = [entry.step.target for entry in solver_steps(case.recipe, Inputs(folder)) if isinstance(entry.step.target, Track)]
    return [(np.asarray(track.time).tolist(), np.asarray(track.value).tolist()) for track in tracks]


def test_columns_of_a_voltage_table_can_be_named(tmp_path: Path) -> None:
    (tmp_path / "v.csv").write_text("t [ms],U1 [kV],U2 [kV]\n0,0,0\n2000,1,2\n4000,0,0\n")
    columns = 'columns = { time = "t", voltage = "U2" }\n'
    assert followed(tmp_path, f'table = "v.csv"\n{columns}') == [([0.0, 2.0, 4.0], [0.0, 2000.0, 0.0])]
    with pytest.raises(InputError, match=r'^step\[0\]\.columns\.time: v\.csv: no column "time" for time'):
        followed(tmp_path, 'table = "v.csv"\n')
    with pytest.raises(InputError, match=r"step\[0\]: columns goes with table$"):
        followed(tmp_path, f'hold = "1 s"\n{columns}')


def test_a_sheet_of_a_workbook_can_be_a_voltage_table(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    book = openpyxl.Workbook()
    book.active.append(["notes"])
    sheet = book.create_sheet("Voltage")
    for row in (["time [s]", "voltage [kV]"], [0.0, 0.0], [1.0, 2.5], [3.0, 0.5]):
        sheet.append(row)
    content = io.BytesIO()
    book.save(content)
    (tmp_path / "v.xlsx").write_bytes(content.getvalue())
    assert followed(tmp_path, 'table = "v.xlsx"\nsheet = "Voltage"\n') == [([0.0, 1.0, 3.0], [0.0, 2500.0, 500.0])]
    (tmp_path / "v.csv").write_text("time [s],voltage [V]\n0,0\n1,1\n")
    with pytest.raises(InputError, match=r'^step\[0\]\.table: v\.csv: sheet = "Voltage" is stated, but this is no workbook$'):
        followed(tmp_path, 'table = "v.csv"\nsheet = "Voltage"\n')


CALIBRATE = """
kind = "calibrate"
material = "example:vhb4905.toml"
[[test]]
file = "film.csv"
film = { thickness = "1 mm", prestretch = 2.0, boundary = "frame", electrode_share = 0.25 }
ramp = "20 V/s"
columns = { voltage = "V", MEASURE = "HEADER" }
[free]
"equilibrium.shear_modulus" = {}
"""
COMPARE = (
    FILM
    + """voltage = "2 kV"
rate = "20 V/s"
[[compare]]
file = "film.csv"
x = "voltage [V]"
x_column = "V"
y = "MEASURE [1]"
y_column = "HEADER"
"""
)


@pytest.mark.parametrize(
    ("recipe", "measure", "header", "values", "message"),
    [
        (CALIBRATE, "area_strain", "A/A0", (1.0, 1.01, 1.05, 1.08), ""),
        (CALIBRATE, "area_strain", "dA [1]", (0.0, 0.01, 0.05, 0.08), ""),
        (CALIBRATE, "relative_stretch", "L/L0", (1.0, 1.01, 1.05, 1.08), ""),
        (
            CALIBRATE,
            "relative_stretch",
            "A/A0",
            (1.0, 1.01, 1.05, 1.08),
            'column "A/A0" holds areas, .*: state columns.area_strain',
        ),
        (CALIBRATE, "stretch", "area strain", (0.0, 0.01, 0.05, 0.08), 'column "area strain" holds areas, .* columns.area_strain'),
        (
            CALIBRATE,
            "area_strain",
            "L/L0",
            (1.0, 1.01, 1.05, 1.08),
            'column "L/L0" holds lengths, .*: state columns.stretch or columns.rel.*',
        ),
        (
            CALIBRATE,
            "area_strain",
            "area [1]",
            (1.0, 1.01, 1.05, 1.08),
            'column "area" is 1 at the lowest voltage, .*: call a column of ratios .*',
        ),
        (COMPARE, "area_strain", "A/A0", (1.0, 1.01, 1.05, 1.08), ""),
        (
            COMPARE,
            "relative_stretch_1",
            "A/A0",
            (1.0, 1.01, 1.05, 1.08),
            '.* holds areas, .* compare it with "area_strain \\[1\\]", .*',
        ),
        (
            COMPARE,
            "area_strain",
            "lambda",
            (1.0, 1.01, 1.05, 1.08),
            '.* holds lengths, .* compare it with "relative_stretch_1 \\[1\\]"',
        ),
        (COMPARE, "area_strain", "ratio", (1.0, 1.01, 1.05, 1.08), 'column "ratio" is 1 at the lowest voltage, .*'),
        (COMPARE.replace('y_column = "HEADER"\n', ""), "area_strain", "area_strain [%]", (0.0, 1.0, 5.0, 8.0), ""),
        (CALIBRATE, "area_strain", "A/A0 [%]", (100.0, 101.0, 105.0, 108.0), ""),
        (CALIBRATE, "relative_stretch", "A/A0 / %", (100.0, 101.0, 105.0, 108.0), 'column "A/A0 / %" holds areas, .*'),
    ],
)
def test_areas_and_lengths_of_a_film_are_told_apart(
    recipe: str, measure: str, header: str, values: tuple[float, ...], message: str, tmp_path: Path
) -> None:
    rows = [f"{volt},{value}" for volt, value in zip((0, 1000, 2000, 2500), values, strict=True)]
    (tmp_path / "film.csv").write_text("\n".join([f"V [V],{header}", *rows]))
    (tmp_path / "r.toml").write_text(recipe.replace("MEASURE", measure).replace("HEADER", header))
    if not message:
        warnings_of(tmp_path / "r.toml")
        return
    with pytest.raises(InputError, match=f"film.csv: {message}$"):
        warnings_of(tmp_path / "r.toml")


@pytest.mark.parametrize(
    ("voltage", "strain", "ratios"),
    [
        ((4e3, 5e3, 6e3), (0.70, 1.00, 1.58), False),
        ((6e3, 6e3), (1.58, 1.60), False),
        ((0.0, 0.0), (1.0, 1.0), False),
        ((0.0, 1e3, 2e3, 3e3), (0.0, 1.2, 1.3, 1.35), False),  # a film that snaps through
        ((0.9e3, 3e3), (1.01, 1.09), True),
        ((-3e3, -1.5e3, 0.0), (1.4, 1.1, 1.0), True),
        ((0.0, 1e3, 2e3, 2.5e3), (1.0, 1.05, 1.2, 2.6), True),  # up to pull-in
        ((), (), False),
    ],
)
def test_ratios_of_areas_are_those_that_begin_at_1_without_a_voltage(
    voltage: tuple[float, ...], strain: tuple[float, ...], ratios: bool
) -> None:
    expected = pytest.raises(InputError, match="call a column of ratios") if ratios else contextlib.nullcontext()
    with expected:
        check_area_strain(np.array(voltage), np.array(strain), "area", "film.csv")
