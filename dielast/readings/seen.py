"""What a measured file holds, as far as it says so itself: its tables, and which column of a table has which role.

A column has a role by its name, with a unit of the role's dimension, or by a unit that only this role has. A unit is never guessed:
where the header states none, `SeenColumn.unit` is None.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.base.units import (
    AREA,
    LENGTH,
    NUMBER,
    STRAIN,
    STRAIN_RATE,
    TIME,
    VOLTAGE,
    VOLTAGE_RATE,
    Dimension,
    conversion,
    converts,
    is_ambiguous,
    is_unit,
    kind_of,
)
from dielast.io.cells import TextFormat, decode
from dielast.io.files import Inputs
from dielast.io.table import as_number, spoken
from dielast.io.text_table import MeasuredTable, read_measured
from dielast.io.workbook import is_workbook, sheet_names
from dielast.material.checks import odd_temperature
from dielast.readings.columns_recipe import ROLES, STRAINS, STRESSES
from dielast.readings.instruments import recognise
from dielast.readings.instruments.export import ROLES as OF_EXPORTS, Deformation, deformation_of, plain
from dielast.readings.steps import TABLE, by_temperature

DIMENSIONS: Mapping[str, Dimension] = {
    **ROLES,
    **{"voltage": VOLTAGE, "ramp": VOLTAGE_RATE, "intact": TIME, "prestretch": NUMBER, "prestretch_2": NUMBER},
    **{"relative_stretch": NUMBER, "area_strain": STRAIN},
    **{"thickness": LENGTH, "width": LENGTH, "gauge_length": LENGTH, "area": AREA, "humidity": STRAIN, "rate": STRAIN_RATE},
}
"""The dimension of the numbers in a column by its role; roles without one hold text or labels."""

# further names than those in exports of instruments, the better choice first; those of one letter are in _LETTERS
_NAMES: Mapping[str, tuple[str, ...]] = {
    "time": ("test time", "elapsed time", "total time", "time to failure", "life", "lifetime", "prüfzeit"),
    "modulus": ("young's modulus", "shear modulus", "tensile modulus", "e relax", "g relax", "e-modul"),
    "storage": ("e stor", "g stor", "e storage", "g storage", "tensile storage modulus", "shear storage modulus", "storage"),
    "loss": ("e loss", "g loss", "tensile loss modulus", "shear loss modulus", "loss"),
    "strain": ("nominal strain", "engineering strain", "eps", "epsilon", "ε", "dehnung"),
    "stretch": ("stretch", "stretch ratio", "stretch 1", "lambda", "λ"),
    "stress": (
        "nominal stress",
        "nominal stress 1",
        "engineering stress",
        "sigma",
        "σ",  # noqa: RUF001
        "spannung",
        "standardspannung",
    ),
    "extension": (
        "extension",
        "displacement",
        "elongation",
        "crosshead",
        "stroke",
        "weg",
        "standardweg",
        "traverse",
        "verlängerung",
    ),
    "force": ("force", "load", "axial force", "tensile force", "kraft", "standardkraft"),
    "set": ("set", "segment", "set number"),
    "voltage": ("voltage", "failure voltage", "breakdown voltage", "spannung"),
    "ramp": ("ramp", "ramp rate", "voltage rate"),
    "intact": ("intact", "last seen intact"),
    "relative_stretch": ("relative stretch", "relative stretch 1"),
    "area_strain": ("area strain", "areal strain", "A/A0", "A / A0", "area ratio", "area stretch"),
    "prestretch": ("prestretch", "pre-stretch", "prestretch 1"),
    "prestretch_2": ("prestretch 2",),
    "thickness": ("thickness", "dicke"),
    "width": ("width", "breite"),
    "gauge_length": ("gauge length", "gage length", "initial length", "messlänge"),
    "area": ("area", "electrode area"),
    "humidity": ("humidity", "relative humidity", "rh"),
    "rate": ("rate", "strain rate", "stretch rate", "vel", "velocity"),
    "suspended": ("suspended", "censored", "runout", "running"),
    "specimen": ("specimen", "sample", "film"),
    "batch": ("batch", "lot"),
    "mode": ("mode", "failure mode"),
    "recipe": ("recipe",),
    "label": ("id", "test", "specimen", "sample", "curve", "run", "no", "nr"),
}
_LETTERS: Mapping[str, tuple[str, ...]] = {
    **{"temperature": ("T",), "time": ("t",), "frequency": ("f",), "angular_frequency": ("w",), "modulus": ("E", "G")},
    **{"compliance": ("J", "D"), "force": ("F",), "extension": ("u",), "stress": ("P",), "voltage": ("U", "V", "phi", "Phi")},
}
NAMES = {role: (*OF_EXPORTS.get(role, ()), *_NAMES.get(role, ())) for role in (*OF_EXPORTS, *_NAMES)}
_SHEETS = 20  # sheets of a workbook that are looked at
# what shows a measurement: one of the first with another, or a deformation with what it takes
_OVER = ("time", "frequency", "angular_frequency", "voltage")
_RESPONSES = ("modulus", "compliance", "storage", "loss", "tan_delta", "complex_modulus", "relative_stretch", "area_strain")
# roles that a column without a known name may have by its unit: no other role of these files has it
_BY_UNIT = ("temperature", "time", "frequency", "angular_frequency", "force", "extension", "compliance", "voltage", "ramp")


@dataclass(frozen=True, slots=True)
class SeenColumn:
    """A column in its `role`: its index, what a recipe calls it, its unit (None if the header states none that fits), and what
    shows the role.
    """

    place: int
    name: str | int
    role: str
    unit: str | None
    reason: str

    @property
    def lacks_unit(self) -> bool:
        """Whether its numbers need a unit that the header does not state."""
        dimension = DIMENSIONS.get(self.role)
        return self.unit is None and dimension is not None and dimension is not NUMBER


@dataclass(frozen=True, slots=True, eq=False)
class SeenTable:
    """One table of a file: a plain one, or a `step` of an export. `levels` are the temperatures in degC that headers state, each
    with columns of its own; `table` then has those of the first. `above` is the text above a plain table.
    """

    table: MeasuredTable
    step: str = ""
    deformation: Deformation | None = None
    levels: tuple[float, ...] = ()
    above: str = ""

    def columns(self, roles: Iterable[str]) -> dict[str, SeenColumn]:
        """The columns by role, for those of the `roles` that the table shows; a column has one role."""
        found: dict[str, SeenColumn] = {}
        taken: set[int] = set()
        wanted = list(roles)
        for role in wanted:
            for name in (*NAMES.get(role, (role,)), *_LETTERS.get(role, ())):
                letter = name in _LETTERS.get(role, ())
                place = next((k for k in self._called(name, letter) if k not in taken and self._fits(k, role)), None)
                if place is not None and role not in found:
                    found[role] = self._column(place, role, "its name")
                    taken.add(place)
        for role in wanted:
            dimension = DIMENSIONS.get(role)
            if role in found or role not in _BY_UNIT or dimension is None:
                continue
            units = self.table.units
            of_dimension = [k for k, unit in enumerate(units) if unit is not None and states(unit, dimension)]
            free = [k for k in of_dimension if k not in taken and not self._is_known(k)]
            if len(free) == 1 and self.has_numbers(free[0]):
                found[role] = self._column(free[0], role, f"its unit, {units[free[0]]}")
                taken.add(free[0])
        return found

    def contradictions(self) -> list[str]:
        """Columns whose name contradicts their unit or their numbers, as messages."""
        wrong, unlike = [], list[tuple[str, str, str, str]]()
        for place, (name, unit) in enumerate(zip(self.table.names, self.table.units, strict=True)):
            roles = [role for role in DIMENSIONS if self._is_named(place, role)]
            what = kind_of(unit) if unit is not None else None
            if roles and unit is not None and what is not None and not any(self._fits(place, role) for role in roles):
                unlike.append((name, roles[0], unit, what.name))
        while unlike:
            name, role, unit, what_name = unlike.pop(0)
            theirs = [other for other in unlike if states(other[2], DIMENSIONS[role]) and states(unit, DIMENSIONS[other[1]])]
            if theirs:
                unlike.remove(theirs[0])
                both = f'columns "{name}" [{unit}] and "{theirs[0][0]}" [{theirs[0][2]}]'
                wrong.append(f"{both} have the unit of each other: are their names, or their units, swapped?")
            else:
                called = f"{'an' if role[0] in 'aeio' else 'a'} {spoken(role)}"
                wrong.append(f'column "{name}" is called {called}, but its unit, {unit}, is that of {what_name}')
        columns = self.columns(("time", "temperature"))
        for role, column in columns.items():
            numbers = self.numbers(column)
            numbers = np.zeros(0) if numbers is None else numbers[np.isfinite(numbers)]
            if role == "time" and np.any(numbers < 0):
                wrong.append(f'column "{column.name}" has times below 0, down to {numbers.min():g} s: is it another quantity?')
            elif role == "temperature" and (odd := odd_temperature(numbers)):
                wrong.append(f'column "{column.name}" holds {odd}')
        return wrong

    def is_measured(self) -> bool:
        """Whether the rows are those of a measurement, not of parameters or specimens."""
        shown = self.columns((*_OVER, *_RESPONSES, *STRAINS, *STRESSES)).keys()
        over_another = len(shown) > 1 and not shown.isdisjoint(_OVER)
        return self.table.lines.size > 1 and (over_another or not (shown.isdisjoint(STRAINS) or shown.isdisjoint(STRESSES)))

    def unnamed(self, known: Iterable[SeenColumn]) -> list[str | int]:
        """What a recipe calls the other columns that hold something."""
        places, names = {column.place for column in known}, self._names
        return [names[k] for k, cells in enumerate(self.table.cells) if k not in places and any(cells)]

    def numbers(self, column: SeenColumn) -> NDArray[np.float64] | None:
        """The numbers of a column in SI and degC (n,), NaN for other cells; None if its unit is not known."""
        dimension = DIMENSIONS.get(column.role)
        if dimension is None or column.lacks_unit:
            return None
        scale, offset = conversion(column.unit or "1", dimension)
        with np.errstate(over="ignore"):  # infinite is no reading, as whoever reads the column says
            return self.raw(column.place) * scale + offset

    def has_numbers(self, place: int) -> bool:
        """Whether the column of this index holds a number."""
        return bool(np.isfinite(self.raw(place)).any())

    def name_of(self, place: int) -> str | int:
        """What a recipe calls the column of this index: its header, or its number where the header is no name of its own."""
        return self._names[place]

    @property
    def _names(self) -> list[str | int]:
        """What a recipe calls each column, as `name_of`."""
        spelled = [header.spelled or header.text for header in self.table.headers]
        times = Counter(map(str.strip, spelled))
        return [text if text.strip() and times[text.strip()] == 1 else k for k, text in enumerate(spelled, start=1)]

    def raw(self, place: int) -> NDArray[np.float64]:
        """The numbers as they are written in the column of this index (n,), NaN for other cells."""
        marks = str.maketrans({",": ".", ".": " "}) if self.table.decimal == "," else {}
        return np.array([as_number(cell.translate(marks)) for cell in self.table.cells[place]])

    def _column(self, place: int, role: str, reason: str) -> SeenColumn:
        unit, dimension = self.table.headers[place].unit, DIMENSIONS.get(role)
        known = unit is not None and dimension is not None and states(unit, dimension)
        return SeenColumn(place, self.name_of(place), role, unit if known else None, reason)

    def _called(self, name: str, letter: bool) -> list[int]:
        texts = [text.strip() if letter else plain(text) for text in self.table.names]
        return [k for k, text in enumerate(texts) if text == (name if letter else plain(name))]

    def _is_named(self, place: int, role: str) -> bool:
        text = self.table.headers[place].name  # of this column alone, as there may be thousands
        names = map(plain, NAMES.get(role, (role,)))
        return text.strip() in _LETTERS.get(role, ()) or plain(text) in names

    def _is_known(self, place: int) -> bool:
        return any(self._is_named(place, role) for role in NAMES)

    def _fits(self, place: int, role: str) -> bool:
        """Whether the unit of a column may be that of a role; text in brackets that is no unit belongs to the name."""
        unit, dimension = self.table.headers[place].unit, DIMENSIONS.get(role)
        if dimension is None:
            return True
        fits = unit is None or not is_unit(unit) or states(unit, dimension) or is_ambiguous(unit, dimension)
        return fits and self.has_numbers(place)


@dataclass(frozen=True, slots=True, eq=False)
class SeenFile:
    """A measured file: its `name` as a recipe states it, the `format` ("table", or that of an export) and its tables or steps. A
    `sheet` of a workbook is named unless it is the first; `other_sheets` are all the others.
    """

    name: str
    format: str
    tables: tuple[SeenTable, ...]
    is_workbook: bool = False
    sheet: str | None = None
    other_sheets: tuple[str, ...] = ()

    @property
    def is_export(self) -> bool:
        """Whether it is an instrument's export, whose columns a recipe need not name."""
        return self.format != TABLE

    @property
    def first(self) -> SeenTable:
        """The first table."""
        return self.tables[0]

    @property
    def doubts(self) -> list[str]:
        """Columns of the first table that contradict themselves, as messages with the file."""
        return [f"{self.name}: {text}" for text in self.first.contradictions()]

    def unrecognised(self, what: str) -> InputError:
        """The error for a first table in which no column of `what` is recognised."""
        return InputError(f"no column of {what} was recognised; there are {self.first.table.quoted_names}", file=self.name)


