"""The kinds of recipes as the engine sees them; which kinds there are, it is given from above."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from dielast.recipe.base import RecipeBase


class Kind(Protocol):
    """A kind of recipe."""

    @property
    def model(self) -> type[RecipeBase]:
        """The model of its recipes."""

    @property
    def files(self) -> tuple[str, ...]:
        """The names of all files that its runs may write, besides figures and summaries."""


Kinds = Mapping[str, Kind]
"""Every kind of recipe by its name."""


def or_makers(kinds: Kinds, file: str) -> str | None:
    """The one or two kinds of recipe whose runs write a file of this name, as commands joined by "or"; None for more or none."""
    makers = [name for name, kind in kinds.items() if file in kind.files]
    return " or dielast ".join(makers) if 1 <= len(makers) <= 2 else None


def maker_of(kinds: Kinds, file: str) -> str | None:
    """The kind of recipe whose runs write a file of this name; None if there are none or several."""
    makers = [name for name, kind in kinds.items() if file in kind.files]
    return makers[0] if len(makers) == 1 else None
