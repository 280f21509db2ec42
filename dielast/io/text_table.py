"""Tables of laboratories: header rows and units, and columns of numbers in SI.

`read_measured` finds the shape of a text table and keeps its cells; `MeasuredTable.column` turns one column into numbers in SI,
naming the line of whatever is not a number. Units come from the header (`name [unit]`, `name (unit)`, `name / unit`), from a row
of units below the names, or from the recipe; they are never guessed.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Self

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, Where, shown, similar
from dielast.base.units import (
    FORCE,
    LARGEST,
    LENGTH,
    NUMBER,
    SMALLEST,
    TEMPERATURE,
    TEMPERATURES,
    TIME,
    Dimension,
    conversion,
    is_ambiguous,
    is_unit,
)
from dielast.io.cells import (
    RECOGNISED,
    SEPARATORS,
    TextFormat,
    decode,
    is_number,
    modal_width,
    refuse_header_alone,
    sniff,
    split_cells,
    split_lines,
)
from dielast.io.header import ColumnHeader, filled_width, read_header, temperatures_in
from dielast.io.table import as_number, split_header
from dielast.io.workbook import is_workbook, sheet_names

_SHEETS = 4  # sheets of a workbook that are named


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredTable:
    """The cells of a table as text: a list of rows for each of `headers`; `lines` holds each row's line in the file (from 1).

    `header_line` is the line of the units in a file with several tables, for messages; else 0. `stated_units` are those of the
    recipe, by role; None if the recipe has no key for them.
    """

    source: str
    headers: tuple[ColumnHeader, ...]
    cells: tuple[list[str], ...]
    lines: NDArray[np.int64]
    decimal: str
    stated_units: Mapping[str, str] | None = None
    header_line: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the columns."""
        return tuple(header.name for header in self.headers)

    @property
    def quoted_names(self) -> str:
        """The names of the columns, for messages."""
        return ", ".join(f'"{name}"' for name in self.names)

    @property
    def units(self) -> tuple[str | None, ...]:
        """The units of the columns, None where none is stated."""
        return tuple(header.unit for header in self.headers)

    def error(self, text: str, row: int | None = None) -> InputError:
        """The error about the table, or about its row with this index."""
        return InputError(text, file=self.source, line=None if row is None else self.lines[row])

    def find(self, column: str | int, role: str) -> int:
        """Index of the column called `column`: its header as the file spells it, `name [unit]`, its name without the unit, or, of a
        ratio, the first part.

        A number counts columns from 1. Raises `InputError` if there is no such column, or several of them.
        """
        if isinstance(column, int):
            if 1 <= column <= len(self.names):
                return column - 1
            raise self.error(f"column {column} is wanted for {role}, but there are {len(self.names)} columns")
        texts = [header.text for header in self.headers]
        spelled = [header.spelled or header.text for header in self.headers]
        unitless = [header.name if header.unit is None else "" for header in self.headers]
        parsed = ColumnHeader(*split_header(column))
        ways: list[tuple[Sequence[str], str]] = [
            *((spelled, column), (texts, parsed.text), (self.names, column), (unitless, parsed.name)),
            ([name.replace(" ", "") for name in self.names], column.replace(" ", "")),
            ([name.partition("/")[0] if "/" in name else "" for name in self.names], column),  # A of A / A0
        ]
        # first with, then without regard to upper and lower case: T and t may be two columns
        for same in (str.strip, _plain):
            for spelling, text in ways:
                matches = [index for index, cell in enumerate(spelling) if cell and same(cell) == same(text)]
                if len(matches) > 1:
                    raise self.error(f'column "{column}" for {role} appears {len(matches)} times')
                if matches:
                    return matches[0]
        # the names as in the file, with the units from the row below them
        there = [cell if split_header(cell)[1] else text for cell, text in zip(spelled, texts, strict=True)]
        near = similar(column, there)
        hint = f'did you mean "{near}"?' if near else "there are " + ", ".join(f'"{header}"' for header in there)
        raise self.error(f'no column "{column}" for {role}; {hint}')

    def has(self, name: str) -> bool:
        """Whether a column is called `name`."""
        return any(_plain(name) == _plain(known) for known in self.names)

    def only(self, rows: NDArray[np.bool_]) -> Self:
        """The table with only those `rows` (mask)."""
        chosen = rows.tolist()
        return replace(self, cells=tuple(list(compress(cells, chosen)) for cells in self.cells), lines=self.lines[rows])

    def rows_where(self, values: Mapping[str, str | float]) -> NDArray[np.bool_]:
        """The rows (rows,) that hold these values in these columns, the same text or the same number; `InputError` if none does."""
        keep = np.ones(self.lines.size, dtype=bool)
        for column, value in values.items():
            index = self.find(column, "where")
            same = [cell == value for cell in self.cells[index]] if isinstance(value, str) else self._numbers(index) == value
            keep &= np.asarray(same, dtype=bool)
        if not keep.any():
            chosen = ", ".join(f"{name} = {value}" for name, value in values.items())
            raise self.error(f"no row has {chosen}" if chosen else "no rows")
        return keep

    def column(
        self, column: str | int, role: str, dimension: Dimension, rows: NDArray[np.bool_] | None = None
    ) -> NDArray[np.float64]:
        """The column in `dimension.unit`, shape (rows,); on request only those `rows` (mask).

        Raises `InputError` naming the line for text, empty cells and NaN, or the column for missing, contradicting and wrong units.
        """
        if rows is not None:
            return self.only(rows).column(column, role, dimension)
        index = self.find(column, role)
        scale, offset = self._conversion(index, column, role, dimension)
        here, cells, numbers = f'column "{self.names[index]}"', self.cells[index], self._numbers(index)
        wrong = np.flatnonzero(~np.isfinite(numbers))
        for row in wrong[:1]:
            what = f'"{cells[row]}" is not a finite number' if cells[row] else "the cell is empty"
            more = f" ({wrong.size} such cells)" if wrong.size > 1 else ""
            raise self.error(f"{here}: {what}{more}{self._hint(index, cells[row])}", row)
        with np.errstate(over="ignore"):
            values = numbers * scale + offset
        # times and what a machine measures have limits of their own
        largest = {TIME: math.inf, LENGTH: math.inf, FORCE: math.inf, TEMPERATURE: TEMPERATURES[1]}.get(dimension, LARGEST)
        for row in np.flatnonzero(~np.isfinite(values) | (np.abs(values) > largest))[:1]:
            raise self.error(f"{here}: the number is too large", row)
        return np.where(np.abs(values) < SMALLEST, 0.0, values)

    def _numbers(self, index: int) -> NDArray[np.float64]:
        """The numbers in a column, NaN for other text: beside decimal commas a point separates thousands, or is a mistake."""
        marks = str.maketrans({",": ".", ".": " "}) if self.decimal == "," else {}
        return np.array([as_number(cell.translate(marks)) for cell in self.cells[index]])

    def _hint(self, index: int, cell: str) -> str:
        """What to do about a cell of a column that is no number."""
        if re.fullmatch(r"\d+:[\d:.,]+", cell):
            return ": write a time as a number, in a unit such as s"
        if re.fullmatch(r"[+-]?[\d.,'\s]+([eE][+-]?\d+)?", cell):
            return f': the decimal mark is "{self.decimal}", and thousands are not separated'
        if cell and _plain(cell) in (_plain(self.headers[index].spelled), _plain(self.names[index])):
            return ": delete the rows that repeat the header"
        return ": write a number, or delete the row"

    def check(self, column: str | int, role: str, dimension: Dimension | None) -> None:
        """Raise `InputError` as `column` does for a missing column or a wrong unit; without a `dimension` for the former alone."""
        index = self.find(column, role)
        if dimension is not None:
            self._conversion(index, column, role, dimension)

    def _conversion(self, index: int, column: str | int, role: str, dimension: Dimension) -> tuple[float, float]:
        name, in_header = self.names[index], self.units[index]
        in_mapping = split_header(column)[1] if isinstance(column, str) and in_header is None else None
        stated = (self.stated_units or {}).get(role, in_mapping)
        here = f'column "{name}"'
        place: Where = {"file": self.source, "line": self.header_line or None}
        # the brackets may hold a part of the name instead of a unit
        if in_header is not None and stated is not None and (is_ambiguous(in_header, dimension) or not is_unit(in_header)):
            in_header = None
        if in_header is not None and stated is not None and not _alike(stated, in_header, dimension):
            raise InputError(
                f"{here}: the unit is [{in_header}] in the header and [{stated}] in the recipe's units; leave the wrong one out",
                **place,
            )
        unit = in_header if in_header is not None else stated
        if unit is None:
            if dimension is NUMBER:
                return 1.0, 0.0
            needed = dimension.unit
            or_else = "" if self.stated_units is None else f' or state units = {{ {role} = "{needed}" }}'
            raise InputError(f'{here} has no unit: call it "{name} [{needed}]"{or_else}', **place)
        try:
            return conversion(unit, dimension)
        except InputError as error:
            raise InputError(f"{here} [{unit}]: {error}", **place) from None


