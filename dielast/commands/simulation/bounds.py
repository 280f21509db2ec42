"""Bounds from draws of the material: the cases of a simulation, or the cells of a map, are solved again with every draw."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from dielast.base.errors import in_a_draw, warn
from dielast.commands.simulation.cases import Batches, SimulationBatch
from dielast.commands.simulation.result import BoundedEvent, CaseResult, SolvedCase, StatedCase
from dielast.handover.law_section import breakdown
from dielast.io.table import Column, Table, split_header
from dielast.material.intervals import DrawIntervals
from dielast.material.scatter import Sample
from dielast.mechanics.cases import of_case
from dielast.mechanics.criteria import named
from dielast.numerics.arrays import Flags, Floats
from dielast.sharing.study import Draws, Study
from dielast.simulate.events import EVENT_UNITS, Event, event_columns
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import POWER, UNITS as LINE_UNITS, LifetimeLine
from dielast.simulate.map_plan import column_of
from dielast.simulate.quantities import CELLS, quantity_of

SURVIVING = "surviving [1]"
FAILURE = "failure"  # the first of all failures


def bounded_cases(batches: Batches, cases: Sequence[SolvedCase], study: Study) -> list[CaseResult]:
    """The results, with bounds in cases with draws, which are divided into `batches`."""
    drawn: dict[int, Draws[CaseResult]] = {}
    for number, case in enumerate(cases):
        if case.sample is not None:
            parts = draws_of(batches, case, case.sample, case.result, "uncertainty", of_case(number, len(cases)))
            intervals = case.recipe.uncertainty.intervals(case.sample.laws)
            drawn[number] = Draws(len(drawn), parts, partial(_bounded, case.result, intervals=intervals))
    bounds = dict(zip(drawn, study.batches(list(drawn.values()), "draws"), strict=True))
    return [bounds.get(number, case.result) for number, case in enumerate(cases)]


def draws_of(
    batches: Batches, case: StatedCase, sample: Sample, result: CaseResult, key: str, number: int | None
) -> list[SimulationBatch]:
    """The draws of a case in batches, whose errors name the `key` that states the draws, and the `number` of the case."""
    with in_a_draw(key=key, case=number):
        parts = batches(drawn_case(case, sample, result), sample.thickness_factor)
    return [replace(part, place={"key": key, "case": number}) for part in parts]


def _bounded(result: CaseResult, drawn: Sequence[CaseResult], intervals: DrawIntervals) -> CaseResult:
    """The result of a case with bounds from its draws, a film's events too."""
    if result.events is None:
        return bounded(result, drawn, intervals)
    events = [draw.events or () for draw in drawn]
    failed = [any(named(event.name).is_failure for event in draw) for draw in events]
    return replace(bounded(result, drawn, intervals, failed), bounded_events=bounded_events(result.events, events, intervals))


def drawn_case(case: StatedCase, sample: Sample, result: CaseResult) -> list[StatedCase]:
    """A case with the material of each draw of a sample. A draw of a film has its breakdown field in its material, and the rows of
    the result, including the last row.
    """
    if result.events is None:
        return [StatedCase(case.recipe, member, case.steps, None) for member in sample.specimens()]
    stated, time = breakdown(case.recipe.breakdown), result.columns["time [s]"]
    # of two rows at one time, the second is after a jump
    times = np.where(np.diff(time, prepend=np.nan) == 0, np.nextafter(time, np.inf), time).tolist() or None
    output = case.recipe.output.model_copy(update={"times": times, "profile": None})
    recipe = case.recipe.model_copy(update={"breakdown": None, "output": output})
    drawn = []
    for member, factor in zip(sample.aged(), sample.breakdown_factor.tolist(), strict=True):
        field = stated or member.breakdown
        material = replace(member, breakdown=None if field is None else field.scaled(factor))
        drawn.append(StatedCase(recipe, material, case.steps, None))
    return drawn


def _passed(time: Floats) -> Flags:
    """Rows between two jumps at one time, which have the same time as the rows after them."""
    first, last = np.diff(time, prepend=np.nan) != 0, np.diff(time, append=np.nan) != 0
    return np.asarray(~last & (~first | (time == 0)))


