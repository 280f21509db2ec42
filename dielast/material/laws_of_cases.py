"""Laws of many cases as few laws whose constants are arrays, to evaluate all cases at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Self, TypeVar

import numpy as np

from dielast.material.law import BreakdownLaw, DamageLaw, DielectricLaw, Law, LogRatio
from dielast.numerics.arrays import ByCase, Floats, Index

Kind = TypeVar("Kind", bound=Law)


@dataclass(frozen=True, slots=True, eq=False)
class LawsOfCases(ByCase, Generic[Kind]):
    """The laws of cases: case k has the law `laws[number[k]]`; -1 is no law. Where there is a `place`, the constants of a law are
    arrays, and the case has their row `place[k]`. Both arrays are (cases,).
    """

    laws: tuple[Kind, ...]
    number: Index
    place: Index | None = None

    @classmethod
    def of(cls, stated: Sequence[Kind | None], cases: int) -> LawsOfCases[Kind]:
        """From one law for all cases, or one for each case; None is no law. All laws of a class become one.

        The constants of a law must be numbers, and the law must also take arrays (k,) of them.
        """
        classes: dict[type[Any], dict[int, tuple[int, Kind]]] = {}
        number, place = np.full((2, len(stated)), -1, dtype=np.intp)
        for index, law in enumerate(stated):
            if law is not None:
                alike = classes.setdefault(type(law), {})
                number[index] = list(classes).index(type(law))
                place[index] = alike.setdefault(id(law), (len(alike), law))[0]
        laws = tuple(_stacked([law for _, law in alike.values()]) for alike in classes.values())
        width = (cases,) if len(stated) == 1 else number.shape
        return cls(laws, np.broadcast_to(number, width), np.broadcast_to(place, width))

    @classmethod
    def apart(cls, stated: Sequence[Kind], cases: int) -> LawsOfCases[Kind]:
        """From one law for all cases, or one for each case, whatever their constants are; only equal laws become one."""
        different = tuple(dict.fromkeys(stated))
        return cls(different, np.broadcast_to(np.array([different.index(law) for law in stated]), (cases,)))

    def take(self, cases: Index) -> Self:
        """The selected cases (k,)."""
        return self if self.place is None and len(self.laws) < 2 else ByCase.take(self, cases)

    def __bool__(self) -> bool:
        return bool(self.laws)

    def values(self, cases: Index, of_law: Callable[[Kind, Index], Floats], without: float) -> Floats:
        """The values (k,) for `cases` (k,) of a function `of_law`, which is called with a law, whose constants are (m,), and the
        indices (m,) in `cases` that have this law; `without` is the value for a case without a law.
        """
        result = np.full(cases.size, without)
        for law, columns in self.parts(cases):
            result[columns] = of_law(law, columns)
        return result

    def parts(self, cases: Index) -> Iterator[tuple[Kind, Index]]:
        """Each law, with constants (m,), and the indices (m,) in `cases` (k,) that have this law."""
        number = self.number[cases]
        for index, law in enumerate(self.laws):
            columns = np.flatnonzero(number == index)
            if not columns.size:
                continue
            if self.place is None:
                yield law, columns
            else:
                place = self.place[cases[columns]]
                yield law.with_values({name: value[place] for name, value in law.values().items() if value is not None}), columns


def _stacked(laws: Sequence[Kind]) -> Kind:
    """One law with the constants of laws of one class as arrays (k,)."""
    columns = {name: [law.values()[name] for law in laws] for name in laws[0].values()}
    return laws[0].with_values(
        {name: None if set(column) == {None} else np.array(column, dtype=float) for name, column in columns.items()}
    )


@dataclass(frozen=True, slots=True, eq=False)
class StretchDependentBreakdown(ByCase):
    """Breakdown `laws` that depend on the present stretch and thickness, for films of an undeformed `thickness` (cases,) in m;
    `at_prestretch` (cases,) is their field in V/m at the prestretch, 1 for films with a constant breakdown field.
    """

    laws: LawsOfCases[BreakdownLaw]
    thickness: Floats
    at_prestretch: Floats

    @classmethod
    def of(cls, laws: LawsOfCases[BreakdownLaw], thickness: Floats, prestretch: Floats) -> Self:
        """For films (cases,) at a `prestretch` sqrt(l1 l2)."""
        relaxed = cls(laws, thickness, np.ones_like(thickness))
        every = np.arange(thickness.size)
        return cls(laws, thickness, relaxed.ratio(every, 4 * np.log(prestretch)))

    def ratio(self, cases: Index, log_area: Floats) -> Floats:
        """The breakdown field of `cases` (k,) at 2 ln(l1 l2) = `log_area` (k,), over that at the prestretch.

        l = exp(log_area/4), and, as films are incompressible, h = H exp(-log_area/2).
        """
        stretch, thickness = np.exp(0.25 * log_area), self.thickness[cases] * np.exp(-0.5 * log_area)
        begin = self.at_prestretch[cases]
        return self.laws.values(cases, lambda law, k: law.of_film(stretch[k], thickness[k]) / begin[k], 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class FailureLaws(ByCase):
    """What fields films endure: `breakdown_field` (cases,) in V/m at their prestretch, infinite where it is not known; its change
    with the state of the film, `following`; and the laws of ageing, `damage`. The last two are None if there are no such laws.
    """

    breakdown_field: Floats
    following: StretchDependentBreakdown | None = None
    damage: LawsOfCases[DamageLaw] | None = None


NO_STRETCH = DielectricLaw()
"""Stands for all laws of permittivities that do not depend on stretch."""


UNSTRETCHED: LawsOfCases[DielectricLaw] = LawsOfCases((), np.zeros(0, dtype=np.intp))
"""The dependence on stretch of any number of permittivities that have none."""


def stretch_laws(laws: Sequence[DielectricLaw], cases: int) -> LawsOfCases[DielectricLaw]:
    """How the permittivities of cases depend on stretch, from one law for each case or one for all."""
    if not any(law.depends_on_stretch for law in laws):
        return UNSTRETCHED
    return LawsOfCases.apart([law if law.depends_on_stretch else NO_STRETCH for law in laws], cases)


def log_ratio(laws: LawsOfCases[DielectricLaw], log_squared_stretch: Floats) -> LogRatio:
    """`DielectricLaw.log_ratio` of the `stretch_laws` of the cases, at Lambda (2, cases)."""
    if len(laws.laws) < 2:
        return next(iter(laws.laws), NO_STRETCH).log_ratio(log_squared_stretch)
    cases = log_squared_stretch.shape[1]
    value, slope, bend = np.empty(cases), np.empty((2, cases)), np.empty((3, cases))
    for law, here in laws.parts(np.arange(cases)):
        value[here], slope[:, here], bend[:, here] = law.log_ratio(log_squared_stretch[:, here])
    return value, slope, bend
