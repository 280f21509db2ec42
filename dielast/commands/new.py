"""Recipes for measured files, and what these files hold."""

import glob
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from dielast.base.errors import InputError, Problem, as_toml, listed, nearest, shown
from dielast.base.units import TEMPERATURE
from dielast.commands.plan import warnings_of
from dielast.commands.registry import COMMANDS
from dielast.io.files import EXAMPLE, EXAMPLES, Inputs, exists, of_backslashes, resolve
from dielast.readings.named import levels_of
from dielast.readings.seen import DIMENSIONS, NAMES, Given, SeenColumn, SeenFile, SeenTable
from dielast.readings.stated import listed_sheets
from dielast.recipe.lines import FILL, RecipeLines

_RECIPE = Path("recipe.toml")
_KEYS = 8  # keys to fill in that are listed
_LEVELS = 30  # temperatures that are listed


def given(names: Sequence[str]) -> Given:
    """The files of these names and glob patterns, relative to the current folder; raises `InputError` if there are none."""
    folder, found = Path(), list[str]()
    for name in names:
        if not name:
            raise InputError("--data is empty, the name of a file is needed")
        if "example:" in name or exists(folder / name):
            mark, rest = (EXAMPLE, name.removeprefix(EXAMPLE)) if name.startswith(EXAMPLE) else ("", name)
            matches = sorted(glob.glob(rest, root_dir=EXAMPLES)) if mark and glob.has_magic(rest) else [rest]
            found += [mark + match for match in matches]
            if mark:
                resolve(folder, found[-1] if matches else name)
            continue
        matches = sorted(path for path in glob.glob(name, recursive=True) if os.path.isfile(path)) if glob.has_magic(name) else []
        if not matches:
            unlike = f", and no kind of recipe: {nearest(name, COMMANDS)}" if name.isidentifier() else ""
            raise InputError(f"no such file{unlike}{of_backslashes(name)}", file=name)
        found += matches
    pattern = names[0] if len(names) == 1 and found != [names[0]] else None
    return Given(list(dict.fromkeys(found)), Inputs(folder), pattern)


def started(kind: str, files: Given) -> tuple[str, list[str]]:
    """The recipe of a `kind` for the `files`, and what is doubtful about them; raises `InputError` for files of another kind."""
    try:
        recipe = COMMANDS[kind].from_data(files)
    except InputError as error:
        others = [
            name for name, recipe in _takers(files) if name != kind and not recipe.unsure and f"dielast {name}" not in str(error)
        ]
        error = error.adding(f"; {listed(others)} would take {'it' if len(files.names) == 1 else 'them'}" if others else "")
        raise InputError(*error.problems, *map(Problem, _contradictions(files))) from None
    if recipe.missing:
        recipe.lines.insert(1, f"# {_keys(recipe)} to fill in, as the files do not state them: {_listed_keys(recipe)}")
    return str(recipe), [*recipe.doubts, *_mistakes(recipe)]


def described(files: Given) -> tuple[str, list[str]]:
    """What the `files` hold and which commands take them, and what is doubtful about them."""
    takers = [(kind, recipe) for kind, recipe in _takers(files) if not recipe.unsure]
    lines = [line for name in files.names for line in _of_file(name, files, bool(takers))]
    doubts = _contradictions(files)
    them, are = ("them", "they are") if len(files.names) > 1 else ("it", "it is")
    for kind, recipe in takers:
        what = f"as {are}"
        if recipe.missing:
            what = f"with {_keys(recipe)} to fill in: {_listed_keys(recipe)}"
        lines.append(f"dielast new {kind} --data takes {them} {what}")
        doubts += recipe.doubts
    if not takers:
        these, advice = (
            ("these together", "") if len(files.names) > 1 else ("this", ": rename its columns, or name them in a recipe (columns)")
        )
        lines.append(f"no command takes {these}{advice}")
    complete = next((recipe for _, recipe in takers if not recipe.missing), None)
    return "\n".join(lines) + "\n", list(dict.fromkeys([*doubts, *(_mistakes(complete) if complete else [])]))


