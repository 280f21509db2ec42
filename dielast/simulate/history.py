"""What the histories that simulations give have in common."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from dielast.io.result import TabularResult
from dielast.io.table import Table, case_table
from dielast.numerics.columns import Floats
from dielast.simulate.cycles import CycleTable
from dielast.simulate.film import Outcome


class History(TabularResult):
    """Arrays (cases, times) by the names of `UNITS`, None for what is not known; `temperature` (cases,) in degC, one `outcome` a
    case.
    """

    __slots__ = ()
    UNITS: ClassVar[Mapping[str, str]]
    """Units of the columns of the table."""

    temperature: Floats
    stretch_1: Floats
    outcome: tuple[Outcome, ...]
    cycles: CycleTable | None

    def case(self, row: int) -> dict[str, Floats]:
        """The columns of a case up to where it ended, (rows,), by their headers."""
        reached = np.isfinite(self.stretch_1[row])
        known = {f"{name} [{unit}]": getattr(self, name) for name, unit in self.UNITS.items()}
        return {header: np.asarray(values[row][reached]) for header, values in known.items() if values is not None}

    def columns(self) -> Table:
        """All cases, one below the other."""
        return case_table(self.temperature.tolist(), [self.case(row) for row in range(len(self.stretch_1))])

    @property
    def completed(self) -> bool:
        """Whether every case came to its end or to the event that it was to stop at."""
        return all(outcome.completed for outcome in self.outcome)
