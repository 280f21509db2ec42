"""`new`, `validate` and `schema`."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from dielast.commands.registry import COMMANDS, read_cases
from dielast.errors import DielastWarning, InputError, Problem, shown
from dielast.io.files import Inputs, read_file
from dielast.recipe.kinds import or_kind
from dielast.recipe.toml import parse_toml


def print_starter(kind: str) -> int:
    """Print the starter recipe of `kind`."""
    if kind not in COMMANDS:
        raise InputError(f"{shown(kind)} is no kind of recipe: {or_kind(kind, COMMANDS)}")
    sys.stdout.write(COMMANDS[kind].starter())
    return 0


def validate_files(paths: Sequence[Path]) -> int:
    """Check recipes, the files they name, load and material files; raises `InputError` with every mistake of every file."""
    mistakes: list[Problem] = []
    for path in paths:
        try:
            caught = _validate(path)
        except InputError as error:
            mistakes += error.problems
            continue
        print(f"{path}: ok", flush=True)
        for message in caught:
            print(f"warning: {path}: {message}", file=sys.stderr)
    if mistakes:
        raise InputError(*mistakes)
    return 0


def _validate(path: Path) -> list[str]:
    """Warnings on the way; raises `InputError` with a line for every mistake."""
    keys = parse_toml(read_file(path, str(path)), str(path)).keys() if os.path.isfile(path) else set()
    if "kind" not in keys and {"equilibrium", "nonequilibrium"} & keys:
        from dielast.handover.material_file import read_material

        read_material(path)
        return []
    if keys == {"step"}:
        from dielast.recipe.cases import check_load

        check_load(COMMANDS, path)
        return []
    cases = read_cases(path)
    from dielast.commands.inspect import mistakes

    with warnings.catch_warnings(record=True) as record:
        warnings.simplefilter("always", DielastWarning)
        wrong = mistakes(COMMANDS[cases[0].recipe.kind].readings(cases, Inputs(path.parent)))
    if wrong:
        raise InputError(*(problem.within(file=path) if problem.file else problem.at(file=path) for problem in wrong))
    return list(dict.fromkeys(str(entry.message) for entry in record if issubclass(entry.category, DielastWarning)))


def print_schema() -> int:
    """Print the JSON Schema of recipes."""
    from dielast.recipe.schema import recipe_schema

    print(json.dumps(recipe_schema(COMMANDS), indent=2))
    return 0
