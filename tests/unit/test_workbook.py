"""Workbooks are read as text tables are; a hostile one is a line, whatever it claims to hold."""

from __future__ import annotations

import io
import random
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import exports
import numpy as np
import pytest
from readings import expect_sweeps, read

from dielast.base.errors import InputError
from dielast.base.units import STRESS, TEMPERATURE, TIME
from dielast.commands.spectrum.sources import read_curve
from dielast.io import workbook
from dielast.io.cells import TextFormat, decode
from dielast.io.files import Inputs, sha256
from dielast.io.text_table import read_measured
from dielast.readings.recipe import CurveData
from dielast.recipe.validate import check

openpyxl = pytest.importorskip("openpyxl")
pytest.importorskip("python_calamine")
HEADER = ["T [°C]", "time [s]", "E [MPa]"]
ROWS = [[20.0, 1.0, 2.5], [20.0, 10.5, 0.3], [40.0, 1e-3, 3333333.333333333]]  # 16 digits, of which a spreadsheet keeps 15


def book(*sheets: Sequence[Sequence[Any]], change: Callable[[Any], None] | None = None) -> bytes:
    """A workbook of sheets called Data, Data2 ... with these rows."""
    made = openpyxl.Workbook()
    made.remove(made.active)
    for rows in sheets:
        own = made.create_sheet("Data")
        for row in rows:
            own.append(row)
    if change is not None:
        change(made)
    buffer = io.BytesIO()
    made.save(buffer)
    return buffer.getvalue()


