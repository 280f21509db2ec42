"""Workbooks (Excel, OpenDocument) as text: the rows of a sheet as lines, tabs between their cells.

Workbooks are read by python-calamine in a separate process with bounded memory: a workbook of a few kilobytes may claim more
cells than any machine can hold, and the library then ends the process that it runs in.
"""

from __future__ import annotations

import os
import re
import sys
from contextlib import suppress
from functools import lru_cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from dielast.base.errors import InputError, shown

if TYPE_CHECKING:
    from python_calamine import CalamineWorkbook

MAGIC = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
MEMORY = 2 << 30  # bytes, for the process that reads
SECONDS = 100  # more than reading a sheet of MOST cells takes
MOST = 5_000_000  # cells of a sheet
LONGEST_TEXT = 256 << 20  # bytes, the limit of any other file
NEEDED = "pip install 'dielast[excel]'"
_REFUSED = 3  # exit code of the reading process after it has written its reason
_BY_POINT = re.compile(r"[+-]?\d+\.\d+([eE][+-]?\d+)?")
_BY_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")


def is_workbook(content: bytes) -> bool:
    """Whether the bytes of a file begin like those of a workbook; other zipped files do as well."""
    return content.startswith(MAGIC)


@lru_cache(maxsize=1)
def sheet_text(content: bytes, source: str, sheet: str | int | None = None, decimal: str | None = None) -> str:
    """The rows of a `sheet`, by its name or number from 1, by default the first one that is not hidden; with a decimal point.

    Formulas have the values that were saved with them; vertically merged cells all hold the same value. `decimal` is the decimal
    mark of numbers that are stored as text; None means the mark of most of them. Raises `InputError` naming `source` if the
    workbook cannot be read, if it has no such sheet, or if python-calamine is not installed.
    """
    chosen = ("first", "") if sheet is None else ("number" if isinstance(sheet, int) else "name", str(sheet))
    return _served(content, source, (*chosen, decimal or ""))


@lru_cache(maxsize=1)
def sheet_names(content: bytes, source: str) -> list[str]:
    """The names of the sheets that are not hidden; raises `InputError` as `sheet_text` does."""
    return _served(content, source, ("names", "", "")).split("\n")


def _served(content: bytes, source: str, wanted: tuple[str, str, str]) -> str:
    """What the process that reads workbooks answers to `wanted`."""
    if find_spec("python_calamine") is None:
        raise InputError(
            f"reading a workbook needs a package that is not installed: {NEEDED}, or save the sheet as CSV", file=source
        )
    import subprocess  # imported here, as text files do not need it

    # so that both processes import the same modules
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "RUST_BACKTRACE": "0"}
    command = [sys.executable, "-P", "-c", "from dielast.io.workbook import serve; serve()", *wanted]
    try:
        done = subprocess.run(command, input=content, capture_output=True, timeout=SECONDS, env=environment, check=False)
    except subprocess.TimeoutExpired:
        raise InputError(_TOO_LARGE, file=source) from None
    except OSError as error:
        raise InputError(
            f"the process that reads workbooks did not start: {error.strerror}; save the sheet as CSV", file=source
        ) from None
    if done.returncode == _REFUSED:
        raise InputError(done.stdout.decode(errors="replace"), file=source)
    if done.returncode != 0:
        raise InputError(_TOO_LARGE, file=source)
    return done.stdout.decode()


_TOO_LARGE = "the workbook is damaged, or too large when unpacked: save the sheet as CSV"


