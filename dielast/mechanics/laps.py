"""The pieces of a programme with a cycle of steps, of which only the first two laps are stored.

A step leaves what it does not state as it was, and states all else whatever came before. So from the second lap on the pieces of
all laps are equal, but for their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import overload

from dielast.mechanics.piece import Piece
from dielast.numerics.arrays import Cases


@dataclass(frozen=True, slots=True, eq=False)
class Pieces(Sequence[Piece]):
    """`stored` pieces, those of the second lap being those of all later ones, of a cycle that runs through `laps` of them."""

    stored: Sequence[Piece]
    laps: int = 0

    def __len__(self) -> int:
        again = sum(piece.lap == 2 for piece in self.stored)
        return len(self.stored) + again * (max(self.laps, 2) - 2)

    @overload
    def __getitem__(self, index: int) -> Piece: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Piece]: ...
    def __getitem__(self, index: int | slice) -> Piece | Sequence[Piece]:
        """A piece, with the number of its lap."""
        if isinstance(index, slice):
            return [self[at] for at in range(*index.indices(len(self)))]
        lapped = [at for at, piece in enumerate(self.stored) if piece.lap == 2]
        later = len(self) - len(self.stored)
        index = range(len(self))[index]
        if not lapped or index < lapped[0] + len(lapped):
            return self.stored[index]
        beyond = index - lapped[0]
        if beyond >= len(lapped) + later:
            return self.stored[index - later]
        return replace(self.stored[lapped[0] + beyond % len(lapped)], lap=2 + beyond // len(lapped))

    def take(self, cases: Cases) -> Pieces:
        """The pieces of the selected cases (k,)."""
        return replace(self, stored=[piece.take(cases) for piece in self.stored])
