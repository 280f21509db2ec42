"""What can go wrong, in the words that reach the user.

Bad input raises `InputError`, numerics that give up raise `NumericsError`, and what a user should know but can live with is
warned of as `DielastWarning`. A predicted failure of the film is none of these: it is a value in a result.
"""

from __future__ import annotations

import re
import warnings
from typing import Any

LONGEST = 1000  # characters of a message: more than any that is meant to be read
_ENDLESS = re.compile(r"\S{300,}")


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
    """A value as an error message shows it: text in quotes, in one line, cut if long."""
    text = _printable(f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else str(value))
    return text if len(text) <= 60 else text[:57] + "..."


def _one_line(message: str) -> str:
    """The message without line breaks and control characters that came from a file, and without endless words."""
    line = _ENDLESS.sub(lambda word: word[0][:200] + "..." + word[0][-60:], _printable(message))
    return line if len(line) <= LONGEST else line[: LONGEST - 3] + "..."


def _printable(text: str) -> str:
    return text if text.isprintable() else "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in text)
