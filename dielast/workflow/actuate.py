"""`actuate`: voltage history -> stretch of a prestretched film, and its failure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dielast.files import Inputs
from dielast.material import Material
from dielast.recipe.cases import Case
from dielast.recipe.material import breakdown
from dielast.recipe.voltage import MAJOR_AXIS, MINOR_AXIS, ActuateRecipe
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution
from dielast.simulate.actuate import ActuationHistory, Event, actuate
from dielast.simulate.voltage import VoltageStep
from dielast.stability import TimeScale
from dielast.table import Column
from dielast.workflow.bounds import FilmResult, band, bounded_event_columns, bounded_films, some_fail
from dielast.workflow.cases import (
    CaseResult,
    SimulationBatch,
    axes_of,
    case_columns,
    compare_headline,
    divided,
    each,
    failures,
    given_up,
    labels,
    last,
    matches,
    one_or_all,
    read_materials,
    result_columns,
    swept,
    temperature_of,
)
from dielast.workflow.doubts import doubt_films
from dielast.workflow.history import Entry, in_recipe_terms, output_times, values_of
from dielast.workflow.report import Report
from dielast.workflow.uncertainty import interval_label, samples_of, uncertainty_headline
from dielast.workflow.waveform import voltage_entries

if TYPE_CHECKING:
    from dielast.workflow.compare import Match

Array = NDArray[np.float64]
MEASURED = "relative_stretch_1 [1]"


def run(cases: Sequence[Case[ActuateRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Simulate every case, report."""
    recipe = cases[0].recipe
    materials = read_materials(cases, inputs)
    films = solve_batches(film_batches(cases, materials, inputs), execution)
    results, events = [result for result, _ in films], [own for _, own in films]
    doubt_films(cases, materials, results, events, [voltage_entries(case.recipe, inputs) for case in cases])
    samples = samples_of(cases, materials, inputs)
    bounds = bounded_films(
        cases, samples, films, lambda own, drawn, thickness: film_batches(own, drawn, inputs, thickness), execution
    )
    told, told_events = [result for result, _ in bounds], [own for _, own in bounds]
    columns = [result.columns for result in results]
    seen = [dict(own) | electrode_axes(case.recipe, own) for case, own in zip(cases, columns, strict=True)]

    def again(case: int, times: Array) -> Mapping[str, Array]:
        one = cases[case].recipe
        output = one.output.model_copy(update={"times": times.tolist()})
        asked = Case(one.model_copy(update={"output": output}))
        repeated = solve_batches(film_batches([asked], [materials[case]], inputs))[0][0].columns
        return dict(repeated) | electrode_axes(one, repeated)

    found = matches(recipe, seen, inputs, again)
    x, y, scales = axes_of(recipe, seen[0], MEASURED, time_scale="linear")

    def figure() -> Any:
        from dielast.plots.simulation import plot_cases

        marks, drawn = [], []
        for index, (case, own) in enumerate(zip(cases, seen, strict=True)):
            points = [(event, _at(event, own, x, case.recipe), _at(event, own, y, case.recipe)) for event in events[index]]
            marks += [(index, event.name, across, up) for event, across, up in points]
            # the line goes through its events, however sparse the rows of the table are there
            order = np.argsort(np.append(own["time [s]"], [event.time for event, _, _ in points]), kind="stable")
            extra = {x: [across for _, across, _ in points], y: [up for _, _, up in points]}
            drawn.append({header: np.append(own[header], values)[order] for header, values in extra.items()})
        return plot_cases(
            drawn,
            labels(cases, materials),
            [entry for entry in found if entry.headers == (x, y)],
            x,
            y,
            scales,
            recipe.title,
            marks,
            swept(cases),
            [band(one.columns, x, y) for one in told],
            interval_label([case.recipe for case in cases]) + " of the films that survive" * any(some_fail(one) for one in told),
            [one.span for own in told_events for one in own if one.event is not None] if x == "time [s]" else (),
        )

    happened = event_columns(events) if recipe.uncertainty is None else bounded_event_columns(told_events)
    tables = {"actuate.csv": result_columns(told), "events.csv": happened, "cases.csv": case_columns(cases)}
    sections = headline(cases, results, events, found) | uncertainty_headline([case.recipe.uncertainty for case in cases], samples)
    return Report(tables, sections, figure, failures=failures(results))


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
    for name in ("breakdown", "pull-in", "loss-of-tension"):
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