def serve() -> None:
    """Read a workbook from standard input and write one of its sheets, or the reason why it cannot be read, to standard output."""
    _bound_memory()
    kind, sheet, decimal = sys.argv[1:]
    code = 0
    try:
        content = sys.stdin.buffer.read()
        if kind == "names":
            text = "\n".join(_shown_sheets(_opened(content)))
        else:
            text = _read(content, int(sheet) if kind == "number" else sheet if kind == "name" else None, decimal)
    except InputError as error:
        text, code = str(error), _REFUSED
    except MemoryError:
        text, code = _TOO_LARGE, _REFUSED
    except BaseException as error:  # a damaged file may raise any error, even a panic of Rust
        reason = " ".join(str(error).split()) or type(error).__name__
        text, code = f"the workbook cannot be read: {reason[:200]}", _REFUSED
    encoded = text.encode("utf-8", "replace")
    if len(encoded) > LONGEST_TEXT:
        encoded, code = _TOO_LARGE.encode(), _REFUSED
    sys.stdout.buffer.write(encoded)
    sys.stdout.buffer.flush()
    os._exit(code)


def _bound_memory() -> None:
    """Bound the memory of this process where the system can: Windows has no such limit, macOS one that it may refuse to change."""
    with suppress(ImportError, AttributeError, OSError, ValueError):
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY if hard == resource.RLIM_INFINITY else min(MEMORY, hard), hard))


def _read(content: bytes, sheet: str | int | None, decimal: str) -> str:
    book = _opened(content)
    cells = book.get_sheet_by_name(_sheet_name(book, sheet))
    height, width = (last + 1 for last in cells.end or (-1, -1))
    if height * width > MOST:
        raise InputError(f"a sheet of {height} rows and {width} columns is too large: save it as CSV")
    rows: list[list[Any]] = cells.to_python(skip_empty_area=False)
    for (top, left), (bottom, right) in cells.merged_cell_ranges or ():
        if left == right and left < len(rows[top] if top < len(rows) else ()):
            for row in rows[top + 1 : bottom + 1]:
                row[left] = rows[top][left]
    rows = [row[cells.start[1] :] for row in rows] if cells.start else rows  # empty columns before the first
    texts = [cell for row in rows for cell in row if isinstance(cell, str)]
    commas, points = (sum(map(bool, map(pattern.fullmatch, map(str.strip, texts)))) for pattern in (_BY_COMMA, _BY_POINT))
    by_comma = decimal == "," if decimal else commas > points
    return "\n".join("\t".join(_text(cell, by_comma) for cell in row) for row in rows)


def _opened(content: bytes) -> CalamineWorkbook:
    from io import BytesIO

    from python_calamine import CalamineWorkbook

    return CalamineWorkbook.from_filelike(BytesIO(content))


def _shown_sheets(book: CalamineWorkbook) -> list[str]:
    """The names of the sheets of cells that are not hidden."""
    from python_calamine import SheetTypeEnum, SheetVisibleEnum

    tables = [entry for entry in book.sheets_metadata if entry.typ == SheetTypeEnum.WorkSheet]
    return [" ".join(entry.name.split("\n")) for entry in tables if entry.visible == SheetVisibleEnum.Visible]


def _sheet_name(book: CalamineWorkbook, sheet: str | int | None) -> str:
    from python_calamine import SheetTypeEnum

    names = [entry.name for entry in book.sheets_metadata if entry.typ == SheetTypeEnum.WorkSheet]
    if isinstance(sheet, int) and sheet <= len(names):
        return names[sheet - 1]
    if sheet in names:
        return str(sheet)
    if sheet is not None:
        raise InputError(f"sheet: no {shown(sheet)}; the workbook has {', '.join(map(shown, names)) or 'no sheets'}")
    if not names:
        raise InputError("a workbook without a sheet of cells")
    return next(iter(_shown_sheets(book)), names[0])


def _text(cell: Any, by_comma: bool) -> str:
    """The text of a cell; numbers with all their digits."""
    if isinstance(cell, bool) or not isinstance(cell, int | float | str):
        return str(cell)
    if isinstance(cell, int | float):
        return str(int(cell)) if float(cell).is_integer() and abs(cell) < 1e15 else repr(cell)
    text = " ".join(cell.split())
    if by_comma and _BY_COMMA.fullmatch(text):
        text = text.replace(",", ".")
    return '"' + text.replace('"', '""') + '"' if '"' in text else text
