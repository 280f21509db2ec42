"""Laws W(I1) of chains with a limiting stretch, which one constant states; without a limit they are neo-Hookean."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np

from dielast.material.springs.first_invariant import FirstInvariantLaw
from dielast.numerics.arrays import Floats


class LimitedLaw(FirstInvariantLaw):
    """Base of laws whose first constant states the limit of the chains, infinite by default: a number, or an array (n, cases) or
    (n, 1) for several springs.

    `SHORTEST` is the constant of chains that are taut at a stretch of about 1.7; smaller values are implausible for a rubber.
    `MEASURE` says what the constant is a value of, in words that follow the number, and `USUAL` is a question about a likely
    mistake.
    """

    __slots__ = ()

    SHORTEST: ClassVar[float]
    MEASURE: ClassVar[str] = ""
    USUAL: ClassVar[str]

    def _limit(self) -> tuple[str, Floats]:
        """The name of the constant and its value."""
        name = self.constants[0].name
        return name, np.asarray(getattr(self, name), dtype=float)

    def describe_limit(self) -> str:
        """The limit with its number."""
        name, limit = self._limit()
        return f"the {self.title} limit, {name} = {float(limit):g}{self.MEASURE}"

    def warning(self, whose: str) -> str:
        """A warning of chains that are taut at small stretches, or an empty text."""
        name, limit = self._limit()
        shortest = float(np.min(limit))
        if shortest >= self.SHORTEST:
            return ""
        return f"{name} = {shortest:g} ({whose}): chains so short make no rubber: {self.USUAL}"

    def unlimited(self) -> Self:
        """The law without a limit."""
        return type(self)()

    def exact_forms(self) -> tuple[str, ...]:
        """The law itself, and neo-Hookean if there is no limit."""
        return ("neo-hookean", self.name) if np.all(np.isinf(self._limit()[1])) else (self.name,)
