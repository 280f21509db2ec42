"""TA Instruments TRIOS: text and CSV exports, and the "Export to LIMS" text.

Both hold a header of sections and a section `[step]` for each step. In the plain export a step's name, the names of its columns and
their units follow in three lines; in the LIMS text each line begins with what it is (`Step name`, `Variables`, `Units`,
`Data point`), and the number of points is stated.
"""

from __future__ import annotations

import re

from dielast.errors import InputError
from dielast.io.text_table import split_lines
from dielast.readings.instruments.names import Deformation, deformation_of
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

NAME = "TA Instruments TRIOS"

_STEP = re.compile(r"^\[step\][\t;, ]*$", re.IGNORECASE | re.MULTILINE)
_HEADER = re.compile(
    r"^(TA Instruments LIMS export|\[(Parameters: )?File Parameters\]|Trios version[\t;,])", re.IGNORECASE | re.MULTILINE
)
_INSTRUMENT = re.compile(r"^Instrument type[\t;,]+(?P<type>[^\t;,\r\n]*)", re.IGNORECASE | re.MULTILINE)
_KINDS: tuple[tuple[str, Deformation], ...] = (("rsa|dma|q800", "tension"), ("ares|hr|ar-?g2|ar ?\\d", "shear"))


def sniff(text: str) -> bool:
    """Whether `text` is such an export."""
    return _STEP.search(text) is not None or _HEADER.search(text) is not None


def read(text: str, source: str) -> list[ExportedStep]:
    """The steps of the export; raises `InputError` naming file and line."""
    lines = split_lines(text)
    starts = [index for index, line in enumerate(lines) if _STEP.match(line)]
    if not starts:
        raise InputError("a TRIOS export without any [step]: the file seems cut off", file=source, line=len(lines))
    rows = numbered(text, separator_of("".join(lines[starts[0] + 1 :][:6])))
    deformation, end = _deformation(text), last_filled(rows)
    return [_step(rows[start:stop], source, end, deformation) for start, stop in zip(starts, [*starts[1:], len(rows)], strict=True)]


def _deformation(text: str) -> Deformation | None:
    instrument = _INSTRUMENT.search(text)
    kind = instrument["type"] if instrument else ""
    return next((deformation for pattern, deformation in _KINDS if re.search(pattern, kind, re.IGNORECASE)), None)


def _step(rows: list[Row], source: str, end: int, deformation: Deformation | None) -> ExportedStep:
    """One step from the line `[step]` on."""
    body = [row for row in rows[1:] if not is_blank(row)]
    if any(row[1][0].casefold() in ("step name", "variables", "data point") for row in body[:4]):
        return _lims_step(body, source, end, deformation)
    # whatever comes after the step is a section of its own
    stop = next((place for place, row in enumerate(body) if row[1][0].startswith("[") and place > 2), len(body))
    if len(body) < 2:
        raise InputError("a [step] without the names of its columns: the file seems cut off", file=source, line=rows[0][0])
    units = body[2] if len(body) > 2 else None
    return build(
        source, body[0][1][0], (body[1], units), body[3:stop], last_line=end, deformation=deformation_of(body[1][1]) or deformation
    )


def _lims_step(body: list[Row], source: str, end: int, deformation: Deformation | None) -> ExportedStep:
    """One step of the LIMS text."""
    keyed = {row[1][0].casefold(): row for row in reversed(body)}
    if "variables" not in keyed:
        raise InputError("a [step] without its line of variables: the file seems cut off", file=source, line=body[0][0])
    points = value(keyed["number of points"]) if "number of points" in keyed else ""
    units = shift_left(keyed["units"]) if "units" in keyed else None
    return build(
        source,
        value(keyed["step name"]) if "step name" in keyed else "",
        (shift_left(keyed["variables"]), units),
        [shift_left(row) for row in body if row[1][0].casefold() == "data point"],
        last_line=end,
        points=stated_points(points),
        deformation=deformation,
    )
