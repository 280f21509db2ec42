"""What exports of instruments have in common: rows of cells, steps as tables, and the usual names of columns."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import zip_longest
from typing import Literal, NamedTuple, Self

import numpy as np

from dielast.base.errors import InputError
from dielast.io.cells import is_number, split_cells, split_lines
from dielast.io.header import ColumnHeader
from dielast.io.text_table import MeasuredTable

Deformation = Literal["tension", "shear"]

# the better choice first: the time of a step is preferred to that of the test
ROLES: Mapping[str, tuple[str, ...]] = {
    "temperature": ("temperature", "sample temperature", "temp.", "temp", "temperatur"),
    "time": ("step time", "interval time", "time", "segment time", "intervallzeit", "zeit"),
    "frequency": ("frequency", "freq.", "frequenz"),
    "angular_frequency": ("angular frequency", "ang. frequency", "omega", "ω", "kreisfrequenz"),
    "storage": ("storage modulus", "g'", "e'", "speichermodul"),
    "loss": ("loss modulus", "g''", "e''", "verlustmodul"),
    "tan_delta": (
        "tan(delta)",
        "tan delta",
        "tan(δ)",
        "tan δ",
        "tan d",
        "tan(d)",
        "loss factor",
        "damping factor",
        "verlustfaktor",
    ),
    "complex_modulus": ("complex modulus", "|g*|", "|e*|", "g*", "e*", "complex shear modulus", "komplexer modul"),
    "complex_viscosity": ("complex viscosity", "|eta*|", "eta*", "|η*|", "η*", "komplexe viskosität"),
    "modulus": ("relaxation modulus", "modulus", "g(t)", "e(t)", "relaxationsmodul"),
    "compliance": ("creep compliance", "compliance", "j(t)", "d(t)", "kriechnachgiebigkeit", "nachgiebigkeit"),
    "strain": ("strain", "shear strain", "extensional strain", "tensile strain", "deformation", "scherdeformation"),
    "stress": ("stress", "shear stress", "extensional stress", "tensile stress", "schubspannung"),
}
# names of a single letter, for which case matters
_LETTERS = {"T": "temperature", "t": "time", "f": "frequency", "w": "angular_frequency"}

_TENSION = re.compile(r"\b(young|tensile|extensional)|^\|?e('|\*|\()")
_SHEAR = re.compile(r"\bshear (strain|stress|modulus)|^\|?g('|\*|\()|scher|schub")
_PER_SECOND = ("1/s", "s-1", "s^-1", "s⁻¹", "/s")
_BRACKETS = ("[]", "()")


class Layout(NamedTuple):
    """The layout of the exports of one instrument software: its `name` in the summary, `sniff`, whose result is true for a text in
    this layout, complete or not, and `read`, which returns the steps of a text of a file, or raises `InputError` with the line.
    """

    name: str
    sniff: Callable[[str], object]
    read: Callable[[str, str], "list[ExportedStep]"]


class Row(NamedTuple):
    """A line of an export: its number in the file, from 1, and its cells."""

    line: int
    cells: list[str]

    @property
    def key(self) -> str:
        """The first cell, which in many formats states the kind of line."""
        return self.cells[0]

    @property
    def values(self) -> list[str]:
        """The nonempty cells after the key."""
        return [cell for cell in self.cells[1:] if cell]

    @property
    def value(self) -> str:
        """The value after the key in a line of a header block."""
        return next(iter(self.values), "")

    @property
    def is_blank(self) -> bool:
        """Whether all cells are empty."""
        return not any(self.cells)

    @property
    def has_number(self) -> bool:
        """Whether a cell is a number, with either decimal mark."""
        return any(map(is_number, self.cells))

    def picked(self, before: Iterable[int], between: Iterable[str] = (), after: Iterable[int] = ()) -> Self:
        """The cells at indices `before`, the cells `between`, and those at indices `after`; empty where the row is shorter."""
        first, last = ([self.cells[k] if k < len(self.cells) else "" for k in places] for places in (before, after))
        return type(self)(self.line, [*first, *between, *last])

    def without_key(self) -> Self:
        """The row without its first cell."""
        return type(self)(self.line, self.cells[1:])


@dataclass(frozen=True, slots=True, eq=False)
class ExportedStep:
    """One step of an export: its `name`, its `table`, and the deformation of the specimen, None if the file does not state it."""

    name: str
    table: MeasuredTable
    deformation: Deformation | None


@dataclass(frozen=True, slots=True, eq=False)
class Export:
    """All `rows` of the export in the file `source`."""

    source: str
    rows: list[Row]

    @classmethod
    def of(cls, text: str, source: str, separator: str) -> Self:
        """The export with its lines split into cells at the `separator`."""
        return cls(source, [Row(number, split_cells(line, separator)) for number, line in enumerate(split_lines(text), start=1)])

    @classmethod
    def from_header(
        cls, text: str, source: str, is_header: Callable[[str], object], missing: str, separator: str | None = None
    ) -> tuple[Self, int]:
        """The export, split at the `separator`, by default that of the first line that `is_header`, and the index of this line.

        Raises `InputError` with the `missing` part if there is no such line.
        """
        lines = split_lines(text)
        start = next((place for place, line in enumerate(lines) if is_header(line)), None)
        if start is None:
            raise cut_off(missing, source, len(lines))
        return cls.of(text, source, separator or separator_of(lines[start])), start

    def step(
        self,
        name: str,
        header: tuple[Row, Row | None],
        readings: Sequence[Row],
        *,
        points: int | None = None,
        decimal: str | None = None,
        deformation: Deformation | None,
    ) -> ExportedStep:
        """The step called `name` from its `header` (the rows of names and of units), and its rows of `readings`.

        `points` is the number of readings that the file states. Raises `InputError` with file and line.
        """
        (names_line, names), units = header
        width = max((place for place, cell in enumerate(names, start=1) if cell), default=0)
        if units is None or any(is_number(cell) and cell != "1" for cell in units.cells):
            raise InputError(f'step "{name}": the row of units under the names is missing', file=self.source, line=names_line)
        self.check_widths(name, width, readings)
        if points is not None and points != len(readings):
            line = readings[-1].line if readings else units.line
            raise cut_off(f'step "{name}" ends after {len(readings)} of {points} points', self.source, line)
        headed = zip_longest(names[:width], units.cells[:width], fillvalue="")
        table = MeasuredTable(
            self.source,
            tuple(ColumnHeader(cell, _unit(cell, unit)) for cell, unit in headed),
            tuple([cells[k] if k < len(cells) else "" for _, cells in readings] for k in range(width)),
            np.array([row.line for row in readings], dtype=np.int64),
            decimal or decimal_mark(readings),
            header_line=units.line,
        )
        return ExportedStep(name, table, deformation)

    def check_widths(self, name: str, width: int, readings: Sequence[Row]) -> None:
        """`InputError` for a row of more than `width` cells, or of fewer cells in the file's last line, which is then incomplete.

        In other lines, missing cells at the end are empty.
        """
        last_line = next((row.line for row in reversed(self.rows) if not row.is_blank), 0)
        for line, cells in readings:
            wrong = f'{len(cells)} cells, but step "{name}" has {width} columns'
            if any(cells[width:]):
                raise InputError(wrong, file=self.source, line=line)
            if line == last_line and len(cells) < width:
                raise cut_off(wrong, self.source, line)


def cut_off(missing: str, source: str, line: int) -> InputError:
    """The error for an export that is incomplete."""
    return InputError(f"{missing}: the file seems cut off", file=source, line=line)


def stated_points(text: str) -> int | None:
    """The number of points that a file states, None if it does not."""
    return int(text) if text.isdecimal() and len(text) < 10 else None


def separator_of(line: str) -> str:
    """The separator of the cells of a line of names: a tab, else a semicolon, else a comma."""
    return next((mark for mark in "\t;," if mark in line), "\t")


def decimal_mark(rows: Sequence[Row]) -> str:
    """The decimal mark of most numbers."""
    commas = sum("," in cell and is_number(cell, ",") for row in rows for cell in row.cells)
    points = sum("." in cell and is_number(cell, ".") for row in rows for cell in row.cells)
    return "," if commas > points else "."


def _unit(name: str, cell: str) -> str:
    text = cell.strip()
    if len(text) > 1 and text[0] + text[-1] in _BRACKETS:
        text = text[1:-1].strip()
    if plain(name) in ROLES["angular_frequency"] and text in _PER_SECOND:
        return "rad/s"  # the name of the column states that it is an angular frequency
    return text or "-"


@lru_cache(maxsize=4096)
def plain(name: str) -> str:
    """A column's name in the form of `ROLES`: lower case, single blanks, primes as apostrophes."""
    text = re.sub(r"[\s_]+", " ", name).strip().casefold()
    return re.sub("[\u2032\u2019\u00b4`]", "'", text).replace('"', "''").replace("\u2033", "''")


def columns_by_role(table: MeasuredTable) -> dict[str, int]:
    """The number (from 1) of the column for each role for which `table` has readings."""
    cells_by_name = zip(table.names, table.cells, strict=True)
    filled = [
        (k, name) for k, (name, cells) in enumerate(cells_by_name, 1) if any(is_number(cell, table.decimal) for cell in cells)
    ]
    number = {plain(name): k for k, name in reversed(filled)}
    columns = {role: number[name] for role, names in ROLES.items() for name in reversed(names) if name in number}
    for k, name in filled:
        if name in _LETTERS:
            columns.setdefault(_LETTERS[name], k)
    return columns


def deformation_of(names: Sequence[str]) -> Deformation | None:
    """Tension or shear, if the names of the columns state it."""
    texts = [plain(name) for name in names]
    tension, shear = (any(pattern.search(text) for text in texts) for pattern in (_TENSION, _SHEAR))
    return None if tension == shear else "tension" if tension else "shear"
