"""Read the files that a recipe names without running it: a mistake in a file is stated with the key that names the file."""

import os
import warnings
from pathlib import Path

from dielast.base.errors import DielastWarning, InputError, NumericsError, messages_of
from dielast.commands.registry import COMMANDS, read_cases
from dielast.io.files import Inputs, read_file
from dielast.io.toml import parse_toml


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
        try:
            COMMANDS[cases[0].recipe.kind].prepared(cases, Inputs(path.parent))
        except (InputError, NumericsError) as error:
            wrong = (problem.within(file=path) if problem.file else problem.at(file=path) for problem in error.problems)
            raise InputError(*dict.fromkeys(wrong)) from None
