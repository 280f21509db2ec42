"""The result of one case of a simulation: its table, cycles and events, with bounds from draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dielast.numerics.columns import Floats

if TYPE_CHECKING:
    from dielast.simulate.history import Event
    from dielast.simulate.sensitivity import Sensitivity


@dataclass(frozen=True, slots=True)
class BoundedEvent:
    """An event of a case (None if it happens in draws only), with bounds of its numbers by name, and its probability."""

    name: str
    event: Event | None
    lower: Mapping[str, float]
    upper: Mapping[str, float]
    probability: float

    @property
    def span(self) -> tuple[float, float]:
        """Lower and upper bound of the time, infinite if the event may never happen."""
        return self.lower["time"], self.upper["time"]


@dataclass(frozen=True, slots=True)
class GivenUp:
    """The `time` in s up to which a case was solved, and the `reason` why it ended."""

    time: float
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class CaseResult:
    """One case: the `columns` (times,) of its table by header, up to the solved time; the `failure` of the solver that ended it
    early; with a waveform, the columns (cycles,) of its `cycles` by header. A film also has `events`, with bounds from draws, and,
    if the recipe states them, a `profile` and the `sensitivity` of its life. `stated` are the headers of columns that are equal in
    all draws.
    """

    temperature: float
    columns: Mapping[str, Floats]
    failure: GivenUp | None
    cycles: Mapping[str, Floats] | None = None
    events: Sequence[Event] | None = None
    bounded_events: Sequence[BoundedEvent] = ()
    stated: tuple[str, ...] = ("time [s]",)
    profile: Mapping[str, Floats] | None = None
    sensitivity: Sensitivity | None = None
    stopped: Event | None = None
    """The event that the case stopped at."""
