"""Read what a recipe names without running it: every mistake in a file is stated with the key that leads there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dielast.commands.command import Reading
from dielast.errors import InputError, NumericsError


def mistakes(readings: Iterable[Reading]) -> list[str]:
    """A line, beginning with the key, for every mistake in the files; what several cases state alike is read once."""
    found: dict[str, None] = {}
    seen: list[tuple[str, Any]] = []
    for key, stated, read in readings:
        if (key, stated) in seen:
            continue
        seen.append((key, stated))
        try:
            read()
        except (InputError, NumericsError) as error:
            found.update(dict.fromkeys(f"{key}: {line}" if key else line for line in error.messages))
    return list(found)
