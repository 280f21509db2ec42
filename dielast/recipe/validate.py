"""From the values of a TOML file to a checked model, with every mistake in one line: file, key, what is wrong, what is needed."""

import math
import types
import typing
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from dielast.base.errors import DielastError, InputError, Problem, listed, shown, shown_path, similar
from dielast.base.units import LARGEST, decimal_comma
from dielast.recipe.base import Kinds
from dielast.recipe.fields import Section
from dielast.recipe.paths import keys_of

Model = TypeVar("Model", bound=BaseModel)
Place = tuple[int | str, ...]
"""The keys and indices that lead to a value."""
Mistake = tuple[Place, Problem]
"""Where in a recipe a mistake is, and what it is."""
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


def check(model: type[Model], values: Mapping[str, Any], source: str, folder: Path) -> Model:
    """`values` as a `model`; paths are relative to `folder`. Raises `InputError` with a line for every mistake."""
    checked = examine(model, values, source, folder)
    if isinstance(checked, list):
        raise InputError(*in_order(checked, values))
    return checked


def examine(
    model: type[Model], values: Mapping[str, Any], source: str, folder: Path, kinds: Kinds | None = None
) -> Model | list[Mistake]:
    """`values` as a `model`, or every mistake in them; messages also suggest keys and files of the other `kinds`."""
    sweep = values.get("sweep")
    swept = {shown_path(keys_of(key)): listed for key, listed in sweep.items()} if isinstance(sweep, dict) else {}
    context: dict[str, Any] = {
        "folder": folder,
        "columns": getattr(model, "columns", tuple)(),
        "swept": swept,
        "maker_of": partial(_maker_of, kinds or {}),
    }
    wrong = list(_extremes({key: value for key, value in values.items() if key != "sweep"}))
    try:
        checked = model.model_validate(values, context=context)
    except ValidationError as error:
        details = error.errors(include_url=False)
        # a key that is misspelt is not missing as well
        meant = {_meant(model, detail["loc"]) for detail in details if detail["type"] == "extra_forbidden"}
        wrong += [
            mistake
            for detail in details
            if detail["type"] != "missing" or detail["loc"] not in meant
            for mistake in _mistakes(model, detail, kinds or {})
        ]
    return [(place, problem.at(file=source)) for place, problem in wrong] if wrong else checked


def _extremes(value: Any, place: Place = ()) -> Iterator[Mistake]:
    """The bare numbers in a value that are too large to be computed with."""
    if isinstance(value, float) and LARGEST < abs(value) < math.inf:
        yield place, Problem(f"{value:g}: a number of at most {LARGEST:g} is needed", key=_path(place))
    for key, each in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from _extremes(each, (*place, key))


def _maker_of(kinds: Kinds, file: str, key: str | None) -> str | None:
    """The up to three commands that write a file of this name; for a folder, its `key` is the name of the command."""
    if key is not None:
        return key if key in kinds else None
    makers = [name for name, kind in kinds.items() if file in kind.files]
    return " or dielast ".join(makers) if 0 < len(makers) < 4 else None


def in_order(mistakes: Iterable[Mistake], values: Mapping[str, Any]) -> list[Problem]:
    """The problems of `mistakes`, without repetition, in the order of the recipe's `values`; a mistake of a whole table is last."""

    def position(mistake: Mistake) -> list[float]:
        positions: list[float] = []
        inner: Any = values
        for key in mistake[0]:
            keys: list[Any] = list(inner if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ())
            positions.append(keys.index(key) if key in keys else len(keys))
            inner = inner[key] if key in keys else None
        return [*positions, float("inf")]

    return list(dict.fromkeys(problem for _, problem in sorted(mistakes, key=position)))


def on_the_way(place: Place, path: Place) -> bool:
    """Whether two places are equal, or one of them contains the other."""
    return all(str(key) == str(other) for key, other in zip(place, path, strict=False))


def unknown_key(model: type[BaseModel], keys: Place) -> str | None:
    """The message about the path `keys` if it leads to no key of `model`, else None; indices at its end are ignored."""
    named = [key for key in keys if not str(key).isdecimal()]
    return _unknown(model, tuple(named), {}) if field_at(model, tuple(named)) is None else None


def field_at(model: type[BaseModel], keys: Place) -> FieldInfo | None:
    """The field at the path `keys`, whose indices of lists are ignored; None if the model has no such key."""
    table = _table_at(model, keys[:-1])
    return None if table is None or not keys else _fields(table).get(str(keys[-1]))


def _mistakes(model: type[BaseModel], detail: ErrorDetails, kinds: Kinds) -> list[Mistake]:
    """The mistakes that pydantic reports, with their places, in plain words; validators name keys relative to their table."""
    context = detail.get("ctx", {})
    if detail["type"] == "value_error" and isinstance(error := context["error"], DielastError):
        places = [(*detail["loc"], *_keys(problem.key or "")) for problem in error.problems]
        located = zip(places, error.problems, strict=True)
        # a file that the value names is stated after the key
        return [(place, p.within(key=_path(place)) if p.file else replace(p, key=_path(place))) for place, p in located]
    return [(detail["loc"], Problem(_text(model, detail, context, kinds), key=_path(detail["loc"])))]


