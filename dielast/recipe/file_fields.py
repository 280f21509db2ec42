"""The field types that name what lies outside of a recipe: files and folders, and within a file its columns, sheets and steps."""

import os
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import SimpleNamespace
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
    """The files of a list in its order, or those that a glob pattern matches, sorted by name.

    With `endings`, a folder stands for its files with these endings, and numbers in names are sorted by their value.
    """
    if isinstance(names, list) and names:
        return tuple(existing_file(name, info) for name in names)
    if endings and isinstance(names, str) and names:
        return _pictures(names, info, endings)
    if not isinstance(names, str) or not Path(names).name:  # "." and "/" have no file name
        raise InputError("a list of files or a glob pattern is needed")
    folder = (info.context or {}).get("folder")
    if folder is None:
        return (names,)
    base = Path(names).anchor
    try:
        matches = sorted(str(path) for path in (Path(base) if base else folder).glob(names.removeprefix(base)) if path.is_file())
    except (
        OSError,  # the name is too long
        ValueError,  # ** within a name
        NotImplementedError,  # more than one root: ///x
        RecursionError,  # hundreds of nested folders
    ) as error:
        raise InputError(f"{shown(names)}: not a glob pattern: {error}") from None
    if not matches:
        raise InputError(f"{shown(names)}: no file matches{of_backslashes(names)}")
    # with slashes, so that results are the same on every system
    return tuple(Path(path if base else os.path.relpath(path, folder)).as_posix() for path in matches)


def _pictures(names: str, info: ValidationInfo, endings: Sequence[str]) -> tuple[str, ...]:
    """The files of a folder or of a glob pattern, also among the examples."""
    folder = (info.context or {}).get("folder")
    if folder is None:
        return (names,)
    mark, names = (EXAMPLE, names.removeprefix(EXAMPLE)) if names.startswith(EXAMPLE) else ("", names)
    base = EXAMPLES if mark else folder
    whole = os.path.isdir(base / names)
    found = _files(f"{names}/*" if whole else names, SimpleNamespace(context={"folder": base}))
    chosen = [name for name in found if not whole or name.lower().endswith(tuple(endings))]
    if not chosen:
        raise InputError(f"{shown(names)}: no file in this folder ends with {', '.join(endings)}")
    chosen.sort(key=lambda name: [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)])
    return tuple(mark + name for name in chosen)


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
InputFiles = Annotated[
    tuple[str, ...],
    PlainValidator(_files),
    WithJsonSchema({"anyOf": [{"type": "array", "items": PATH}, {"type": "string", "format": "glob pattern"}]}),
    NAMES_FILES,
]
PhotographFiles = Annotated[
    tuple[str, ...],
    PlainValidator(partial(_files, endings=PICTURES)),
    WithJsonSchema({"anyOf": [{"type": "array", "items": PATH}, {"type": "string", "format": "glob pattern"}]}),
    NAMES_FILES,
]
ColumnName = Annotated[str | int, *_name_or_number("column", "A column's header, its name without the unit, or its number from 1.")]
SheetName = Annotated[str | int, *_name_or_number("sheet", "A sheet's name, or its number from 1.")]
Step = Annotated[
    str | int,
    *_name_or_number("step", "A step of an instrument's export: its name, in which * and ? stand for any text, or its number."),
]
