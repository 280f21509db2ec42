"""Laws of many cases as a few laws whose constants are arrays, so that a family is evaluated for all cases at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np

from dielast.material.law import Law
from dielast.numerics.arrays import Floats, Index

Kind = TypeVar("Kind", bound=Law)


@dataclass(frozen=True, slots=True, eq=False)
class LawsOfCases(Generic[Kind]):
    """The law of each case: `number` (cases,) is the index of its law in `laws`, -1 without a law, and `place` (cases,) the index
    in
    the constants (k,) of that law.

    The constants of a law must be numbers, which may be replaced by arrays (k,).
    """

    laws: tuple[Kind, ...]
    number: Index
    place: Index

    @classmethod
    def of(cls, stated: Sequence[Kind | None], cases: int) -> LawsOfCases[Kind]:
        """The laws of cases from one law for all, or one per case; None is no law."""
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

    def take(self, cases: Index) -> LawsOfCases[Kind]:
        """The selected cases (k,)."""
        return replace(self, number=self.number[cases], place=self.place[cases])

    def ask(self, cases: Index, answer: Callable[[Kind, Index], Floats], without: float) -> Floats:
        """The `answer` (k,) of the laws of `cases` (k,), and `without` for cases without a law.

        `answer` is called with a law, whose constants are arrays (m,), and the columns (m,) of `cases` to which it applies.
        """
        result, number = np.full(cases.size, without), self.number[cases]
        for index, law in enumerate(self.laws):
            columns = np.flatnonzero(number == index)
            if columns.size:
                result[columns] = answer(_of_places(law, self.place[cases[columns]]), columns)
        return result


def _stacked(laws: Sequence[Kind]) -> Kind:
    """One law of their common class, with their constants as arrays (k,)."""
    values = {constant.name: [getattr(law, constant.name) for law in laws] for constant in laws[0].constants}
    arrays = {name: None if set(column) == {None} else np.array(column, dtype=float) for name, column in values.items()}
    return replace(laws[0], **arrays)  # type: ignore[type-var]


def _of_places(law: Kind, place: Index) -> Kind:
    """The law with its constants at these indices (m,)."""
    values = {constant.name: getattr(law, constant.name) for constant in law.constants}
    return replace(law, **{name: value[place] for name, value in values.items() if value is not None})  # type: ignore[type-var]
