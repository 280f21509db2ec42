"""RepTate: its text files of oscillation (.osc, .tts), relaxation (.gt) and creep (.creep).

The first line states parameters, `T=-10;Mw=33.6;chem=PI;`, temperatures in degC. Columns follow, their names and units above them
parted by tabs, in which some cells may be blank, or without any: then they are RepTate's own, in SI, told by the file's ending.
Rows may have fewer columns than there are names. The moduli are shear.
"""

from __future__ import annotations

import re
from pathlib import Path

from dielast.errors import InputError
from dielast.io.text_table import is_number, split_cells, split_lines
from dielast.readings.instruments.names import plain
from dielast.readings.instruments.step import ExportedStep, Row, build, is_blank, last_filled

NAME = "RepTate"

_PARAMETERS = re.compile(r"\s*(?:[A-Za-z_]\w*\s*=[^;=\n]*;\s*)+(?:[A-Za-z_]\w*\s*=[^;=\n]*)?\s*")
_OSCILLATION = ("w", "G'", 'G"')
# what the columns of a file are where it does not say so
_OWN: dict[str, tuple[str, ...]] = {
    ".osc": _OSCILLATION,
    ".tts": _OSCILLATION,
    ".gt": ("t", "Gt"),
    ".creep": ("t", "strain"),
}
_ITS_OWN = ("Mw", "chem", "gamma")  # parameters that tell a file without names of columns
_NAMES = {
    **dict.fromkeys(("w", "omega", "freq", "frequency", "angular frequency"), ("angular frequency", "rad/s")),
    **dict.fromkeys(("g'", "g'(w)"), ("G'", "Pa")),
    **dict.fromkeys(("g''", "g''(w)"), ("G''", "Pa")),
    **dict.fromkeys(("t", "time"), ("time", "s")),
    **dict.fromkeys(("gt", "g(t)", "g"), ("relaxation modulus", "Pa")),
    **dict.fromkeys(("sxy", "stress"), ("stress", "Pa")),
    "strain": ("strain", "-"),
    "j": ("compliance", "1/Pa"),
}


def sniff(text: str) -> bool:
    """Whether `text` is such a file: parameters in its first line, numbers soon below, and names that are RepTate's in between."""
    first, *below = split_lines(text[:5000])
    if len(first) > 1000 or _PARAMETERS.fullmatch(first) is None:
        return False
    start = next((k for k, line in enumerate(below[:4]) if _is_reading(split_cells(line, " "))), None)
    if start is None:
        return False
    header = [line for line in below[:start] if line.strip("# \t")]
    if not header:
        return any(key in _ITS_OWN for key in map(str.strip, re.findall(r"([^;=]+)=", first)))
    return sum(plain(cell) in _NAMES for cell in _cells(header[0])) > 1


def read(text: str, source: str) -> list[ExportedStep]:
    """The table of the file as its only step, named after its temperature; raises `InputError` naming file and line."""
    first, *lines = split_lines(text)
    parameters = dict(_pair(part) for part in first.split(";") if "=" in part)
    rows = [(number, split_cells(line, " ")) for number, line in enumerate(lines, start=2)]
    start = next((place for place, row in enumerate(rows) if _is_reading(row[1])), len(rows))
    readings = [row for row in rows[start:] if not is_blank(row) and not row[1][0].startswith("#")]
    if not readings:
        raise InputError("nothing but a header: the file seems cut off", file=source, line=len(lines) + 1)
    width = max(len(cells) for _, cells in readings)
    header = [line for line in lines[:start] if line.strip("# \t")]
    names, units = _columns(header, source, width)
    if parameters.get("gamma", "0") not in ("0", "0.0") and "stress" in names and "strain" not in names:
        names, units = [*names, "strain"], [*units, "-"]
        readings = [(line, [*cells, parameters["gamma"]]) for line, cells in readings]
    if "strain" in names and "stress" not in names and "stress" in parameters:
        names, units = [*names, "stress"], [*units, "Pa"]
        readings = [(line, [*cells, parameters["stress"]]) for line, cells in readings]
    return [_segment(source, parameters, (names, units), readings, last_filled(rows))]


def _segment(
    source: str, parameters: dict[str, str], header: tuple[list[str], list[str]], readings: list[Row], end: int
) -> ExportedStep:
    kind = "creep" if "strain" in header[0] and Path(source).suffix.lower() == ".creep" else "relaxation"
    kind = "oscillation" if "G'" in header[0] else kind
    temperature = parameters.get("T", "").rstrip(".")
    name = f"{parameters.get('label') or kind}, {kind}" + (f" ({temperature} °C)" if is_number(temperature, ".") else "")
    return build(source, name, ((1, header[0]), (1, header[1])), readings, last_line=end, decimal=".", deformation="shear")


def _columns(header: list[str], source: str, width: int) -> tuple[list[str], list[str]]:
    """Names and units of the first `width` columns; of the temperature that a thermometer shows, the file's own counts."""
    stated = [_cells(line) for line in header]
    own = _OWN.get(Path(source).suffix.lower())
    if not stated and own is None:
        known = ", ".join(_OWN)
        raise InputError(f'a RepTate file without names of columns, and not called {known}: say format = "table"', file=source)
    spelled = stated[0] if stated else list(own or ())
    below = stated[1] if len(stated) > 1 else []
    names: list[str] = []
    units: list[str] = []
    for k in range(width):
        written, unit = (row[k] if k < len(row) else "" for row in (spelled, below))
        name, usual = _NAMES.get(plain(written), (written, "-"))
        # what stands there again is the same
        if name in names or written == "T" or plain(written) in ("temp", "temperature"):
            name = f"{written or 'column'} {k + 1}"
        names.append(name or f"column {k + 1}")
        units.append(unit if unit.strip("[] ") else usual)
    return names, units


def _cells(line: str) -> list[str]:
    """Names or units, between tabs, where an empty one can be seen, or between blanks."""
    text = line.lstrip("# ")
    return [cell.strip() for cell in text.split("\t")] if "\t" in text else split_cells(text, " ")


def _pair(part: str) -> tuple[str, str]:
    key, _, value = part.partition("=")
    return key.strip(), value.strip()


def _is_reading(cells: list[str]) -> bool:
    return len(cells) > 1 and all(is_number(cell, ".") for cell in cells)
