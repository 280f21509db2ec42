"""Netzsch Gabo Eplexor: text export of its table, with a decimal comma where the computer is set to German.

A header names the instrument. It is followed by a line of names (`f`, `E'`, `E''`, `|E*|`, `tan delta`, `T`) and a line of units.
Cells without a measured value contain `---`.
"""

import re

from dielast.io.cells import split_lines
from dielast.readings.instruments.export import Export, ExportedStep, deformation_of, plain, separator_of

NAME = "Gabo Eplexor"

_MAKER = re.compile(r"\b(eplexor|gabo qualimeter)\b", re.IGNORECASE)
_MODULI = ({"|e*|", "e'", "e''"}, {"|g*|", "g'", "g''"})


def sniff(text: str) -> bool:
    """Whether `text` is such an export: it has the line of names, and the maker above it."""
    if _MAKER.search(text) is None:
        return False
    lines = split_lines(text)
    start = next((place for place, line in enumerate(lines) if _is_header(line)), None)
    return start is not None and _MAKER.search("\n".join(lines[:start])) is not None


def read(text: str, source: str) -> list[ExportedStep]:
    """The table of the export; raises `InputError` naming file and line."""
    export, start = Export.from_header(text, source, _is_header, "an Eplexor export without its line of names")
    names = export.rows[start]
    below = [row for row in export.rows[start + 1 :] if not row.is_blank]
    readings = [row for row in below[1:] if row.has_number]
    return [export.step("table", (names, next(iter(below), None)), readings, deformation=deformation_of(names.cells) or "tension")]


def _is_header(line: str) -> bool:
    cells = {plain(cell) for cell in line.split(separator_of(line))}
    return any(len(moduli & cells) > 1 for moduli in _MODULI)
