"""The events of films, such as breakdown and pull-in: in order, as a table, and the first of some."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.io.table import Column, Table
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.watch import EventArrays

Names = NDArray[np.object_]
NONE = "none"
"""The name of the first event where none happens."""

EVENT_UNITS = {"time": "s", "voltage": "V", "stretch_1": "1", "stretch_2": "1", "true_field": "V/m"}
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
    numbers = {name: np.array([getattr(event, name) for _, event in flat], dtype=float) for name in EVENT_UNITS}
    return [
        Column("case", None, np.array([case for case, _ in flat], dtype=np.int64)),
        Column("event", None, [event.name for _, event in flat]),
        *(Column(name, EVENT_UNITS[name], values) for name, values in numbers.items()),
    ]


def events_of(happened: Mapping[Criterion, EventArrays], case: int, thickness: float, end: float) -> tuple[Event, ...]:
    """The events of one case up to its end in s, in order of time, and of voltage on the way to one that comes at once."""
    events: list[Event] = []
    for criterion, entry in happened.items():
        time, field = float(entry.time[case]), float(entry.field[case])
        stretch_1, stretch_2 = np.exp(0.5 * entry.log_squared_stretch[:, case]).tolist()
        if time <= end:
            true_field = field * stretch_1 * stretch_2
            events.append(Event(criterion.name, time, field * thickness, stretch_1, stretch_2, true_field))
    first: dict[tuple[str, float], Event] = {}
    for event in sorted(events, key=lambda event: (event.time, abs(event.voltage))):
        first.setdefault((event.name, event.time), event)  # loss of tension of both axes at one time is one event
    return tuple(first.values())


def first_of(happened: Mapping[Criterion, EventArrays], names: Sequence[str]) -> EventArrays:
    """The first event of these names in each film: its time, and the film at that time.

    Of events at one time, on the way to a voltage that comes at once, the first is the one at the lowest voltage.
    """
    entries = [entry for criterion, entry in happened.items() if criterion.name in names]
    any_entry = next(iter(happened.values()))
    first = EventArrays.never(any_entry.time.size, len(any_entry.exposed))
    for entry in entries:
        no_later = (first.time == entry.time) & (np.abs(first.field) <= np.abs(entry.field))
        earlier = np.flatnonzero(~(first.time < entry.time) & ~no_later & ~np.isnan(entry.time))
        first.put(earlier, entry.take(earlier))
    return first


def name_of_first(happened: Mapping[Criterion, EventArrays], names: Sequence[str]) -> Names:
    """The name (films,) of `first_of` these events, or "none"; of events at one time and field, the one that `names` has first."""
    end = first_of(happened, names)
    first = np.full(end.time.size, NONE, dtype=object)
    for name in reversed(names):
        event = first_of(happened, [name])
        first[(event.time == end.time) & (event.field == end.field)] = name
    return first
