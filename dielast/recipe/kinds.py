"""The kinds of recipes as this package needs them; the commands pass in the kinds that exist."""

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
    """The commands that write a file of this name, joined by "or"; None if there are more than two or none."""
    makers = [name for name, kind in kinds.items() if file in kind.files]
    return " or dielast ".join(makers) if 1 <= len(makers) <= 2 else None


def maker_of(kinds: Kinds, file: str) -> str | None:
    """The only kind of recipe whose runs write a file of this name; None if there is none or several."""
    makers = [name for name, kind in kinds.items() if file in kind.files]
    return makers[0] if len(makers) == 1 else None
