"""The results of simulations: how cases end, the events of films, and the base of all histories."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from inspect import signature
from typing import TYPE_CHECKING, Any, ClassVar, ParamSpec, TypeVar

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleTable

if TYPE_CHECKING:
    from dielast.simulate.quantities import Quantity

Arguments = ParamSpec("Arguments")
Made = TypeVar("Made")

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


def simulating(prepare: Callable[Arguments, Callable[[], Made]], name: str, result: type[Made]) -> Callable[Arguments, Made]:
    """The public function `name`, which simulates what `prepare` returns once it has checked the arguments."""

    @wraps(prepare)
    def simulated(*arguments: Arguments.args, **keywords: Arguments.kwargs) -> Made:
        return prepare(*arguments, **keywords)()

    simulated.__name__ = simulated.__qualname__ = name
    simulated.__signature__ = signature(prepare).replace(return_annotation=result)  # type: ignore[attr-defined]
    return simulated
