"""The result of one case of a simulation: its table, cycles and events, with bounds from draws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.commands.simulation.timed_steps import TimedSteps
from dielast.io.spool import Away, Spool
from dielast.numerics.arrays import Floats
from dielast.numerics.random_streams import stream
from dielast.simulate.quantities import quantity_of

if TYPE_CHECKING:
    from dielast.material.material import Material
    from dielast.material.scatter import Sample
    from dielast.simulate.events import Event
    from dielast.simulate.history import Outcome
    from dielast.simulate.membrane import SlackEvent


@dataclass(frozen=True, slots=True)
class BoundedEvent:
    """An event of a case (None if it happens in draws only), its probability, and lower and upper bounds of its numbers by name.
    The upper bound of the time is infinite if the event may never happen.
    """

    name: str
    event: Event | None
    bounds: Mapping[str, tuple[float, float]]
    probability: float
    assured_life: float | None = None
    """The time in s before which it does not happen in the required share of films, with the required confidence."""


@dataclass(frozen=True, slots=True, eq=False)
class CaseColumns(Mapping[str, Floats]):
    """Columns (rows,) by header in one array `numbers` (columns, rows): a sweep has as many as cases, and an array for each column
    would take more memory than its numbers.
    """

    headers: tuple[str, ...]
    numbers: Floats | Away

    @classmethod
    def of(cls, columns: Mapping[str, Floats]) -> CaseColumns:
        """The columns of any mapping."""
        if isinstance(columns, CaseColumns):
            return columns
        return cls(_known(tuple(columns)), np.array([*columns.values()], dtype=float))

    def __getitem__(self, header: str) -> Floats:
        if header not in _places(self.headers):
            raise KeyError(header)
        return self.numbers[_places(self.headers)[header]]

    def __iter__(self) -> Iterator[str]:
        return iter(self.headers)

    def __len__(self) -> int:
        return len(self.headers)

    def __reduce__(self) -> tuple[Any, ...]:
        """Other processes get the numbers themselves."""
        return CaseColumns, (self.headers, np.asarray(self.numbers))


@cache
def _known(headers: tuple[str, ...]) -> tuple[str, ...]:
    """One tuple for all cases with these headers."""
    return headers


@cache
def _places(headers: tuple[str, ...]) -> dict[str, int]:
    return {header: place for place, header in enumerate(headers)}


@dataclass(frozen=True, slots=True, eq=False)
class CaseResult:
    """One case: the `columns` (times,) of its table by header, up to the solved time; the `failure` of the solver that ended it
    early; with a waveform, the columns (cycles,) of its `cycles` by header. A film also has `events`, with bounds from draws, and,
    if the recipe states it, a `profile`. `stated` are the headers of columns that are equal in all draws.
    """

    temperature: float
    columns: Mapping[str, Floats]
    failure: Outcome | None
    cycles: Mapping[str, Floats] | None = None
    events: Sequence[Event] | None = None
    bounded_events: Sequence[BoundedEvent] = ()
    slack: Sequence[SlackEvent] = ()
    stated: tuple[str, ...] = ("time [s]",)
    profile: Mapping[str, Floats] | None = None
    stopped: Event | None = None
    """The event that the case stopped at."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", CaseColumns.of(self.columns))

    def end(self, planned: float) -> float:
        """The time in s at which the case ended; its load ends at the time `planned`."""
        ended = self.failure or self.stopped
        return planned if ended is None else ended.time

    def put(self, spool: Spool) -> CaseResult:
        """The result with its numbers where the `spool` holds them."""
        columns = CaseColumns.of(self.columns)
        return replace(self, columns=CaseColumns(columns.headers, spool.put(np.asarray(columns.numbers))))


def held(spool: Spool, solved: Any) -> Any:
    """What a batch has solved, with the numbers of each `CaseResult` where the `spool` holds them."""
    return [entry.put(spool) if isinstance(entry, CaseResult) else entry for entry in solved]


@dataclass(frozen=True, slots=True, eq=False)
class StatedCase:
    """The `recipe` of a case, and the `material` and the `steps` that the solver takes for it; `sample` are its draws, None without
    `[uncertainty]`.
    """

    recipe: Any
    material: Material
    steps: TimedSteps
    sample: Sample | None

    @property
    def temperature(self) -> float:
        """In degC: that of the recipe, or the reference temperature of the material."""
        stated = self.recipe.temperature
        return self.material.reference_temperature if stated is None else float(stated)


@dataclass(frozen=True, slots=True, eq=False)
class SolvedCase(StatedCase):
    """A case with its result."""

    result: CaseResult


def at_event(event: Event, columns: Mapping[str, Floats], header: str, recipe: Any) -> float:
    """The value of a column at an event: that of the event if it determines the quantity, else interpolated in the table, NaN in an
    empty one.
    """
    quantity = quantity_of(header)
    if quantity is None or quantity.at is None:
        if not columns["time [s]"].size:
            return np.nan
        return float(np.interp(event.time, columns["time [s]"], columns[header]))
    return quantity.at(event, (_begin(1, columns, recipe), _begin(2, columns, recipe)))


def _begin(axis: int, columns: Mapping[str, Floats], recipe: Any) -> float:
    """The stretch when the voltage begins: the prestretch, or the stretch under a weight."""
    if recipe.film.weights[0][axis - 1] is None or not columns["time [s]"].size:
        return float(recipe.film.prestretch[axis - 1])
    return float(columns[f"stretch_{axis} [1]"][0] / columns[f"relative_stretch_{axis} [1]"][0])


def with_noise(result: CaseResult, recipe: Any, case: int) -> CaseResult:
    """Relative Gaussian noise on the measured quantity: the stress in relaxation, the elongation (stretch - 1) in creep."""
    # a stream for each case, so that the noise does not depend on the number of cases
    random = stream(recipe.output.seed, "noise", case)
    columns = dict(result.columns)
    for axis in (1, 2):
        factor = 1 + recipe.output.noise * random.standard_normal(columns["time [s]"].size)
        nominal, stretch = columns[f"nominal_stress_{axis} [Pa]"], columns[f"stretch_{axis} [1]"]
        if recipe.kind == "relax":
            nominal = nominal * factor
        else:
            stretch = 1 + (stretch - 1) * factor
        columns[f"nominal_stress_{axis} [Pa]"] = nominal
        columns[f"stretch_{axis} [1]"] = stretch
        columns[f"true_stress_{axis} [Pa]"] = nominal * stretch
        if axis == 1 and "relaxation_modulus [Pa]" in columns:
            columns["relaxation_modulus [Pa]"] = columns["relaxation_modulus [Pa]"] * factor
    return replace(result, columns=columns)
