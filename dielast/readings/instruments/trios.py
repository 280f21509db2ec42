"""TA Instruments TRIOS: text and CSV exports, and the "Export to LIMS" text.

Both have a header of sections, and a section `[step]` for each step. In the plain export, the name of a step, the names of its
columns and their units follow in three lines. In the LIMS text, each line begins with its kind (`Step name`, `Variables`, `Units`,
`Data point`), and the number of points is stated.
"""

import re

from dielast.io.cells import split_lines
from dielast.readings.instruments.export import (
    Deformation,
    Export,
    ExportedStep,
    Row,
    cut_off,
    deformation_of,
    separator_of,
    stated_points,
)

NAME = "TA Instruments TRIOS"

_STEP = re.compile(r"^\[step\][\t;, ]*$", re.IGNORECASE | re.MULTILINE)
sniff = re.compile(
    r"^(\[step\][\t;, ]*$|TA Instruments LIMS export|\[(Parameters: )?File Parameters\]|Trios version[\t;,])",
    re.IGNORECASE | re.MULTILINE,
).search
_INSTRUMENT = re.compile(r"^Instrument type[\t;,]+(?P<type>[^\t;,\r\n]*)", re.IGNORECASE | re.MULTILINE)
_KINDS: tuple[tuple[str, Deformation], ...] = (("rsa|dma|q800", "tension"), ("ares|hr|ar-?g2|ar ?\\d", "shear"))


def read(text: str, source: str) -> list[ExportedStep]:
    """The steps of the export; raises `InputError` naming file and line."""
    lines = split_lines(text)
    starts = [index for index, line in enumerate(lines) if _STEP.match(line)]
    if not starts:
        raise cut_off("a TRIOS export without any [step]", source, len(lines))
    export = Export.of(text, source, separator_of("".join(lines[starts[0] + 1 :][:6])))
    ends, deformation = [*starts[1:], len(lines)], _deformation(text)
    return [_step(export, export.rows[start:end], deformation) for start, end in zip(starts, ends, strict=True)]


def _deformation(text: str) -> Deformation | None:
    instrument = _INSTRUMENT.search(text)
    kind = instrument["type"] if instrument else ""
    return next((deformation for pattern, deformation in _KINDS if re.search(pattern, kind, re.IGNORECASE)), None)


def _step(export: Export, rows: list[Row], deformation: Deformation | None) -> ExportedStep:
    """One step, from the line `[step]` on."""
    body = [row for row in rows[1:] if not row.is_blank]
    if any(row.key.casefold() in ("step name", "variables", "data point") for row in body[:4]):
        return _lims_step(export, body, deformation)
    # a step is followed by sections of other kinds
    stop = next((place for place, row in enumerate(body) if row.key.startswith("[") and place > 2), len(body))
    if len(body) < 2:
        raise cut_off("a [step] without the names of its columns", export.source, rows[0].line)
    name, names, *units = body[:3]
    deformation = deformation_of(names.cells) or deformation
    return export.step(name.key, (names, units[0] if units else None), body[3:stop], deformation=deformation)


def _lims_step(export: Export, body: list[Row], deformation: Deformation | None) -> ExportedStep:
    """One step of the LIMS text."""
    keyed = {row.key.casefold(): row for row in reversed(body)}
    if "variables" not in keyed:
        raise cut_off("a [step] without its line of variables", export.source, body[0].line)
    name, points = (keyed[key].value if key in keyed else "" for key in ("step name", "number of points"))
    units = keyed["units"].without_key() if "units" in keyed else None
    readings = [row.without_key() for row in body if row.key.casefold() == "data point"]
    header = keyed["variables"].without_key(), units
    return export.step(name, header, readings, points=stated_points(points), deformation=deformation)
