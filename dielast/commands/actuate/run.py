"""`actuate`: voltage history -> stretch of a prestretched film, and its failure."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dielast.commands.actuate.recipe import MAJOR_AXIS, MINOR_AXIS, ActuateRecipe
from dielast.commands.actuate.waveform import voltage_entries
from dielast.commands.simulation.cases import (
    CaseResult,
    SimulationBatch,
    axes_of,
    batches_of,
    case_columns,
    compare_headline,
    cycle_columns,
    cycles_of,
    each,
    failures,
    given_up,
    last,
    matches,
    one_or_all,
    read_materials,
    result_columns,
    temperature_of,
)
from dielast.commands.simulation.checks import warn_of_films
from dielast.commands.simulation.history import Entry, target_of, values_of
from dielast.commands.simulation.memory import check_series
from dielast.handover.material_file import breakdown
from dielast.io.files import Inputs
from dielast.material.material import Material
from dielast.mechanics.criteria import names
from dielast.mechanics.load import VoltageStep
from dielast.mechanics.stability import TimeScale
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution
from dielast.simulate.actuate import ActuationHistory, actuate
from dielast.simulate.events import Event, event_columns

if TYPE_CHECKING:
    from dielast.commands.simulation.bounds import FilmResult
    from dielast.commands.simulation.compare import Match

Array = NDArray[np.float64]
MEASURED = "relative_stretch_1 [1]"


def run(cases: Sequence[Case[ActuateRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Simulate every case, report."""
    recipe = cases[0].recipe
    materials = read_materials(cases, inputs)
    check_series(cases, 12, inputs, execution.jobs)
    films = solve_batches(film_batches(cases, materials, inputs), execution)
    results, events = [result for result, _ in films], [own for _, own in films]
    warn_of_films(cases, materials, results, events, [voltage_entries(case.recipe, inputs) for case in cases])
    told, happened = results, event_columns(events)
    intervals: dict[str, dict[str, Any]] = {}
    spans: list[tuple[float, float]] = []
    if any(case.recipe.uncertainty is not None for case in cases):
        from dielast.commands.simulation.bounds import bounded_event_columns, bounded_films
        from dielast.commands.simulation.uncertainty import samples_of, uncertainty_headline

        samples = samples_of(cases, materials, inputs)
        bounds = bounded_films(
            cases, samples, films, lambda own, drawn, thickness: film_batches(own, drawn, inputs, thickness), execution
        )
        told, told_events = [result for result, _ in bounds], [own for _, own in bounds]
        spans = [one.span for own in told_events for one in own if one.event is not None]
        if recipe.uncertainty is not None:
            happened = bounded_event_columns(told_events)
        intervals = uncertainty_headline([case.recipe.uncertainty for case in cases], samples)
    columns = [result.columns for result in results]
    seen = [dict(own) | electrode_axes(case.recipe, own) for case, own in zip(cases, columns, strict=True)]

    def again(case: int, times: Array) -> Mapping[str, Array]:
        one = cases[case].recipe
        output = one.output.model_copy(update={"times": times.tolist()})
        asked = Case(one.model_copy(update={"output": output}))
        repeated = solve_batches(film_batches([asked], [materials[case]], inputs))[0][0].columns
        return dict(repeated) | electrode_axes(one, repeated)

    found = matches(recipe, seen, inputs, again)
    x, y, scales = axes_of(cases, seen[0], MEASURED, time_scale="linear")

    def figure() -> Any:
        from dielast.commands.simulation.bounds import band
        from dielast.commands.simulation.pictures import FilmEvent, picture
        from dielast.commands.simulation.uncertainty import interval_label

        across = "time [s]" if x in cases[0].settings else x
        marks = [
            [
                FilmEvent(event.name, event.time, _at(event, own, across, case.recipe), _at(event, own, y, case.recipe))
                for event in events[index]
            ]
            for index, (case, own) in enumerate(zip(cases, seen, strict=True))
        ]
        bands, called = [band(one.columns, across, y) for one in told], interval_label([case.recipe for case in cases])
        return picture(cases, materials, seen, found, (x, y, scales), bands, called, marks, spans if x == "time [s]" else ())

    tables = {"actuate.csv": result_columns(told), "events.csv": happened, "cases.csv": case_columns(cases)}
    if (cycling := cycle_columns(results)) is not None:
        tables["cycles.csv"] = cycling
    return Report(tables, headline(cases, results, events, found) | intervals, figure, failures=failures(results))


def _at(event: Event, columns: Mapping[str, Array], header: str, recipe: ActuateRecipe) -> float:
    """The value of a column at an event: as located where the event holds it, else between the rows of the table."""
    located = {
        "time [s]": event.time,
        "voltage [V]": event.voltage,
        "stretch_1 [1]": event.stretch_1,
        "stretch_2 [1]": event.stretch_2,
        "relative_stretch_1 [1]": event.stretch_1 / recipe.film.prestretch[0],
        "relative_stretch_2 [1]": event.stretch_2 / recipe.film.prestretch[1],
        "true_field [V/m]": event.true_field,
    }
    return located.get(header) or float(np.interp(event.time, columns["time [s]"], columns[header]))


