"""TA Instruments Universal Analysis: text export of the DMA 2980 and Q800.

A header of keys holds `Sig1`, `Sig2` ... with each column's name and unit; readings follow after `StartOfData`. A row that begins
with a negative whole number marks the end of a step of the method.
"""

from __future__ import annotations

import re

from dielast.errors import InputError
from dielast.io.table import split_header
from dielast.readings.instruments.names import Deformation
from dielast.readings.instruments.step import ExportedStep, Row, build, is_blank, last_filled, numbered

NAME = "TA Instruments Universal Analysis"

_MARK = re.compile(r"^(Nsig\t\d+|StartOfData)\s*$", re.MULTILINE)
_METHOD_STEP = re.compile(r"-\d+(\.0*)?")


def sniff(text: str) -> bool:
    """Whether `text` is such an export."""
    return _MARK.search(text) is not None


def read(text: str, source: str) -> list[ExportedStep]:
    """The steps of the export; raises `InputError` naming file and line."""
    rows = numbered(text, "\t")
    signals = [row for row in rows if re.fullmatch(r"Sig\d+", row[1][0])]
    start = next((place for place, row in enumerate(rows) if row[1][0] == "StartOfData"), None)
    if start is None or not signals:
        raise InputError(
            "a Universal Analysis export without its signals or StartOfData: the file seems cut off", file=source, line=rows[-1][0]
        )
    headers = [split_header(row[1][1] if len(row[1]) > 1 else "") for row in signals]
    line = signals[-1][0]
    header = ((line, [name for name, _ in headers]), (line, [unit or "" for _, unit in headers]))
    steps: list[list[Row]] = [[]]
    for row in rows[start + 1 :]:
        if _is_step_end(row[1], headers[0][0]):
            steps.append([])
        elif not is_blank(row):
            steps[-1].append(row)
    filled = [step for step in steps if step] or [[]]
    end = last_filled(rows)
    # these are analysers of tension and bending; a shear sandwich is named in the header
    deformation: Deformation = (
        "shear" if any(re.search(r"\bshear\b", cell, re.IGNORECASE) for row in rows[:start] for cell in row[1]) else "tension"
    )
    return [
        build(source, f"step {number}", header, step, last_line=end, deformation=deformation)
        for number, step in enumerate(filled, start=1)
    ]


def _is_step_end(cells: list[str], first: str) -> bool:
    return first.casefold().startswith("time") and _METHOD_STEP.fullmatch(cells[0]) is not None
