"""Anton Paar Rheoplus: text export of data series.

After `Data Series Information` come lines `Name:`, `Number of Intervals:`; each interval has `Interval:`, `Number of Data Points:`
and a table that begins with `Meas. Pts.`, a line of units in brackets below.
"""

from __future__ import annotations

import re

from dielast.errors import InputError
from dielast.io.text_table import is_number, split_lines
from dielast.readings.instruments.names import deformation_of
from dielast.readings.instruments.step import ExportedStep, build, last_filled, numbered, separator_of, stated_points, value

NAME = "Anton Paar Rheoplus"

# a table of one's own may count its Meas. Pts. as well, but has no line of bare units in brackets below them
_MARK = re.compile(r"^\"?(Data Series Information\"?[\t;, ]*$|Meas\. Pts\.[^\n]*\n\"?[\t;, ]+\"?\[)", re.MULTILINE)
_TABLE = "Meas. Pts."


def sniff(text: str) -> bool:
    """Whether `text` is such an export."""
    return _MARK.search(text) is not None


def read(text: str, source: str) -> list[ExportedStep]:
    """The intervals of the export; raises `InputError` naming file and line."""
    lines = split_lines(text)
    first = next((line for line in lines if line.strip('"').startswith(_TABLE)), None)
    if first is None:
        raise InputError(f'a Rheoplus export without any "{_TABLE}": the file seems cut off', file=source, line=len(lines))
    rows = numbered(text, separator_of(first))
    end = last_filled(rows)
    segments = []
    series, number, points = "", "", None
    for place, row in enumerate(rows):
        match row[1][0]:
            case "Name:":
                series = value(row)
            case "Interval:":
                number = value(row)
            case "Number of Data Points:":
                points = stated_points(value(row))
            case key if key == _TABLE:
                below = rows[place + 1 :]
                units = below[0] if below else None
                stop = next((k for k, own in enumerate(below[1:], start=1) if not _is_reading(own[1])), len(below))
                name = " ".join(part for part in (series, number and f"interval {number}") if part)
                deformation = deformation_of(row[1]) or "shear"
                header = (row, units if units and not _is_reading(units[1]) else None)
                segments.append(build(source, name, header, below[1:stop], last_line=end, points=points, deformation=deformation))
                points = None
    return segments


def _is_reading(cells: list[str]) -> bool:
    return is_number(cells[0], ".")
