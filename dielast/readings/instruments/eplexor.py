"""Netzsch Gabo Eplexor: text export of its table, in German places with a decimal comma.

A header names the instrument; a line of names (`f`, `E'`, `E''`, `|E*|`, `tan delta`, `T`) and a line of units follow; `---` stands
where nothing was measured.
"""

from __future__ import annotations

import re

from dielast.errors import InputError
from dielast.io.text_table import is_number, split_lines
from dielast.readings.instruments.names import deformation_of, plain
from dielast.readings.instruments.step import ExportedStep, build, is_blank, last_filled, numbered, separator_of

NAME = "Gabo Eplexor"

_MAKER = re.compile(r"\b(eplexor|gabo qualimeter)\b", re.IGNORECASE)
_OWN_NAMES = ({"|e*|", "e'", "e''"}, {"|g*|", "g'", "g''"})


def sniff(text: str) -> bool:
    """Whether `text` is such an export: its line of names, and above it the maker."""
    if _MAKER.search(text) is None:
        return False
    lines = split_lines(text)
    start = _header(lines)
    return start is not None and _MAKER.search("\n".join(lines[:start])) is not None


def read(text: str, source: str) -> list[ExportedStep]:
    """The table of the export; raises `InputError` naming file and line."""
    lines = split_lines(text)
    start = _header(lines)
    if start is None:
        raise InputError("an Eplexor export without its line of names: the file seems cut off", file=source, line=len(lines))
    rows = numbered(text, separator_of(lines[start]))
    below = [row for row in rows[start + 1 :] if not is_blank(row)]
    units = below[0] if below else None
    readings = [row for row in below[1:] if any(is_number(cell, mark) for cell in row[1] for mark in ".,")]
    deformation = deformation_of(rows[start][1]) or "tension"
    return [build(source, "table", (rows[start], units), readings, last_line=last_filled(rows), deformation=deformation)]


def _header(lines: list[str]) -> int | None:
    for place, line in enumerate(lines):
        cells = {plain(cell) for cell in line.split(separator_of(line))}
        if any(len(own & cells) > 1 for own in _OWN_NAMES):
            return place
    return None
