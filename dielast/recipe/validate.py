"""From TOML text to a checked model, with every mistake in one line: file, key, what is wrong, what is needed."""

from __future__ import annotations

import difflib
import os
import re
import tomllib
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from sys import float_info
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dielast.errors import InputError, as_toml, shown, shown_path
from dielast.files import read_file
from dielast.recipe.fields import Section
from dielast.recipe.models import KINDS
from dielast.recipe.paths import DEEPEST, read_setting, set_key

Model = TypeVar("Model", bound=BaseModel)
Place = tuple[int | str, ...]
"""The keys and indices that lead to a value."""
Mistake = tuple[Place, str]
"""Where in a recipe something is wrong, and the line that says so."""
_PLAIN = {
    "missing": "is needed",
    "float_type": "a bare number is needed",
    "int_type": "a whole number is needed",
    "int_from_float": "a whole number is needed",
    "string_type": "text is needed",
    "bool_type": "true or false is needed",
    "list_type": "a list is needed",
    "dict_type": "a table of keys is needed",
    "model_type": "a table of keys is needed",
    "finite_number": "a finite number is needed",
    "greater_than": "a number above {gt:g} is needed",
    "greater_than_equal": "at least {ge:g} is needed",
    "less_than": "a number below {lt:g} is needed",
    "less_than_equal": "at most {le:g} is needed",
    "string_too_short": "at least {characters} needed",
    "string_too_long": "at most {characters} allowed",
    "too_short": "at least {entries} needed",
    "too_long": "at most {entries} allowed",
    "literal_error": "one of {expected} is needed",
}
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*){{{DEEPEST}}}")
_DIGITS = re.compile(r"[0-9A-Fa-f_]{250,}")
LARGEST_TOML = 8 << 20  # bytes: a material of 100,000 branches needs half of it


def read_values(path: Path, kind: str | None = None, overrides: Sequence[str] = (), content: bytes | None = None) -> dict[str, Any]:
    """The unchecked values of the recipe in the file `path`, whose `content` may have been read, `overrides` applied.

    Raises `InputError` if it is no TOML, its kind is unknown or not the `kind` given, or an override leads nowhere.
    """
    values = parse_toml(read_file(path, str(path)) if content is None else content, str(path))
    wrong: list[str] = []
    for override in overrides:
        try:
            set_key(values, *read_override(override), f"--set {override}")
        except InputError as error:
            wrong += error.messages
    if wrong:
        raise InputError(*wrong)
    stated = values.get("kind")
    if stated not in KINDS:
        known = ", ".join(KINDS)
        near = difflib.get_close_matches(str(stated), KINDS, n=1)
        hint = f'did you mean "{near[0]}"?' if near else f"one of {known} is needed"
        raise InputError(
            f"{path}: kind: {shown(stated)}: {hint}" if "kind" in values else f"{path}: kind: is needed: one of {known}"
        )
    if kind is not None and stated != kind:
        raise InputError(f'{path}: kind: this is a "{stated}" recipe: run it with "dielast {stated}"')
    return values


def parse_toml(content: bytes, source: str) -> dict[str, Any]:
    """The TOML text `content`; raises `InputError` naming `source` and the line."""
    if len(content) > LARGEST_TOML:
        raise InputError(f"{source}: larger than {LARGEST_TOML >> 20} MiB: recipes and material files are not; tables go into CSV")
    try:
        text = content.decode("utf-8-sig")
        if _DEEP_KEY.search(text):  # which takes the parser memory without end
            raise RecursionError
        values = tomllib.loads(text)
        if _too_large(values):
            raise OverflowError
        return values
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise InputError(f"{source}: line {line}: not UTF-8 text") from None
    except tomllib.TOMLDecodeError as error:
        where = re.search(r"\(at (?:line (\d+), column \d+|end of document)\)", str(error))
        line = int(where[1]) if where and where[1] else content.count(b"\n") + 1
        what = str(error).split(" (at ")[0]
        raise InputError(f"{source}: line {line}: not TOML: {what[0].lower()}{what[1:]}") from None
    except RecursionError:
        raise InputError(f"{source}: not TOML: nested too deeply") from None
    except (ValueError, OverflowError):  # ValueError is Python's own limit
        digits = _DIGITS.search(text)
        line = text.count("\n", 0, digits.start() if digits else None) + 1
        raise InputError(f"{source}: line {line}: not TOML: a number of too many digits") from None


def _too_large(value: Any) -> bool:
    """Whether there is an integer in `value` that no floating-point number comes near."""
    if isinstance(value, int):
        return abs(value) > float_info.max
    return any(map(_too_large, value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()))


def check(model: type[Model], values: Mapping[str, Any], source: str, folder: Path) -> Model:
    """`values` as a `model`; paths are relative to `folder`. Raises `InputError` with a line for every mistake."""
    found = examine(model, values, source, folder)
    if isinstance(found, list):
        raise InputError(*in_order(found, values))
    return found


