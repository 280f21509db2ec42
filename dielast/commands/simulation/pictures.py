"""The figure of the cases of a recipe, over a column of their results or over a swept key."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from dielast.commands.simulation.naming import labels, swept, titled
from dielast.material.material import Material
from dielast.mechanics.criteria import named
from dielast.numerics.arrays import Flags, Floats
from dielast.plots.events import Band, Mark, Span
from dielast.plots.looks import Swept
from dielast.plots.simulation import plot_cases
from dielast.plots.style import lasting
from dielast.recipe.cases import Case

if TYPE_CHECKING:
    from dielast.commands.simulation.compare import Match

SKIPPED = 20.0  # ratio of time intervals that shows that cycles between two rows are left out


@dataclass(frozen=True, slots=True)
class FilmEvent:
    """An event of a film in a figure: its `name`, its time in s, and `x` and `y` in SI."""

    name: str
    time: float
    x: float
    y: float


def picture(
    cases: Sequence[Case[Any]],
    materials: Sequence[Material],
    columns: Sequence[Mapping[str, Floats]],
    matches: Sequence[Match],
    axes: tuple[str, str, tuple[str, str]],
    bands: Sequence[Band | None],
    interval: str,
    events: Sequence[Sequence[FilmEvent]] = (),
    spans: Sequence[Span | None] = (),
) -> Figure:
    """The figure of the cases: a line for each case over a column of its results, or lines that join all cases at equal times.

    `axes` are those of `axes_of`; `events` are by case, and `spans` are their lower and upper x, one after the other. If x is a
    swept key, the x of an event is its time.
    """
    x, y, scales = axes
    title, times = cases[0].recipe.title, cases[0].recipe.output.times
    if joined(x, cases, columns):
        title = titled(title, cases, materials, _after(columns, events, times))
        return _across_cases(x, y, scales, title, cases, materials, columns, times, bands, interval, events)
    drawn: list[Mapping[str, Floats]] = []
    failed: list[int | None] = []
    for index, table in enumerate(columns):
        happened = events[index] if index < len(events) else ()
        # the line includes the events, as the rows of the table may be sparse
        order = np.argsort(np.append(table["time [s]"], [event.time for event in happened]), kind="stable")
        extra = {x: [event.x for event in happened], y: [event.y for event in happened]}
        line = {header: np.append(table[header], values)[order] for header, values in extra.items()}
        left_out = _left_out(cases[index].recipe, np.append(table["time [s]"], [event.time for event in happened])[order])
        line[y] = np.where(left_out, np.nan, line[y])
        drawn.append(line)
        failures = [table["time [s]"].size + place for place, event in enumerate(happened) if named(event.name).is_failure]
        failed.append(int(np.flatnonzero(np.isin(order, failures))[0]) if failures else None)
    marks = [(index, event.name, event.x, event.y) for index, happened in enumerate(events) for event in happened]
    return plot_cases(
        drawn,
        labels(cases, materials),
        [entry for entry in matches if entry.headers == (x, y)],
        x,
        y,
        scales,
        titled(title, cases, materials),
        marks,
        swept(cases, materials),
        [_parted(*each) for each in zip(bands, cases, columns, strict=True)] if bands else [],
        interval,
        spans,
        failed,
    )


def _parted(band: Band | None, case: Case[Any], table: Mapping[str, Floats]) -> Band | None:
    """A band of a table with nothing across the cycles that the table leaves out."""
    if band is None or band[0].size != table["time [s]"].size:
        return band
    along, lower, upper = band
    return along, np.where(_left_out(case.recipe, table["time [s]"]), np.nan, lower), upper


def _left_out(recipe: Any, time: Floats) -> Flags:
    """The last row (times,) before cycles that the table leaves out, where the line is broken."""
    periods = [period for step in recipe.step if (period := getattr(step, "period", None)) is not None]
    gaps = np.diff(time, append=np.inf)
    if not periods or recipe.output.times is not None or time.size < 3:
        return np.zeros(time.size, dtype=bool)
    before, after = np.append(np.inf, gaps[:-1]), np.append(gaps[1:], np.inf)
    # rows of a cycle are dense, and intervals of a hold grow slowly
    return np.asarray((gaps > 0.75 * min(periods)) & (gaps > SKIPPED * np.minimum(before, after)) & np.isfinite(gaps))


def _after(columns: Sequence[Mapping[str, Floats]], events: Sequence[Sequence[FilmEvent]], times: Sequence[float] | None) -> str:
    """The time of the points of a sweep, if all cases that have not failed share one."""
    if times is not None:
        return f"after {lasting(times[0])}" if len(times) == 1 else ""
    failed = {case for case, happened in enumerate(events) if any(named(event.name).is_failure for event in happened)}
    reached = [table["time [s]"] for case, table in enumerate(columns) if case not in failed and table["time [s]"].size]
    ends = {f"after {lasting(time[-1])}" for time in reached}
    return ends.pop() if len(ends) == 1 else ""


def joined(x: str, cases: Sequence[Case[Any]], columns: Sequence[Mapping[str, Floats]]) -> bool:
    """Whether lines join cases rather than times: as the recipe states, else if the line of a case would have a single x."""
    if x in cases[0].settings:
        return True
    plot, stated = cases[0].recipe.plot, cases[0].recipe.output.times
    if plot.join is not None:
        return bool(plot.join == "cases")
    if x == "time [s]" or stated is None or len(cases) == 1:
        return False
    return all(np.ptp(table[x]) <= 1e-9 * np.max(np.abs(table[x])) for table in columns if table[x].size)


def _across_cases(
    x: str,
    y: str,
    scales: tuple[str, str],
    title: str,
    cases: Sequence[Case[Any]],
    materials: Sequence[Material],
    columns: Sequence[Mapping[str, Floats]],
    times: Sequence[float] | None,
    bands: Sequence[Band | None],
    interval: str,
    events: Sequence[Sequence[FilmEvent]],
) -> Figure:
    """Column `y` of every case, at its end or at each of the output `times`, over `x`, a swept key or a column.

    A line joins the cases in the order of that key, or of the quantity with most values. `bands` have the rows of the `columns`. A
    case that failed earlier has a mark at its failure instead of points after it.
    """
    factors = swept(cases, materials)
    is_key = x in cases[0].settings
    most = max(range(len(factors)), key=lambda one: (bool(factors[one].values), len(factors[one].levels)))
    axis = factors.pop(list(cases[0].settings).index(x) if is_key else most)
    header = axis.label if is_key else x
    wanted: list[float | None] = [None] if times is None else list(times)
    groups: dict[tuple[str, ...], list[int]] = {}
    for case in sorted(range(len(cases)), key=lambda case: axis.levels.index(axis.level(case))):
        groups.setdefault(tuple(one.text(case) for one in factors), []).append(case)
    failed = {
        case: event.time for case, happened in enumerate(events) for event in reversed(happened) if named(event.name).is_failure
    }
    series: list[dict[str, Floats]] = []
    drawn: list[Band | None] = []
    members: list[int] = []
    marks: list[Mark] = []
    for group in groups.values():
        # marks are drawn with the first line of the group
        marks += [
            (len(series), event.name, axis.values[case] if is_key else event.x, event.y)
            for case in group
            if case in failed
            for event in events[case]
            if named(event.name).is_failure and event.time == failed[case]
        ]
        for time in wanted:
            rows = [_row(columns[case]["time [s]"], time, failed.get(case)) for case in group]
            along = (
                np.array([axis.values[case] for case in group]) if is_key else _taken([columns[case][x] for case in group], rows)
            )
            series.append({header: along, y: _taken([columns[case][y] for case in group], rows)})
            known = [bands[case] if case < len(bands) else None for case in group]
            low, high = (_taken([None if one is None else one[side] for one in known], rows) for side in (1, 2))
            drawn.append((along, low, high) if np.any(np.isfinite(low)) else None)
            members.append(group[0])
    lines = [Swept(one.label, *_of(one, members)) for one in factors]
    if times is not None and len(times) > 1:
        texts = tuple(f"after {lasting(time)}" for time in times)
        lines.append(Swept("time [s]", tuple(times) * len(groups), texts * len(groups)))
    names = [", ".join(one.text(index) for one in lines) for index in range(len(series))]
    return plot_cases(series, names, (), header, y, scales, title, marks, lines, drawn, interval)


def _of(one: Swept, members: Sequence[int]) -> tuple[tuple[float, ...], tuple[str, ...]]:
    return tuple(one.values[case] for case in members) if one.values else (), tuple(one.text(case) for case in members)


def _row(time: Floats, wanted: float | None, failed: float | None) -> int | None:
    """The row of a case at a time, or its last row; None if the time was not reached, or if the film had failed by then."""
    if not time.size or (failed is not None and (wanted is None or wanted >= failed)):
        return None
    if wanted is None:
        return time.size - 1
    rows = np.flatnonzero(np.isclose(time, wanted, rtol=1e-9, atol=0.0))
    return int(rows[-1]) if rows.size else None


def _taken(values: Sequence[Floats | None], rows: Sequence[int | None]) -> Floats:
    pairs = zip(values, rows, strict=True)
    return np.array([np.nan if column is None or row is None else column[row] for column, row in pairs])