def opendocument(rows: Sequence[Sequence[Any]]) -> bytes:
    """An OpenDocument spreadsheet of one sheet."""
    cells = "".join(
        "<table:table-row>"
        + "".join(
            f'<table:table-cell office:value-type="float" office:value="{cell!r}"/>'
            if isinstance(cell, float)
            else f'<table:table-cell office:value-type="string"><text:p>{cell}</text:p></table:table-cell>'
            for cell in row
        )
        + "</table:table-row>"
        for row in rows
    )
    name = "urn:oasis:names:tc:opendocument:xmlns"
    spaces = " ".join(f'xmlns:{own}="{name}:{own}:1.0"' for own in ("office", "table", "text"))
    body = (
        f'<office:body><office:spreadsheet><table:table table:name="Data">{cells}</table:table></office:spreadsheet></office:body>'
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("content.xml", f'<?xml version="1.0"?><office:document-content {spaces}>{body}</office:document-content>')
        manifest = f'xmlns:manifest="{name}:manifest:1.0"'
        archive.writestr("META-INF/manifest.xml", f'<?xml version="1.0"?><manifest:manifest {manifest}/>')
    return buffer.getvalue()


def numbers(content: bytes, name: str = "dma.xlsx", **form: Any) -> list[list[float]]:
    table = read_measured(content, name, TextFormat(**form))
    columns = [table.column(own, own, unit) for own, unit in (("T", TEMPERATURE), ("time", TIME), ("E", STRESS))]
    return np.column_stack(columns).tolist()


EXPECTED = [[T, t, 1e6 * E] for T, t, E in ROWS]


@pytest.mark.parametrize("make", [book, opendocument])
def test_every_digit_of_a_sheet_is_read(make: Callable[[Any], bytes]) -> None:
    assert numbers(make([HEADER, *ROWS])) == EXPECTED
    assert numbers(make([["Operator", "Jörg", ""], ["T", "time", "E"], ["°C", "s", "MPa"], *ROWS])) == EXPECTED


def test_a_sheet_is_chosen_by_name_or_number() -> None:
    content = book([["notes", "", ""]], [HEADER, *ROWS])
    assert numbers(content, sheet="Data1") == numbers(content, sheet=2) == EXPECTED
    for wrong in ("Dta", 3):
        with pytest.raises(InputError, match=r'^dma.xlsx: sheet: no .*; the workbook has "Data", "Data1"$'):
            numbers(content, sheet=wrong)
    with pytest.raises(InputError, match=r'^dma.csv: sheet = "Data" is stated, but this is no workbook$'):
        numbers(b"T [C],time [s],E [Pa]\n1,2,3\n", "dma.csv", sheet="Data")


def test_a_first_sheet_without_a_table_says_how_to_choose_another() -> None:
    for rows, said in (
        ([], "the file is empty"),
        ([["notes", "of", "mine"]], "no row of numbers found|no columns of numbers found"),
    ):
        with pytest.raises(
            InputError, match=rf'^dma.xlsx: ({said}).* \(this is the first sheet, "Data"; for another one state sheet = "Data1"\)$'
        ):
            numbers(book(rows, [HEADER, *ROWS]))


def test_a_table_may_begin_anywhere() -> None:
    content = book([[], ["", "", "", ""], *([None, None, None, None, *row] for row in (HEADER, *ROWS))])
    assert numbers(content) == EXPECTED
    with pytest.raises(InputError, match=r'dma.xlsx: line 5: column "E": the cell is empty'):
        numbers(
            book([[], [None, None, *HEADER], *([None, None, *row] for row in ([*ROWS[0]], [*ROWS[1]], [20.0, 1.0, None], ROWS[2]))])
        )


def test_hidden_sheets_are_not_the_first() -> None:
    def hide(made: Any) -> None:
        made.worksheets[0].sheet_state = "hidden"

    assert numbers(book([["notes", "", ""]], [HEADER, *ROWS], change=hide)) == EXPECTED


@pytest.mark.parametrize("mark", [".", ","])
def test_numbers_stored_as_text_are_numbers(mark: str) -> None:
    rows = [[T, str(t).replace(".", mark), f" {E!r}".replace(".", mark)] for T, t, E in ROWS]
    assert numbers(book([HEADER, *rows])) == EXPECTED
    assert numbers(book([HEADER, *rows]), decimal=mark) == EXPECTED


def test_formulas_count_with_their_saved_values() -> None:
    content = book([HEADER, *ROWS])
    buffer = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(buffer, "w") as new:
        for entry in old.namelist():
            text = old.read(entry)
            if entry.endswith("sheet1.xml"):
                text = text.replace(b"<v>2.5</v>", b"<f>5/2</f><v>2.5</v>")
                assert b"<f>" in text
            new.writestr(entry, text)
    assert numbers(buffer.getvalue()) == EXPECTED
    with pytest.raises(InputError, match=r'dma.xlsx: line 2: column "E": the cell is empty'):
        numbers(book([HEADER, [20.0, 1.0, "=5/2"], *ROWS]))  # never calculated


def test_merged_and_blank_cells() -> None:
    def merge(made: Any) -> None:
        made.worksheets[0].merge_cells("A1:C1")
        made.worksheets[0].merge_cells("A4:A5")

    rows = [
        ["All of it", None, None],
        [None, None, None],
        HEADER,
        *([T if k != 1 else None, t, E] for k, (T, t, E) in enumerate(ROWS)),
    ]
    assert numbers(book(rows, change=merge)) == EXPECTED
    rows[4] = [20.0, 10.5, None]
    with pytest.raises(InputError, match=r'dma.xlsx: line 5: column "E": the cell is empty'):
        numbers(book(rows))


@pytest.mark.parametrize("name", ["trios-sweeps.txt", "rheocompass-sweeps.csv", "rheology-advantage-sweeps.txt"])
def test_an_export_in_a_workbook_is_an_export(tmp_path: Path, name: str) -> None:
    text = decode(exports.files()[name], name)
    mark = "\t" if "\t" in text else ";" if ";" in text else ","
    rows = [[float(cell) if cell.replace(".", "").isdigit() else cell for cell in line.split(mark)] for line in text.split("\n")]
    (tmp_path / "export.xlsx").write_bytes(book(rows))
    reading = read(tmp_path, file="export.xlsx")
    expect_sweeps(reading.measurements, 3.0)
    assert reading.formats != ("table",)


def test_the_hash_of_the_file_is_that_of_the_workbook(tmp_path: Path) -> None:
    content = book([["time [s]", "modulus [Pa]"], *([float(t), 1e6 / t] for t in (1, 2, 4))])
    (tmp_path / "dma.xlsx").write_bytes(content)
    inputs = Inputs(tmp_path)
    curve = read_curve(check(CurveData, {"file": "dma.xlsx", "reference_temperature": "20 degC"}, "r", tmp_path), inputs)
    assert curve.columns[1].tolist() == [1e6, 5e5, 2.5e5]
    assert inputs.digests == [("dma.xlsx", sha256(content))]


def test_what_is_missing_is_said_with_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workbook, "find_spec", lambda name: None)
    with pytest.raises(InputError) as caught:
        numbers(book([HEADER, *ROWS, [0, 0, 0]]))
    assert "pip install 'dielast[excel]'" in str(caught.value)
    assert len(caught.value.messages) == 1


def far(made: Any) -> None:
    made.worksheets[0]["XFD1048576"] = 1


def many(made: Any) -> None:
    made.worksheets[0]["ALL5001"] = 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"PK\x03\x04\x14\x00\x06\x00", "the workbook cannot be read"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "the workbook cannot be read"),
        (book([HEADER, *ROWS])[:-400], "the workbook cannot be read"),
        (book([HEADER, *ROWS], change=far), "too large when unpacked: save the sheet as CSV"),
        (book([HEADER, *ROWS], change=many), "a sheet of 5001 rows and 1000 columns is too large: save it as CSV"),
    ],
)
def test_a_hostile_workbook_is_one_line(content: bytes, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_measured(content, "dma.xlsx")
    assert str(caught.value).startswith("dma.xlsx: ")
    assert message in str(caught.value)
    assert len(caught.value.messages) == 1


def test_damaged_workbooks_are_read_or_refused_in_a_line() -> None:
    rng, whole, told = random.Random(1), book([HEADER, *ROWS]), list[str]()
    for _ in range(12):
        damaged = bytearray(whole)
        for _ in range(rng.randint(1, 30)):
            damaged[rng.randrange(4, len(damaged))] = rng.randrange(256)
        try:
            read_measured(bytes(damaged), "dma.xlsx")
        except InputError as error:
            told += error.messages
    assert told
    assert all(line.startswith("dma.xlsx: ") for line in told)
