"""Anton Paar RheoCompass: CSV and text exports, often UTF-16.

Each interval begins with `Interval and data points:` (its number, how many points) and `Interval data:` followed by the columns'
names; below stand a line of qualifiers, mostly empty, and a line of units in brackets. Lines of readings begin with an empty cell.
"""

from __future__ import annotations

import re

from dielast.errors import InputError
from dielast.io.text_table import is_number, split_lines
from dielast.readings.instruments.names import deformation_of
from dielast.readings.instruments.step import (
    ExportedStep,
    Row,
    build,
    is_blank,
    last_filled,
    numbered,
    separator_of,
    shift_left,
    stated_points,
    value,
)

NAME = "Anton Paar RheoCompass"

_START = re.compile(r"^\"?(Interval data|Intervalldaten):", re.MULTILINE)
_MARK = re.compile(r"^\"?(Interval and data points|Interval data|Intervalldaten):\"?[\t;,]", re.MULTILINE)


def sniff(text: str) -> bool:
    """Whether `text` is such an export."""
    return _MARK.search(text) is not None


def read(text: str, source: str) -> list[ExportedStep]:
    """The intervals of the export; raises `InputError` naming file and line."""
    lines = split_lines(text)
    first = next((line for line in lines if _START.match(line)), None)
    if first is None:
        raise InputError('a RheoCompass export without any "Interval data:": the file seems cut off', file=source, line=len(lines))
    rows = numbered(text, separator_of(first))
    end = last_filled(rows)
    segments: list[ExportedStep] = []
    result, number, points = "", "", None
    for place, row in enumerate(rows):
        key = row[1][0]
        if key.startswith(("Result:", "Ergebnis:")):
            result = value(row)
        elif key.startswith("Interval and data points:"):
            filled = [cell for cell in row[1][1:] if cell]
            number = filled[0] if filled else ""
            points = stated_points(filled[1]) if len(filled) > 1 else None
        elif _START.match(key):
            name = " ".join(part for part in (result, number and f"interval {number}") if part)
            segments.append(_interval(rows[place:], source, name or f"interval {len(segments) + 1}", end, points))
            points = None
    return segments


def _interval(rows: list[Row], source: str, name: str, end: int, points: int | None) -> ExportedStep:
    """The interval whose line of names is the first of `rows`."""
    body: list[Row] = []
    units: Row | None = None
    for row in rows[1:]:
        if row[1][0]:
            break
        if units is None and any(cell.startswith("[") for cell in row[1]):
            units = shift_left(row)
        elif any(is_number(cell, mark) for cell in row[1] for mark in ".,"):
            body.append(shift_left(row))
            if units is None:
                break
        elif is_blank(row) and body:
            break
    deformation = deformation_of(rows[0][1]) or "shear"
    return build(source, name, (shift_left(rows[0]), units), body, last_line=end, points=points, deformation=deformation)
