"""Tables: named columns with units, written as CSV with 9 significant digits."""

import io
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, overload

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.base.units import is_unit

if TYPE_CHECKING:
    import pandas as pd

_FORMULA = re.compile(
    r"[=@+\t\r]|-(?!\d*\.?\d+(?:[eE][+-]?\d+)?(?:\s*(?:1/)?(?!\d)[\w°%][\w°%/*^. ]*)?$)"
)  # but -40 degC is not a formula
BLOCK = 10_000  # rows that are written at a time
LONGEST_HEADER = 300  # characters
_HEADER = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\)|\s/\s(?P<slash>\S+))\s*")
_WORDED = re.compile(r"(?P<name>.*\S)\s+in\s+(?P<unit>\S.*)")
# tan(delta), E(t), G'(omega): the brackets hold the argument of a function, not a unit; and A / A0 is a ratio
_FUNCTION = re.compile(
    r"(?:(?P<first>\w+)\s*/\s*(?P=first)_?[0₀]|\b[Tt][Aa][Nn]\s?\([^()]*\)|(?<!\w)\w['\"]*\((?:[tTfwω]|omega|time)\))$"
)


@dataclass(frozen=True, slots=True, eq=False)
class Stacked:
    """The numbers (n,) of one column of several cases, one below the other, not copied.

    `ends` (cases,) count the rows up to the end of each case.
    """

    cases: Sequence[Mapping[str, NDArray[np.float64]]]
    header: str
    ends: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.ends[-1])

    def __iter__(self) -> Iterator[np.float64]:
        for case in self.cases:
            yield from case[self.header]

    @overload
    def __getitem__(self, rows: int) -> np.float64: ...

    @overload
    def __getitem__(self, rows: slice) -> NDArray[np.float64]: ...

    def __getitem__(self, rows: int | slice) -> np.float64 | NDArray[np.float64]:
        """The number of a row, or those of several rows as an array."""
        if not isinstance(rows, slice):
            row = range(len(self))[rows]  # counted from the end if negative; raises `IndexError` as lists do
            return np.float64(self[row : row + 1][0])
        begin, end, step = rows.indices(len(self))
        if step != 1 or begin >= end:
            return self[:][rows] if len(self) else np.empty(0)
        first, last = np.searchsorted(self.ends, [begin, end - 1], side="right").tolist()
        before = int(self.ends[first - 1]) if first else 0
        parts = [case[self.header] for case in self.cases[first : last + 1]]
        return np.concatenate(parts or [np.empty(0)])[begin - before : end - before]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype)


@dataclass(frozen=True, slots=True, eq=False)
class Repeated:
    """A number for each case, `numbers` (cases,), in all rows of the case; `ends` as in `Stacked`."""

    numbers: NDArray[Any]
    ends: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.ends[-1])

    def __getitem__(self, rows: int | slice) -> Any:
        """The number of a row, or those of several rows as an array."""
        return self.numbers[np.searchsorted(self.ends, range(len(self))[rows], side="right")]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.asarray(self[:], dtype)


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """A column: `name`, `unit` (None for text and counts), and `values` (n,) of numbers or text.

    A number that is not finite becomes an empty cell of a file.
    """

    name: str
    unit: str | None
    values: NDArray[np.float64] | NDArray[np.int64] | Sequence[str] | Stacked | Repeated

    @property
    def header(self) -> str:
        """The header cell, `name [unit]`."""
        return self.name if self.unit is None else f"{self.name} [{self.unit}]"


Table = Sequence[Column]
Frame: TypeAlias = "pd.DataFrame"


def split_header(header: str) -> tuple[str, str | None]:
    """(name, unit) of a header cell written `name [unit]`, `name (unit)`, `name / unit`, or `name in unit` if dielast knows the
    unit; the unit is None if none is stated.

    Arguments and first values are no units: tan(delta), E(t) and A / A0 are names.
    """
    if len(header) <= LONGEST_HEADER and _FUNCTION.search(header.strip()):
        return header.strip(), None
    # a longer text is not a header, and would take the pattern very long
    match = _HEADER.fullmatch(header.strip()) if len(header) <= LONGEST_HEADER else None
    if match is None or not match["name"]:
        worded = _WORDED.fullmatch(header.strip()) if len(header) <= LONGEST_HEADER else None
        if worded is not None and is_unit(worded["unit"]):
            return worded["name"], worded["unit"]
        return header.strip(), None
    return match["name"], next(unit for unit in (match["square"], match["round"], match["slash"]) if unit is not None).strip()


def as_number(cell: str) -> float:
    """The number in a cell, also with the minus sign of typography; NaN for other text."""
    try:
        return float(cell.replace("\u2212", "-"))
    except ValueError:
        return math.nan


def rounded(value: Any) -> Any:
    """Numbers to 9 significant digits, as in the tables; also those in a list."""
    if isinstance(value, float):
        return float(f"{value:.9g}")
    return [rounded(entry) for entry in value] if isinstance(value, list | tuple) else value


def spoken(name: str) -> str:
    """The name of a column in messages and on axes: words instead of underscores."""
    return name.replace("_", " ")


def plural(name: str) -> str:
    """The plural of `spoken`."""
    text = spoken(name)
    if text.endswith("modulus"):
        return text[:-2] + "i"
    return text[:-1] + "ies" if text.endswith("y") else text + "s"


