"""Array types, and how cases are selected: the last axis of arrays is the cases, and no result may depend on their number.

`Floats` are float64, `Flags` booleans, `Texts` words, `Index` integers that index another array; `Cases` index cases, or the
columns of an array.
"""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Index = NDArray[np.intp]
Cases = Index
Texts = NDArray[np.str_]


def rms(values: Floats) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def paired(columns: Cases) -> Cases:
    """The columns (k,); a single column is repeated, to shape (2,).

    numpy sums an array of shape (n, 1) in a different order than an array of shape (n, 2), and so rounds differently. No result may
    depend on how many cases run together, so at least two columns are selected wherever sums over springs or stages follow.
    Both copies then write the same result to the same column.
    """
    return np.repeat(columns, 2) if columns.size == 1 else columns


def where(mask: Flags) -> Cases:
    """The columns (k,) in which a mask is true; a single column is repeated (`paired`)."""
    return paired(np.flatnonzero(mask))


class ByCase:
    """A dataclass of arrays whose last axis is the cases, and of objects with a method `take`; other fields hold for all cases."""

    __slots__ = ()
    __match_args__: tuple[str, ...]  # the names of the fields that the constructor takes

    def take(self, cases: Cases) -> Self:
        """The selected cases (k,)."""
        return type(self)(*(_taken(getattr(self, name), cases) for name in self.__match_args__))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The cases of all parts, in the order of the parts, which have the same fields that hold for all cases."""
        return cls(*(_joined([getattr(part, name) for part in parts]) for name in cls.__match_args__))


def _taken(value: Any, cases: Cases) -> Any:
    """The selected cases of the value of a field."""
    if isinstance(value, np.ndarray):
        return value.take(cases, axis=-1)  # contiguous, as sums over springs need it; indexing is not
    return value.take(cases) if _has_cases(value) else value


def _joined(values: list[Any]) -> Any:
    """The cases of all values of a field."""
    if isinstance(values[0], np.ndarray):
        return np.concatenate(values, axis=-1)
    return type(values[0]).joined(values) if _has_cases(values[0]) else values[0]


def _has_cases(value: Any) -> bool:
    """Whether an object that is no array has cases; a number of numpy, which has a method `take` as well, has none."""
    return hasattr(value, "take") and not isinstance(value, np.generic)
