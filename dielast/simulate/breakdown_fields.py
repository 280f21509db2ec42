"""The breakdown field of films: stated by the user, or by the law of the material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError
from dielast.material.breakdown import Breakdown, BreakdownLaw
from dielast.material.laws_of_cases import FollowingField, LawsOfCases
from dielast.material.material import Material
from dielast.mechanics.cases import spread
from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class BreakdownFields:
    """The breakdown field in V/m or as a law, `stated` by the user or else by the materials."""

    materials: Sequence[Material]
    stated: ArrayLike | BreakdownLaw | None

    def varied(self) -> list[ArrayLike]:
        """The numbers that may differ from case to case."""
        return [] if self.stated is None or isinstance(self.stated, BreakdownLaw) else [self.stated]

    def laws(self) -> list[BreakdownLaw | None]:
        """The law of all films, or the law of each film; None without a law."""
        if isinstance(self.stated, BreakdownLaw):
            return [self.stated]
        return [None if self.varied() else material.breakdown for material in self.materials]

    def over_prestretch(self) -> bool:
        """Whether a field is a table over prestretch."""
        return any(isinstance(law, Breakdown) and len(law.prestretch) > 1 for law in self.laws())

    def following(self, stretch: Floats, thickness: Floats, cases: int) -> FollowingField | None:
        """The change of the field with the state of the film after the prestretch; None if no law has one."""
        laws = LawsOfCases.of([law if law is not None and law.follows_film else None for law in self.laws()], cases)
        return FollowingField.of(laws, thickness, stretch) if laws else None

    def field(self, stretch: Floats, thickness: Floats, cases: int) -> Floats:
        """E_EB (cases,) in V/m at the prestretch sqrt(l1 l2) of films with an undeformed thickness in m, both (cases,).

        It is infinite where it is not known. Raises `InputError` where it is not positive.
        """
        for stated in self.varied():
            fields = spread(stated, "breakdown_field", cases)
            if np.any(fields <= 0):
                raise InputError(f"{float(fields.min()):g} V/m: it must be positive", argument="breakdown_field")
            return fields
        fields, present = np.full(cases, np.inf), thickness / np.square(stretch)
        for index, material in enumerate(self.materials):
            cases_of = slice(None) if len(self.materials) == 1 else slice(index, index + 1)
            law = self.stated if isinstance(self.stated, BreakdownLaw) else material.breakdown
            if law is not None:
                fields[cases_of] = law.of_film(stretch[cases_of], present[cases_of])
        return fields