class Given:
    """The files that are given for a recipe: their `names`, relative to its folder, and the glob `pattern` that matched them, if
    one did. They are read once, on demand, through `inputs`.
    """

    def __init__(self, names: Sequence[str], inputs: Inputs, pattern: str | None = None) -> None:
        self.names, self.inputs, self.pattern = tuple(names), inputs, pattern
        self._seen: list[SeenFile] = []

    @property
    def stated(self) -> str | list[str]:
        """The files as a recipe states several of them."""
        return self.pattern or list(self.names)

    @property
    def seen(self) -> list[SeenFile]:
        """What each file holds; raises `InputError` for a file without a table."""
        self._seen = self._seen or [look(self.inputs.read(name), name) for name in self.names]
        return self._seen


def look(content: bytes, name: str) -> SeenFile:
    """What the table or the export in the bytes `content` of the file `name` holds; raises `InputError` if no table is found.

    Of a workbook it is the first sheet with a measurement, or else the first with a table.
    """
    if not is_workbook(content):
        return _look(content, name)
    sheets, found, wrong = sheet_names(content, name), list[SeenFile](), list[InputError]()
    for number, sheet in enumerate(sheets[:_SHEETS]):
        try:
            seen = _look(content, name, sheet if number else None)
        except InputError as error:
            wrong.append(error)
            continue
        others = tuple(other for other in sheets if other != sheet)
        found.append(replace(seen, sheet=sheet if number else None, other_sheets=others))
        if seen.is_export or seen.first.is_measured():
            return found[-1]
    if not found:
        raise wrong[0]
    return found[0]


