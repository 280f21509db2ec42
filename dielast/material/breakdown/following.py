"""Breakdown fields that change with the film, of many films at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.material.breakdown.law import BreakdownLaw
from dielast.material.laws_of_cases import LawsOfCases
from dielast.numerics.columns import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class FollowingField:
    """Breakdown `laws` that follow films of an undeformed `thickness` (cases,) in m, and the field (cases,) in V/m that they give
    at the prestretch, `at_prestretch`, 1 for films whose breakdown field stays as it is.
    """

    laws: LawsOfCases[BreakdownLaw]
    thickness: Floats
    at_prestretch: Floats

    @classmethod
    def of(cls, laws: LawsOfCases[BreakdownLaw], thickness: Floats, prestretch: Floats) -> FollowingField:
        """Of films (cases,) at a `prestretch` sqrt(l1 l2)."""
        relaxed = cls(laws, thickness, np.ones_like(thickness))
        every = np.arange(thickness.size)
        return cls(laws, thickness, relaxed.ratio(every, 4 * np.log(prestretch)))

    def take(self, cases: Cases) -> FollowingField:
        """The same for some of the films."""
        return FollowingField(self.laws.take(cases), self.thickness[cases], self.at_prestretch[cases])

    def ratio(self, cases: Cases, log_area: Floats) -> Floats:
        """The breakdown field of `cases` (k,) at 2 ln(l1 l2) (k,) over that at the prestretch.

        l = exp(log_area/4), and, as films are incompressible, h = H exp(-log_area/2).
        """
        stretch, thickness = np.exp(0.25 * log_area), self.thickness[cases] * np.exp(-0.5 * log_area)
        begin = self.at_prestretch[cases]
        return self.laws.ask(cases, lambda law, k: law.of_film(stretch[k], thickness[k]) / begin[k], 1.0)
