"""TA Instruments Rheology Advantage: text export of the AR rheometers.

Each step has a line of column names in the short forms of this software (`ang. frequency`, `osc. stress`, `G'`), a line of units,
and its readings.
"""

import re

from dielast.io.cells import is_number, split_lines
from dielast.readings.instruments.export import Export, ExportedStep, plain, separator_of

NAME = "TA Instruments Rheology Advantage"

_SHORT_FORMS = {"ang. frequency", "osc. stress", "osc. torque", "global time", "delta", "% strain"}
_SHORT_FORM = re.compile("|".join(map(re.escape, sorted(_SHORT_FORMS))), re.IGNORECASE)
_ENOUGH = 2  # short forms in one line, by which the format is recognised


def sniff(text: str) -> bool:
    """Whether `text` is such an export."""
    return _SHORT_FORM.search(text) is not None and any(_is_header(line) for line in split_lines(text))


def read(text: str, source: str) -> list[ExportedStep]:
    """The steps of the export; raises `InputError` naming file and line."""
    lines = split_lines(text)
    starts = [place for place, line in enumerate(lines) if _is_header(line)]
    export = Export.of(text, source, separator_of(lines[starts[0]]))
    steps = []
    for number, (start, stop) in enumerate(zip(starts, [*starts[1:], len(lines)], strict=True), start=1):
        below = [row for row in export.rows[start + 1 : stop] if not row.is_blank]
        title = next((row for row in reversed(export.rows[:start]) if not row.is_blank), None)
        name = title.key if title and title.key and not is_number(title.key) else f"step {number}"
        header = export.rows[start], next(iter(below), None)
        steps.append(export.step(name, header, [row for row in below[1:] if is_number(row.key)], deformation="shear"))
    return steps


def _is_header(line: str) -> bool:
    return "." in line and len(_SHORT_FORMS.intersection(plain(cell) for cell in line.split(separator_of(line)))) >= _ENOUGH
