"""`new`, `validate`, `report` and `schema`."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from dielast.commands.registry import COMMANDS
from dielast.errors import InputError, Problem, nearest, shown


def print_starter(kind: str) -> int:
    """Print the starter recipe of `kind`."""
    if kind not in COMMANDS:
        raise InputError(f"{shown(kind)} is no kind of recipe: {nearest(kind, COMMANDS)}")
    sys.stdout.write(COMMANDS[kind].starter())
    return 0


def validate_files(paths: Sequence[Path]) -> int:
    """Check recipes, the files they name, load and material files; raises `InputError` with every mistake of every file."""
    from dielast.commands.inspect import warnings_of

    mistakes: list[Problem] = []
    for path in paths:
        try:
            caught = warnings_of(path)
        except InputError as error:
            mistakes += error.problems
            continue
        print(f"{path}: ok", flush=True)
        for message in caught:
            print(f"warning: {path}: {message}", file=sys.stderr)
    if mistakes:
        # a load file may be stated by itself and by a recipe
        raise InputError(*{str(problem): problem for problem in mistakes}.values())
    return 0


def write_report(folders: Sequence[Path], out: Path) -> int:
    """Write the results in the `folders` as one page into the file `out`; raises `InputError` with every mistake."""
    from dielast.io.files import check_folder, check_targets, write_files
    from dielast.report.chain import outdated, read_results
    from dielast.report.page import html_page

    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError("a report is HTML: a name such as report.html is needed (see --out)", file=out)
    check_folder(out.parent, "for the report is needed (see --out)")
    results = read_results(folders, {kind: command.files for kind, command in COMMANDS.items()})
    check_targets([out], [path for result in results for path in result.paths])
    page = html_page(results, {kind: COMMANDS[kind].help for kind in {result.kind for result in results}})
    write_files(out.parent, {out.name: page})
    print(f"report: {', '.join(result.folder for result in results)} in {out}", flush=True)
    for index, text in outdated(results):
        print(f"warning: {results[index].folder}: {text}", file=sys.stderr)
    return 0


def print_schema() -> int:
    """Print the JSON Schema of recipes."""
    from dielast.recipe.schema import recipe_schema

    print(json.dumps(recipe_schema(COMMANDS), indent=2))
    return 0
