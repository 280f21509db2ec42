"""RepTate: its text files of oscillation (.osc, .tts), relaxation (.gt) and creep (.creep).

The first line states parameters, `T=-10;Mw=33.6;chem=PI;`, with temperatures in degC. Names and units of columns, separated by tabs
and sometimes blank, are above the columns; without them, the extension of the file determines its columns, in SI. Rows may have
fewer columns than there are names. The moduli are shear.
"""

import re
from pathlib import Path

from dielast.base.errors import InputError
from dielast.io.cells import is_number, split_cells, split_lines
from dielast.readings.instruments.export import Export, ExportedStep, Layout, Row, cut_off, plain

_PARAMETERS = re.compile(r"\s*(?:[A-Za-z_]\w*\s*=[^;=\n]*;\s*)+(?:[A-Za-z_]\w*\s*=[^;=\n]*)?\s*")
_OSCILLATION = ("w", "G'", 'G"')
# the columns of a file without names, by its extension
_COLUMNS: dict[str, tuple[str, ...]] = {
    ".osc": _OSCILLATION,
    ".tts": _OSCILLATION,
    ".gt": ("t", "Gt"),
    ".creep": ("t", "strain"),
}
_PARAMETERS_OF_REPTATE = ("Mw", "chem", "gamma")  # parameters by which a file without column names is recognised
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


def _sniff(text: str) -> bool:
    """Whether `text` is such a file: parameters in its first line, numbers soon after it, and names of RepTate in between."""
    first, *below = split_lines(text[:5000])
    if len(first) > 1000 or _PARAMETERS.fullmatch(first) is None:
        return False
    start = next((k for k, line in enumerate(below[:4]) if _is_reading(split_cells(line, " "))), None)
    if start is None:
        return False
    header = [line for line in below[:start] if line.strip("# \t")]
    if not header:
        return not _parameters(first).keys().isdisjoint(_PARAMETERS_OF_REPTATE)
    return sum(plain(cell) in _NAMES for cell in _cells(header[0])) > 1


def _read(text: str, source: str) -> list[ExportedStep]:
    """The table of the file as its only step, named after its temperature; raises `InputError` naming file and line."""
    first, *lines = split_lines(text)
    parameters = _parameters(first)
    export = Export(source, [Row(number, split_cells(line, " ")) for number, line in enumerate(lines, start=2)])
    start = next((place for place, row in enumerate(export.rows) if _is_reading(row.cells)), len(lines))
    readings = [row for row in export.rows[start:] if not row.is_blank and not row.key.startswith("#")]
    if not readings:
        raise cut_off("nothing but a header", source, len(lines) + 1)
    names, units = _columns([line for line in lines[:start] if line.strip("# \t")], source, max(len(row.cells) for row in readings))

    def add_parameter(name: str, unit: str, value: str) -> None:
        """Add a column with the same value in every row."""
        names.append(name)
        units.append(unit)
        readings[:] = [Row(row.line, [*row.cells, value]) for row in readings]

    if parameters.get("gamma", "0") not in ("0", "0.0") and "stress" in names and "strain" not in names:
        add_parameter("strain", "-", parameters["gamma"])
    if "strain" in names and "stress" not in names and "stress" in parameters:
        add_parameter("stress", "Pa", parameters["stress"])
    is_creep = "strain" in names and Path(source).suffix.lower() == ".creep"
    kind = "oscillation" if "G'" in names else "creep" if is_creep else "relaxation"
    temperature = parameters.get("T", "").rstrip(".")
    name = f"{parameters.get('label') or kind}, {kind}" + (f" ({temperature} °C)" if is_number(temperature, ".") else "")
    return [export.step(name, (Row(1, names), Row(1, units)), readings, decimal=".", deformation="shear")]


def _columns(header: list[str], source: str, width: int) -> tuple[list[str], list[str]]:
    """Names and units of the first `width` columns; columns of temperature are not used, as the file states the temperature."""
    stated = [_cells(line) for line in header]
    usual_names = _COLUMNS.get(Path(source).suffix.lower())
    if not stated and usual_names is None:
        known = ", ".join(_COLUMNS)
        raise InputError(f'a RepTate file without names of columns, and not called {known}: state format = "table"', file=source)
    spelled = stated[0] if stated else list(usual_names or ())
    below = stated[1] if len(stated) > 1 else []
    names: list[str] = []
    units: list[str] = []
    for k in range(width):
        written, unit = (row[k] if k < len(row) else "" for row in (spelled, below))
        name, usual = _NAMES.get(plain(written), (written, "-"))
        # a second column of a quantity is renamed
        if name in names or written == "T" or plain(written) in ("temp", "temperature"):
            name = f"{written or 'column'} {k + 1}"
        names.append(name or f"column {k + 1}")
        units.append(unit if unit.strip("[] ") else usual)
    return names, units


def _cells(line: str) -> list[str]:
    """Names or units separated by tabs (some may be empty), or else by blanks."""
    text = line.lstrip("# ")
    return [cell.strip() for cell in text.split("\t")] if "\t" in text else split_cells(text, " ")


def _parameters(line: str) -> dict[str, str]:
    pairs = (part.split("=", 1) for part in line.split(";") if "=" in part)
    return {key.strip(): value.strip() for key, value in pairs}


def _is_reading(cells: list[str]) -> bool:
    return len(cells) > 1 and all(is_number(cell, ".") for cell in cells)


REPTATE = Layout("RepTate", _sniff, _read)
