"""The recipe models as others read them: a JSON Schema for editors, and a list of keys for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from dielast.recipe.fields import QUANTITY, UNIT
from dielast.recipe.kinds import Kinds

NAMES = {"string": "text", "number": "number", "integer": "whole number", "boolean": "true or false"}


@dataclass(frozen=True, slots=True)
class Key:
    """A key of a recipe: its `path`, such as `step[].rate`, what it `takes`, its `default` or an empty text, and its meaning."""

    path: str
    takes: str
    default: str
    meaning: str


def recipe_schema(kinds: Kinds) -> dict[str, Any]:
    """One JSON Schema for recipes of all `kinds`, which the key `kind` tells apart."""
    references, schema = models_json_schema([(kind.model, "validation") for kind in kinds.values()])
    _say_units(schema)
    definitions = schema["$defs"]
    recipes = [definitions[reference["$ref"].split("/")[-1]] for reference in references.values()]
    for recipe in recipes:
        needed = _needed(recipe, definitions)
        if "load" in recipe["properties"]:
            # the steps stand in the recipe or in another file
            needed["required"].remove("step")
            needed["oneOf"] = [{"required": ["step"]}, {"required": ["load"]}]
        # a swept key need not be stated outside of the sweep
        swept = {"if": {"required": ["sweep"]}, "else": needed}
        recipe["allOf"] = [swept if "sweep" in recipe["properties"] else needed]
    for definition in definitions.values():
        definition.pop("required", None)
    for recipe in recipes:
        recipe["required"] = ["kind"]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "dielast recipe",
        "oneOf": list(references.values()),
        **schema,
    }


def _needed(schema: Mapping[str, Any], definitions: Mapping[str, Any]) -> dict[str, Any]:
    """The schema of nothing but the keys that a table, and the tables within it, must hold."""
    needed: dict[str, Any] = {"required": list(schema["required"])} if "required" in schema else {}
    for name, field in schema["properties"].items():
        inner, many = _table(field, definitions)
        if inner is not None and (within := _needed(inner, definitions)):
            needed.setdefault("properties", {})[name] = {"items": within} if many else within
    return needed


def keys(model: type[BaseModel]) -> list[Key]:
    """Every key of a recipe or material file, in the order of the model, the keys of a table below it."""
    schema = model.model_json_schema()
    _say_units(schema)
    return list(_keys(schema, schema.get("$defs", {}), ""))


def _say_units(node: Any) -> None:
    """Give every default of a quantity its unit, as a recipe would."""
    if isinstance(node, dict):
        default = node.get("default")
        unit = next((option[UNIT] for option in _options(node) if UNIT in option), None)
        if unit is not None and isinstance(default, float):
            node["default"] = f"{default:g} {unit}"
        node = list(node.values())
    if isinstance(node, list):
        for inner in node:
            _say_units(inner)


def _keys(schema: Mapping[str, Any], definitions: Mapping[str, Any], prefix: str) -> Iterator[Key]:
    required = schema.get("required", ())
    for name, field in schema["properties"].items():
        path = prefix + name
        inner, many = _table(field, definitions)
        default = "needed" if name in required else _default(field)
        if inner is None:
            yield Key(path, _takes(field), default, field["description"])
        else:
            # a key without a description has that of its table
            meaning = field.get("description", inner.get("description", ""))
            yield Key(path, "tables" if many else "table", "needed" if name in required else "", meaning)
            yield from _keys(inner, definitions, f"{path}[]." if many else f"{path}.")


def _table(field: Mapping[str, Any], definitions: Mapping[str, Any]) -> tuple[Mapping[str, Any] | None, bool]:
    """The schema of the table that a key holds, or None, and whether the key holds a list of such tables."""
    for option in _options(field):
        target = option.get("items", option)
        if "$ref" in target:
            return definitions[target["$ref"].split("/")[-1]], "items" in option
        if "properties" in target:
            return target, False
    return None, False


def _options(field: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The alternatives that a key may hold, without null, which stands for a key left out."""
    if "anyOf" in field:
        return [option for inner in field["anyOf"] for option in _options(inner)]
    return [] if field.get("type") == "null" else [field]


def _takes(field: Mapping[str, Any]) -> str:
    kinds = list(dict.fromkeys(_kind(option) for option in _options(field)))
    lists = [f"list of {kind}" for kind in kinds]
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
