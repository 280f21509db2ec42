"""The JSON Schema of recipes, for editors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic.json_schema import models_json_schema

from dielast.recipe.fields import UNIT
from dielast.recipe.kinds import Kinds


def recipe_schema(kinds: Kinds) -> dict[str, Any]:
    """One JSON Schema for recipes of all `kinds`, which the key `kind` tells apart."""
    references, schema = models_json_schema([(kind.model, "validation") for kind in kinds.values()])
    say_units(schema)
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
        inner, many = table_in(field, definitions)
        if inner is not None and (within := _needed(inner, definitions)):
            needed.setdefault("properties", {})[name] = {"items": within} if many else within
    return needed


def say_units(node: Any) -> None:
    """Give every default of a quantity its unit, as a recipe would."""
    if isinstance(node, dict):
        default = node.get("default")
        unit = next((option[UNIT] for option in options(node) if UNIT in option), None)
        if unit is not None and isinstance(default, float):
            node["default"] = f"{default:g} {unit}"
        node = list(node.values())
    if isinstance(node, list):
        for inner in node:
            say_units(inner)


def table_in(field: Mapping[str, Any], definitions: Mapping[str, Any]) -> tuple[Mapping[str, Any] | None, bool]:
    """The schema of the table that a key holds, or None, and whether the key holds a list of such tables."""
    for option in options(field):
        target = option.get("items", option)
        if "$ref" in target:
            return definitions[target["$ref"].split("/")[-1]], "items" in option
        if "properties" in target:
            return target, False
    return None, False


def options(field: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The alternatives that a key may hold, without null, which stands for a key left out."""
    if "anyOf" in field:
        return [option for inner in field["anyOf"] for option in options(inner)]
    return [] if field.get("type") == "null" else [field]
