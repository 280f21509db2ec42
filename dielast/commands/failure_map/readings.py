"""What `dielast validate` reads for `failure-map`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dielast.commands.command import Reading
from dielast.commands.failure_map.recipe import FailureMapRecipe
from dielast.commands.simulation.readings import material_readings
from dielast.io.files import Inputs
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[FailureMapRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The material and its draws."""
    return material_readings(cases[0], inputs)
