"""Read what a recipe names without running it: every mistake in a file is stated with the key that leads there."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from dielast.commands.command import Reading
from dielast.errors import InputError, NumericsError, Problem


def mistakes(readings: Iterable[Reading]) -> list[Problem]:
    """Every mistake in the files, with the key that leads there; what several cases state alike is read once."""
    found: dict[Problem, None] = {}
    seen: list[tuple[str, Any]] = []
    for key, stated, read in readings:
        if (key, stated) in seen:
            continue
        seen.append((key, stated))
        try:
            read()
        except (InputError, NumericsError) as error:
            found.update(dict.fromkeys(_reached_by(key, problem) for problem in error.problems))
    return list(found)


def _reached_by(key: str, problem: Problem) -> Problem:
    """A problem of a file as one of the `key` that names the file; a problem that has a key of the recipe keeps that key."""
    return problem.within(key=key) if key and (problem.file or not problem.key) else problem
