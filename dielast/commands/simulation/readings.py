"""What `dielast validate` reads for a simulation: the material with its draws, tables of steps, measured points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from dielast.commands.command import Reading
from dielast.commands.simulation.cases import check_case, material_key, material_of, read_materials
from dielast.commands.simulation.compare import read_points
from dielast.commands.simulation.run import Simulation
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.commands.simulation.uncertainty import sample_of
from dielast.errors import InputError, Mistakes, without_warnings
from dielast.io.files import Inputs
from dielast.recipe.cases import Case

Maker = Callable[[Sequence[Any]], Simulation]
"""Makes the simulation of a command from the recipes of its cases."""


def readings(cases: Sequence[Case[Any]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case."""
    for case in cases:
        recipe, material = case.recipe, material_key(case)
        yield "material", material, partial(material_of, case, inputs)
        if recipe.uncertainty is not None:
            yield "uncertainty", (material, recipe.uncertainty), partial(_read_draws, case, inputs)
        for index, step in enumerate(getattr(recipe, "step", ())):
            if step.table is not None:
                alone = recipe.model_copy(update={"step": [step], "load": None})
                yield f"step[{index}].table", step, partial(solver_steps, alone, inputs)
        specimen = getattr(recipe, "specimen", None)
        for index, comparison in enumerate(getattr(recipe, "compare", ())):
            yield f"compare[{index}].file", (comparison, specimen), partial(read_points, comparison, inputs, specimen)
    for index, comparison in enumerate(getattr(cases[0].recipe, "compare", ())):
        yield "", (index, comparison), partial(check_case, index, comparison, len(cases))


def checked_readings(simulation: Maker, cases: Sequence[Case[Any]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case, and whether the material allows what the recipes ask of it."""
    yield from readings(cases, inputs)
    yield "", "material", partial(_check_use, simulation, cases, inputs)


def _check_use(simulation: Maker, cases: Sequence[Case[Any]], inputs: Inputs) -> None:
    """Raise the errors that the run would raise before it solves anything, one for each batch of cases.

    A mistake in a file is reported by the reading of that file.
    """
    try:
        # the run warns of the materials
        with without_warnings():
            materials = read_materials(cases, inputs)
        simulated = simulation([case.recipe for case in cases])
        batches = simulated.batches(cases, materials, inputs)
    except InputError:
        return
    wrong = Mistakes()
    for batch in batches:
        wrong.tried(partial(batch.check, simulated.check))
    wrong.refuse()


def _read_draws(case: Case[Any], inputs: Inputs) -> None:
    """The draws of the material; a mistake in the material file itself is reported by the reading of the material."""
    try:
        material = material_of(case, inputs)
    except InputError:
        return
    sample_of(case, material, inputs)
