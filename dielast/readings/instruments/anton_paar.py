"""Exports of Anton Paar's software: RheoCompass and Rheoplus."""

import re
from itertools import takewhile

from dielast.io.cells import is_number
from dielast.readings.instruments.export import Export, ExportedStep, Layout, Row, deformation_of, stated_points

_START = re.compile(r"^\"?(Interval data|Intervalldaten):", re.MULTILINE)
_sniff_rheocompass = re.compile(r"^\"?(Interval and data points|Interval data|Intervalldaten):\"?[\t;,]", re.MULTILINE).search


def _read_rheocompass(text: str, source: str) -> list[ExportedStep]:
    """The intervals of the export; raises `InputError` naming file and line."""
    export, _ = Export.from_header(text, source, _START.match, 'a RheoCompass export without any "Interval data:"')
    steps: list[ExportedStep] = []
    result, number, points = "", "", None
    for place, row in enumerate(export.rows):
        if row.key.startswith(("Result:", "Ergebnis:")):
            result = row.value
        elif row.key.startswith("Interval and data points:"):
            number, count = (*row.values, "", "")[:2]
            points = stated_points(count)
        elif _START.match(row.key):
            name = " ".join(part for part in (result, number and f"interval {number}") if part)
            steps.append(_interval(export, place, name or f"interval {len(steps) + 1}", points))
            points = None
    return steps


def _interval(export: Export, start: int, name: str, points: int | None) -> ExportedStep:
    """The interval whose line of names is row `start`."""
    names, readings = export.rows[start], list[Row]()
    units: Row | None = None
    for row in export.rows[start + 1 :]:
        if row.key:
            break
        if units is None and any(cell.startswith("[") for cell in row.cells):
            units = row.without_key()
        elif row.has_number:
            readings.append(row.without_key())
            if units is None:
                break
        elif row.is_blank and readings:
            break
    deformation = deformation_of(names.cells) or "shear"
    return export.step(name, (names.without_key(), units), readings, points=points, deformation=deformation)


RHEOCOMPASS = Layout("Anton Paar RheoCompass", _sniff_rheocompass, _read_rheocompass)
"""Anton Paar RheoCompass: CSV and text exports, often UTF-16.

Each interval begins with `Interval and data points:` (its number, and the number of points) and `Interval data:` followed by the
names of the columns; below are a line of qualifiers, mostly empty, and a line of units in brackets. Lines of readings begin with an
empty cell.
"""


# a hand-made table may also have Meas. Pts., but no line of only units in brackets below
_sniff_rheoplus = re.compile(r"^\"?(Data Series Information\"?[\t;, ]*$|Meas\. Pts\.[^\n]*\n\"?[\t;, ]+\"?\[)", re.MULTILINE).search
_TABLE = "Meas. Pts."


def _read_rheoplus(text: str, source: str) -> list[ExportedStep]:
    """The intervals of the export; raises `InputError` naming file and line."""
    missing = f'a Rheoplus export without any "{_TABLE}"'
    export, _ = Export.from_header(text, source, lambda line: line.strip('"').startswith(_TABLE), missing)
    steps = []
    series, number, points = "", "", None
    for place, row in enumerate(export.rows):
        match row.key:
            case "Name:":
                series = row.value
            case "Interval:":
                number = row.value
            case "Number of Data Points:":
                points = stated_points(row.value)
            case key if key == _TABLE:
                units = next(iter(export.rows[place + 1 :]), None)
                readings = list(takewhile(_is_reading, export.rows[place + 2 :]))
                name = " ".join(part for part in (series, number and f"interval {number}") if part)
                deformation = deformation_of(row.cells) or "shear"
                header = (row, units if units and not _is_reading(units) else None)
                steps.append(export.step(name, header, readings, points=points, deformation=deformation))
                points = None
    return steps


def _is_reading(row: Row) -> bool:
    return is_number(row.key, ".")


RHEOPLUS = Layout("Anton Paar Rheoplus", _sniff_rheoplus, _read_rheoplus)
"""Anton Paar Rheoplus: text export of data series.

`Data Series Information` is followed by lines `Name:` and `Number of Intervals:`. Each interval has `Interval:`, `Number of Data
Points:` and a table that begins with `Meas. Pts.`, with a line of units in brackets below.
"""