def _keys(recipe: RecipeLines) -> str:
    return f"{len(recipe.missing)} key{'s' if len(recipe.missing) > 1 else ''}"


def _listed_keys(recipe: RecipeLines) -> str:
    return ", ".join(recipe.missing[:_KEYS]) + (", ..." if len(recipe.missing) > _KEYS else "")


def _takers(files: Given) -> Iterator[tuple[str, RecipeLines]]:
    """The commands that take the files, with their recipes."""
    for kind, command in COMMANDS.items():
        if not command.takes_data:
            continue
        try:
            yield kind, command.from_data(files)
        except InputError:
            continue


def _contradictions(files: Given) -> list[str]:
    try:
        return [text for seen in files.seen for text in seen.doubts]
    except InputError:
        return []


def _mistakes(recipe: RecipeLines) -> list[str]:
    """What `dielast validate` says of a recipe with nothing to fill in."""
    if recipe.missing:
        return []
    try:
        return warnings_of(_RECIPE, str(recipe).encode())
    except InputError as error:
        return [message.removeprefix(f"{_RECIPE}: ") for message in error.messages]


def _of_file(name: str, files: Given, taken: bool) -> Iterator[str]:
    """What a file holds; a file without a table is an error, unless a command takes it."""
    if os.path.isdir(resolve(files.inputs.folder, name)):
        yield f"{name}: folder"
        return
    try:
        seen = next(file for file in files.seen if file.name == name)
    except InputError as error:
        try:
            from dielast.readings.photographs.decode import read_picture

            height, width = read_picture(files.inputs.read(name), name).shape[:2]
        except InputError:
            if not taken:
                raise error from None
            yield f"{name}: no table of measurements"
            return
        yield f"{name}: photograph, {width} x {height} pixels"
        return
    yield from _of_tables(seen)


def _of_tables(seen: SeenFile) -> Iterator[str]:
    rows = sum(table.table.lines.size for table in seen.tables)
    steps = f", {len(seen.tables)} step{'s' if len(seen.tables) > 1 else ''}" if seen.is_export else ""
    place = f"sheet {shown(seen.sheet)} of a workbook" if seen.sheet is not None else "a workbook"
    yield f"{seen.name}: {seen.format}{f' in {place}' if seen.is_workbook else ''}{steps}, {rows} rows"
    if seen.other_sheets:
        yield f"  {listed_sheets(seen.other_sheets)}"
    for table in seen.tables[:_LEVELS]:
        if seen.is_export:
            yield f"  step {shown(table.step)}, {table.table.lines.size} rows" + (
                f", {table.deformation}" if table.deformation else ""
            )
        if table.levels:
            yield f"  columns for each of {len(table.levels)} temperatures in the headers: {_listed(list(table.levels))}"
        columns = table.columns([role for role in NAMES if role != "label"])
        for column in sorted(columns.values(), key=lambda column: column.place):
            yield f"  {column.role.replace('_', ' '):18} {_range(table, column)}   {as_toml(column.name)}" + (
                "" if column.reason == "its name" else f", by {column.reason}"
            )
        if left := table.unnamed(columns.values()):
            yield f"  not recognised: {', '.join(map(as_toml, left))}"


def _range(table: SeenTable, column: SeenColumn) -> str:
    """The range of a column in its unit, or that there is none."""
    dimension = DIMENSIONS.get(column.role)
    written = table.raw(column.place)
    written = written[np.isfinite(written)]
    if dimension is None or not written.size:
        texts = dict.fromkeys(table.table.cells[column.place])
        return f"{len(texts)} different"
    numbers = table.numbers(column)
    if dimension is TEMPERATURE and numbers is not None:
        levels = levels_of(numbers)
        if len(levels) <= _LEVELS:
            return _listed(levels)
    unit = f" ({FILL}: no unit)" if column.lacks_unit else "" if column.unit in (None, "1", "-") else f" {column.unit}"
    span = f"{written.min():.6g}" if np.ptp(written) == 0 else f"{written.min():.6g} to {written.max():.6g}"
    return span + unit


def _listed(levels: Sequence[float]) -> str:
    return f"{', '.join(f'{level:.6g}' for level in levels)} degC"
