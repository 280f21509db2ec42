"""Every key of a recipe or a material file, read from the JSON Schema of its model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from dielast.recipe.fields import QUANTITY
from dielast.recipe.schema import options, say_units, table_in

NAMES = {"string": "text", "number": "number", "integer": "whole number", "boolean": "true or false"}


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a recipe: its `path`, such as `step[].rate`, what it `takes`, its `default` or an empty text, and its meaning."""

    path: str
    takes: str
    default: str
    meaning: str


def keys(model: type[BaseModel]) -> list[Key]:
    """Every key of a recipe or material file, in the order of the model, the keys of a table below it."""
    schema = model.model_json_schema()
    say_units(schema)
    return list(_keys(schema, schema.get("$defs", {}), ""))


def _keys(schema: Mapping[str, Any], definitions: Mapping[str, Any], prefix: str) -> Iterator[Key]:
    required = schema.get("required", ())
    for name, field in schema["properties"].items():
        path = prefix + name
        inner, many = table_in(field, definitions)
        default = "needed" if name in required else _default(field)
        if inner is None:
            yield Key(path, _takes(field), default, field["description"])
        else:
            # a key without a description has that of its table
            meaning = field.get("description", inner.get("description", ""))
            yield Key(path, "tables" if many else "table", "needed" if name in required else "", meaning)
            yield from _keys(inner, definitions, f"{path}[]." if many else f"{path}.")


def _takes(field: Mapping[str, Any]) -> str:
    kinds = list(dict.fromkeys(_kind(option) for option in options(field)))
    lists = [f"list of {kind}" for kind in (*kinds, " or ".join(kinds[:-1]))]
    return " or ".join("a list of them" if kind in lists else kind for kind in kinds)


def _kind(option: Mapping[str, Any]) -> str:
    if "const" in option:
        return f'"{option["const"]}"'
    if "enum" in option:
        return ", ".join(f'"{value}"' for value in option["enum"])
    if "examples" in option:
        examples = " or ".join(f'"{example}"' for example in option["examples"])
        return f"{option[QUANTITY]}, {examples}" if QUANTITY in option else examples
    if "format" in option:
        return str(option["format"])
    if option.get("type") == "array":
        return f"list of {_takes(option['items'])}" if option.get("items") else "list"
    if option.get("type") == "object":
        return "table"
    return str(NAMES.get(option.get("type", ""), "value"))


def _default(field: Mapping[str, Any]) -> str:
    default = field.get("default")
    if default in (None, [], {}):
        return ""
    return f'"{default}"' if isinstance(default, str) else f"{default:g}" if isinstance(default, float) else str(default)
