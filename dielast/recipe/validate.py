"""From TOML text to a checked model, with every mistake in one line: file, key, what is wrong, what is needed."""

from __future__ import annotations

import difflib
import os
import re
import tomllib
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from sys import float_info
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from dielast.errors import InputError, shown
from dielast.files import read_file
from dielast.recipe.fields import Section
from dielast.recipe.models import KINDS

Model = TypeVar("Model", bound=BaseModel)
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
DEEPEST = 64  # parts of a dotted key
_DEEP_KEY = re.compile(rf"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*){{{DEEPEST}}}")
_DIGITS = re.compile(r"[0-9A-Fa-f_]{250,}")
LARGEST_TOML = 8 << 20  # bytes: a material of 100,000 branches needs half of it


def read_values(path: Path, kind: str | None = None, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The unchecked values of the recipe in the file `path`, `overrides` applied.

    Raises `InputError` if it is no TOML, its kind is unknown or not the `kind` given, or an override leads nowhere.
    """
    values = parse_toml(read_file(path, str(path)), str(path))
    for override in overrides:
        _apply(values, override)
    stated = values.get("kind")
    if stated not in KINDS:
        known = ", ".join(KINDS)
        near = difflib.get_close_matches(str(stated), KINDS, n=1)
        hint = f'did you mean "{near[0]}"?' if near else f"one of {known} is needed"
        raise InputError(f'{path}: kind: "{stated}": {hint}' if stated is not None else f"{path}: kind: is needed: one of {known}")
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
    try:
        return model.model_validate(values, context={"folder": folder})
    except ValidationError as error:
        lines = dict.fromkeys(f"{source}: {line}" for line in _lines(model, error))
        raise InputError(*lines) from None


def _lines(model: type[BaseModel], error: ValidationError) -> list[str]:
    lines = []
    for problem in error.errors(include_url=False):
        keys = problem["loc"]
        where = _path(keys)
        prefix = f"{where}: " if where else ""
        context = problem.get("ctx", {})
        if problem["type"] == "extra_forbidden":
            lines.append(prefix + _unknown(_owner(model, keys), str(keys[-1])))
        elif problem["type"] == "value_error":
            lines.append(prefix + str(context["error"]))
        else:
            needed = _PLAIN.get(problem["type"], problem["msg"]).format(**context, **_counted(context))
            found = "" if problem["type"] == "missing" else f"{shown(problem['input'])}: "
            lines.append(prefix + found + needed)
    return lines


def _counted(context: Mapping[str, Any]) -> dict[str, str]:
    """How many characters or entries there may be, with the verb that belongs to it."""
    number = context.get("min_length", context.get("max_length"))
    one = number == 1
    return {
        "characters": f"{number} character is" if one else f"{number} characters are",
        "entries": f"{number} entry is" if one else f"{number} entries are",
    }


def _owner(model: type[BaseModel], keys: Sequence[int | str]) -> type[BaseModel]:
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


def _path(keys: Sequence[int | str]) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")


def _apply(values: dict[str, Any], override: str) -> None:
    """Set one key of the recipe from `PATH=VALUE`; VALUE is TOML, or else text."""
    try:
        # bytes that the locale could not read are UTF-8 all the same
        override = os.fsencode(override).decode()
    except UnicodeDecodeError:
        raise InputError(f"--set {override!a}: not UTF-8 text") from None
    path, sign, text = override.partition("=")
    if not sign or not all(path.strip().split(".")):
        raise InputError(f"--set {override}: PATH=VALUE is needed, such as fit.branches=20")
    try:
        if _DEEP_KEY.search(text):
            raise RecursionError
        value = tomllib.loads(f"value = {text.strip()}")["value"]
    except (ValueError, RecursionError):
        value = text.strip()
    set_key(values, path.strip(), value, f"--set {override}")


def set_key(values: dict[str, Any], path: str, value: Any, where: str) -> None:
    """Set the key at a `path` such as `step.0.rate`; raises `InputError` beginning with `where` if the path leads nowhere."""
    keys = path.split(".")
    if len(keys) > DEEPEST:
        raise InputError(f"{where}: the path leads nowhere: it has {len(keys)} parts")
    target: Any = values
    for depth, key in enumerate(keys):
        last = depth == len(keys) - 1
        if isinstance(target, list):
            if not key.isdecimal() or len(key) > 9 or int(key) >= len(target):
                there = f"has entries 0 to {len(target) - 1}" if target else "is empty"
                raise InputError(f"{where}: {'.'.join(keys[:depth])} {there}")
            if last:
                target[int(key)] = value
            target = target[int(key)]
        elif isinstance(target, dict):
            if last:
                target[key] = value
            target = target.setdefault(key, {})
        else:
            raise InputError(f"{where}: {'.'.join(keys[:depth])} is not a table")
