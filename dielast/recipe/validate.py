"""From TOML text to a checked model, with every mistake in one line: file, key, what is wrong, what is needed."""

from __future__ import annotations

import difflib
import os
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dielast.errors import DielastError, InputError, Mistakes, Problem, as_toml, located, shown, shown_path
from dielast.io.files import read_file
from dielast.recipe.fields import Section
from dielast.recipe.models import KINDS, or_kind, recipe_model
from dielast.recipe.paths import read_path, read_setting, set_key
from dielast.recipe.toml import load, parse_toml
from dielast.units import decimal_comma

Model = TypeVar("Model", bound=BaseModel)
Place = tuple[int | str, ...]
"""The keys and indices that lead to a value."""
Mistake = tuple[Place, Problem]
"""Where in a recipe something is wrong, and what."""
PATHS = ("material", "mastercurve", "file", "files", "load", "table")  # keys that name files or folders
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


def read_values(
    path: Path, kind: str | None = None, overrides: Sequence[str] = (), content: bytes | None = None
) -> tuple[dict[str, Any], Mistakes]:
    """The unchecked values of the recipe in the file `path`, whose `content` may have been read, `overrides` applied.

    With them, what is wrong with the overrides. Raises `InputError` if it is no TOML, or its kind is unknown or not the `kind`
    given.
    """
    values = parse_toml(read_file(path, str(path)) if content is None else content, str(path))
    wrong = Mistakes()
    for override in overrides:
        wrong.tried(partial(_override, values, override))
    stated = values.get("kind")
    if stated not in KINDS:
        needed = f"is needed: one of {', '.join(KINDS)}"
        unknown = f"{shown(stated)}: {or_kind(str(stated))}" if "kind" in values else needed
        raise InputError(*wrong, Problem(unknown, file=path, key="kind"))
    if kind is not None and stated != kind:
        other = f'the recipe is one of "{stated}": run it with "dielast {stated}"'
        raise InputError(*wrong, Problem(other, file=path, key="kind"))
    return values, wrong


def _override(values: dict[str, Any], override: str) -> None:
    with located(key=f"--set {override}"):
        set_key(values, *read_override(override))


def check(model: type[Model], values: Mapping[str, Any], source: str, folder: Path) -> Model:
    """`values` as a `model`; paths are relative to `folder`. Raises `InputError` with a line for every mistake."""
    found = examine(model, values, source, folder)
    if isinstance(found, list):
        raise InputError(*in_order(found, values))
    return found


def examine(model: type[Model], values: Mapping[str, Any], source: str, folder: Path) -> Model | list[Mistake]:
    """`values` as a `model`, as `check` has it, or every mistake in them."""
    try:
        sweep = values.get("sweep")
        swept = {shown_path(read_path(key) or (key,)): own for key, own in sweep.items()} if isinstance(sweep, dict) else {}
        context = {"folder": folder, "columns": getattr(model, "COLUMNS", ()), "swept": swept}
        return model.model_validate(values, context=context)
    except ValidationError as error:
        wrong = [_mistakes(model, found) for found in error.errors(include_url=False)]
        return [(place, problem.at(file=source)) for mistakes in wrong for place, problem in mistakes]


def in_order(mistakes: Iterable[Mistake], values: Mapping[str, Any]) -> list[Problem]:
    """The problems of `mistakes`, each once, in the order of the recipe's `values`; those of a whole table are last in
    it.
    """

    def position(mistake: Mistake) -> list[float]:
        found: list[float] = []
        inner: Any = values
        for key in mistake[0]:
            there: list[Any] = list(inner if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ())
            found.append(there.index(key) if key in there else len(there))
            inner = inner[key] if key in there else None
        return [*found, float("inf")]

    return list(dict.fromkeys(problem for _, problem in sorted(mistakes, key=position)))


