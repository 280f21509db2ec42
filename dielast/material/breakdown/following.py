"""Breakdown fields that depend on the present film, for many films at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.material.breakdown.law import BreakdownLaw
from dielast.material.laws_of_cases import LawsOfCases
from dielast.numerics.arrays import Floats, Index


@dataclass(frozen=True, slots=True, eq=False)
class FollowingField:
    """Breakdown `laws` that depend on the present stretch and thickness, for films of an undeformed `thickness` (cases,) in m;
    `at_prestretch` (cases,) is their field in V/m at the prestretch, 1 for films with a constant breakdown field.
    """

    laws: LawsOfCases[BreakdownLaw]
    thickness: Floats
    at_prestretch: Floats

    @classmethod
    def of(cls, laws: LawsOfCases[BreakdownLaw], thickness: Floats, prestretch: Floats) -> FollowingField:
        """For films (cases,) at a `prestretch` sqrt(l1 l2)."""
        relaxed = cls(laws, thickness, np.ones_like(thickness))
        every = np.arange(thickness.size)
        return cls(laws, thickness, relaxed.ratio(every, 4 * np.log(prestretch)))

    def take(self, cases: Index) -> FollowingField:
        """The laws of some of the films."""
        return FollowingField(self.laws.take(cases), self.thickness[cases], self.at_prestretch[cases])

    def ratio(self, cases: Index, log_area: Floats) -> Floats:
        """The breakdown field of `cases` (k,) at 2 ln(l1 l2) = `log_area` (k,), over that at the prestretch.

        l = exp(log_area/4), and, as films are incompressible, h = H exp(-log_area/2).
        """
        stretch, thickness = np.exp(0.25 * log_area), self.thickness[cases] * np.exp(-0.5 * log_area)
        begin = self.at_prestretch[cases]
        return self.laws.ask(cases, lambda law, k: law.of_film(stretch[k], thickness[k]) / begin[k], 1.0)
