"""Read the files that a recipe names without running it: a mistake in a file is stated with the key that names the file."""

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from dielast.base.errors import DielastWarning, InputError, NumericsError, Problem, messages_of
from dielast.commands.registry import COMMANDS, read_cases
from dielast.io.files import Inputs, read_file
from dielast.io.toml import parse_toml
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case

Check = Callable[[Sequence[Case[Any]], Inputs], object]
"""What the run of a command does with its cases and the files that they name before it solves anything."""


def warnings_of(path: Path, content: bytes | None = None) -> list[str]:
    """The warnings about a recipe, a load file or a material file, or about a recipe of this `content` that would be there.

    Raises `InputError` with a line for every mistake.
    """
    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always", DielastWarning)
        _inspect(path, content)
    return messages_of(record)


def amount_of(path: Path, measured: bool = False) -> str:
    """What a recipe amounts to, and if it is to be `measured`, how long it takes here; empty for what is no recipe, or one case."""
    if os.path.isfile(path) and "kind" not in parse_toml(read_file(path, str(path)), str(path)):
        return ""
    from dielast.commands import plan

    cases = read_cases(path)
    parts = [plan.extent(cases), plan.measured(cases[0].recipe.kind, cases, path) if measured else ""]
    return "; ".join(filter(None, parts))


def _inspect(path: Path, content: bytes | None) -> None:
    keys = parse_toml(read_file(path, str(path)), str(path)).keys() if content is None and os.path.isfile(path) else set()
    if "kind" not in keys and {"equilibrium", "nonequilibrium"} & keys:
        from dielast.handover.material_file import read_material
        from dielast.material.checks import warn_of_material

        warn_of_material(read_material(path))
    elif keys == {"step"}:
        from dielast.recipe.cases import check_load

        check_load(COMMANDS, path)
    else:
        cases = read_cases(path, content=content)
        wrong = mistakes(readings_of(cases, Inputs(path.parent)))
        if wrong:
            raise InputError(*(problem.within(file=path) if problem.file else problem.at(file=path) for problem in wrong))


def readings_of(cases: Sequence[Case[Any]], inputs: Inputs) -> Iterator[Reading]:
    """What is read for a recipe of any kind: what its command lists, or else what all simulations read."""
    command = COMMANDS[cases[0].recipe.kind]
    listed = command.readings
    return checked_readings(command.prepared, cases, inputs) if listed is None else listed(cases, inputs)


def mistakes(readings: Iterable[Reading]) -> list[Problem]:
    """Every mistake in the files, with the key that names the file; a file that several cases share is read once."""
    problems_by_key: dict[Problem, None] = {}
    seen: list[tuple[str, Any]] = []
    for key, stated, read in readings:
        if (key, stated) in seen:
            continue
        seen.append((key, stated))
        try:
            read()
        except (InputError, NumericsError) as error:
            problems_by_key.update(dict.fromkeys(_reached_by(key, problem) for problem in error.problems))
    return list(problems_by_key)


def _reached_by(key: str, problem: Problem) -> Problem:
    """A problem of a file, stated for the `key` that names the file; a problem with a key of the recipe keeps that key."""
    return problem.within(key=key) if key and (problem.file or not problem.key) else problem


def readings(cases: Sequence[Case[Any]], inputs: Inputs) -> Iterator[Reading]:
    """The files of every case: the material with its draws, tables of steps, measured points."""
    from dielast.commands.simulation.cases import material_key, material_of
    from dielast.commands.simulation.compare import check_comparison
    from dielast.commands.simulation.solver_steps import solver_steps

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
    from dielast.commands.simulation.cases import material_of
    from dielast.commands.simulation.uncertainty import sample_of

    try:
        material = material_of(case, inputs)
    except InputError:
        return
    sample_of(case, material, inputs)
