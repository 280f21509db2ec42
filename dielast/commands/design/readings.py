"""What `dielast validate` reads for `design`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from dielast.commands.command import Reading
from dielast.commands.design.recipe import DesignRecipe
from dielast.commands.simulation.readings import material_readings
from dielast.io.files import Inputs
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[DesignRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The material and its draws."""
    return material_readings(cases[0], inputs)
