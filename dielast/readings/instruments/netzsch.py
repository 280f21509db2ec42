"""Exports of Netzsch's software: Proteus, and that of the Gabo Eplexor."""

import re
from collections.abc import Mapping

from dielast.base.errors import InputError
from dielast.io.cells import split_lines
from dielast.readings.instruments.export import (
    Export,
    ExportedStep,
    Layout,
    Row,
    cut_off,
    decimal_mark,
    deformation_of,
    plain,
    separator_of,
)

_sniff_proteus = re.compile(r"^(#FORMAT:\W*NETZSCH|##Temp\./)", re.MULTILINE).search
_KEY = re.compile(r"^#(?P<key>[^#:][^:]*):[\t;, ]*(?P<value>.*?)[\t;, ]*$", re.MULTILINE)
_SEPARATORS = {"SEMICOLON": ";", "COMMA": ",", "TAB": "\t"}
_DECIMALS = {"COMMA": ",", "POINT": "."}
_AT = re.compile(r"(?P<name>.*?)\s*\(\s*(?P<frequency>\d+(?:[.,]\d+)?)\s*Hz\s*\)")
_FREQUENCY = "Frequency"


def _read_proteus(text: str, source: str) -> list[ExportedStep]:
    """The table of the export as its only step; raises `InputError` naming file and line."""
    keys = {match["key"].strip(): match["value"] for match in _KEY.finditer(text)}
    missing = 'a Proteus export without its line of names, "##..."'
    separator = _named(_SEPARATORS, keys, "SEPARATOR")
    export, start = Export.from_header(text, source, lambda line: line.startswith("##"), missing, separator)
    line, cells = export.rows[start]
    names, units = (Row(line, list(column)) for column in zip(*map(_split, cells), strict=True))
    readings = [row for row in export.rows[start + 1 :] if not row.is_blank and not row.key.startswith("#")]
    name = keys.get("IDENTITY", "") or "measurement"
    if not readings:
        raise cut_off("nothing follows the line of names", source, line)
    export.check_widths(name, len(cells), readings)
    decimal = _named(_DECIMALS, keys, "DECIMAL") or decimal_mark(readings)
    names, units, readings = _one_row_a_frequency(names, units, readings, source, decimal)
    return [export.step(name, (names, units), readings, decimal=decimal, deformation=deformation_of(names.cells))]


def _named(words: Mapping[str, str], keys: Mapping[str, str], key: str) -> str | None:
    return words.get(re.split(r"[\t;, ]", keys.get(key, ""))[0].upper())


def _split(cell: str) -> tuple[str, str]:
    """Name and unit of a header cell `name/unit`; a slash within brackets belongs to the unit."""
    text = cell.lstrip("#").strip()
    match = re.fullmatch(r"(?P<name>[^/]*)/(?:\((?P<bracketed>.*)\)|(?P<unit>.*))", text)
    return (match["name"].strip(), (match["bracketed"] or match["unit"] or "").strip()) if match else (text, "")


def _one_row_a_frequency(names: Row, units: Row, readings: list[Row], source: str, decimal: str) -> tuple[Row, Row, list[Row]]:
    """Names, units and readings, with columns of several frequencies, such as `E'(1.000 Hz)`, concatenated, and the frequency in a
    separate column.
    """
    common: list[int] = []
    at_frequency: dict[str, dict[int, str]] = {}  # the columns of each frequency, with their names
    for k, name in enumerate(names.cells):
        if match := _AT.fullmatch(name):
            at_frequency.setdefault(match["frequency"], {})[k] = match["name"]
        else:
            common.append(k)
    if not at_frequency:
        return names, units, readings
    first, *others = at_frequency.values()
    measured = list(first.values())
    if any(list(other.values()) != measured for other in others):
        raise InputError(f"the frequencies {', '.join(at_frequency)} Hz do not have the same columns", file=source)
    long = [
        row.picked(common, [re.sub("[.,]", decimal, frequency)], columns)
        for row in readings
        if len(row.cells) >= len(common)
        for frequency, columns in at_frequency.items()
    ]
    # the columns of the first frequency become those of all frequencies
    return Row(names.line, [*names.picked(common).cells, _FREQUENCY, *measured]), units.picked(common, ["Hz"], first), long


PROTEUS = Layout("Netzsch Proteus", _sniff_proteus, _read_proteus)
"""Netzsch Proteus: ASCII export of the DMA 242 and others.

A header of lines `#KEY: value` states the decimal mark and the separator. The line of names begins with `##` and includes the units
(`##Temp./°C;Time/min;E'/MPa`). With several frequencies, each name contains its frequency: `E'(1.000 Hz)/MPa`.
"""


_MAKER = re.compile(r"\b(eplexor|gabo qualimeter)\b", re.IGNORECASE)
_MODULI = ({"|e*|", "e'", "e''"}, {"|g*|", "g'", "g''"})


def _sniff_eplexor(text: str) -> bool:
    """Whether `text` is such an export: it has the line of names, and the maker above it."""
    if _MAKER.search(text) is None:
        return False
    lines = split_lines(text)
    start = next((place for place, line in enumerate(lines) if _is_header(line)), None)
    return start is not None and _MAKER.search("\n".join(lines[:start])) is not None


def _read_eplexor(text: str, source: str) -> list[ExportedStep]:
    """The table of the export; raises `InputError` naming file and line."""
    export, start = Export.from_header(text, source, _is_header, "an Eplexor export without its line of names")
    names = export.rows[start]
    below = [row for row in export.rows[start + 1 :] if not row.is_blank]
    readings = [row for row in below[1:] if row.has_number]
    return [export.step("table", (names, next(iter(below), None)), readings, deformation=deformation_of(names.cells) or "tension")]


def _is_header(line: str) -> bool:
    cells = {plain(cell) for cell in line.split(separator_of(line))}
    return any(len(moduli & cells) > 1 for moduli in _MODULI)


EPLEXOR = Layout("Gabo Eplexor", _sniff_eplexor, _read_eplexor)
"""Netzsch Gabo Eplexor: text export of its table, with a decimal comma where the computer is set to German.

A header names the instrument. It is followed by a line of names (`f`, `E'`, `E''`, `|E*|`, `tan delta`, `T`) and a line of units.
Cells without a measured value contain `---`.
"""