def _mistakes(model: type[BaseModel], found: ErrorDetails) -> list[Mistake]:
    """What pydantic found, in words of this project and with its place; a validator names keys relative to the table it checks."""
    context = found.get("ctx", {})
    if found["type"] == "value_error" and isinstance(error := context["error"], DielastError):
        places = [(*found["loc"], *_keys(problem.key or "")) for problem in error.problems]
        return [(place, replace(problem, key=_path(place))) for place, problem in zip(places, error.problems, strict=True)]
    return [(found["loc"], Problem(_text(model, found, context), key=_path(found["loc"])))]


def _keys(path: str) -> Place:
    """The keys and indices of a path such as `step[0].rate`, of a list's validator also `[0]`."""
    return tuple(int(key) if key.isdecimal() else key for key in path.replace("[", ".").replace("]", "").split(".") if key)


def _text(model: type[BaseModel], found: ErrorDetails, context: Mapping[str, Any]) -> str:
    keys, kind, value = found["loc"], found["type"], found["input"]
    if kind == "extra_forbidden":
        return _unknown(model, keys)
    if kind == "value_error":
        return str(context["error"])
    if kind == "list_type" and isinstance(value, dict) and _models(_annotation(model, keys)):
        return _no_list(str(keys[-1]), value)
    needed = _PLAIN.get(kind, found["msg"]).format(**context, **_counted(context))
    comma = decimal_comma(value) if isinstance(value, str) and kind in ("float_type", "int_type") else ""
    return ("" if kind == "missing" else f"{shown(value)}: ") + needed + (f"; {comma}" if comma else "")


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


def _unknown(model: type[BaseModel], keys: Place) -> str:
    """What is said of a key that the section of `model` at this place does not have."""
    owner, key = _owner(model, keys), str(keys[-1])
    if issubclass(owner, Section) and key in owner.ELSEWHERE:
        return owner.ELSEWHERE[key]
    of_recipes = not {"kind", "step"}.isdisjoint(model.model_fields)
    if of_recipes and (others := [kind for kind in KINDS if _has(recipe_model(kind), keys)]):
        return f"unknown key; {key} belongs to {', '.join(others)}"
    near = difflib.get_close_matches(key, owner.model_fields, n=1, cutoff=0.5)
    return "unknown key; " + (f'did you mean "{near[0]}"?' if near else "known here are " + ", ".join(owner.model_fields))


def _has(model: type[BaseModel], keys: Place) -> bool:
    """Whether recipes of `model` have such a key."""
    for key in keys[:-1]:
        if isinstance(key, str):
            inner = _models(model.model_fields[key].annotation) if key in model.model_fields else []
            if not inner:
                return False
            model = inner[0]
    return keys[-1] in model.model_fields


def _path(keys: Place) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else f".{shown_path([key])}" for key in keys).lstrip(".")


def read_override(override: str) -> tuple[tuple[str, ...], Any]:
    """The path of keys and the value of `PATH=VALUE`; VALUE is TOML, or else text."""
    try:
        # bytes that the locale could not read are UTF-8 all the same
        override = os.fsencode(override).decode()
    except UnicodeDecodeError:
        raise InputError("not UTF-8 text", key=f"--set {override!a}") from None
    setting = read_setting(override)
    if setting is None:
        raise InputError("PATH=VALUE is needed, such as fit.branches=20", key=f"--set {override}")
    keys, text = setting
    try:
        return keys, load(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return keys, text


def settings(overrides: Sequence[str]) -> list[str]:
    """The `overrides` in one spelling, without the folders of absolute paths, which are this machine's own."""
    stated = [read_override(override) for override in overrides]
    return [f"{shown_path(keys)} = {as_toml(_anywhere(keys[-1], value))}" for keys, value in stated]


def _anywhere(key: str, value: Any) -> Any:
    if isinstance(value, str):
        is_file = key.split(".")[-1] in PATHS  # of a sweep's path of keys, the last
        return Path(value).name if is_file and Path(value).is_absolute() else value
    if isinstance(value, list):
        return [_anywhere(key, entry) for entry in value]
    return {inner: _anywhere(inner, entry) for inner, entry in value.items()} if isinstance(value, dict) else value
