"""Laws of many cases as few laws whose constants are arrays, so that a family answers for all cases at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from dielast.material.law import Law
from dielast.numerics.columns import Cases, Floats

Kind = TypeVar("Kind", bound=Law)


@dataclass(frozen=True, slots=True, eq=False)
class LawsOfCases(Generic[Kind]):
    """The law of each case, if the case has a law: row `place` (cases,) of the law number `number` (cases,) of `laws`, -1 for none.

    The constants of a law must be numbers, of which the law takes arrays (k,), too.
    """

    laws: tuple[Kind, ...]
    number: Cases
    place: Cases

    @classmethod
    def of(cls, stated: Sequence[Kind | None], cases: int) -> LawsOfCases[Kind]:
        """Of one law for all cases, or one for each case; None is no law."""
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

    def __bool__(self) -> bool:
        return bool(self.laws)

    def take(self, cases: Cases) -> LawsOfCases[Kind]:
        """The same for some of the cases."""
        return replace(self, number=self.number[cases], place=self.place[cases])

    def ask(self, cases: Cases, answer: Callable[[Kind, Cases], Floats], without: float) -> Floats:
        """The `answer` (k,) of the laws of `cases` (k,), given a law and the columns (m,) of `cases` that it is of, its constants
        (m,); `without` for a case that has no law.
        """
        result, number = np.full(cases.size, without), self.number[cases]
        for index, law in enumerate(self.laws):
            columns = np.flatnonzero(number == index)
            if columns.size:
                result[columns] = answer(_of_places(law, self.place[cases[columns]]), columns)
        return result


def _stacked(laws: Sequence[Kind]) -> Kind:
    """One law of the class of all, with their constants as arrays (k,)."""
    values = {own.name: [getattr(law, own.name) for law in laws] for own in laws[0].constants}
    arrays = {name: None if set(each) == {None} else np.array(each, dtype=float) for name, each in values.items()}
    return replace(laws[0], **arrays)  # type: ignore[type-var]


def _of_places(law: Kind, place: Cases) -> Kind:
    """The law with the constants at these places (m,)."""
    values = {own.name: getattr(law, own.name) for own in law.constants}
    return replace(law, **{name: value[place] for name, value in values.items() if value is not None})  # type: ignore[type-var]
