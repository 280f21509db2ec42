"""TA Instruments Universal Analysis: text export of the DMA 2980 and Q800.

Keys `Sig1`, `Sig2` ... in the header have the name and unit of each column; readings follow after `StartOfData`. A row that begins
with a negative integer marks the end of a step of the method.
"""

import re

from dielast.io.table import split_header
from dielast.readings.instruments.export import Deformation, Export, ExportedStep, Row, cut_off

NAME = "TA Instruments Universal Analysis"

sniff = re.compile(r"^(Nsig\t\d+|StartOfData)\s*$", re.MULTILINE).search
_STEP_END = re.compile(r"-\d+(\.0*)?")


def read(text: str, source: str) -> list[ExportedStep]:
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
