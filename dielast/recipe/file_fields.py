"""The field types that name what lies outside of a recipe: files and folders, and within a file its columns, sheets and steps."""

import os
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import PlainValidator, ValidationInfo, WithJsonSchema
from pydantic.fields import FieldInfo

from dielast.base.errors import InputError, shown
from dielast.io.files import EXAMPLE, EXAMPLES, exists, of_backslashes, resolve


def is_path(field: FieldInfo) -> bool:
    """Whether the values of a field are names of files or folders."""

    def within(annotation: Any) -> bool:
        return annotation == NAMES_FILES or any(map(within, get_args(annotation)))

    return NAMES_FILES in field.metadata or within(field.annotation)


def _existing(name: Any, info: ValidationInfo, kind: str, test: Callable[[Path], bool]) -> str:
    if not isinstance(name, str) or not name:
        raise InputError(f"the path of a {kind} is needed")
    folder = (info.context or {}).get("folder")
    if folder is not None:
        path = resolve(folder, name)
        maker_of = (info.context or {}).get("maker_of")
        maker = maker_of and maker_of(path.name, None if kind == "file" else info.field_name)
        if not exists(path):
            if maker:
                raise InputError(f"{shown(name)} does not exist; run the recipe that makes it (dielast {maker})")
            raise InputError(f"{shown(name)}: no such {kind}{of_backslashes(name)}")
        if not test(path):
            raise InputError(f"{shown(name)}: a {kind} is needed{f', which dielast {maker} writes' if maker else ''}")
    return name


existing_file = partial(_existing, kind="file", test=Path.is_file)
_folder = partial(_existing, kind="folder", test=Path.is_dir)


def _files(names: Any, info: ValidationInfo, endings: Sequence[str] = ()) -> tuple[str, ...]:
    """The files of a list in its order, or those that a glob pattern matches, also among the examples, sorted by name.

    With `endings`, a folder stands for its files with these endings, and numbers in names are sorted by their value.
    """
    if isinstance(names, list) and names:
        return tuple(existing_file(name, info) for name in names)
    if not isinstance(names, str) or not (names if endings else Path(names).name):  # "." and "/" have no file name
        raise InputError("a list of files or a glob pattern is needed")
    folder = (info.context or {}).get("folder")
    if folder is None:
        return (names,)
    home, mark = (EXAMPLES, EXAMPLE) if names.startswith(EXAMPLE) else (folder, "")
    pattern = names.removeprefix(mark)
    whole = bool(endings) and os.path.isdir(home / pattern)
    base, pattern = Path(pattern).anchor, f"{pattern}/*" if whole else pattern
    try:
        matches = sorted(str(path) for path in (Path(base) if base else home).glob(pattern.removeprefix(base)) if path.is_file())
    except (
        OSError,  # the name is too long
        ValueError,  # ** within a name
        NotImplementedError,  # more than one root: ///x
        RecursionError,  # hundreds of nested folders
    ) as error:
        raise InputError(f"{shown(names)}: not a glob pattern: {error}") from None
    if whole:
        matches = [path for path in matches if path.lower().endswith(tuple(endings))]
    if not matches:
        wrong = f"no file in this folder ends with {', '.join(endings)}" if whole else f"no file matches{of_backslashes(names)}"
        raise InputError(f"{shown(names)}: {wrong}")
    # with slashes, so that results are the same on every system
    found = [mark + Path(path if base else os.path.relpath(path, home)).as_posix() for path in matches]
    if endings:
        found.sort(key=lambda name: [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)])
    return tuple(found)


def _name_or_number(noun: str, description: str) -> tuple[PlainValidator, WithJsonSchema]:
    """How a name, or a number from 1, is checked and described."""

    def read(name: Any) -> str | int:
        if isinstance(name, bool) or (not (isinstance(name, str) and name) and not (isinstance(name, int) and name >= 1)):
            raise InputError(f"{shown(name)}: a {noun}'s name, or its number from 1, is needed")
        return name

    schema = {"anyOf": [{"type": "string"}, {"type": "integer", "minimum": 1}], "description": description}
    return PlainValidator(read), WithJsonSchema(schema)


NAMES_FILES = "names files or folders"
PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".gif")
PATH = {
    "type": "string",
    "format": "path",
    "description": "Path relative to the recipe, or example:NAME for a file that ships with dielast.",
}
InputFile = Annotated[str, PlainValidator(existing_file), WithJsonSchema(PATH), NAMES_FILES]
InputFolder = Annotated[str, PlainValidator(_folder), WithJsonSchema(PATH), NAMES_FILES]
PATHS = {"anyOf": [{"type": "array", "items": PATH}, {"type": "string", "format": "glob pattern"}]}
InputFiles = Annotated[tuple[str, ...], PlainValidator(_files), WithJsonSchema(PATHS), NAMES_FILES]
PhotographFiles = Annotated[tuple[str, ...], PlainValidator(partial(_files, endings=PICTURES)), WithJsonSchema(PATHS), NAMES_FILES]
ColumnName = Annotated[str | int, *_name_or_number("column", "A column's header, its name without the unit, or its number from 1.")]
SheetName = Annotated[str | int, *_name_or_number("sheet", "A sheet's name, or its number from 1.")]
Step = Annotated[
    str | int,
    *_name_or_number("step", "A step of an instrument's export: its name, in which * and ? stand for any text, or its number."),
]
