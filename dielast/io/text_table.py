"""Tables as laboratories have them: any separator, decimal mark, encoding, workbook, header rows and units, sniffed unless stated.

`read_measured` finds the shape of a text table and keeps its cells; `MeasuredTable.column` turns one column into numbers in SI,
naming the line of whatever is not a number. Units come from the header (`name [unit]`, `name (unit)`, `name / unit`), from a row
of units below the names, or from the recipe; they are never guessed.
"""

from __future__ import annotations

import codecs
import contextlib
import csv
import difflib
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, Where, shown
from dielast.io.header import filled_width, read_header, temperatures_in
from dielast.io.table import split_header
from dielast.io.workbook import is_workbook, sheet_text
from dielast.units import NUMBER, Dimension, conversion, is_ambiguous, is_unit

SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "blank"}
_SNIFFED_LINES = 200
_NUMBER = {
    ".": re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+(,\d*)?|,\d+)([eE][+-]?\d+)?"),
}


@dataclass(frozen=True, slots=True)
class TextFormat:
    """How a table is written, as far as the recipe says; None is sniffed."""

    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    skip_rows: int = 0
    sheet: str | int | None = None
    """Of a workbook: its name, or its number from 1; the first."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredTable:
    """The cells of a table as text: a list of rows for each of `names`; `lines` holds each row's line in the file (from 1).

    `header_line` is the line of the units, where it is worth naming: in a file of several tables; else 0. `spelled` holds the
    header cells as the file has them; without it they are taken for `name [unit]`. `stated_units` are a recipe's, by role; None
    where a recipe has no key for them. `over` holds the temperatures in degC that a row above the names states for each column.
    """

    source: str
    names: tuple[str, ...]
    units: tuple[str | None, ...]
    cells: tuple[list[str], ...]
    lines: NDArray[np.int64]
    decimal: str
    stated_units: Mapping[str, str] | None = None
    header_line: int = 0
    spelled: tuple[str, ...] = ()
    over: tuple[float | None, ...] = ()

    def find(self, wanted: str | int, role: str) -> int:
        """Index of the column called `wanted`: its header as the file spells it, `name [unit]`, or its name without the unit.

        A number counts columns from 1. Raises `InputError` if there is no such column, or several of them.
        """
        if isinstance(wanted, int):
            if 1 <= wanted <= len(self.names):
                return wanted - 1
            raise InputError(f"column {wanted} is wanted for {role}, but there are {len(self.names)} columns", file=self.source)
        headers = [_header_of(name, unit) for name, unit in zip(self.names, self.units, strict=True)]
        spelled = self.spelled or headers
        unitless = [name if unit is None else "" for name, unit in zip(self.names, self.units, strict=True)]
        bare, unit = split_header(wanted)
        ways = ((spelled, wanted), (headers, _header_of(bare, unit)), (self.names, wanted), (unitless, bare))
        # as written, then without regard to upper and lower case: T and t are two columns
        for same in (str.strip, _plain):
            for spelling, text in ways:
                matches = [index for index, cell in enumerate(spelling) if cell and same(cell) == same(text)]
                if len(matches) > 1:
                    raise InputError(f'column "{wanted}" for {role} appears {len(matches)} times', file=self.source)
                if matches:
                    return matches[0]
        # as the file spells them, but with their units from a row below
        there = [cell if split_header(cell)[1] else header for cell, header in zip(spelled, headers, strict=True)]
        near = difflib.get_close_matches(wanted, there, n=1)
        hint = f'did you mean "{near[0]}"?' if near else "there are " + ", ".join(f'"{header}"' for header in there)
        raise InputError(f'no column "{wanted}" for {role}; {hint}', file=self.source)

    def has(self, name: str) -> bool:
        """Whether a column is called `name`."""
        return any(_plain(name) == _plain(known) for known in self.names)

    def equals(self, wanted: str | int, value: str | float) -> NDArray[np.bool_]:
        """Which rows hold `value` in a column, shape (rows,): the same text, or the same number."""
        index = self.find(wanted, "where")
        if isinstance(value, str):
            return np.array([cell == value for cell in self.cells[index]])
        decimal = self.decimal
        return np.array([_number(cell.replace(decimal, ".")) == value for cell in self.cells[index]])

    def column(
        self, wanted: str | int, role: str, dimension: Dimension, rows: NDArray[np.bool_] | None = None
    ) -> NDArray[np.float64]:
        """The column in `dimension.unit`, shape (rows,); on request only those `rows` (mask).

        Raises `InputError` naming the line for text, empty cells and NaN, or the column for missing, contradicting and wrong units.
        """
        index = self.find(wanted, role)
        scale, offset = self._conversion(index, wanted, role, dimension)
        with np.errstate(over="ignore"):
            values = _numbers(self, index, rows) * scale + offset
        for row in np.flatnonzero(~np.isfinite(values))[:1]:
            line = (self.lines if rows is None else self.lines[rows])[row]
            raise InputError(f'column "{self.names[index]}": the number is too large', file=self.source, line=line)
        return values

    def check(self, wanted: str | int, role: str, dimension: Dimension | None) -> None:
        """Raise `InputError` as `column` does for a missing column or a wrong unit; without a `dimension` for the former alone."""
        index = self.find(wanted, role)
        if dimension is not None:
            self._conversion(index, wanted, role, dimension)

    def _conversion(self, index: int, wanted: str | int, role: str, dimension: Dimension) -> tuple[float, float]:
        name, in_header = self.names[index], self.units[index]
        in_mapping = split_header(wanted)[1] if isinstance(wanted, str) and in_header is None else None
        stated = (self.stated_units or {}).get(role, in_mapping)
        here = f'column "{name}"'
        place: Where = {"file": self.source, "line": self.header_line or None}
        # brackets may as well hold a part of the name
        if in_header is not None and stated is not None and (is_ambiguous(in_header, dimension) or not is_unit(in_header)):
            in_header = None
        if in_header is not None and stated is not None and not _alike(stated, in_header, dimension):
            raise InputError(f"{here}: the header says [{in_header}], the recipe's units say [{stated}]; leave one out", **place)
        unit = in_header if in_header is not None else stated
        if unit is None:
            if dimension is NUMBER:
                return 1.0, 0.0
            needed = dimension.unit
            or_else = "" if self.stated_units is None else f' or say units = {{ {role} = "{needed}" }}'
            raise InputError(f'{here} has no unit: call it "{name} [{needed}]"{or_else}', **place)
        try:
            return conversion(unit, dimension)
        except InputError as error:
            raise InputError(f"{here} [{unit}]: {error}", **place) from None


def read_measured(
    content: bytes, source: str, form: TextFormat | None = None, units: Mapping[str, str] | None = None
) -> MeasuredTable:
    """The table in the bytes `content` of the file called `source`; `units` states units by role where the header does not, and
    is None where a recipe cannot state any.

    Raises `InputError` if the text cannot be decoded, or if no table of numbers can be found in it.
    """
    form = form or TextFormat()
    text = decode(content, source, form.encoding, form.sheet, form.decimal)
    if not is_workbook(content):
        return _table(text, source, form, units)
    try:
        return _table(text, source, replace(form, separator="\t", decimal="."), units)
    except InputError as error:
        if form.sheet is not None:
            raise
        raise error.adding(' (in the first sheet: say sheet = "NAME" for another)') from None


def _table(text: str, source: str, form: TextFormat, units: Mapping[str, str] | None) -> MeasuredTable:
    numbered = list(enumerate(split_lines(text), start=1))[form.skip_rows :]
    filled = [(number, line) for number, line in numbered if line.strip(" \t;,")]
    if not filled:
        raise InputError("the file is empty" + (f" after skip_rows = {form.skip_rows}" if text.strip() else ""), file=source)
    separator, decimal = _sniff(source, [line for _, line in filled], form)
    rows = [split_cells(line, separator) for _, line in filled]
    width = _modal_width(rows, decimal)
    first = _first_data_row(rows, width, decimal)
    if first is None:
        _refuse_header_alone(source, [line for _, line in filled], separator)
        between = SEPARATORS.get(separator, separator)
        raise InputError(f'no row of numbers found (separator {between}, decimal mark "{decimal}")', file=source)
    # a line that begins with # is a comment, unless it is above the numbers, where it may hold names
    kept = [index for index in range(first, len(rows)) if not filled[index][1].lstrip().startswith("#")]
    lines = [filled[index][0] for index in kept]
    data = [rows[index] for index in kept]
    # blanks align the numbers below names that tabs may part
    above = [split_cells(line, "\t" if separator == " " and "\t" in line else separator) for _, line in filled[:first]]
    columns = max(width, min(map(len, data)), filled_width(data[0]))
    header = read_header(source, above, columns, separator == " " and not any("\t" in line for _, line in filled[:first]))
    names = header.names
    for line, row in zip(lines, data, strict=True):
        if filled_width(row) > len(names):
            raise InputError(f"{filled_width(row)} cells, but the table has {len(names)} columns", file=source, line=line)
        row[len(names) :] = [""] * (len(names) - len(row))
    cells = tuple(list(column) for column in zip(*data, strict=True))
    return MeasuredTable(
        source, names, header.units, cells, np.array(lines), decimal, units, spelled=header.spelled, over=header.temperature
    )


def decode(
    content: bytes, source: str, encoding: str | None = None, sheet: str | int | None = None, decimal: str | None = None
) -> str:
    """The text in `content`: UTF-8, UTF-16 if marked or plainly so, or else latin-1, unless `encoding` is stated.

    Its lines end in a line feed, whatever system they come from. Of a workbook it is a `sheet`, as `sheet_text` has it. Raises
    `InputError` naming `source` if it is no text, in an unknown encoding, or a workbook that cannot be read.
    """
    if is_workbook(content):
        return sheet_text(content, source, sheet, decimal)
    if sheet is not None:
        raise InputError(f"sheet = {shown(sheet)} is stated, but this is no workbook", file=source)
    if encoding is None:
        if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            encoding = "utf-16"
        elif content[1:200:2].count(0) > 60:
            encoding = "utf-16-le"
        else:
            try:
                return "\n".join(split_lines(content.decode("utf-8-sig")))
            except UnicodeDecodeError:
                encoding = "latin-1"
    try:
        text = content.decode(encoding).lstrip("\ufeff")
    except LookupError:
        raise InputError(f'unknown encoding "{encoding}", such as "utf-8" or "latin-1" is needed', file=source) from None
    except UnicodeDecodeError as error:
        raise InputError(f"byte {error.start} is not {encoding} text", file=source) from None
    if "\x00" in text:
        raise InputError("not a text table (it holds NUL characters)", file=source)
    return "\n".join(split_lines(text))


def split_lines(text: str) -> list[str]:
    """The lines of a text from any system; unlike `str.splitlines`, only at line ends."""
    return re.split(r"\r\n|\n|\r", text)


def _sniff(source: str, lines: Sequence[str], form: TextFormat) -> tuple[str, str]:
    """The separator and decimal mark under which most cells of the last lines read are numbers."""
    sample = lines[:_SNIFFED_LINES]
    best, best_score = (form.separator or ",", form.decimal or "."), 0.0
    for separator in [form.separator] if form.separator else SEPARATORS:
        rows = [split_cells(line, separator) for line in sample]
        for decimal in [form.decimal] if form.decimal else (".", ","):
            if separator == decimal:
                continue
            width = _modal_width(rows, decimal)
            if width < 2 and form.separator is None:
                continue
            fitting = [row for row in rows if filled_width(row) == width]
            numeric = sum(is_number(cell, decimal) for row in fitting for cell in row)
            # each row counts by its share of numbers, so that splitting numbers at their decimal mark gains nothing
            score = numeric / width * len(fitting) / len(rows) if width else 0.0
            if score > best_score * 1.001:
                best, best_score = (separator, decimal), score
    if best_score == 0.0 and form.separator is None:
        for separator in "\t;,":
            _refuse_header_alone(source, lines, separator)
        raise InputError("no columns of numbers found; state separator and decimal if they are unusual", file=source)
    return best


def _refuse_header_alone(source: str, lines: Sequence[str], separator: str) -> None:
    """Raise `InputError` if `lines`, in which no numbers were found, are only a row of names, with or without a row of units."""
    names, *below = (split_cells(line, separator) for line in lines[:3])
    if len(names) > 1 and (not below or (len(below) == 1 and all(is_unit(cell.strip("[]()")) for cell in below[0]))):
        raise InputError("no columns of numbers found: there are no rows below the header", file=source)


def split_cells(line: str, separator: str) -> list[str]:
    """The cells of a line without blanks around them; quoted cells may hold the separator."""
    if separator == " ":
        # a unit in brackets belongs to the name before it
        return re.findall(r"\S+(?:\s+[\[(][^\])]*[\])])?", line)
    if '"' in line:
        with contextlib.suppress(csv.Error):  # a cell larger than any
            return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    return [cell.strip() for cell in line.split(separator)]


def _modal_width(rows: Sequence[Sequence[str]], decimal: str) -> int:
    widths = Counter(filled_width(row) for row in rows if any(is_number(cell, decimal) for cell in row))
    return max(widths, key=lambda width: widths[width]) if widths else 0


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number written with this decimal mark."""
    return _NUMBER[decimal].fullmatch(cell) is not None


