"""Netzsch Proteus: ASCII export of the DMA 242 and others.

A header of lines `#KEY: value` says the decimal mark and the separator; the line of names begins with `##` and has the units in it
(`##Temp./°C;Time/min;E'/MPa`). With several frequencies a name says its own: `E'(1.000 Hz)/MPa`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from dielast.errors import InputError
from dielast.io.text_table import split_lines
from dielast.readings.instruments.names import deformation_of
from dielast.readings.instruments.step import ExportedStep, Row, build, check_widths, decimal_mark, is_blank, last_filled, numbered

NAME = "Netzsch Proteus"

_MARK = re.compile(r"^(#FORMAT:\W*NETZSCH|##Temp\./)", re.MULTILINE)
_KEY = re.compile(r"^#(?P<key>[^#:][^:]*):[\t;, ]*(?P<value>.*?)[\t;, ]*$", re.MULTILINE)
_SEPARATORS = {"SEMICOLON": ";", "COMMA": ",", "TAB": "\t"}
_DECIMALS = {"COMMA": ",", "POINT": "."}
_AT = re.compile(r"(?P<name>.*?)\s*\(\s*(?P<frequency>\d+(?:[.,]\d+)?)\s*Hz\s*\)")
_FREQUENCY = "Frequency"


def sniff(text: str) -> bool:
    """Whether `text` is such an export."""
    return _MARK.search(text) is not None


def read(text: str, source: str) -> list[ExportedStep]:
    """The table of the export as its only step; raises `InputError` naming file and line."""
    keys = {match["key"].strip(): match["value"] for match in _KEY.finditer(text)}
    lines = split_lines(text)
    start = next((place for place, line in enumerate(lines) if line.startswith("##")), None)
    if start is None:
        raise InputError(
            'a Proteus export without its line of names, "##...": the file seems cut off', file=source, line=len(lines)
        )
    separator = _named(_SEPARATORS, keys, "SEPARATOR") or next((mark for mark in "\t;," if mark in lines[start]), ";")
    rows = numbered(text, separator)
    names, units = zip(*(_split(cell) for cell in rows[start][1]), strict=True)
    line = rows[start][0]
    readings = [row for row in rows[start + 1 :] if not is_blank(row) and not row[1][0].startswith("#")]
    end = last_filled(rows)
    name = keys.get("IDENTITY", "") or "measurement"
    if not readings:
        raise InputError("nothing follows the line of names: the file seems cut off", file=source, line=line)
    check_widths(source, name, len(names), readings, end)
    decimal = _named(_DECIMALS, keys, "DECIMAL") or decimal_mark([cells for _, cells in readings])
    header, readings = _one_row_a_frequency(list(names), list(units), readings, source, decimal)
    return [
        build(
            source,
            name,
            ((line, header[0]), (line, header[1])),
            readings,
            last_line=end,
            decimal=decimal,
            deformation=deformation_of(header[0]),
        )
    ]


def _named(words: Mapping[str, str], keys: Mapping[str, str], key: str) -> str | None:
    return words.get(re.split(r"[\t;, ]", keys.get(key, ""))[0].upper())


def _split(cell: str) -> tuple[str, str]:
    """Name and unit of a header cell `name/unit`; a slash within brackets belongs to the unit."""
    text = cell.lstrip("#").strip()
    match = re.fullmatch(r"(?P<name>[^/]*)/(?:\((?P<bracketed>.*)\)|(?P<unit>.*))", text)
    return (match["name"].strip(), (match["bracketed"] or match["unit"] or "").strip()) if match else (text, "")


def _one_row_a_frequency(
    names: list[str], units: list[str], rows: list[Row], source: str, decimal: str
) -> tuple[tuple[list[str], list[str]], list[Row]]:
    """Columns of several frequencies, such as `E'(1.000 Hz)`, one below the other, the frequency in a column of its own."""
    common: list[int] = []
    own: dict[str, dict[int, str]] = {}  # of each frequency, its columns and what they hold
    for k, name in enumerate(names):
        if match := _AT.fullmatch(name):
            own.setdefault(match["frequency"], {})[k] = match["name"]
        else:
            common.append(k)
    if not own:
        return (names, units), rows
    first, *others = own.values()
    measured = list(first.values())
    if any(list(other.values()) != measured for other in others):
        raise InputError(f"the frequencies {', '.join(own)} Hz do not have the same columns", file=source)
    long = [
        (
            line,
            [
                *(cells[k] if k < len(cells) else "" for k in common),
                re.sub("[.,]", decimal, frequency),
                *(cells[k] if k < len(cells) else "" for k in columns),
            ],
        )
        for line, cells in rows
        if len(cells) >= len(common)
        for frequency, columns in own.items()
    ]
    return (
        ([names[k] for k in common] + [_FREQUENCY] + measured, [units[k] for k in common] + ["Hz"] + [units[k] for k in first]),
        long,
    )