def case_table(cases: Mapping[int, Mapping[str, NDArray[np.float64]]], temperature: Sequence[float] | None = None) -> Table:
    """The table of several cases by number, one below the other; each has its columns (rows,) by header, after its number and, if
    stated, its `temperature` in degC.
    """
    table = stacked_table(cases, tuple(next(iter(cases.values()))), temperature)
    return [replace(column, values=np.asarray(column.values)) for column in table]


def stacked_table(
    cases: Mapping[int, Mapping[str, NDArray[np.float64]]], headers: Sequence[str], temperature: Sequence[float] | None = None
) -> Table:
    """The table as by `case_table`, of these columns alone, whose numbers are not copied."""
    below = list(cases.values())
    ends = np.cumsum([case[headers[0]].size for case in below])
    columns = [Column("case", None, Repeated(np.array(list(cases)), ends))]
    if temperature is not None:
        columns.append(Column("temperature", "degC", Repeated(np.asarray(temperature, dtype=float), ends)))
    for header in headers:
        name, _, unit = header.rstrip("]").partition(" [")
        columns.append(Column(name, unit or None, Stacked(below, header, ends)))
    return columns


def joined(tables: Sequence[Table]) -> Table:
    """Tables with the same columns, one below the other."""
    values = [[part.values for part in parts] for parts in zip(*tables, strict=True)]
    whole = [np.concatenate(part) if isinstance(part[0], np.ndarray) else [cell for row in part for cell in row] for part in values]
    return [Column(column.name, column.unit, cells) for column, cells in zip(tables[0], whole, strict=True)]


def to_frame(table: Table) -> Frame:
    """The table as a pandas data frame, for a notebook; columns are called as in the CSV."""
    import pandas as pd

    whole = {
        column.header: np.asarray(column.values) if isinstance(column.values, Stacked | Repeated) else column.values
        for column in table
    }
    return pd.DataFrame(whole)


def to_csv(table: Table) -> bytes:
    """The table as CSV: UTF-8, LF, comma, 9 significant digits. Raises `ValueError` if columns differ in length."""
    text = io.BytesIO()  # which gives its bytes without a copy
    text.writelines(csv_blocks(table))
    return text.getvalue()


def csv_blocks(table: Table) -> Iterator[bytes]:
    """The table as by `to_csv` in pieces, because cells take ten times the memory of their text."""
    rows = {len(column.values) for column in table}
    if len(rows) > 1:
        raise ValueError("columns of one table differ in length")
    yield ",".join(_quoted(column.header) for column in table).encode() + b"\n"
    for first in range(0, max(rows, default=0), BLOCK):
        cells = [_cells(column.values[first : first + BLOCK]) for column in table]
        yield "\n".join(map(",".join, zip(*cells, strict=True))).encode() + b"\n"


def _cells(values: NDArray[np.float64] | NDArray[np.int64] | Sequence[str]) -> list[str]:
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        # adding zero turns -0 into 0; NaN and infinity become empty cells
        return ["" if text in ("nan", "inf", "-inf") else text for text in map("%.9g".__mod__, (values + 0.0).tolist())]
    if isinstance(values, np.ndarray):
        return [str(value) for value in values.tolist()]
    # a spreadsheet would take text such as =1+1 for a formula
    return [_quoted(f"'{value}" if _FORMULA.match(value) else value) for value in values]


def _quoted(text: str) -> str:
    if any(mark in text for mark in ',"\n\r'):
        return '"' + text.replace('"', '""') + '"'
    return text


def parse_csv(content: bytes, name: str) -> dict[str, list[str]]:
    """The cells of a CSV that dielast wrote, by header; raises `InputError` if it is not such a table."""
    import csv

    try:
        rows = list(csv.reader(io.StringIO(content.decode()), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"not a table that dielast wrote: {error}", file=name) from None
    if not rows or any(len(row) != len(rows[0]) for row in rows):
        raise InputError("not a table that dielast wrote: rows differ in length", file=name)
    return {header: [row[index] for row in rows[1:]] for index, header in enumerate(rows[0])}


def number_columns(content: bytes, name: str, headers: Sequence[str]) -> list[NDArray[np.float64]]:
    """The number columns `headers` of a CSV that dielast wrote; an empty cell is NaN. Raises `InputError` naming column and row."""
    cells = parse_csv(content, name)
    columns = []
    for header in headers:
        if header not in cells:
            raise InputError(f'column "{header}" is missing', file=name)
        values = np.empty(len(cells[header]))
        for row, text in enumerate(cells[header]):
            try:
                values[row] = float(text) if text else np.nan
            except ValueError:
                raise InputError(f'column "{header}": "{text}" is not a number', file=name, row=row + 2) from None
        columns.append(values)
    return columns


def finite_columns(content: bytes, name: str, headers: Sequence[str], positive: bool = False) -> NDArray[np.float64]:
    """The columns `headers` (k, n) of a table; raises `InputError` naming row and column of a cell that is not a finite number or,
    with `positive`, not above 0.
    """
    columns = np.array(number_columns(content, name, headers))
    wrong = ~np.isfinite(columns) | ((columns <= 0) & positive)
    for row, column in np.argwhere(wrong.T)[:1]:
        needed = "a positive number" if positive else "a number"
        raise InputError(f'column "{headers[column]}": {needed} is needed', file=name, row=row + 2)
    return columns
