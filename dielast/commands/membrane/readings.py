"""What `dielast validate` reads for `relax` and `creep`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dielast.commands.command import Reading
from dielast.commands.simulation.history import Recipe, solver_steps
from dielast.commands.simulation.readings import simulation_readings
from dielast.io.files import Inputs
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[Recipe]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case."""
    return simulation_readings(cases, inputs, solver_steps)
