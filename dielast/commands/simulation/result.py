"""The result of one case of a simulation: its table, its cycles and events, and what draws say of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dielast.numerics.columns import Floats

if TYPE_CHECKING:
    from dielast.simulate.events import Event
    from dielast.simulate.sensitivity import Sensitivity


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


@dataclass(frozen=True, slots=True)
class GivenUp:
    """The `time` in s up to which a case was finished, and the `reason` for which it was not finished further."""

    time: float
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class CaseResult:
    """One case: the `columns` (times,) of its table by header, up to where it was finished, the `failure` that ended it early, and
    the columns (cycles,) of its `cycles` by header, if it has a waveform; of a film also its `events`, which draws give bounds, and
    its `profile` and the `sensitivity` of its life, if they were asked for. `stated` are the headers of columns that are the same
    in every draw.
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
