"""What `dielast validate` reads for a simulation: the material with its draws, tables of steps, measured points."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

from dielast.commands.simulation.cases import material_key, material_of
from dielast.commands.simulation.compare import check_comparison
from dielast.commands.simulation.solver_steps import solver_steps
from dielast.commands.simulation.uncertainty import sample_of
from dielast.errors import InputError
from dielast.io.files import Inputs
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case

Check = Callable[[Sequence[Case[Any]], Inputs], object]
"""What the run of a command does with its cases and the files that they name before it solves anything."""


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
    for index, comparison in enumerate(getattr(cases[0].recipe, "compare", ())):
        yield f"compare[{index}].file", (index, comparison), partial(check_comparison, index, comparison, cases, inputs)


def checked_readings(check: Check, cases: Sequence[Case[Any]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case, and what the run would `check` before it solves anything."""
    yield from readings(cases, inputs)
    yield "", "run", partial(_check, check, cases, inputs)


def _check(check: Check, cases: Sequence[Case[Any]], inputs: Inputs) -> None:
    """Raise the errors that the run would raise before it solves anything, and warn as it would.

    A mistake in a file is reported by the reading of that file.
    """
    try:
        check(cases, inputs)
    except InputError as error:
        if of_recipe := [problem for problem in error.problems if problem.file is None]:
            raise InputError(*of_recipe) from None


def _read_draws(case: Case[Any], inputs: Inputs) -> None:
    """The draws of the material; a mistake in the material file itself is reported by the reading of the material."""
    try:
        material = material_of(case, inputs)
    except InputError:
        return
    sample_of(case, material, inputs)