def _look(content: bytes, name: str, sheet: str | None = None) -> SeenFile:
    form = TextFormat(sheet=sheet)
    text = decode(content, name, form)
    layout = recognise(text)
    if layout is not None:
        steps = [step for step in layout.read(text, name) if step.table.lines.size]
        if not steps:
            raise InputError(f"this {layout.name} export has no steps with readings", file=name)
        return SeenFile(name, layout.name, tuple(SeenTable(step.table, step.name, step.deformation) for step in steps))
    table = read_measured(content, name, form, units={}, with_texts=True)
    table = _numeric(content, name, form) or table
    parts = by_temperature(table, None, "modulus")
    above = "\n".join(text.split("\n")[: max(int(table.lines[0]) - 1, 0)])
    deformation = deformation_of(table.names)
    seen = SeenTable(table, deformation=deformation, above=above)
    if len(parts) > 1:
        seen = replace(seen, table=parts[0][1], levels=tuple(level for level, _ in parts))
    return SeenFile(name, TABLE, (seen,), is_workbook(content))


def _numeric(content: bytes, name: str, form: TextFormat) -> MeasuredTable | None:
    """The file as a table of numbers; None if only rows with more texts than numbers make one."""
    try:
        return read_measured(content, name, form, units={})
    except InputError:
        return None


def states(unit: str, dimension: Dimension) -> bool:
    """Whether a cell with a unit, or with a dash for none, states a unit of the dimension."""
    return converts(unit, dimension) or (unit.strip() == "-" and dimension in (NUMBER, STRAIN))
