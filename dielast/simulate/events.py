"""What happened to films, in a user's terms: voltages, stretches, and times in order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dielast.io.table import Column, Table
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.event_arrays import EventArrays

UNITS = {"time": "s", "voltage": "V", "stretch_1": "1", "stretch_2": "1", "true_field": "V/m"}
"""Units of the numbers of an event."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a film: `name` is that of its criterion, such as breakdown, pull-in or loss-of-tension; the `time`
    in s since the voltage programme began, V, V/m. Where two held axes lose their tension at different times, those are two events.
    """

    name: str
    time: float
    voltage: float
    stretch_1: float
    stretch_2: float
    true_field: float


def event_columns(events: Sequence[Sequence[Event]]) -> Table:
    """The table of the events of each case, in order of time."""
    flat = [(case, event) for case, in_order in enumerate(events) for event in in_order]
    return [
        Column("case", None, np.array([case for case, _ in flat], dtype=np.int64)),
        Column("event", None, [event.name for _, event in flat]),
        *(Column(name, unit, np.array([getattr(event, name) for _, event in flat], dtype=float)) for name, unit in UNITS.items()),
    ]


def events_of(happened: Mapping[Criterion, EventArrays], case: int, thickness: float, end: float) -> tuple[Event, ...]:
    """The events of one case up to its end in s, in order of time."""
    events: list[Event] = []
    for criterion, entry in happened.items():
        time, field = float(entry.time[case]), float(entry.field[case])
        first, second = np.exp(0.5 * entry.log_squared_stretch[:, case]).tolist()
        # what both axes lose at one moment is lost once
        if time <= end and not any(event.name == criterion.name and event.time == time for event in events):
            events.append(Event(criterion.name, time, field * thickness, first, second, field * first * second))
    return tuple(sorted(events, key=lambda event: event.time))


def first_of(happened: Mapping[Criterion, EventArrays], names: Sequence[str]) -> EventArrays:
    """When a criterion of these names first happened, and how the films were then."""
    entries = [entry for criterion, entry in happened.items() if criterion.name in names]
    any_entry = next(iter(happened.values()))
    first = EventArrays.never(any_entry.time.size, len(any_entry.exposed))
    for entry in entries:
        first.put(earlier := np.flatnonzero(~(first.time <= entry.time) & ~np.isnan(entry.time)), entry.take(earlier))
    return first
