"""Events of films in the quantities of the user: voltages, stretches, and times in order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dielast.io.table import Column, Table
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.watch import EventArrays

UNITS = {"time": "s", "voltage": "V", "stretch_1": "1", "stretch_2": "1", "true_field": "V/m"}
"""The units of the numbers of an event."""


@dataclass(frozen=True, slots=True)
class Event:
    """An event of a film: `name` is that of the criterion, such as breakdown, pull-in or loss-of-tension; `time` is in s since the
    voltage programme began, `voltage` in V, `true_field` in V/m. Loss of tension of two axes at different times is two events.
    """

    name: str
    time: float
    voltage: float
    stretch_1: float
    stretch_2: float
    true_field: float


def event_columns(events: Sequence[Sequence[Event]]) -> Table:
    """The table of the events of all cases, in order of case and time."""
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
        # loss of tension of both axes at one time is one event
        if time <= end and not any(event.name == criterion.name and event.time == time for event in events):
            events.append(Event(criterion.name, time, field * thickness, first, second, field * first * second))
    return tuple(sorted(events, key=lambda event: event.time))


def first_of(happened: Mapping[Criterion, EventArrays], names: Sequence[str]) -> EventArrays:
    """The first event of these names in each film: its time, and the film at that time."""
    entries = [entry for criterion, entry in happened.items() if criterion.name in names]
    any_entry = next(iter(happened.values()))
    first = EventArrays.never(any_entry.time.size, len(any_entry.exposed))
    for entry in entries:
        first.put(earlier := np.flatnonzero(~(first.time <= entry.time) & ~np.isnan(entry.time)), entry.take(earlier))
    return first
