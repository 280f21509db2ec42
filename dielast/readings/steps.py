"""The parts of the files of a recipe's measurements: plain tables, by temperature if they are wide, and steps of exports."""

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, located, shown
from dielast.io.cells import decode, is_number
from dielast.io.header import ColumnHeader, temperature_in
from dielast.io.table import split_header
from dielast.io.text_table import MeasuredTable, read_measured
from dielast.io.workbook import is_workbook
from dielast.material.measurement_kind import CREEP, KINDS, OSCILLATION, RELAXATION, MeasurementKind
from dielast.readings.columns_recipe import MODULI, ROLES, Columns
from dielast.readings.instruments import ExportedStep, recognise
from dielast.readings.instruments.export import Deformation, columns_by_role, plain
from dielast.readings.recipe import CurveColumns, CurveData, MeasuredData, MeasurementData

Measured: TypeAlias = tuple[MeasurementKind, Mapping[str, str | int]]
"""The kind of measurement, and the columns by role."""

TABLE = "table"

_OVER_TIME = ((RELAXATION, "relax"), (CREEP, "creep"))  # with a word that the name of a step of such a test contains
_NOTHING = ("", "n/a", "n.a.", "nan")
_SWEPT = 1.5  # ratio of highest to lowest frequency, below which a step is no frequency sweep
_TEMPERATURE = re.compile(r"(?<!\d)([+-]?\d++(?:[.,]\d++)?)\s*+°\s*C")


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A table of readings of one `kind` with its `columns` by role; `file` is the index of its file, `format` that of an export.

    `temperature` in degC is that of all its readings, if the headers of its columns state it.
    """

    table: MeasuredTable
    columns: Mapping[str, str | int]
    kind: MeasurementKind
    file: int
    format: str
    deformation: Deformation | None
    step: str = ""
    temperature: float | None = None

    @property
    def is_export(self) -> bool:
        """Whether the part is from an export; rows without measured values are then not mistakes of the user."""
        return self.format != TABLE

    def only(self, rows: NDArray[np.bool_]) -> Self:
        """The part with only those `rows` (mask)."""
        return replace(self, table=self.table.only(rows))

    def column(self, role: str) -> NDArray[np.float64]:
        """The numbers (rows,) in the column of `role`, in SI; raises `InputError` with the file, and the line or column."""
        return self.table.column(self.columns[role], role, ROLES[role])

    def filled(self, role: str) -> NDArray[np.bool_]:
        """Mask (rows,) of the rows with a reading in the column of `role`, not a mark for a missing one."""
        cells = self.table.cells[self.table.find(self.columns[role], role)]
        return np.array([cell.strip("-").casefold() not in _NOTHING for cell in cells], dtype=bool)

    def temperature_in_step(self) -> float | None:
        """The temperature in degC in the name of the step, as in `Frequency sweep (150.0 °C)`."""
        match = _TEMPERATURE.search(self.step)
        return float(match[1].replace(",", ".")) if match else None


def parts_of(content: bytes, source: str, file: int, data: MeasuredData) -> tuple[list[Part], list[str]]:
    """The parts of a file that `data` asks for, and the names of the steps of an export that are not used.

    Raises `InputError` with the file, and the line or step.
    """
    text = decode(content, source, data.text_format())
    layout = None if data.is_plain else recognise(text)
    if layout is None:
        return _plain_parts(content, source, file, data), []
    try:
        steps = layout.read(text, source)
    except InputError as error:
        if data.columns is None:
            raise
        raise error.adding(f' (or is it no {layout.name} export? say format = "table")') from None
    decimal = None if is_workbook(content) else data.decimal
    steps = [
        replace(step, table=replace(step.table, stated_units=data.units, decimal=decimal or step.table.decimal)) for step in steps
    ]
    _check_chosen(steps, source, data.steps)
    parts, left_out = [], []
    for number, step in enumerate(steps, start=1):
        chosen = data.steps is None or any(_is_meant(entry, number, step.name) for entry in data.steps)
        measured = _measured(step, data, data.steps is not None) if chosen else None
        if measured is None:
            if chosen and data.steps is not None:
                raise InputError(_what_is_there(step), file=source)
            left_out.append(step.name)
            continue
        kind, columns = measured
        if not kind.over_frequency and number > 1:
            _refuse_running_clock(step, steps[number - 2], columns)
        parts.append(Part(step.table, columns, kind, file, layout.name, step.deformation, step.name))
    if not parts:
        tests = KINDS[data.measurement].tests if data.measurement else "frequency sweep, relaxation or creep test"
        there = "; ".join(_what_is_there(step) for step in steps[:3]) + (" ..." if len(steps) > 3 else "")
        raise InputError(f"no {tests} found in this {layout.name} export: {there or 'it has no steps'}", file=source)
    return parts, left_out


def _plain_parts(content: bytes, source: str, file: int, data: MeasuredData) -> list[Part]:
    """The parts of a plain table: one, or one for each temperature that its headers state."""
    table = read_measured(content, source, data.text_format(), data.units)
    columns = CurveColumns() if data.columns is None and isinstance(data, CurveData) else data.columns
    if isinstance(data, MeasurementData) and not data.temperature_keys and data.layout != "long":
        least = 1 if data.layout == "wide" else 2
        unit = data.units.get("temperature") if data.layout == "wide" else None
        tables = by_temperature(table, unit, "compliance" if data.measurement == "creep" else "modulus")
        if len(tables) >= least:
            return [_of_wide(part, file, data, columns, temperature) for temperature, part in tables]
        if data.layout == "wide":
            raise InputError('layout = "wide", but no header states a temperature, such as "E (20 °C) [MPa]"', file=source)
    if columns is None:
        there, recipe = ", ".join(map(shown, table.names)), f"dielast new mastercurve --data {source}"
        stated = f"state data.columns, or let {recipe} do it; there are {there}"
        raise InputError(f"columns are needed: this is no instrument's export that dielast knows; {stated}", file=source)
    if data.steps is not None:
        raise InputError("steps are wanted, but this is no instrument's export that dielast knows", file=source)
    kind, roles = _stated(data, columns)
    return [Part(table, roles, kind, file, TABLE, "tension")]


def by_temperature(table: MeasuredTable, unit: str | None, nameless: str) -> list[tuple[float, MeasuredTable]]:
    """A table for each temperature in degC in the headers of `table`, or in the row above them, in their order.

    Each has the columns of its temperature and the columns without a temperature, such as a common time, and the rows in which the
    former are not empty; the names no longer contain the temperature. `unit` is that of bare numbers in headers, None if these are
    not temperatures; `nameless` is the name of a column whose header is only a temperature. Raises `InputError` if a dash before a
    temperature may or may not be a sign.
    """
    unnamed = not any(header.spelled for header in table.headers)  # a row of temperatures and no other
    headers = []
    for header in table.headers:
        spelled, level = header.spelled or header.name, header.temperature
        with located(file=table.source):
            stated = temperature_in(spelled, unit)
        if stated is not None:
            level, rest = stated
            name, stated_unit = split_header(rest if rest[:1].isalpha() else f"{nameless} {rest}")
            in_row_below = stated_unit is None and header.unit != split_header(spelled)[1]
            headers.append(ColumnHeader(name, header.unit if in_row_below else stated_unit, temperature=level))
        else:
            headers.append(replace(header, name=nameless) if unnamed and level is not None else header)
    used = [k for k, header in enumerate(headers) if header.name or any(table.cells[k])]
    shared = [k for k in used if headers[k].temperature is None]
    parts: list[tuple[float, MeasuredTable]] = []
    for level in dict.fromkeys(header.temperature for header in headers):
        columns = [k for k in used if headers[k].temperature == level]
        rows = np.array([any(cells) for cells in zip(*(table.cells[k] for k in columns), strict=True)], dtype=bool)
        if level is not None and rows.any():
            filled, kept = table.only(rows), [*shared, *columns]
            plain = tuple(ColumnHeader(headers[k].name, headers[k].unit) for k in kept)
            parts.append((level, replace(filled, headers=plain, cells=tuple(filled.cells[k] for k in kept))))
    return parts


def _of_wide(table: MeasuredTable, file: int, data: MeasuredData, columns: Columns | None, temperature: float) -> Part:
    """The part of one temperature; columns that the recipe does not name are identified by their names."""
    measured = _stated(data, columns) if columns is not None else _measured(ExportedStep("", table, None), data, True)
    if measured is None:
        raise table.error(f"columns are needed: at {temperature:g} degC there are {table.quoted_names}")
    kind, roles = measured
    return Part(table, roles, kind, file, TABLE, "tension", temperature=temperature)


def _stated(data: MeasuredData, columns: Columns) -> Measured:
    """The kind of measurement and the columns by role, as the recipe states them; the default name of the time column is "time"."""
    kind = KINDS[data.measurement or columns.measurement]
    return kind, ({} if kind.over_frequency else {"time": "time"}) | columns.by_role


def _is_meant(entry: str | int, number: int, name: str) -> bool:
    return entry == number if isinstance(entry, int) else fnmatch.fnmatch(name.casefold(), entry.casefold())


def _check_chosen(steps: Sequence[ExportedStep], source: str, chosen: Sequence[str | int] | None) -> None:
    for entry in chosen or ():
        if not any(_is_meant(entry, number, step.name) for number, step in enumerate(steps, start=1)):
            there = ", ".join(f'{number} "{step.name}"' for number, step in enumerate(steps, start=1))
            raise InputError(f"no step {shown(entry)}; there are {there[:300]}", file=source)


def _what_is_there(step: ExportedStep) -> str:
    if not step.table.lines.size:
        return f'step "{step.name}" is empty'
    names = ", ".join(step.table.names[:8]) + (" ..." if len(step.table.names) > 8 else "")
    return f'step "{step.name}" has {names}'


def _measured(step: ExportedStep, data: MeasuredData, chosen: bool) -> Measured | None:
    """The kind of measurement in a step, and its columns by role; None if the step is not suitable for a master curve.

    Every kind of test exports strain and stress. They are used if the name of the step contains relaxation or creep, or if the
    recipe names the step and states the kind.
    """
    if not step.table.lines.size:
        return None
    if data.columns is not None:
        return _stated(data, data.columns)
    by_role = columns_by_role(step.table)
    name = step.name.casefold()
    possible: dict[MeasurementKind, Sequence[str]] = {}
    moduli = next((roles for roles in MODULI if roles <= by_role.keys()), None)
    swept = [role for role in ("frequency", "angular_frequency") if role in by_role]
    if moduli and swept:
        frequencies = [abs(number) for number in _numbers(step.table, by_role[swept[0]] - 1)]
        if len(frequencies) > 1 and max(frequencies) > _SWEPT * min(frequencies):
            possible[OSCILLATION] = [*swept, *moduli, "complex_viscosity"]
    for kind, hint in _OVER_TIME if "time" in by_role else ():
        hinted = hint in name and "recover" not in name
        if kind.value in by_role and (hinted or OSCILLATION not in possible):
            possible[kind] = ["time", kind.value]
        elif {"strain", "stress"} <= by_role.keys() and (hinted or (chosen and data.measurement == kind.name)):
            possible[kind] = ["time", "strain", "stress"]
    kinds = [KINDS[data.measurement]] if data.measurement else list(possible)
    if data.measurement is None and len(possible) > 1:
        kinds = [kind for kind in possible if kind.name[:5] in name] or kinds
    for kind in kinds:
        if kind in possible:
            return kind, {role: by_role[role] for role in ("temperature", *possible[kind]) if role in by_role}
    return None


def _numbers(table: MeasuredTable, index: int) -> list[float]:
    return [float(cell.replace(",", ".")) for cell in table.cells[index] if is_number(cell, table.decimal)]


def _refuse_running_clock(step: ExportedStep, before: ExportedStep, columns: Mapping[str, str | int]) -> None:
    """`InputError` if the time continues from the step before: every time of the step would be too long."""
    table = step.table
    index = table.find(columns["time"], "time")
    name = table.names[index]
    same = [k for k, earlier in enumerate(before.table.names) if earlier == name]
    if plain(name) not in ("time", "zeit") or not same:
        return
    earlier, later = _numbers(before.table, same[0]), _numbers(table, index)
    if earlier and later and 0 < earlier[-1] <= later[0]:
        raise table.error(f'column "{name}" runs on from the step before into step "{step.name}": export the step time as well', 0)
