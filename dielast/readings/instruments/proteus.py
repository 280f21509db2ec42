"""Netzsch Proteus: ASCII export of the DMA 242 and others.

A header of lines `#KEY: value` states the decimal mark and the separator. The line of names begins with `##` and includes the units
(`##Temp./°C;Time/min;E'/MPa`). With several frequencies, each name contains its frequency: `E'(1.000 Hz)/MPa`.
"""

import re
from collections.abc import Mapping

from dielast.errors import InputError
from dielast.readings.instruments.export import Export, ExportedStep, Row, cut_off, decimal_mark, deformation_of

NAME = "Netzsch Proteus"

sniff = re.compile(r"^(#FORMAT:\W*NETZSCH|##Temp\./)", re.MULTILINE).search
_KEY = re.compile(r"^#(?P<key>[^#:][^:]*):[\t;, ]*(?P<value>.*?)[\t;, ]*$", re.MULTILINE)
_SEPARATORS = {"SEMICOLON": ";", "COMMA": ",", "TAB": "\t"}
_DECIMALS = {"COMMA": ",", "POINT": "."}
_AT = re.compile(r"(?P<name>.*?)\s*\(\s*(?P<frequency>\d+(?:[.,]\d+)?)\s*Hz\s*\)")
_FREQUENCY = "Frequency"


def read(text: str, source: str) -> list[ExportedStep]:
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