def bounded(
    result: CaseResult, drawn: Sequence[CaseResult], intervals: DrawIntervals, failed: Sequence[bool] | None = None
) -> CaseResult:
    """The result of a case, with lower and upper bounds of each column in which the draws differ.

    For films, `failed` says which draws end by failure. From then on, such a draw counts as above every upper bound of stretches
    and field, and as below every lower bound of stress and stability; a bound among failed draws is infinite. A further column
    holds the share of draws that had not failed by each time. A draw that ends for another reason is no longer counted.
    """
    time = result.columns["time [s]"]
    there = np.isfinite(_stacked([draw.columns["time [s]"] for draw in drawn], time.size))
    lost = ~there & np.array(failed if failed is not None else [False] * len(drawn))[:, None]
    determined = ~_passed(time) if failed is not None else np.ones(time.size, dtype=bool)
    columns: dict[str, Floats] = {}
    for header, values in result.columns.items():
        columns[header] = values
        quantity = quantity_of(header)
        if header not in result.stated and (quantity is None or quantity.written):
            table = _stacked([draw.columns[header] for draw in drawn], time.size)
            beyond = -np.inf if quantity is not None and quantity.falls else np.inf
            low, high = intervals.of(np.where(determined, np.where(lost, beyond, table), np.nan))
            columns[_bound_header(header, "lower")], columns[_bound_header(header, "upper")] = low, high
    if failed is not None:
        columns[SURVIVING] = np.sum(there, axis=0) / np.maximum(np.sum(there | lost, axis=0), 1)
    return replace(result, columns=columns)


def band(columns: Mapping[str, Floats], x: str, y: str) -> tuple[Floats, Floats, Floats] | None:
    """x, lower and upper y of a case with bounds, for a figure; None if x is uncertain as well."""
    if _bound_header(x, "lower") in columns or _bound_header(y, "lower") not in columns:
        return None
    return columns[x], columns[_bound_header(y, "lower")], columns[_bound_header(y, "upper")]


def _bound_header(header: str, which: str) -> str:
    name, unit = split_header(header)
    return f"{name}_{which} [{unit}]"


def _stacked(columns: Sequence[Floats], rows: int) -> Floats:
    """A column of several draws as (draws, rows), NaN after the end of a draw."""
    table = np.full((len(columns), rows), np.nan)
    for row, values in zip(table, columns, strict=True):
        row[: min(rows, values.size)] = values[:rows]
    return table


def bounded_events(events: Sequence[Event], drawn: Sequence[Sequence[Event]], intervals: DrawIntervals) -> list[BoundedEvent]:
    """The events of a case with bounds, and the events that happen in draws only.

    A draw without the event counts as an infinite time, so that a time may have no upper bound. Bounds of other quantities are
    those of the draws in which the event happens. If lives are assured, the draws are those of the film before which a share
    fails, and the time that they exceed is stated.
    """
    count: Counter[str] = Counter()
    rows: list[tuple[str, int, Event | None]] = []
    for event in events:
        rows.append((event.name, count[event.name], event))
        count[event.name] += 1
    rows += [(name, 0, None) for name in dict.fromkeys(event.name for draw in drawn for event in draw) if name not in count]
    result = []
    for name, which, central in rows:
        same = [[event for event in draw if event.name == name][which : which + 1] for draw in drawn]
        bounds = {}
        for number in EVENT_UNITS:
            absent = np.inf if number == "time" else np.nan
            low, high = intervals.of(np.array([float(getattr(draw[0], number)) if draw else absent for draw in same]))
            bounds[number] = float(low), float(high)
        times = np.array([draw[0].time if draw else np.inf for draw in same])
        life = intervals.assured(times)
        share = sum(map(len, same)) / len(same)
        result.append(BoundedEvent(name, central, bounds, share, None if life is None else float(life)))
    return result


def bounded_event_columns(events: Sequence[Sequence[BoundedEvent]]) -> Table:
    """The table of events with bounds, by case; an event that happens in draws only has bounds only."""
    absent = dict.fromkeys(EVENT_UNITS, np.nan)
    table = event_columns([[row.event or Event(row.name, **absent) for row in rows] for rows in events])
    flat = [row for rows in events for row in rows]
    bounds = {name: np.array([row.bounds[name] for row in flat], dtype=float).reshape(-1, 2).T for name in EVENT_UNITS}
    lives = [row.assured_life for row in flat]
    return [
        *_between_bounds(table, bounds),
        Column("probability", "1", np.array([row.probability for row in flat], dtype=float)),
        *([Column("assured_life", "s", np.array(lives, dtype=float))] if any(life is not None for life in lives) else []),
    ]