def event_columns(events: Sequence[Sequence[Event]]) -> list[Column]:
    """The table of events, by case and time."""
    flat = [(case, event) for case, own in enumerate(events) for event in own]
    numbers = {
        ("time", "s"): [event.time for _, event in flat],
        ("voltage", "V"): [event.voltage for _, event in flat],
        ("stretch_1", "1"): [event.stretch_1 for _, event in flat],
        ("stretch_2", "1"): [event.stretch_2 for _, event in flat],
        ("true_field", "V/m"): [event.true_field for _, event in flat],
    }
    return [
        Column("case", None, np.array([case for case, _ in flat], dtype=np.int64)),
        Column("event", None, [event.name for _, event in flat]),
        *(Column(name, unit, np.array(values, dtype=float)) for (name, unit), values in numbers.items()),
    ]


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
    # a case that stands in the list many times, once for each draw, is read once
    known = {id(case): voltage_entries(case.recipe, inputs) for case in {id(case): case for case in cases}.values()}
    programmes = [known[id(case)] for case in cases]
    groups: dict[Any, list[int]] = {}
    for index, (case, programme) in enumerate(zip(cases, programmes, strict=True)):
        recipe = case.recipe
        film, output = recipe.film, recipe.output
        times = output_times(output, programme, 0.0)
        limits = breakdown(recipe.breakdown)
        key = (
            film.prestretch_rate is None,
            film.relax,
            film.boundary,
            limits,
            recipe.pull_in.timescale,
            recipe.stop.at,
        )
        shape = tuple(entry.shape for entry in programme)
        asked = (output.times is None, output.points_per_decade)
        groups.setdefault((key, times, asked, recipe.solver.rtol, shape), []).append(index)
    batches = []
    for (_, times, _, _, shape), members in groups.items():
        recipe = cases[members[0]].recipe
        origin = [entry.origin for entry in programmes[members[0]]]
        share, by_share = recipe.pull_in.timescale
        for part in divided(members, materials):
            films = [cases[index].recipe.film for index in part]
            own = [materials[index] for index in part]
            run = partial(
                actuate,
                one_or_all(own),
                [_joined([programmes[index][position] for index in part]) for position in range(len(shape))],
                thickness=np.array([film.thickness for film in films])
                * (1.0 if thickness_factor is None else thickness_factor[part]),
                prestretch=(np.array([film.prestretch[0] for film in films]), np.array([film.prestretch[1] for film in films])),
                prestretch_rate=None if films[0].prestretch_rate is None else np.array([film.prestretch_rate for film in films]),
                relax=recipe.film.relax,
                boundary=recipe.film.boundary,
                temperature=[temperature_of(cases[index].recipe, materials[index]) for index in part],
                breakdown_field=breakdown(recipe.breakdown),
                pull_in_timescale=TimeScale.fraction(share) if by_share else TimeScale.fixed(share),
                stop_at=recipe.stop.at,
                times=times,
                points_per_decade=recipe.output.points_per_decade,
                with_end=recipe.output.times is None,
                rtol=recipe.solver.rtol,
            )
            result = partial(_case, materials=own, boundary=recipe.film.boundary)
            told = partial(in_recipe_terms, origin=origin, members=part, cases=len(known))
            batches.append(SimulationBatch(part, run, result, told))
    return batches


def _joined(entries: Sequence[Entry]) -> VoltageStep:
    """The same step of several cases as one, with arrays as in `values_of`."""
    return VoltageStep(values_of(entries, "target"), rate=values_of(entries, "rate"), duration=values_of(entries, "duration"))


def _case(history: ActuationHistory, row: int, *, materials: Sequence[Material], boundary: tuple[str, str]) -> FilmResult:
    reached = np.isfinite(history.stretch_1[row])
    columns = {
        "time [s]": history.time,
        "voltage [V]": history.voltage,
        "stretch_1 [1]": history.stretch_1,
        "stretch_2 [1]": history.stretch_2,
        "relative_stretch_1 [1]": history.relative_stretch_1,
        "relative_stretch_2 [1]": history.relative_stretch_2,
        "nominal_stress_1 [Pa]": history.nominal_stress_1,
        "nominal_stress_2 [Pa]": history.nominal_stress_2,
        "true_field [V/m]": history.true_field,
        "stability [1]": history.stability,
    }
    failure = given_up(history.outcome[row], materials[row], "dead-load" in boundary)
    kept = {name: values[row][reached] for name, values in columns.items()}
    return CaseResult(float(history.temperature[row]), kept, failure), history.events[row]