def headline(
    cases: Sequence[Case[ActuateRecipe]],
    results: Sequence[CaseResult],
    events: Sequence[Sequence[Event]],
    found: Sequence[Match],
) -> dict[str, dict[str, Any]]:
    """The last relative stretch of each case, and the first event of each kind in the cases that it happens in."""
    final: dict[str, list[float]] = {"relative_stretch_1 [1]": [], "relative_stretch_2 [1]": []}
    for case, result, own in zip(cases, results, events, strict=True):
        stop = next((event for event in own if event.name == case.recipe.stop.at), None)
        for header, values in final.items():
            # a table at stated times need not hold the end
            values.append(last(result.columns[header]) if stop is None else _at(stop, result.columns, header, case.recipe))
    sections: dict[str, dict[str, Any]] = {
        "actuate": {"cases": len(results)} | {f"final_{header.split(' ')[0]}": each(values) for header, values in final.items()}
    }
    for name in names():
        first = {case: event for case, own in enumerate(events) for event in reversed(own) if event.name == name}
        if first:
            sections[name] = {
                "cases": list(first),
                "time_s": [event.time for event in first.values()],
                "stretch_1": [event.stretch_1 for event in first.values()],
                "true_field_V_per_m": [event.true_field for event in first.values()],
            }
    if found:
        sections["compare"] = compare_headline(found)
    return sections


def electrode_axes(recipe: ActuateRecipe, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Axes in m of an electrode that was a circle on the prestretched film, if its diameter is stated."""
    diameter = recipe.film.electrode_diameter
    if diameter is None:
        return {}
    first, second = columns["relative_stretch_1 [1]"] * diameter, columns["relative_stretch_2 [1]"] * diameter
    return {MAJOR_AXIS: np.maximum(first, second), MINOR_AXIS: np.minimum(first, second)}


def film_batches(
    cases: Sequence[Case[ActuateRecipe]], materials: Sequence[Material], inputs: Inputs, thickness_factor: Array | None = None
) -> list[SimulationBatch[FilmResult]]:
    """The cases in batches of those with programmes of one shape.

    `thickness_factor` (cases,), if given, is one on the thickness of each film.
    """
    factor = np.ones(len(cases)) if thickness_factor is None else thickness_factor

    def batch(members: Sequence[int], entries: Sequence[Sequence[Entry]]) -> tuple[partial[Any], partial[FilmResult]]:
        recipe, used = cases[members[0]].recipe, [materials[index] for index in members]
        films = [cases[index].recipe.film for index in members]
        share, by_share = recipe.pull_in.timescale
        run = partial(
            actuate,
            one_or_all(used),
            [_joined(step) for step in entries],
            thickness=np.array([film.thickness for film in films]) * factor[list(members)],
            prestretch=tuple(np.array([film.prestretch for film in films]).T),
            prestretch_rate=None if films[0].prestretch_rate is None else np.array([film.prestretch_rate for film in films]),
            relax=recipe.film.relax,
            boundary=recipe.film.boundary,
            temperature=[temperature_of(cases[index].recipe, materials[index]) for index in members],
            breakdown_field=breakdown(recipe.breakdown),
            pull_in_timescale=TimeScale.fraction(share) if by_share else TimeScale.fixed(share),
            stop_at=recipe.stop.at,
            times=recipe.output.times,
            points_per_decade=recipe.output.points_per_decade,
            with_end=recipe.output.times is None,
            rtol=recipe.solver.rtol,
            cycles=recipe.output.cycles,
        )
        return run, partial(_case, materials=used, boundary=recipe.film.boundary)

    return batches_of(cases, materials, lambda recipe: voltage_entries(recipe, inputs), _alike, batch)


def _alike(recipe: ActuateRecipe) -> Hashable:
    """What the recipes of cases must share to be solved together."""
    film, ends = recipe.film, (breakdown(recipe.breakdown), recipe.pull_in.timescale, recipe.stop.at)
    return film.prestretch_rate is None, film.relax, film.boundary, ends


def _joined(entries: Sequence[Entry]) -> VoltageStep:
    """The same step of several cases as one, with arrays as in `values_of`."""
    return VoltageStep(target_of(entries), rate=values_of(entries, "rate"), duration=values_of(entries, "duration"))


def _case(history: ActuationHistory, row: int, *, materials: Sequence[Material], boundary: tuple[str, str]) -> FilmResult:
    failure = given_up(history.outcome[row], materials[row], "dead-load" in boundary)
    return CaseResult(float(history.temperature[row]), history.case(row), failure, cycles_of(history.cycles, row)), history.events[
        row
    ]
