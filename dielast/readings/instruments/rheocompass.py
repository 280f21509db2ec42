"""Anton Paar RheoCompass: CSV and text exports, often UTF-16.

Each interval begins with `Interval and data points:` (its number, and the number of points) and `Interval data:` followed by the
names of the columns; below are a line of qualifiers, mostly empty, and a line of units in brackets. Lines of readings begin with an
empty cell.
"""

import re

from dielast.readings.instruments.export import Export, ExportedStep, Row, deformation_of, stated_points

NAME = "Anton Paar RheoCompass"

_START = re.compile(r"^\"?(Interval data|Intervalldaten):", re.MULTILINE)
sniff = re.compile(r"^\"?(Interval and data points|Interval data|Intervalldaten):\"?[\t;,]", re.MULTILINE).search


def read(text: str, source: str) -> list[ExportedStep]:
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