def examine(model: type[Model], values: Mapping[str, Any], source: str, folder: Path) -> Model | list[Mistake]:
    """`values` as a `model`, as `check` has it, or every mistake in them."""
    try:
        return model.model_validate(values, context={"folder": folder, "columns": getattr(model, "COLUMNS", ())})
    except ValidationError as error:
        return [(problem["loc"], f"{source}: {_line(model, problem)}") for problem in error.errors(include_url=False)]


def in_order(mistakes: Iterable[Mistake], values: Mapping[str, Any]) -> list[str]:
    """The lines of `mistakes`, each once, in the order of the recipe's `values`; what is wrong with a whole table is last in it."""

    def position(mistake: Mistake) -> list[float]:
        found: list[float] = []
        inner: Any = values
        for key in mistake[0]:
            there: list[Any] = list(inner if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ())
            found.append(there.index(key) if key in there else len(there))
            inner = inner[key] if key in there else None
        return [*found, float("inf")]

    return list(dict.fromkeys(line for _, line in sorted(mistakes, key=position)))


def _line(model: type[BaseModel], problem: ErrorDetails) -> str:
    keys, kind, value = problem["loc"], problem["type"], problem["input"]
    where = _path(keys)
    prefix = f"{where}: " if where else ""
    context = problem.get("ctx", {})
    if kind == "extra_forbidden":
        return prefix + _unknown(_owner(model, keys), str(keys[-1]))
    if kind == "value_error":
        return prefix + str(context["error"])
    if kind == "list_type" and isinstance(value, dict) and _models(_annotation(model, keys)):
        return prefix + _no_list(str(keys[-1]), value)
    needed = _PLAIN.get(kind, problem["msg"]).format(**context, **_counted(context))
    return prefix + ("" if kind == "missing" else f"{shown(value)}: ") + needed


def _no_list(key: str, value: Mapping[str, Any]) -> str:
    """What is wrong with a table where a list of tables is needed."""
    index = next((inner for inner in value if inner.isdecimal()), None)
    if index is None:
        return f"{shown(value)}: a list is needed: write [[{key}]], in double brackets"
    return (
        f"there is no entry {index} yet: write [[{key}]] into the recipe, or state the whole list, as in --set '{key}=[{{ ... }}]'"
    )


def _counted(context: Mapping[str, Any]) -> dict[str, str]:
    """How many characters or entries there may be, with the verb that belongs to it."""
    number = context.get("min_length", context.get("max_length"))
    one = number == 1
    return {
        "characters": f"{number} character is" if one else f"{number} characters are",
        "entries": f"{number} entry is" if one else f"{number} entries are",
    }


def _annotation(model: type[BaseModel], keys: Place) -> Any:
    """What the field that `keys` lead to may hold."""
    field = _owner(model, keys).model_fields.get(str(keys[-1])) if keys else None
    return None if field is None else field.annotation


def _owner(model: type[BaseModel], keys: Place) -> type[BaseModel]:
    for key in keys[:-1]:
        if isinstance(key, str) and key in model.model_fields:
            inner = _models(model.model_fields[key].annotation)
            model = inner[0] if inner else model
    return model


def _models(annotation: Any) -> list[type[BaseModel]]:
    """The models within an annotation, through Optional, unions, lists and Annotated."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in typing.get_args(annotation) for model in _models(inner)]


def _unknown(model: type[BaseModel], key: str) -> str:
    if issubclass(model, Section) and key in model.ELSEWHERE:
        return model.ELSEWHERE[key]
    near = difflib.get_close_matches(key, model.model_fields, n=1, cutoff=0.5)
    return "unknown key; " + (f'did you mean "{near[0]}"?' if near else "known here are " + ", ".join(model.model_fields))


def _path(keys: Place) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else f".{shown_path([key])}" for key in keys).lstrip(".")


def read_override(override: str) -> tuple[tuple[str, ...], Any]:
    """The path of keys and the value of `PATH=VALUE`; VALUE is TOML, or else text."""
    try:
        # bytes that the locale could not read are UTF-8 all the same
        override = os.fsencode(override).decode()
    except UnicodeDecodeError:
        raise InputError(f"--set {override!a}: not UTF-8 text") from None
    setting = read_setting(override)
    if setting is None:
        raise InputError(f"--set {override}: PATH=VALUE is needed, such as fit.branches=20")
    keys, text = setting
    try:
        if _DEEP_KEY.search(text):
            raise RecursionError
        return keys, tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return keys, text


def settings(overrides: Sequence[str]) -> list[str]:
    """The `overrides` in one spelling, without the folders of absolute paths, which are this machine's own."""
    stated = [read_override(override) for override in overrides]
    return [f"{shown_path(keys)} = {as_toml(_anywhere(value))}" for keys, value in stated]


def _anywhere(value: Any) -> Any:
    if isinstance(value, str):
        return Path(value).name if Path(value).is_absolute() else value
    if isinstance(value, list):
        return [_anywhere(entry) for entry in value]
    return {key: _anywhere(entry) for key, entry in value.items()} if isinstance(value, dict) else value
