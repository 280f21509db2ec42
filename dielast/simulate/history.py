"""The results of simulations: how cases end, the events of films, and the base of all histories."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from inspect import signature
from typing import TYPE_CHECKING, Any, ClassVar, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from dielast.io.result import TabularResult
from dielast.io.table import Column, Table, case_table
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.watch import EventArrays
from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleTable

if TYPE_CHECKING:
    from dielast.simulate.quantities import Quantity

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

Names = NDArray[np.object_]
NONE = "none"
"""The name of the first event where none happens."""
REASONS = {
    Status.STEP_VANISHED: "the rates grow beyond all bounds",
    Status.TOO_MANY_STEPS: "the integration takes too many steps",
    Status.STALLED: "the integration comes to a standstill",
    Status.NO_START: "no stable equilibrium within the springs' limits under a load applied at once",
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one case ended: `completed` at `time` (s), or abandoned at that time because of `reason`.

    If an event stopped a completed case, `reason` is its name.
    """

    completed: bool
    time: float
    reason: str = ""

    @classmethod
    def of(cls, status: int, time: float, stopped_at: str = "") -> Outcome:
        """The outcome of a case that ended with this `Status`; `stopped_at` is the event that stopped it."""
        if status == Status.STOPPED:
            return cls(True, float(time), stopped_at)
        return cls(status == Status.COMPLETED, float(time), REASONS.get(Status(status), ""))


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


class History(TabularResult):
    """`values` (cases, times) by header, of the quantities that apply, which are attributes as well, such as `stretch_1`;
    `temperature` (cases,) in degC; one `outcome` per case.
    """

    __slots__ = ()
    QUANTITIES: ClassVar[list[Quantity]]
    """The quantities, in the order of the table."""

    temperature: Floats
    values: Mapping[str, Floats]
    outcome: tuple[Outcome, ...]
    cycles: CycleTable | None

    def case(self, row: int) -> dict[str, Floats]:
        """The columns (rows,) of a case up to its end, by their headers."""
        reached = np.isfinite(self.stretch_1[row])
        return {header: np.asarray(values[row][reached]) for header, values in self.values.items()}

    def columns(self) -> Table:
        """The table of all cases, one after another."""
        written = [quantity.header for quantity in self.QUANTITIES if quantity.written and quantity.header in self.values]
        cases = [self.case(row) for row in range(len(self.stretch_1))]
        table = {row: {header: columns[header] for header in written} for row, columns in enumerate(cases)}
        return case_table(table, self.temperature.tolist())

    def __getattr__(self, name: str) -> Floats:
        """The values (cases, times) of a quantity."""
        if name == "values" or name.startswith("_"):
            raise AttributeError(name)
        for quantity in self.QUANTITIES:
            if quantity.name == name and quantity.header in self.values:
                return self.values[quantity.header]
        raise AttributeError(f"{name}: there are {', '.join(self.values)}")

    def __dir__(self) -> list[str]:
        """The attributes, with those of the quantities that apply."""
        quantities = [quantity.name for quantity in self.QUANTITIES if quantity.header in self.values]
        return sorted({*object.__dir__(self), *quantities})

    def described(self) -> Mapping[str, Any]:
        """The fields, with each quantity in place of the values."""
        parts = super().described()
        shown = {quantity.name: getattr(self, quantity.name) for quantity in self.QUANTITIES if quantity.header in self.values}
        return {name: value for name, value in parts.items() if name != "values"} | shown

    @property
    def completed(self) -> bool:
        """Whether every case ran to its end, or to the event that was to stop it."""
        return all(outcome.completed for outcome in self.outcome)


def joined(parts: Sequence[Any], place: Cases) -> Any:
    """The cases of all parts, in the order given by their indices `place` (cases,) in the concatenated parts.

    A part is an array or a tuple with one entry per case, or a result that consists of such parts and of values that do not depend
    on the case. Arrays (cases, times) of fewer times than others begin with NaN.
    """
    first, kind = parts[0], type(parts[0])
    if isinstance(first, np.ndarray):
        if first.ndim == 2:
            most = max(part.shape[1] for part in parts)
            parts = [np.pad(part, ((0, 0), (most - part.shape[1], 0)), constant_values=np.nan) for part in parts]
        return np.concatenate(parts)[place]
    if isinstance(first, tuple):
        entries = [entry for part in parts for entry in part]
        return tuple(entries[index] for index in place.tolist())
    if isinstance(first, Mapping):
        return {key: joined([part[key] for part in parts], place) for key in first}
    if is_dataclass(first):
        return kind(**{entry.name: joined([getattr(part, entry.name) for part in parts], place) for entry in fields(first)})
    return first


def simulating(prepare: Callable[Arguments, Callable[[], Result]], name: str, result: type[Result]) -> Callable[Arguments, Result]:
    """The public function `name`, which simulates what `prepare` returns once it has checked the arguments."""

    @wraps(prepare)
    def simulated(*arguments: Arguments.args, **keywords: Arguments.kwargs) -> Result:
        return prepare(*arguments, **keywords)()

    simulated.__name__ = simulated.__qualname__ = name
    simulated.__signature__ = signature(prepare).replace(return_annotation=result)  # type: ignore[attr-defined]
    return simulated
