"""What `[uncertainty]` adds to a simulation: every case again with each draw, and the intervals that the draws tell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.ensemble import Sample, draw_sample, fewest_draws, interval, scaled
from dielast.errors import InputError, NumericsError, warn
from dielast.files import Inputs
from dielast.material import Material
from dielast.recipe.cases import Case
from dielast.recipe.material import breakdown
from dielast.recipe.uncertainty import FilmUncertainty, Uncertainty
from dielast.recipe.voltage import ActuateRecipe
from dielast.simulate.actuate import Event
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import LifetimeLine
from dielast.table import Column
from dielast.workflow.cases import CaseResult, each
from dielast.workflow.draws import read_members

Array = NDArray[np.float64]
Band = tuple[Array, Array, Array]

STATED = ("time [s]", "voltage [V]")  # columns that are the same in every draw
SURVIVING = "surviving [1]"
NUMBERS = {"time": "s", "voltage": "V", "stretch_1": "1", "stretch_2": "1", "true_field": "V/m"}  # of an event
LINE = ("slope", "intercept", "rms_residual", "r_squared")
BESIDE = 1.1  # factor by which a material may miss the range of its draws: more is not noise


def sample_of(name: str, material: Material, uncertainty: Uncertainty, inputs: Inputs) -> Sample:
    """The draws of the material in the file `name`; raises `InputError` if there is nothing that could differ between them."""
    members = read_members(name, inputs)
    if members and len(members) < (fewest := fewest_draws(uncertainty.level)):
        raise InputError(
            f"uncertainty.level: the {len(members)} draws of {name} do not tell an interval of level {uncertainty.level:g}: at "
            f"least {fewest} are needed"
        )
    if members:
        _doubt_draws(name, material, members)
    field = thickness = None
    if isinstance(uncertainty, FilmUncertainty):
        field, thickness = uncertainty.scatter()
    if not members and field is None and thickness is None:
        raise InputError(
            f"uncertainty: {name} names no draws, and nothing is said to scatter: mastercurve with [uncertainty] and then spectrum "
            "write a material with draws"
        )
    draws = uncertainty.draws
    if field is None and thickness is None and draws > len(members):
        # the same again tells nothing more
        if "draws" in uncertainty.model_fields_set:
            warn(f"uncertainty.draws: {name} has {len(members)} draws, and nothing else scatters: not {draws}, but these are used")
        draws = len(members)
    return draw_sample(members or (material,), draws, seed=uncertainty.seed, breakdown_field=field, thickness=thickness)


def _doubt_draws(name: str, material: Material, members: Sequence[Material]) -> None:
    """Warn of draws that are not about the material."""
    tau = np.union1d(material.spectrum.relaxation_time, members[0].spectrum.relaxation_time)
    with np.errstate(over="ignore"):  # a time beyond all numbers is one at which all has relaxed
        time = np.append(tau, 10 * tau.max())
        own = material.spectrum.relaxation_modulus(time, material.equilibrium_modulus)
        drawn = np.array([each.spectrum.relaxation_modulus(time, each.equilibrium_modulus) for each in members])
        low, high = drawn.min(axis=0), drawn.max(axis=0)
        missed = (own * BESIDE < low) | (own > high * BESIDE)
    for k in np.flatnonzero(missed)[:1]:
        warn(
            f"{name}: a shear modulus of {own[k]:.4g} Pa after {time[k]:.3g} s is far from those of all draws, {low[k]:.4g} to "
            f"{high[k]:.4g} Pa: if the material has been edited, make its draws anew"
        )


def uncertainty_headline(
    uncertainties: Sequence[Uncertainty | None], samples: Sequence[Sample | None]
) -> dict[str, dict[str, Any]]:
    """The section of a summary that says what the intervals of the cases are; none without them."""
    told = [(own, sample) for own, sample in zip(uncertainties, samples, strict=True) if own is not None and sample is not None]
    if not told:
        return {}
    numbers: dict[str, list[float | int]] = {
        "draws": [len(sample) for _, sample in told],
        "materials": [len({id(member) for member in sample.materials}) for _, sample in told],
        "seed": [own.seed for own, _ in told],
        "level": [own.level for own, _ in told],
    }
    return {"uncertainty": {key: values[0] if len(set(values)) == 1 else each(values) for key, values in numbers.items()}}


def samples_of(cases: Sequence[Case[Any]], materials: Sequence[Material], inputs: Inputs) -> list[Sample | None]:
    """The draws of every case, none in cases without `[uncertainty]`."""
    known: dict[str, Sample] = {}
    samples: list[Sample | None] = []
    for case, material in zip(cases, materials, strict=True):
        wanted: Uncertainty | None = case.recipe.uncertainty
        if wanted is None:
            samples.append(None)
            continue
        key = f"{case.recipe.material}\n{wanted!r}"
        if key not in known:
            known[key] = sample_of(case.recipe.material, material, wanted, inputs)
        samples.append(known[key])
    return samples


def bounded_cases(
    cases: Sequence[Case[Any]],
    samples: Sequence[Sample | None],
    results: Sequence[CaseResult],
    simulate: Callable[[Sequence[Case[Any]], Sequence[Material]], Sequence[CaseResult]],
) -> list[CaseResult]:
    """The results with bounds, in cases that have draws; those of a case run together."""
    told = []
    for case, sample, result in zip(cases, samples, results, strict=True):
        if sample is not None:
            with _said_of_a_draw():
                drawn = simulate([case] * len(sample), sample.materials)
            result = bounded(result, drawn, case.recipe.uncertainty.level)
        told.append(result)
    return told


def bounded_films(
    cases: Sequence[Case[ActuateRecipe]],
    samples: Sequence[Sample | None],
    results: Sequence[CaseResult],
    events: Sequence[Sequence[Event]],
    simulate: Callable[
        [Sequence[Case[ActuateRecipe]], Sequence[Material], Array], tuple[Sequence[CaseResult], Sequence[Sequence[Event]]]
    ],
) -> tuple[list[CaseResult], list[list[BoundedEvent]]]:
    """The results and the events with bounds, in cases that have draws."""
    told, happened = [], []
    for case, sample, result, own in zip(cases, samples, results, events, strict=True):
        wanted = case.recipe.uncertainty
        bounds: list[BoundedEvent] = []
        if wanted is not None and sample is not None:
            known = breakdown(case.recipe.breakdown)
            drawn_materials = []
            for member, factor in zip(sample.materials, sample.breakdown_factor.tolist(), strict=True):
                field = known or member.breakdown
                drawn_materials.append(replace(member, breakdown=None if field is None else scaled(field, factor)))
            with _said_of_a_draw():
                # each has its breakdown field with its material, and is asked for the rows of the result, its end among them
                output = case.recipe.output.model_copy(update={"times": _asked(result.columns["time [s]"])})
                one = Case(case.recipe.model_copy(update={"breakdown": None, "output": output}), case.settings)
                drawn, drawn_events = simulate([one] * len(sample), drawn_materials, sample.thickness_factor)
            result = bounded(result, drawn, wanted.level, failing=True)
            bounds = bounded_events(own, drawn_events, wanted.level)
        told.append(result)
        happened.append(bounds)
    return told, happened


def _asked(time: Array) -> list[float] | None:
    """Times at which a draw tells what a result's rows at `time` do: of two rows at one time, the second is after a jump."""
    return np.where(np.diff(time, prepend=np.nan) == 0, np.nextafter(time, np.inf), time).tolist() or None


