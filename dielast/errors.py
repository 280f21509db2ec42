"""What can go wrong, in the words that reach the user.

Bad input raises `InputError`, numerics that give up raise `NumericsError`, and what a user should know but can live with is
warned of as `DielastWarning`. A predicted failure of the film is none of these: it is a value in a result.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from itertools import islice
from typing import Any

LONGEST = 1000  # characters of a message: more than any that is meant to be read
_ENDLESS = re.compile(r"\S{300,}")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_SHOWN = 60  # characters of a value, and more than enough entries of a list
_DEEPEST = 9  # lists and tables within each other


class DielastError(Exception):
    """Base of every error that dielast raises on purpose; `messages` holds one line for each thing found wrong."""

    def __init__(self, *messages: str) -> None:
        self.messages = tuple(map(_one_line, messages))
        super().__init__("\n".join(self.messages))

    def __reduce__(self) -> tuple[type[DielastError], tuple[str, ...]]:
        """The same error in another process."""
        return type(self), self.messages


class InputError(DielastError, ValueError):
    """A recipe, a table, a material or an argument is wrong (exit code 2)."""


class NumericsError(DielastError):
    """The numerics gave up on a problem that was well posed (exit code 3)."""


class DielastWarning(UserWarning):
    """A result stands, but not as firmly as its digits suggest."""


def warn(message: str) -> None:
    """Issue `message` as a `DielastWarning`; the command line prints it and puts it into the summary."""
    warnings.warn(message, DielastWarning, stacklevel=3)


def shown(value: Any) -> str:
    """A value as an error message shows it: as TOML has it, in one line, cut if long."""
    text = _printable(as_toml(value, _SHOWN))
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def shown_path(keys: Iterable[str]) -> str:
    """A path of keys as TOML has it: dotted, in quotes what is no bare key."""
    return ".".join(key if _BARE_KEY.fullmatch(key) else quoted(key) for key in keys)


def quoted(text: str) -> str:
    """Text in quotes as TOML has it: double ones, or single ones if something in it would have to be escaped."""
    if text.isprintable() and not {'"', "\\"} & {*text}:
        return f'"{text}"'
    if text.isprintable() and "'" not in text:
        return f"'{text}'"
    import json  # which takes its time to load

    return json.dumps(text, ensure_ascii=False)


def as_toml(value: Any, entries: int | None = None, depth: int = _DEEPEST) -> str:
    """A value as TOML has it: of lists and tables so many `entries`, and of those within each other down to a `depth`."""
    match value:
        case str():
            return quoted(value)
        case bool():
            return str(value).lower()
        case list() | tuple() | dict() if depth == 0:
            return "..."
        case list() | tuple():
            return f"[{', '.join(as_toml(entry, entries, depth - 1) for entry in value[:entries])}]"
        case dict():
            first = islice(value.items(), entries)
            pairs = (f"{shown_path([str(key)])} = {as_toml(entry, entries, depth - 1)}" for key, entry in first)
            return f"{{ {', '.join(pairs)} }}" if value else "{}"
    return str(value)


def _one_line(message: str) -> str:
    """The message without line breaks and control characters that came from a file, and without endless words."""
    line = _ENDLESS.sub(lambda word: word[0][:200] + "..." + word[0][-60:], _printable(message))
    return line if len(line) <= LONGEST else line[: LONGEST - 3] + "..."


def _printable(text: str) -> str:
    return text if text.isprintable() else "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in text)
