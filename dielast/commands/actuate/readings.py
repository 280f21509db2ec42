"""What `dielast validate` reads for `actuate`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dielast.commands.actuate.recipe import ActuateRecipe
from dielast.commands.actuate.waveform import voltage_entries
from dielast.commands.command import Reading
from dielast.commands.simulation.readings import simulation_readings
from dielast.io.files import Inputs
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[ActuateRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case."""
    return simulation_readings(cases, inputs, voltage_entries)
