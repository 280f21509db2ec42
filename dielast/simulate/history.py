"""The base class of the histories that simulations return."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.numerics.arrays import Floats
from dielast.simulate.cycles import CycleTable
from dielast.simulate.film import Outcome


class History(TabularResult):
    """Arrays (cases, times) by the names of `UNITS`, or None; `temperature` (cases,) in degC; one `outcome` per case."""

    __slots__ = ()
    UNITS: ClassVar[Mapping[str, str]]
    """The columns of the table, with their units."""

    temperature: Floats
    stretch_1: Floats
    outcome: tuple[Outcome, ...]
    cycles: CycleTable | None

    def case(self, row: int) -> dict[str, Floats]:
        """The columns (rows,) of a case up to its end, by their headers."""
        reached = np.isfinite(self.stretch_1[row])
        columns = {f"{name} [{unit}]": getattr(self, name) for name, unit in self.UNITS.items()}
        return {header: np.asarray(values[row][reached]) for header, values in columns.items() if values is not None}

    def columns(self) -> Table:
        """The table of all cases, one after another."""
        return case_table(self.temperature.tolist(), [self.case(row) for row in range(len(self.stretch_1))])

    @property
    def completed(self) -> bool:
        """Whether every case ran to its end, or to the event that was to stop it."""
        return all(outcome.completed for outcome in self.outcome)
