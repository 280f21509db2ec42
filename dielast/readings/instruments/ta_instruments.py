"""Exports of TA Instruments' software: TRIOS, Universal Analysis and Rheology Advantage."""

import re

from dielast.io.cells import is_number, split_lines
from dielast.io.table import split_header
from dielast.readings.instruments.export import (
    Deformation,
    Export,
    ExportedStep,
    Layout,
    Row,
    cut_off,
    deformation_of,
    plain,
    separator_of,
    stated_points,
)

_STEP = re.compile(r"^\[step\][\t;, ]*$", re.IGNORECASE | re.MULTILINE)
_sniff_trios = re.compile(
    r"^(\[step\][\t;, ]*$|TA Instruments LIMS export|\[(Parameters: )?File Parameters\]|Trios version[\t;,])",
    re.IGNORECASE | re.MULTILINE,
).search
_INSTRUMENT = re.compile(r"^Instrument type[\t;,]+(?P<type>[^\t;,\r\n]*)", re.IGNORECASE | re.MULTILINE)
_KINDS: tuple[tuple[str, Deformation], ...] = (("rsa|dma|q800", "tension"), ("ares|hr|ar-?g2|ar ?\\d", "shear"))


def _read_trios(text: str, source: str) -> list[ExportedStep]:
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


TRIOS = Layout("TA Instruments TRIOS", _sniff_trios, _read_trios)
"""TA Instruments TRIOS: text and CSV exports, and the "Export to LIMS" text.

Both have a header of sections, and a section `[step]` for each step. In the plain export, the name of a step, the names of its
columns and their units follow in three lines. In the LIMS text, each line begins with its kind (`Step name`, `Variables`, `Units`,
`Data point`), and the number of points is stated.
"""


_sniff_universal_analysis = re.compile(r"^(Nsig\t\d+|StartOfData)\s*$", re.MULTILINE).search
_STEP_END = re.compile(r"-\d+(\.0*)?")


def _read_universal_analysis(text: str, source: str) -> list[ExportedStep]:
    """The steps of the export; raises `InputError` naming file and line."""
    export = Export.of(text, source, "\t")
    rows = export.rows
    signals = [row for row in rows if re.fullmatch(r"Sig\d+", row.key)]
    start = next((place for place, row in enumerate(rows) if row.key == "StartOfData"), None)
    if start is None or not signals:
        raise cut_off("a Universal Analysis export without its signals or StartOfData", source, rows[-1].line)
    names, units = zip(*(split_header(row.cells[1] if len(row.cells) > 1 else "") for row in signals), strict=True)
    line = signals[-1].line
    header = Row(line, list(names)), Row(line, [unit or "" for unit in units])
    over_time = names[0].casefold().startswith("time")
    steps: list[list[Row]] = [[]]
    for row in rows[start + 1 :]:
        if over_time and _STEP_END.fullmatch(row.key):
            steps.append([])
        elif not row.is_blank:
            steps[-1].append(row)
    filled = [step for step in steps if step] or [[]]
    # these instruments measure tension and bending; a shear sandwich is named in the header
    sheared = any(re.search(r"\bshear\b", cell, re.IGNORECASE) for row in rows[:start] for cell in row.cells)
    deformation: Deformation = "shear" if sheared else "tension"
    return [export.step(f"step {number}", header, step, deformation=deformation) for number, step in enumerate(filled, start=1)]


UNIVERSAL_ANALYSIS = Layout("TA Instruments Universal Analysis", _sniff_universal_analysis, _read_universal_analysis)
"""TA Instruments Universal Analysis: text export of the DMA 2980 and Q800.

Keys `Sig1`, `Sig2` ... in the header have the name and unit of each column; readings follow after `StartOfData`. A row that begins
with a negative integer marks the end of a step of the method.
"""


_SHORT_FORMS = {"ang. frequency", "osc. stress", "osc. torque", "global time", "delta", "% strain"}
_SHORT_FORM = re.compile("|".join(map(re.escape, sorted(_SHORT_FORMS))), re.IGNORECASE)
_ENOUGH = 2  # short forms in one line, by which the format is recognised


def _sniff_rheology_advantage(text: str) -> bool:
    """Whether `text` is such an export."""
    return _SHORT_FORM.search(text) is not None and any(_is_header(line) for line in split_lines(text))


def _read_rheology_advantage(text: str, source: str) -> list[ExportedStep]:
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


RHEOLOGY_ADVANTAGE = Layout("TA Instruments Rheology Advantage", _sniff_rheology_advantage, _read_rheology_advantage)
"""TA Instruments Rheology Advantage: text export of the AR rheometers.

Each step has a line of column names in the short forms of this software (`ang. frequency`, `osc. stress`, `G'`), a line of units,
and its readings.
"""