def _between_bounds(columns: Sequence[Column], bounds: Mapping[str, Iterable[Floats]]) -> list[Column]:
    """The columns, followed by their lower and upper bounds, if they have any."""
    result = []
    for column in columns:
        pairs = zip(("lower", "upper"), bounds.get(column.name, ()), strict=False)
        name, after, when = column.name.partition(" after ")
        result += [column, *(Column(f"{name}_{which}{after}{when}", column.unit, values.ravel()) for which, values in pairs)]
    return result


def map_bounds(drawn: Sequence[FailureMap], intervals: DrawIntervals) -> dict[str, tuple[Floats, Floats]]:
    """Lower and upper bounds of times and stretches of a map by column name; infinite for a time beyond the horizon, and for the
    stretch of a film that has failed before.
    """
    finished = np.array([draw.failure_mode != "unfinished" for draw in drawn])
    bounds = {}
    for name in (*drawn[0].times, FAILURE):
        times = np.array([draw.time_to_failure if name == FAILURE else draw.times[name] for draw in drawn])
        bounds[column_of(name)] = intervals.of(np.where(np.isnan(times), np.where(finished, np.inf, np.nan), times))
    for when in drawn[0].relative_stretch:
        # a failed film counts as above every stretch
        failed = np.array([draw.time_to_failure < draw.stretch_at[when] for draw in drawn])
        for axis in range(len(drawn[0].relative_stretch[when])):
            stretch = np.array([draw.relative_stretch[when][axis] for draw in drawn])
            bounds[f"relative_stretch_{axis + 1} after {when}"] = intervals.of(np.where(failed, np.inf, stretch))
    for quantity in CELLS:
        values = np.array([quantity.of(draw) for draw in drawn])
        lost = np.isnan(values) & finished
        bounds[quantity.name] = intervals.of(np.where(lost, -np.inf if quantity.falls else np.inf, values))
    return bounds


def warn_of_lives_outside(result: FailureMap, bounds: tuple[Floats, Floats]) -> None:
    """Warn of cells whose own time to failure is not between its `bounds`, each of the shape of the map."""
    life = np.where(np.isnan(result.time_to_failure), np.inf, result.time_to_failure)
    outside = (result.failure_mode != "unfinished") & ((life < bounds[0]) | (life > bounds[1]))
    if count := int(np.count_nonzero(outside)):
        what = f"{count} of {outside.size} cells: the time to failure of the stated material is outside the interval of its draws"
        warn(
            f"{what}: a best fit is one of the materials that its tests allow, and not in their middle where they leave a constant "
            "open; the interval is what is known"
        )


def bounded_map_columns(columns: Sequence[Column], drawn: Sequence[FailureMap], intervals: DrawIntervals) -> list[Column]:
    """The table of a map with bounds of each time, and the probability of failure: the share of the draws that fail within the
    horizon, among those with a known result; if lives are assured, also the life that draws exceed, infinite beyond the horizon.
    """
    failed = np.array([np.isfinite(draw.time_to_failure) for draw in drawn])
    finished = np.array([draw.failure_mode != "unfinished" for draw in drawn])
    probability = np.sum(failed, axis=0) / np.maximum(np.sum(finished, axis=0), 1)
    result = [*_between_bounds(columns, map_bounds(drawn, intervals)), Column("failure_probability", "1", probability.ravel())]
    lives = np.array([np.where(np.isnan(draw.time_to_failure), np.inf, draw.time_to_failure) for draw in drawn])
    if (assured := intervals.assured(np.where(finished, lives, np.nan))) is not None:
        result.append(Column("assured_life", "s", assured.ravel()))
    return result


def bounded_line_columns(
    columns: Sequence[Column], drawn: Sequence[Sequence[LifetimeLine]], intervals: DrawIntervals
) -> list[Column]:
    """The table of lifetime lines with bounds of each number, from the lines of all draws."""
    names = (*LINE_UNITS, *POWER)
    numbers = {name: np.array([[getattr(line, name) for line in lines] for lines in drawn], dtype=float) for name in names}
    return _between_bounds(columns, {name: intervals.of(values) for name, values in numbers.items()})