def read_measured(
    content: bytes,
    source: str,
    form: TextFormat = RECOGNISED,
    units: Mapping[str, str] | None = None,
    *,
    with_texts: bool = False,
) -> MeasuredTable:
    """The table in the bytes `content` of the file `source`; `units` are those that the recipe states, by role, None if it has no
    key for them. A table `with_texts` may have more cells of text than of numbers in its rows.

    Raises `InputError` if the text cannot be decoded, or if no table of numbers can be found in it.
    """
    if source.endswith(".toml"):
        raise InputError("a recipe or a material, not a table of measurements: state the file that it names", file=source)
    text = decode(content, source, form)
    if not is_workbook(content):
        return _table(text, source, form, units, with_texts)
    try:
        return _table(text, source, replace(form, separator="\t", decimal="."), units, with_texts)
    except InputError as error:
        if form.sheet is not None:
            raise
        first, *others = sheet_names(content, source)
        if not others:
            raise
        several = " or ".join(f"sheet = {shown(name)}" for name in others[:_SHEETS]) + " or another one" * (len(others) > _SHEETS)
        raise error.adding(f" (this is the first sheet, {shown(first)}; for another one state {several})") from None


def _table(text: str, source: str, form: TextFormat, units: Mapping[str, str] | None, with_texts: bool) -> MeasuredTable:
    numbered = list(enumerate(split_lines(text), start=1))[form.skip_rows :]
    filled = [(number, line) for number, line in numbered if line.strip(" \t;,")]
    if not filled:
        raise InputError("the file is empty" + (f" after skip_rows = {form.skip_rows}" if text.strip() else ""), file=source)
    separator, decimal = sniff(source, [line for _, line in filled], form)
    rows = [split_cells(line, separator) for _, line in filled]
    width = modal_width(rows, decimal)
    first = _first_data_row(rows, width, decimal, with_texts)
    if first is None:
        refuse_header_alone(source, [line for _, line in filled], separator)
        between = SEPARATORS.get(separator, separator)
        raise InputError(f'no row of numbers found (separator {between}, decimal mark "{decimal}")', file=source)
    # a line that begins with # is a comment; above the numbers it may hold names
    kept = [index for index in range(first, len(rows)) if not filled[index][1].lstrip().startswith("#")]
    lines = [filled[index][0] for index in kept]
    data = [rows[index] for index in kept]
    # numbers are aligned by blanks, but the names above them may be separated by tabs
    above = [split_cells(line, "\t" if separator == " " and "\t" in line else separator) for _, line in filled[:first]]
    columns = max(width, min(map(len, data)), filled_width(data[0]))
    aligned = separator == " " and not any("\t" in line for _, line in filled[:first])
    headers = read_header(source, above, columns, max(map(filled_width, data)), aligned)
    columns = len(headers)
    for line, row in zip(lines, data, strict=True):
        if filled_width(row) > columns:
            raise InputError(f"{filled_width(row)} cells, but the table has {columns} columns", file=source, line=line)
        row[columns:] = [""] * (columns - len(row))
    cells = tuple(list(column) for column in zip(*data, strict=True))
    return MeasuredTable(source, headers, cells, np.array(lines), decimal, units)


def _first_data_row(rows: Sequence[Sequence[str]], width: int, decimal: str, with_texts: bool = False) -> int | None:
    for index, row in enumerate(rows):
        numeric = sum(is_number(cell, decimal) for cell in row)
        wide = filled_width(row)
        is_data = 2 * numeric >= width
        if with_texts:
            is_data = index > 0 and numeric > 0
        elif wide != width:  # columns of different length make the first rows the widest, and a row may end in empty cells
            is_data = is_data and len(row) >= width and numeric == sum(map(bool, row))
        # a name with a unit, such as `time [s]` before temperatures, and a row of temperatures belong to the header
        is_header = any(is_unit(unit) for cell in row if (unit := split_header(cell)[1]) is not None)
        if width and is_data and not is_header and temperatures_in(row) is None:
            return index
    return None


def _alike(unit: str, other: str, dimension: Dimension) -> bool:
    try:
        return conversion(unit, dimension) == conversion(other, dimension)
    except InputError:
        return _plain(unit) == _plain(other)


def _plain(text: str) -> str:
    return re.sub(r"[\s_]+", " ", text).strip().casefold()
