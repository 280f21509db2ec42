"""Tables of voltages, whose columns and sheet the recipe may name."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.commands.registry import read_cases
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.io.files import Inputs
from dielast.mechanics.load import Track

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
    with pytest.raises(InputError, match=r'^v\.csv: sheet = "Voltage" is stated, but this is no workbook$'):
        followed(tmp_path, 'table = "v.csv"\nsheet = "Voltage"\n')