def _passed(time: Array) -> NDArray[np.bool_]:
    """Rows between two jumps at one moment, which no time tells from those after them."""
    first, last = np.diff(time, prepend=np.nan) != 0, np.diff(time, append=np.nan) != 0
    return np.asarray(~last & (~first | (time == 0)))


def interval_label(recipes: Sequence[Any]) -> str:
    """What a legend calls the bands of these recipes, such as "90 % interval"."""
    levels = sorted({each.uncertainty.level for each in recipes if each.uncertainty is not None})
    return " and ".join(f"{100 * level:g} %" for level in levels) + " interval" + "s" * (len(levels) > 1)


@contextmanager
def _said_of_a_draw() -> Iterator[None]:
    """Errors that only a draw meets say so."""
    try:
        yield
    except (InputError, NumericsError) as error:
        raise type(error)(*(f"uncertainty: in a draw: {line}" for line in error.messages)) from None


def bounded(result: CaseResult, drawn: Sequence[CaseResult], level: float, *, failing: bool = False) -> CaseResult:
    """The result of a case with lower and upper columns beside each that the draws differ in.

    With `failing` films, a column tells the share of the draws that had not failed by each time; the bounds are those of the rest.
    """
    time = result.columns["time [s]"]
    there = np.isfinite(_stacked([each.columns["time [s]"] for each in drawn], time.size))
    told = there & ~_passed(time) if failing else there
    columns: dict[str, Array] = {}
    for header, values in result.columns.items():
        columns[header] = values
        if header not in STATED:
            table = _stacked([each.columns[header] for each in drawn], time.size)
            low, high = interval(np.where(told, table, np.nan), level)
            columns[_beside(header, "lower")], columns[_beside(header, "upper")] = low, high
    if failing:
        columns[SURVIVING] = np.mean(there, axis=0)
    return replace(result, columns=columns)


def band(columns: Mapping[str, Array], x: str, y: str) -> Band | None:
    """x, lower and upper y of a bounded case, for a figure; none where x itself is uncertain."""
    if x not in STATED or _beside(y, "lower") not in columns:
        return None
    return columns[x], columns[_beside(y, "lower")], columns[_beside(y, "upper")]


def some_fail(result: CaseResult) -> bool:
    """Whether the bounds of a case are, at some of its times, of those films only that are still there."""
    return bool(np.any(result.columns.get(SURVIVING, np.ones(1)) < 1))


def _beside(header: str, which: str) -> str:
    name, unit = header.rstrip("]").split(" [")
    return f"{name}_{which} [{unit}]"


