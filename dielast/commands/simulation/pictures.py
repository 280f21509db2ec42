"""The figure of the cases of a recipe, over a column of their results or over a swept key."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from dielast.commands.simulation.bounds import band
from dielast.commands.simulation.cases import quantity_of_cycles
from dielast.commands.simulation.naming import labels, swept, titled
from dielast.commands.simulation.result import SolvedCase, at_event
from dielast.commands.simulation.timed_steps import TimedSteps
from dielast.commands.simulation.uncertainty import interval_label
from dielast.material.material import Material
from dielast.mechanics.criteria import named
from dielast.mechanics.load import Waveform
from dielast.numerics.arrays import Flags, Floats
from dielast.plots.events import Band, Curve, Mark
from dielast.plots.looks import Swept, arrange
from dielast.plots.simulation import plot_cases, plot_cycles
from dielast.plots.texts import lasting, number, unit_for
from dielast.recipe.cases import Case

if TYPE_CHECKING:
    from dielast.commands.simulation.compare import Match

SKIPPED = 0.75  # of a period: rows of one cycle are closer together
ROUNDING = 1e-9  # relative, of the times at which steps begin and end
NOTHING: Floats = np.empty(0)
"""The points of a case that no panel shows."""


@dataclass(frozen=True, slots=True, eq=False)
class _Curve:
    """What the figure shows of one case: its `steps`, the `table` of its columns (rows,), its bounds, and its events by time."""

    case: Case[Any]
    steps: TimedSteps
    table: Mapping[str, Floats]
    band: Band | None
    marks: Sequence[tuple[float, Mark]]

    @property
    def failed(self) -> float | None:
        """The time of the first failure."""
        return next((time for time, mark in self.marks if named(mark.name).is_failure), None)

    def left_out(self, time: Floats) -> Flags:
        """The last row (times,) before cycles that the table leaves out, where the line is broken."""
        recipe, last = self.case.recipe, np.zeros(time.size, dtype=bool)
        if recipe.output.times is not None:
            return last
        for timed in self.steps:
            if isinstance(wave := timed.step.target, Waveform):
                cycling = (time[:-1] >= timed.begin * (1 - ROUNDING)) & (time[1:] <= timed.end * (1 + ROUNDING))
                last[:-1] |= cycling & (np.diff(time) > SKIPPED * float(np.asarray(wave.period)))
        laps, lasts = np.array([(run.lap, run.lasts) for run in self.steps.runs()]).T
        if laps.max() > 1:
            ends, cycle = np.cumsum(lasts), np.flatnonzero(laps)
            begin, end = (ends - lasts)[cycle[0]] * (1 - ROUNDING), ends[cycle[-1]] * (1 + ROUNDING)
            first, later = (lasts[laps == lap].sum() * (1 - ROUNDING) for lap in (1, 2))
            skips = np.diff(time) >= np.where(time[:-1] < begin + first, first, later)
            last[:-1] |= (time[:-1] >= begin) & (time[1:] <= end) & skips
        return last

    def row(self, time: float | None) -> int | None:
        """The row at a time, or the last row; None if the time was not reached, or if the film had failed by then."""
        times, failed = self.table["time [s]"], self.failed
        if not times.size or (failed is not None and (time is None or time >= failed)):
            return None
        if time is None:
            return times.size - 1
        rows = np.flatnonzero(np.isclose(times, time, rtol=1e-9, atol=0.0))
        return int(rows[-1]) if rows.size else None


def picture(
    cases: Sequence[Case[Any]],
    solved: Sequence[SolvedCase],
    columns: Sequence[Mapping[str, Floats]],
    matches: Sequence[Match],
    axes: tuple[str, str, tuple[str, str]],
) -> Figure:
    """The figure of the cases: a line for each case over a column of its results, or lines that join all cases at equal times.

    `columns` are what can be drawn of the results, `axes` are those of `axes_of`.
    """
    materials = [case.material for case in solved]
    x, y, scales = axes
    is_key = x in cases[0].settings
    across = "time [s]" if is_key else x
    curves = [
        _Curve(case, film.steps, table, band(film.result.columns, across, y), _marks(film, table, across, y))
        for case, film, table in zip(cases, solved, columns, strict=True)
    ]
    interval = interval_label([case.recipe for case in cases])
    if is_key or _joined(x, curves):
        return _across_cases(x, y, scales, curves, materials, interval)
    lines, names, factors = list[Curve](), labels(cases, materials), swept(cases, materials)
    shown = set(arrange(names, factors, sum(curve.band is not None for curve in curves)).shown)
    for place, (curve, label) in enumerate(zip(curves, names, strict=True)):
        if place not in shown:
            lines.append(Curve(label, NOTHING, NOTHING, None if curve.band is None else (NOTHING,) * 3))
            continue
        # the line includes the events, as the rows of the table may be sparse
        marks = [mark for _, mark in curve.marks]
        time = np.append(curve.table["time [s]"], [time for time, _ in curve.marks])
        order = np.argsort(time, kind="stable")
        along = np.append(curve.table[x], [mark.x for mark in marks])[order]
        up = np.append(curve.table[y], [mark.y for mark in marks])[order]
        up = np.where(curve.left_out(time[order]), np.nan, up)
        failures = [time.size - len(marks) + row for row, mark in enumerate(marks) if named(mark.name).is_failure]
        failed = int(np.flatnonzero(np.isin(order, failures))[0]) if failures else None
        lines.append(Curve(label, along, up, _parted(curve), marks, failed))
    title = titled(cases[0].recipe.title, cases, materials, voltage_in_words(solved))
    compared = [(entry.case, Curve(entry.label, entry.x, entry.y)) for entry in matches if entry.headers == (x, y)]
    return plot_cases(lines, x, y, scales, title, measured=compared, swept=factors, interval=interval)


def voltage_in_words(cases: Sequence[SolvedCase]) -> str:
    """The highest voltage that was simulated, for the title; empty without a voltage, or if it is swept."""
    if any(getattr(case.recipe, "control", "") != "voltage" for case in cases):
        return ""
    highest = {max(map(abs, case.steps.targets), default=0.0) for case in cases}
    tables = (case.result.columns for case in cases if len(highest) == 1 and "voltage [V]" in case.result.columns)
    volts = max((float(np.max(np.abs(table["voltage [V]"]), initial=0.0)) for table in tables), default=0.0)
    # a film that fails on the way does not reach all stated voltages; one of an open circuit may reach more than the stated ones
    if not cases[0].recipe.programme:
        volts = min(max(highest, default=0.0), volts)
    if not volts:
        return ""
    unit, factor = unit_for("V", volts)
    return f"up to {number(volts * factor)} {unit}"


def picture_of_cycles(cases: Sequence[Case[Any]], solved: Sequence[SolvedCase], measured: str) -> Figure:
    """The figure of cases with many cycles."""
    tables = [case.result.cycles for case in solved if case.result.cycles is not None]
    materials = [case.material for case in solved]
    quantity = quantity_of_cycles([case.result for case in solved], measured)
    title = titled(cases[0].recipe.title, cases, materials, voltage_in_words(solved))
    return plot_cycles(tables, labels(cases, materials), swept(cases, materials), quantity, title)


def _marks(case: SolvedCase, table: Mapping[str, Floats], x: str, y: str) -> list[tuple[float, Mark]]:
    """The events of a case by time, with bars for the bounds of their times, if the horizontal axis is time."""
    spans = [event.bounds["time"] for event in case.result.bounded_events if event.event is not None and x == "time [s]"]
    found = []
    for event, span in zip_longest(case.result.events or (), spans):
        along, up = (at_event(event, table, header, case.recipe) for header in (x, y))
        found.append((event.time, Mark(event.name, along, up, span)))
    return found


def _parted(curve: _Curve) -> Band | None:
    """The bounds, with nothing across the cycles that the table leaves out."""
    time = curve.table["time [s]"]
    if curve.band is None or curve.band[0].size != time.size:
        return curve.band
    along, lower, upper = curve.band
    return along, np.where(curve.left_out(time), np.nan, lower), upper


def _after(curves: Sequence[_Curve], times: Sequence[float] | None) -> str:
    """The time of the points of a sweep, if all cases that have not failed share one."""
    if times is not None:
        return f"after {lasting(times[0])}" if len(times) == 1 else ""
    reached = [curve.table["time [s]"] for curve in curves if curve.failed is None and curve.table["time [s]"].size]
    ends = {f"after {lasting(time[-1])}" for time in reached}
    return ends.pop() if len(ends) == 1 else ""


def _joined(x: str, curves: Sequence[_Curve]) -> bool:
    """Whether lines join cases rather than times: as the recipe states, else if the line of a case would have a single x."""
    recipe = curves[0].case.recipe
    if recipe.plot.join is not None:
        return bool(recipe.plot.join == "cases")
    if x == "time [s]" or recipe.output.times is None or len(curves) == 1:
        return False
    along = [curve.table[x] for curve in curves]
    return all(np.ptp(values) <= 1e-9 * np.max(np.abs(values)) for values in along if values.size)


def _across_cases(
    x: str, y: str, scales: tuple[str, str], curves: Sequence[_Curve], materials: Sequence[Material], interval: str
) -> Figure:
    """Column `y` of every case, at its end or at each of the output times, over `x`, a swept key or a column.

    A line joins the cases in the order of that key, or of the quantity with most values. A case that failed earlier has a mark at
    its failure instead of points after it.
    """
    cases = [curve.case for curve in curves]
    times: Sequence[float] | None = cases[0].recipe.output.times
    factors = swept(cases, materials)
    is_key = x in cases[0].settings
    most = max(range(len(factors)), key=lambda factor: (bool(factors[factor].values), len(factors[factor].levels)))
    axis = factors.pop(list(cases[0].settings).index(x) if is_key else most)
    header = axis.label if is_key else x
    groups: dict[tuple[str, ...], list[int]] = {}
    rank = {level: place for place, level in enumerate(axis.levels)}
    for case in sorted(range(len(cases)), key=lambda case: rank[axis.level(case)]):
        groups.setdefault(tuple(factor.text(case) for factor in factors), []).append(case)
    several = times is not None and len(times) > 1
    series: list[Curve] = []
    members: list[int] = []
    for group in groups.values():
        # marks are drawn with the first line of the group
        marks = [
            Mark(mark.name, axis.values[case] if is_key else mark.x, mark.y)
            for case in group
            for time, mark in curves[case].marks
            if named(mark.name).is_failure and time == curves[case].failed
        ]
        for place, time in enumerate([None] if times is None else times):
            rows = [curves[case].row(time) for case in group]
            tables = [curves[case].table for case in group]
            along = np.array([axis.values[case] for case in group]) if is_key else _taken([table[x] for table in tables], rows)
            known = [curves[case].band for case in group]
            low, high = (_taken([None if bounds is None else bounds[side] for bounds in known], rows) for side in (1, 2))
            band = (along, low, high) if np.any(np.isfinite(low)) else None
            after = [f"after {lasting(time)}"] if several and time is not None else []
            label = ", ".join([*(factor.text(group[0]) for factor in factors), *after])
            up = _taken([table[y] for table in tables], rows)
            series.append(Curve(label, along, up, band, marks if place == 0 else ()))
            members.append(group[0])
    lines = [Swept(factor.label, *_of(factor, members)) for factor in factors]
    if times is not None and several:
        texts = tuple(f"after {lasting(time)}" for time in times)
        lines.append(Swept("time [s]", tuple(times) * len(groups), texts * len(groups)))
    title = titled(cases[0].recipe.title, cases, materials, _after(curves, times))
    return plot_cases(series, header, y, scales, title, swept=lines, interval=interval)


def _of(factor: Swept, members: Sequence[int]) -> tuple[tuple[float, ...], tuple[str, ...]]:
    return tuple(factor.values[case] for case in members) if factor.values else (), tuple(factor.text(case) for case in members)


def _taken(values: Sequence[Floats | None], rows: Sequence[int | None]) -> Floats:
    pairs = zip(values, rows, strict=True)
    return np.array([np.nan if column is None or row is None else column[row] for column, row in pairs])
