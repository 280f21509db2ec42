"""A recipe as text, written key by key: each key may have a comment, and what its reader must fill in is marked."""

from collections.abc import Mapping
from typing import Any

from dielast.base.errors import as_toml, shown_path

FILL = "FILL IN"
"""Stands in a value that is not known: a recipe with it is refused, with the name of the key."""
_WIDTH = 41


class RecipeLines:
    """The lines of a recipe of a `kind`. `missing` are the keys that must be filled in, `doubts` are warnings about the files, and
    the recipe is `unsure` if nothing in the files shows that they are for it.
    """

    def __init__(self, kind: str, what: str) -> None:
        """`what` says in a comment what the recipe does."""
        self.lines = [f"# {what} Run it with: dielast {kind} RECIPE.toml", f"kind = {as_toml(kind)}"]
        self.missing: list[str] = []
        self.doubts: list[str] = []
        self.unsure = False
        self._section = ""

    def section(self, header: str, comment: str = "") -> None:
        """Begin a table, such as `[data]` or `[[test]]`."""
        self.lines += ["", _aligned(header, comment)]
        self._section = header.strip("[]")
        if header.startswith("[["):
            self._section += f"[{self.lines.count(header) + sum(line.startswith(f'{header} ') for line in self.lines) - 1}]"

    def key(self, name: str, value: Any, comment: str = "") -> None:
        """State a key; a mapping is an inline table without its entries that are None. A value with `FILL` in it is marked."""
        if isinstance(value, Mapping):
            value = {key: entry for key, entry in value.items() if entry is not None}
        text = as_toml(value)
        if FILL in text:
            inner = [f".{key}" for key, entry in value.items() if FILL in as_toml(entry)] if isinstance(value, dict) else [""]
            self.missing += [".".join(filter(None, (self._section, name))) + more for more in inner]
            comment = f"{FILL}: {comment}" if comment else FILL
        self.lines.append(_aligned(f"{shown_path([name])} = {text}", comment))

    def option(self, text: str, comment: str = "") -> None:
        """A key that may be stated, as a comment."""
        self.lines.append(_aligned(f"# {text}", comment))

    def note(self, text: str) -> None:
        """A comment."""
        self.lines.append(f"# {text}")

    def text(self, lines: str) -> None:
        """Further lines as they are."""
        self.lines += ["", *lines.strip("\n").split("\n")]

    def __str__(self) -> str:
        return "\n".join(self.lines) + "\n"


def _aligned(text: str, comment: str) -> str:
    one_line = "".join(mark if mark.isprintable() else " " for mark in " ".join(comment.split()))
    return f"{text:<{_WIDTH}} # {one_line}" if one_line else text
