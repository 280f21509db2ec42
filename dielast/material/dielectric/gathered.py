"""The dielectrics of many films, some of which have a permittivity that depends on stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dielast.material.dielectric.law import DielectricLaw, LogRatio
from dielast.numerics.arrays import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class StretchedDielectrics:
    """The `laws`, and the index `which` (cases,) of the law of each case."""

    laws: tuple[DielectricLaw, ...]
    which: Cases

    def take(self, cases: Cases) -> StretchedDielectrics:
        """The dielectrics of the selected cases (k,)."""
        return StretchedDielectrics(self.laws, self.which[cases])

    def log_ratio(self, log_squared_stretch: Floats) -> LogRatio:
        """`DielectricLaw.log_ratio` of the laws of the cases, at Lambda (2, cases)."""
        if len(self.laws) == 1:
            return self.laws[0].log_ratio(log_squared_stretch)
        cases = self.which.size
        value, slope, bend = np.empty(cases), np.empty((2, cases)), np.empty((3, cases))
        for number, law in enumerate(self.laws):
            here = self.which == number
            value[here], slope[:, here], bend[:, here] = law.log_ratio(log_squared_stretch[:, here])
        return value, slope, bend


def stretched_dielectrics(laws: Sequence[DielectricLaw], cases: int) -> StretchedDielectrics | None:
    """The dielectrics of cases, from one law for each case or one for all; None if no permittivity depends on stretch."""
    if not any(law.depends_on_stretch for law in laws):
        return None
    different = tuple(dict.fromkeys(laws))
    number = {law: place for place, law in enumerate(different)}
    return StretchedDielectrics(different, np.broadcast_to(np.array([number[law] for law in laws]), (cases,)))