def _stacked(columns: Sequence[Array], rows: int) -> Array:
    """Columns of several draws as (draws, rows), NaN where one ended before."""
    table = np.full((len(columns), rows), np.nan)
    for row, values in zip(table, columns, strict=True):
        row[: min(rows, values.size)] = values[:rows]
    return table


@dataclass(frozen=True, slots=True)
class BoundedEvent:
    """An event of a case, None where it happens in draws only, with the bounds of its `numbers` by name, and how likely it is."""

    name: str
    event: Event | None
    lower: Mapping[str, float]
    upper: Mapping[str, float]
    probability: float

    @property
    def span(self) -> tuple[float, float]:
        """Lower and upper bound of the time, infinite where it may never come."""
        return self.lower["time"], self.upper["time"]


def bounded_events(events: Sequence[Event], drawn: Sequence[Sequence[Event]], level: float) -> list[BoundedEvent]:
    """The events of a case, and those that happen in draws only.

    In a draw in which an event does not happen, it is later than all others: a time without upper bound may be beyond the end. All
    else is that of the draws in which it happens.
    """
    seen: dict[str, int] = {}
    rows: list[tuple[str, int, Event | None]] = []
    for own_event in events:
        rows.append((own_event.name, seen.get(own_event.name, 0), own_event))
        seen[own_event.name] = seen.get(own_event.name, 0) + 1
    rows += [(name, 0, None) for name in dict.fromkeys(each.name for own in drawn for each in own) if name not in seen]
    result = []
    for name, which, event in rows:
        found = [next((e for k, e in enumerate(x for x in own if x.name == name) if k == which), None) for own in drawn]
        lower, upper = {}, {}
        for number in NUMBERS:
            absent = np.inf if number == "time" else np.nan
            low, high = interval(np.array([absent if e is None else float(getattr(e, number)) for e in found]), level)
            lower[number], upper[number] = float(low), float(high)
        result.append(BoundedEvent(name, event, lower, upper, sum(e is not None for e in found) / len(found)))
    return result


def bounded_event_columns(events: Sequence[Sequence[BoundedEvent]]) -> list[Column]:
    """The table of events with bounds, by case; an event that happens in draws only has bounds alone."""
    flat = [(case, event) for case, own in enumerate(events) for event in own]
    columns = [
        Column("case", None, np.array([case for case, _ in flat], dtype=np.int64)),
        Column("event", None, [event.name for _, event in flat]),
    ]
    for name, unit in NUMBERS.items():
        central = [np.nan if row.event is None else float(getattr(row.event, name)) for _, row in flat]
        columns.append(Column(name, unit, np.array(central, dtype=float)))
        columns.append(Column(f"{name}_lower", unit, np.array([row.lower[name] for _, row in flat], dtype=float)))
        columns.append(Column(f"{name}_upper", unit, np.array([row.upper[name] for _, row in flat], dtype=float)))
    return [*columns, Column("probability", "1", np.array([row.probability for _, row in flat], dtype=float))]


def map_bounds(drawn: Sequence[FailureMap], level: float) -> dict[str, tuple[Array, Array]]:
    """Lower and upper bound of each time of a map by name; infinite where it is beyond the horizon."""
    known = np.array([each.failure_mode != "unfinished" for each in drawn])
    bounds = {}
    for name in ("time_to_breakdown", "time_to_pull_in", "time_to_failure"):
        times = np.array([getattr(each, name) for each in drawn])
        bounds[name] = interval(np.where(np.isnan(times), np.where(known, np.inf, np.nan), times), level)
    return bounds


def failure_probability(drawn: Sequence[FailureMap]) -> Array:
    """Share of the draws that fail within the horizon, of those whose fate is known."""
    failed = np.array([np.isfinite(each.time_to_failure) for each in drawn])
    known = np.array([each.failure_mode != "unfinished" for each in drawn])
    return np.asarray(np.sum(failed, axis=0) / np.maximum(np.sum(known, axis=0), 1))


def bounded_map_columns(columns: Sequence[Column], drawn: Sequence[FailureMap], level: float) -> list[Column]:
    """The table of a map with bounds beside each time, and the probability of failure."""
    bounds = map_bounds(drawn, level)
    result = []
    for column in columns:
        result.append(column)
        if column.name in bounds:
            pairs = zip(("lower", "upper"), bounds[column.name], strict=True)
            result += [Column(f"{column.name}_{which}", column.unit, values.ravel()) for which, values in pairs]
    return [*result, Column("failure_probability", "1", failure_probability(drawn).ravel())]


def bounded_line_columns(columns: Sequence[Column], drawn: Sequence[Sequence[LifetimeLine]], level: float) -> list[Column]:
    """The table of lifetime lines with bounds beside each number, from the lines of every draw."""
    result = []
    for column in columns:
        result.append(column)
        if column.name in LINE:
            low, high = interval(np.array([[getattr(line, column.name) for line in lines] for lines in drawn], dtype=float), level)
            result += [Column(f"{column.name}_lower", column.unit, low), Column(f"{column.name}_upper", column.unit, high)]
    return result
