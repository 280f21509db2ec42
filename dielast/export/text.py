"""Numbers and names as every code reads them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from itertools import islice

from dielast.material.shift import kelvin


def number(value: float) -> str:
    """15 significant digits, fewer where that would take more than the 20 characters that Abaqus reads."""
    return next(text for digits in range(15, 0, -1) if len(text := f"{value:.{digits}g}") <= 20)


def rows_of(numbers: Iterable[str], width: int) -> list[tuple[str, ...]]:
    """The numbers in rows of at most so many."""
    rest = iter(numbers)
    return list(iter(lambda: tuple(islice(rest, width)), ()))


def temperature(value: float, scale: str) -> str:
    """A temperature in degC as a number on the model's `scale`, "degC" or "K"."""
    return number(kelvin(value) if scale == "K" else value)


def identifier(name: str) -> str:
    """A name of ASCII letters, digits and underscores that begins with a letter, at most 60 long."""
    text = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    text = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")[:60].rstrip("_")
    return text if text[:1].isalpha() else f"material_{text}".rstrip("_")


def plain(text: str) -> str:
    """Text that is safe in the comments of every code: printable ASCII, no backslash, no double hyphen."""
    shown = "".join(mark if mark.isascii() and mark.isprintable() and mark != "\\" else "?" for mark in text)
    return re.sub(r"-(?=-)", "- ", shown)[:100]
