"""A step of an export as a table, and what every format's reader needs to make one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from dielast.errors import InputError
from dielast.io.text_table import MeasuredTable, is_number, split_cells, split_lines
from dielast.readings.instruments.names import ANGULAR, Deformation, plain

Row: TypeAlias = tuple[int, list[str]]
"""A line's number in the file, from 1, and its cells."""

_PER_SECOND = ("1/s", "s-1", "s^-1", "s⁻¹", "/s")
_MARKS = ("[]", "()")


@dataclass(frozen=True, slots=True, eq=False)
class ExportedStep:
    """One step of an export: its `name`, its `table`, and how the specimen was strained, None where the file does not say."""

    name: str
    table: MeasuredTable
    deformation: Deformation | None


def numbered(text: str, separator: str) -> list[Row]:
    """Every line of `text` as its number and cells."""
    return [(number, split_cells(line, separator)) for number, line in enumerate(split_lines(text), start=1)]


def stated_points(text: str) -> int | None:
    """The number of points that a file states, if it does."""
    return int(text) if text.isdecimal() and len(text) < 10 else None


def separator_of(line: str) -> str:
    """What parts the cells of a line of names: a tab, else a semicolon, else a comma."""
    return next((mark for mark in "\t;," if mark in line), "\t")


def is_blank(row: Row) -> bool:
    """Whether a line holds nothing."""
    return not any(row[1])


def shift_left(row: Row) -> Row:
    """The row without its first cell, which says what kind of line it is."""
    return row[0], row[1][1:]


def value(row: Row) -> str:
    """What stands after the key in a line of a header block."""
    return next((cell for cell in row[1][1:] if cell), "")


def build(
    source: str,
    name: str,
    header: tuple[Row, Row | None],
    rows: Sequence[Row],
    *,
    last_line: int,
    points: int | None = None,
    decimal: str | None = None,
    deformation: Deformation | None = None,
) -> ExportedStep:
    """The step called `name` from its `header`, rows of names and of units, and its `rows` of readings.

    `last_line` is the number of the file's last line that holds anything: a row that is too short is a damaged file there, and has
    empty cells at its end elsewhere. `points` is how many rows the file says there are. Raises `InputError` naming file and line.
    """
    (names_line, names), units = header
    width = max((place for place, cell in enumerate(names, start=1) if cell), default=0)
    if units is None or any(is_number(cell, mark) and cell != "1" for cell in units[1] for mark in ".,"):
        raise InputError(f'step "{name}": the row of units under the names is missing', file=source, line=names_line)
    check_widths(source, name, width, rows, last_line)
    if points is not None and points != len(rows):
        where = rows[-1][0] if rows else units[0]
        raise InputError(
            f'step "{name}" ends after {len(rows)} of {points} points: the file seems cut off', file=source, line=where
        )
    columns = tuple([cells[k] if k < len(cells) else "" for _, cells in rows] for k in range(width))
    table = MeasuredTable(
        source,
        tuple(names[:width]),
        tuple(_unit(names[k], units[1][k] if k < len(units[1]) else "") for k in range(width)),
        columns,
        np.array([line for line, _ in rows], dtype=np.int64),
        decimal or decimal_mark([cells for _, cells in rows]),
        header_line=units[0],
    )
    return ExportedStep(name, table, deformation)


def check_widths(source: str, name: str, width: int, rows: Sequence[Row], last_line: int) -> None:
    """Raise `InputError` for a row of more than `width` cells, or of less where the file ends."""
    for line, cells in rows:
        if any(cells[width:]):
            raise InputError(f'{len(cells)} cells, but step "{name}" has {width} columns', file=source, line=line)
        if line == last_line and len(cells) < width:
            raise InputError(
                f'{len(cells)} cells, but step "{name}" has {width} columns: the file seems cut off', file=source, line=line
            )


def decimal_mark(rows: Sequence[Sequence[str]]) -> str:
    """The mark that more numbers are written with."""
    commas = sum("," in cell and is_number(cell, ",") for cells in rows for cell in cells)
    points = sum("." in cell and is_number(cell, ".") for cells in rows for cell in cells)
    return "," if commas > points else "."


def last_filled(rows: Sequence[Row]) -> int:
    """The number of the last line that holds anything."""
    return next((row[0] for row in reversed(rows) if not is_blank(row)), 0)


def _unit(name: str, cell: str) -> str:
    text = cell.strip()
    if len(text) > 1 and text[0] + text[-1] in _MARKS:
        text = text[1:-1].strip()
    if plain(name) in ANGULAR and text in _PER_SECOND:
        return "rad/s"  # the column's name says which of the two it is
    return text or "-"
