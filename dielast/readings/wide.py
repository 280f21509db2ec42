"""Wide tables, with separate columns for each temperature, divided into one table per temperature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dielast.errors import located
from dielast.io.header import temperature_in
from dielast.io.table import split_header
from dielast.io.text_table import MeasuredTable


def by_temperature(table: MeasuredTable, unit: str | None, nameless: str) -> list[tuple[float, MeasuredTable]]:
    """A table for each temperature in degC in the headers of `table`, or in the row above them, in their order.

    Each has the columns of its temperature and the columns without a temperature, such as a common time, and the rows in which the
    former are not empty; the names no longer contain the temperature. `unit` is that of bare numbers in headers, None if these are
    not temperatures; `nameless` is the name of a column whose header is only a temperature. Raises `InputError` if a dash before a
    temperature may or may not be a sign.
    """
    spelled = table.spelled or table.names
    above = table.over or (None,) * len(table.names)
    names, units, temperature = list(table.names), list(table.units), list(above)
    if not table.spelled:  # a row of temperatures and no other
        names = [name if level is None else nameless for name, level in zip(names, above, strict=True)]
    for k, header in enumerate(spelled):
        with located(file=table.source):
            stated = temperature_in(header, unit)
        if stated is None:
            continue
        temperature[k], rest = stated
        names[k], unit_of_header = split_header(rest if rest[:1].isalpha() else f"{nameless} {rest}")
        if unit_of_header is not None or units[k] is None or units[k] == split_header(header)[1]:
            units[k] = unit_of_header
    shared = [k for k, level in enumerate(temperature) if level is None and (names[k] or any(table.cells[k]))]
    parts: list[tuple[float, MeasuredTable]] = []
    for level in dict.fromkeys(level for level in temperature if level is not None):
        columns = [k for k, there in enumerate(temperature) if there == level and (names[k] or any(table.cells[k]))]
        rows = np.flatnonzero([any(cells) for cells in zip(*(table.cells[k] for k in columns), strict=True)])
        if not rows.size:
            continue
        kept = [*shared, *columns]
        parts.append(
            (
                level,
                replace(
                    table,
                    names=tuple(names[k] for k in kept),
                    units=tuple(units[k] for k in kept),
                    cells=tuple([table.cells[k][row] for row in rows] for k in kept),
                    lines=table.lines[rows],
                    spelled=(),
                    over=(),
                ),
            )
        )
    return parts
