"""What `dielast validate` reads and checks for `actuate`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from dielast.commands.actuate.run import Films
from dielast.commands.command import Reading
from dielast.commands.simulation.readings import checked_readings
from dielast.io.files import Inputs
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[Any]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case, and whether the material allows what the recipes ask of it."""
    return checked_readings(Films, cases, inputs)
