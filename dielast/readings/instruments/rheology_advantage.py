"""TA Instruments Rheology Advantage: text export of the AR rheometers.

For each step a line of column names in its own short forms (`ang. frequency`, `osc. stress`, `G'`), a line of units, readings.
"""

from __future__ import annotations

import re

from dielast.io.text_table import is_number, split_lines
from dielast.readings.instruments.names import plain
from dielast.readings.instruments.step import ExportedStep, Row, build, is_blank, last_filled, numbered, separator_of

NAME = "TA Instruments Rheology Advantage"

_OWN_NAMES = {"ang. frequency", "osc. stress", "osc. torque", "global time", "delta", "% strain"}
_OWN = re.compile("|".join(map(re.escape, sorted(_OWN_NAMES))), re.IGNORECASE)
_ENOUGH = 2  # of its own names in one line


def sniff(text: str) -> bool:
    """Whether `text` is such an export."""
    return _OWN.search(text) is not None and any(_is_header(line) for line in split_lines(text))


def read(text: str, source: str) -> list[ExportedStep]:
    """The steps of the export; raises `InputError` naming file and line."""
    lines = split_lines(text)
    starts = [place for place, line in enumerate(lines) if _is_header(line)]
    rows = numbered(text, separator_of(lines[starts[0]]))
    end = last_filled(rows)
    segments = []
    for number, (start, stop) in enumerate(zip(starts, [*starts[1:], len(rows)], strict=True), start=1):
        below = [row for row in rows[start + 1 : stop] if not is_blank(row)]
        units = below[0] if below else None
        title = next((row[1][0] for row in reversed(rows[:start]) if not is_blank(row)), "")
        name = title if title and not _is_reading((0, [title])) else f"step {number}"
        readings = [row for row in below[1:] if _is_reading(row)]
        segments.append(build(source, name, (rows[start], units), readings, last_line=end, deformation="shear"))
    return segments


def _is_header(line: str) -> bool:
    return "." in line and len(_OWN_NAMES.intersection(plain(cell) for cell in line.split(separator_of(line)))) >= _ENOUGH


def _is_reading(row: Row) -> bool:
    return is_number(row[1][0], ".") or is_number(row[1][0], ",")
