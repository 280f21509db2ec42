"""The text of a laboratory's table as lines and cells: encoding, separator and decimal mark are recognised from the file unless
stated; of a workbook, one sheet is read.
"""

import codecs
import contextlib
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from dielast.base.errors import InputError, shown
from dielast.base.units import is_unit
from dielast.io.header import filled_width
from dielast.io.workbook import is_workbook, sheet_text

_BLANK_CELLS = re.compile(r"\S+(?:\s+[\[(][^\])]{0,100}[\])])?")
SEPARATORS = {"\t": "tab", ";": "semicolon", ",": "comma", " ": "blank"}
# a decimal comma in quotation marks; three digits after it may be thousands
_QUOTED_DECIMAL = re.compile(r'"[+-]?\d+,(\d{1,2}|\d{4,})(?:[eE][+-]?\d+)?"')
_SNIFFED_LINES = 200
_NUMBER = {
    ".": re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+(,\d*)?|,\d+)([eE][+-]?\d+)?"),
    None: re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?"),
}


@dataclass(frozen=True, slots=True)
class TextFormat:
    """How a table is written; None: recognised from the file."""

    separator: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    skip_rows: int = 0
    sheet: str | int | None = None
    """Sheet of a workbook: its name, or its number from 1; None: the first."""


RECOGNISED = TextFormat()


def decode(content: bytes, source: str, form: TextFormat = RECOGNISED) -> str:
    """The text in `content`: in the stated encoding, else UTF-8, UTF-16 if recognised, or latin-1.

    Lines end in a line feed. For a workbook it is the text of a sheet, see `sheet_text`. Raises `InputError` naming `source` for
    content that is not text, an unknown encoding, or a workbook that cannot be read.
    """
    if is_workbook(content):
        return sheet_text(content, source, form.sheet, form.decimal)
    if form.sheet is not None:
        raise InputError(f"sheet = {shown(form.sheet)} is stated, but this is no workbook", file=source)
    encoding = form.encoding
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
    """The lines of a text from any system; unlike `str.splitlines`, without splitting at form feeds and the like."""
    return re.split(r"\r\n|\n|\r", text)


def sniff(source: str, lines: Sequence[str], form: TextFormat) -> tuple[str, str]:
    """The separator and decimal mark under which most cells of the last lines read are numbers."""
    sample = lines[:_SNIFFED_LINES]
    quoted = any(_QUOTED_DECIMAL.search(line) for line in sample)
    best, best_score = (form.separator or ",", form.decimal or "."), 0.0
    for separator in [form.separator] if form.separator else SEPARATORS:
        rows = [split_cells(line, separator) for line in sample]
        for decimal in [form.decimal] if form.decimal else (".", ","):
            if separator == decimal and not quoted:
                continue
            width = modal_width(rows, decimal)
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
            refuse_header_alone(source, lines, separator)
        raise InputError("no columns of numbers found; state separator and decimal if they are unusual", file=source)
    return best


def refuse_header_alone(source: str, lines: Sequence[str], separator: str) -> None:
    """Raise `InputError` if `lines`, in which no numbers were found, are only a row of names, with or without a row of units."""
    names, *below = (split_cells(line, separator) for line in lines[:3])
    if len(names) > 1 and (not below or (len(below) == 1 and all(is_unit(cell.strip("[]()")) for cell in below[0]))):
        raise InputError("no columns of numbers found: there are no rows below the header", file=source)


def split_cells(line: str, separator: str) -> list[str]:
    """The cells of a line without blanks around them; quoted cells may hold the separator."""
    if separator == " ":
        # a unit in brackets belongs to the name before it; without an end to its length, open brackets would take the square of it
        return _BLANK_CELLS.findall(line)
    if '"' in line:
        with contextlib.suppress(csv.Error):  # a cell is larger than csv allows
            return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    return [cell.strip() for cell in line.split(separator)]


def modal_width(rows: Sequence[Sequence[str]], decimal: str) -> int:
    """The number of cells that most rows with a number have."""
    widths = Counter(filled_width(row) for row in rows if any(is_number(cell, decimal) for cell in row))
    return max(widths, key=lambda width: widths[width]) if widths else 0


def is_number(cell: str, decimal: str | None = None) -> bool:
    """Whether a cell is a number written with this decimal mark, or with a point or a comma."""
    return _NUMBER[decimal].fullmatch(cell) is not None