def _first_data_row(rows: Sequence[Sequence[str]], width: int, decimal: str) -> int | None:
    for index, row in enumerate(rows):
        numeric = sum(is_number(cell, decimal) for cell in row)
        wide = filled_width(row)
        is_data = 2 * numeric >= width
        if wide != width:  # of columns of different length the first rows are the widest, and a row may end in empty cells
            is_data = is_data and len(row) >= width and numeric == sum(map(bool, row))
        # a row of temperatures is a header
        if width and is_data and not _names_columns(row) and temperatures_in(row) is None:
            return index
    return None


def _names_columns(row: Sequence[str]) -> bool:
    """Whether a row, of numbers for the most part, has a name with a unit in it, such as `time [s]` before temperatures."""
    return any(unit is not None and is_unit(unit) for cell in row for unit in split_header(cell)[1:])


def _header_of(name: str, unit: str | None) -> str:
    return name if unit is None else f"{name} [{unit}]"


def _numbers(table: MeasuredTable, index: int, rows: NDArray[np.bool_] | None) -> NDArray[np.float64]:
    chosen = np.arange(table.lines.size) if rows is None else np.flatnonzero(rows)
    cells = [table.cells[index][row] for row in chosen]
    plain = [cell.replace(",", ".") for cell in cells] if table.decimal == "," else cells
    values = np.array([_number(cell) for cell in plain])
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        first = int(wrong[0])
        what = f'"{cells[first]}" is not a finite number' if cells[first] else "the cell is empty"
        more = f" ({wrong.size} such cells)" if wrong.size > 1 else ""
        raise InputError(f'column "{table.names[index]}": {what}{more}', file=table.source, line=table.lines[chosen[first]])
    return values


def _number(cell: str) -> float:
    try:
        return float(cell.replace("\u2212", "-"))
    except ValueError:
        return math.nan


def _alike(unit: str, other: str, dimension: Dimension) -> bool:
    try:
        return conversion(unit, dimension) == conversion(other, dimension)
    except InputError:
        return _plain(unit) == _plain(other)


def _plain(text: str) -> str:
    return re.sub(r"[\s_]+", " ", text).strip().casefold()