def _path(place: Place) -> str:
    """A place as a message names it, such as `step[0].rate`."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{shown_path([key])}" for key in place).lstrip(".")


def _keys(path: str) -> Place:
    """The keys and indices of a path such as `step[0].rate`, or `[0]` from the validator of a list."""
    return tuple(int(key) if key.isdecimal() else key for key in path.replace("[", ".").replace("]", "").split(".") if key)


def _text(model: type[BaseModel], detail: ErrorDetails, context: Mapping[str, Any], kinds: Kinds) -> str:
    keys, kind, value = detail["loc"], detail["type"], detail["input"]
    if kind == "extra_forbidden":
        return _unknown(model, keys, kinds)
    if kind == "value_error":
        return str(context["error"])
    if kind == "list_type" and isinstance(value, dict) and (field := field_at(model, keys)) and _models(field.annotation):
        return _no_list(str(keys[-1]), value)
    if kind == "missing" and (choices := _choices(field_at(model, keys))):
        return _PLAIN["literal_error"].format(expected=choices)
    if "expected" in context:
        # quoted as values are shown
        context = {**context, "expected": str(context["expected"]).replace("'", '"')}
    needed = _PLAIN.get(kind, detail["msg"]).format(**context, **_counted(context))
    comma = decimal_comma(value) if isinstance(value, str) and kind in ("float_type", "int_type") else ""
    return ("" if kind == "missing" else f"{shown(value)}: ") + needed + (f"; {comma}" if comma else "")


def _choices(field: FieldInfo | None) -> str:
    """The values of which a field takes one, as messages list them; empty if there is no such list."""
    if field is None or typing.get_origin(field.annotation) is not typing.Literal:
        return ""
    return listed(f'"{value}"' for value in typing.get_args(field.annotation))


def _no_list(key: str, value: Mapping[str, Any]) -> str:
    """The message for a table where a list of tables is needed."""
    index = next((inner for inner in value if inner.isdecimal()), None)
    if index is None:
        return f"{shown(value)}: a list is needed: write [[{key}]], in double brackets"
    return (
        f"there is no entry {index} yet: write [[{key}]] into the recipe, or state the whole list, as in --set '{key}=[{{ ... }}]'"
    )


def _counted(context: Mapping[str, Any]) -> dict[str, str]:
    """The allowed numbers of characters and entries, with a verb in the singular or plural."""
    number = context.get("min_length", context.get("max_length"))
    characters, entries = ("character is", "entry is") if number == 1 else ("characters are", "entries are")
    return {"characters": f"{number} {characters}", "entries": f"{number} {entries}"}


def _table_at(model: type[BaseModel], keys: Place) -> type[BaseModel] | None:
    """The model of the table that `keys` lead to; None if they lead to no table."""
    table: type[BaseModel] | None = model
    any_key = False  # in a table of tables, keys are names
    for key in keys:
        if any_key:
            any_key = False
        elif table is not None and not str(key).isdecimal():
            field = _fields(table).get(str(key))
            table = next(iter(_models(field.annotation)), None) if field is not None else None
            any_key = table is not None and field is not None and typing.get_origin(field.annotation) is dict
    return table


def _fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """The fields of a model by the keys that a recipe has for them."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _models(annotation: Any) -> list[type[BaseModel]]:
    """The models within an annotation, through Optional, unions, lists and Annotated."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in typing.get_args(annotation) for model in _models(inner)]


def _unknown(model: type[BaseModel], keys: Place, kinds: Kinds) -> str:
    """The message for a key that the table of `model` at this place does not have."""
    table, key = _table_at(model, keys[:-1]) or model, str(keys[-1])
    if issubclass(table, Section) and key in table.ELSEWHERE:
        return table.ELSEWHERE[key]
    if others := [name for name, kind in kinds.items() if field_at(kind.model, keys) is not None]:
        return f"unknown key; {key} belongs to {', '.join(others)}"
    known = _fields(table)
    near = _meant(model, keys)
    if homes := [home for home in _homes(model, key) if not home.endswith(_header(model, keys[:-1]))]:
        meant = f'did you mean "{near[-1]}"? ' if near else ""
        return f"unknown key; {meant}{key} belongs {' or '.join(homes[:3])}"
    return "unknown key; " + (f'did you mean "{near[-1]}"?' if near else "known keys here are " + ", ".join(known))


def _meant(model: type[BaseModel], keys: Place) -> Place | None:
    """The place of the known key that is nearest to an unknown one; None if none is near."""
    near = similar(keys[-1], _fields(_table_at(model, keys[:-1]) or model))
    return None if near is None else (*keys[:-1], near)


def _homes(model: type[BaseModel], key: str) -> list[str]:
    """The tables of a recipe that have a key of this name, as their headers: the top of the recipe, or one of its tables."""
    top = ["at the top of the recipe, above its tables"] if key in _fields(model) else []
    return top + [
        f"in {_header(model, (name,))}" for name in _fields(model) if (inner := _table_at(model, (name,))) and key in _fields(inner)
    ]


def _header(model: type[BaseModel], place: Place) -> str:
    """The header of the table at a place, such as `[film]` or `[[step]]`."""
    names = [str(key) for key in place if not str(key).isdecimal()]
    field = field_at(model, tuple(names))
    listed = field is not None and any(
        typing.get_origin(part) in (list, tuple) for part in (field.annotation, *typing.get_args(field.annotation))
    )
    return f"[[{shown_path(names)}]]" if listed else f"[{shown_path(names)}]"
