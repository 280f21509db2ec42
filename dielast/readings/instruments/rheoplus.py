"""Anton Paar Rheoplus: text export of data series.

`Data Series Information` is followed by lines `Name:` and `Number of Intervals:`. Each interval has `Interval:`, `Number of Data
Points:` and a table that begins with `Meas. Pts.`, with a line of units in brackets below.
"""

import re
from itertools import takewhile

from dielast.io.cells import is_number
from dielast.readings.instruments.export import Export, ExportedStep, Row, deformation_of, stated_points

NAME = "Anton Paar Rheoplus"

# a hand-made table may also have Meas. Pts., but no line of only units in brackets below
sniff = re.compile(r"^\"?(Data Series Information\"?[\t;, ]*$|Meas\. Pts\.[^\n]*\n\"?[\t;, ]+\"?\[)", re.MULTILINE).search
_TABLE = "Meas. Pts."


def read(text: str, source: str) -> list[ExportedStep]:
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
