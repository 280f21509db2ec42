"""What can go wrong, in the words that reach the user.

Bad input raises `InputError`, numerics that give up raise `NumericsError`, and what a user should know but can live with is
warned of as `DielastWarning`. A predicted failure of the film is none of these: it is a value in a result.
"""

from __future__ import annotations

import warnings
from typing import Any


class DielastError(Exception):
    """Base of every error that dielast raises on purpose; `messages` holds one line for each thing found wrong."""

    def __init__(self, *messages: str) -> None:
        self.messages = messages
        super().__init__("\n".join(messages))


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
    text = f'"{value}"' if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else str(value)
    text = "".join(mark if mark.isprintable() else ascii(mark)[1:-1] for mark in text)
    return text if len(text) <= 60 else text[:57] + "..."
