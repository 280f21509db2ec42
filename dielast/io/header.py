"""The rows above the numbers of a table: names of columns, their units, and temperatures of columns."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from dielast.base.errors import InputError
from dielast.base.units import BASE_UNITS, TEMPERATURE, conversion, is_unit, parse_unit
from dielast.io.table import LONGEST_HEADER, split_header

_NUMBER = r"[+\-\u2212]?\d++(?:[.,]\d++)?"
_DEGREE = r"(?:°\s?[CF]|º\s?[CF]|℃|℉|deg\.?\s?[CF]|degrees?\s[CF]|[CK])"
# the number of 20 °C, but not of E20 °C or 1.20 °C
_TEMPERATURE = re.compile(rf"(?<![A-Za-z0-9.,])(?P<number>{_NUMBER})\s*_?(?P<unit>{_DEGREE})(?![A-Za-z0-9]|-[A-Za-z])")


@dataclass(frozen=True, slots=True)
class ColumnHeader:
    """The header of a column: its name, its unit (None if none is stated), its cell as `spelled` in the file (empty if there is
    none), and the `temperature` in degC that a row above the names states for it (None if none is stated).
    """

    name: str
    unit: str | None = None
    spelled: str = ""
    temperature: float | None = None

    @property
    def text(self) -> str:
        """The header cell of a result, `name [unit]`."""
        return self.name if self.unit is None else f"{self.name} [{self.unit}]"


# tan(d) and G(t): the brackets hold no unit
_ARGUMENT = re.compile(r"\w['\"]*\([^()]*\)$")


def read_header(source: str, above: Sequence[Sequence[str]], columns: int, filled: int, aligned: bool) -> tuple[ColumnHeader, ...]:
    """The headers of so many `columns` in the rows `above` the data: a row of names, and perhaps rows of units and temperatures.

    Columns after the first `filled` ones are empty; they have no header if the names end before them. `aligned` says whether blanks
    separate the cells, so that empty cells do not show. Raises `InputError` if the row of names and the rows of data differ in
    their number of cells.
    """
    tables = [row for row in above if filled_width(row) > 1 or columns == 1]
    place = next((k for k in reversed(range(len(tables))) if temperatures_in(tables[k]) is not None), None)
    over: list[float | None] = [None] * columns
    if place is not None:
        # an empty cell takes the temperature of the cell before it, as in merged cells
        stated = [*(temperatures_in(tables.pop(place)) or ()), *over][:columns]
        over = list(accumulate(stated, lambda before, level: before if level is None else level))
    if not tables:
        return tuple(ColumnHeader(str(number), temperature=level) for number, level in enumerate(over, start=1))
    names, below = tables[-1], list[str]()
    if len(tables) > 1 and any(names) and all(map(_is_unit_cell, names)):
        names, below = tables[-2], [cell.strip("[]()").strip() for cell in names]
        if aligned and len(below) < columns:
            below = []  # with aligned cells, the column without a unit is unknown
    if filled <= filled_width(names) < columns:
        columns = filled_width(names)
    if filled_width(names) != columns and len(names) != columns:
        # a name with the separator in it, or a column without a name: the names cannot be matched with the columns
        counts = f"the header has {filled_width(names)} cells, the rows have {columns}"
        raise InputError(f"{counts}; quote cells that hold the separator, or skip_rows", file=source)
    headers = []
    for cell, cell_below, level in zip(names, [*below, *[""] * columns], over, strict=False):
        spelled = cell.lstrip("# ")
        # in the row of units an empty cell states nothing; a dash states that the column has no unit
        name, unit = _above_units(spelled, cell_below) if any(below) else split_header(spelled)
        headers.append(ColumnHeader(name, unit, spelled, level))
    return tuple(headers)


def _above_units(spelled: str, below: str) -> tuple[str, str | None]:
    """The name and the unit of a column whose header is above the cell `below` of a row of units.

    Brackets without a unit belong to neither: `Time (total)` is a time. If header and cell state different units, no unit is known,
    and both stand in its place.
    """
    name, unit = split_header(spelled)
    if _ARGUMENT.search(spelled):
        return spelled, below or None
    if unit is None or (below and not is_unit(unit)):
        return name, below or None
    stated, other = parse_unit(unit), parse_unit(below)
    if stated is None or other is None or stated == other:
        return name, unit
    if unit == "C" and other.powers == BASE_UNITS["K"].powers:
        return name, below
    return name, f"{unit} in the header and {below} in the row below it"


def filled_width(row: Sequence[str]) -> int:
    """Cells in a row, not counting empty ones at its end."""
    width = len(row)
    while width and not row[width - 1]:
        width -= 1
    return width


# E-20: a sign or a dash
_JOINED = re.compile(r"(?<=[A-Za-z\])])[-\u2212]$")
# the words before a temperature in a name, as in "E at T = 20 °C" and "E, 20 °C"
_BEFORE = re.compile(r"(?:\b[Tt](?:emp(?:erature)?)?\.?\s*=|@|\bat\b|[_,;:/=|\s-])*$")
_AFTER = re.compile(r"^[_,;:=|@\s-]+")
# the rest of "E (20 °C)" without the temperature
_EMPTY = re.compile(r"\(\s*\)|\[\s*\]|\(\s*[Tt]\s*=\s*\)")


def temperature_in(text: str, unit: str | None = None) -> tuple[float, str] | None:
    """The temperature in degC that a header cell states, such as `E (20 °C) [MPa]`, and the cell without it; None if it has none.

    With a `unit` a bare number is a temperature as well. Raises `InputError` if a dash may or may not be a sign.
    """
    if len(text) > LONGEST_HEADER:
        return None
    match = _TEMPERATURE.search(text)
    if match is None and unit is not None:
        match = re.search(rf"(?<![A-Za-z0-9.,])(?P<number>{_NUMBER})(?![A-Za-z0-9.,])", text)
    if match is None:
        return None
    number, degree = match["number"].replace(",", ".").replace("\u2212", "-"), match.groupdict().get("unit") or unit or ""
    before, after = text[: match.start()], text[match.end() :]
    if _JOINED.search(before):
        other = f'call it "{before[:-1]} (-{number} {degree})" or "{before[:-1]} ({number} {degree})"'
        raise InputError(f'column "{text}": {number} or -{number} {degree}? {other}')
    scale, offset = conversion(_spelled_out(degree), TEMPERATURE)
    bracketed = before.count("(") > before.count(")") or before.count("[") > before.count("]")
    rest = _EMPTY.sub("", before + after if bracketed else f"{_BEFORE.sub('', before)} {_AFTER.sub('', after)}")
    return round(float(number) * scale + offset, 9), " ".join(rest.split())


def temperatures_in(row: Sequence[str]) -> list[float | None] | None:
    """The temperature in degC of each cell of a row of temperatures (None for an empty cell or a label); None for any other row.

    A row of temperatures has at least two different temperatures, or numbers beside a label such as `T [°C]`.
    """
    filled = [cell for cell in row if cell]
    label = next((unit for cell in filled if (unit := _label(cell)) is not None), None)
    temperatures: list[float | None] = []
    for cell in row:
        if not cell or _label(cell) is not None:
            temperatures.append(None)
            continue
        try:
            stated = temperature_in(cell, label)
        except InputError:
            return None
        if stated is None or stated[1]:
            return None
        temperatures.append(stated[0])
    return temperatures if len(set(temperatures) - {None}) > 1 else None


def _label(cell: str) -> str | None:
    """The unit in a cell that labels temperatures, such as `T [°C]` or `Temperature / K`; None for any other cell."""
    name, unit = split_header(cell)
    if unit is None or name.strip().casefold().rstrip(".") not in ("t", "temp", "temperature", "temperatur"):
        return None
    try:
        conversion(_spelled_out(unit), TEMPERATURE)
    except InputError:
        return None
    return unit


def _spelled_out(unit: str) -> str:
    text = re.sub(r"^(?:º|deg(?:ree)?s?\.?)\s?", "°", unit.strip())
    return {"C": "°C", "F": "°F"}.get(text, text)


def _is_unit_cell(cell: str) -> bool:
    text = cell.strip()
    return is_unit(text.strip("[]()")) or (len(text) > 1 and text[0] + text[-1] in ("[]", "()"))
