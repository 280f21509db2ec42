"""The JSON Schema of recipes, for editors."""

from collections.abc import Mapping
from typing import Any

from pydantic.json_schema import models_json_schema

from dielast.recipe.base import Kinds
from dielast.recipe.fields import UNIT


def recipe_schema(kinds: Kinds) -> dict[str, Any]:
    """One JSON Schema for recipes of all `kinds`; the key `kind` selects among them."""
    references, schema = models_json_schema([(kind.model, "validation") for kind in kinds.values()])
    say_units(schema)
    definitions = schema["$defs"]
    recipes = [definitions[reference["$ref"].split("/")[-1]] for reference in references.values()]
    for recipe in recipes:
        needed = _needed(recipe, definitions)
        if "load" in recipe["properties"]:
            # one of [[step]] and load is needed
            needed["required"].remove("step")
            needed["oneOf"] = [{"required": ["step"]}, {"required": ["load"]}]
        # a key may be stated by the sweep alone
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
    """A schema with only the required keys of a table and of the tables within it."""
    needed: dict[str, Any] = {"required": list(schema["required"])} if "required" in schema else {}
    for name, field in schema["properties"].items():
        inner, many = table_in(field, definitions)
        if inner is not None and (within := _needed(inner, definitions)):
            needed.setdefault("properties", {})[name] = {"items": within} if many else within
    return needed


def say_units(node: Any) -> None:
    """Write the default of every quantity with its unit, as in a recipe."""
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
    """The alternatives for the value of a key, without null, which stands for a key that is left out."""
    if "anyOf" in field:
        return [option for inner in field["anyOf"] for option in options(inner)]
    return [] if field.get("type") == "null" else [field]
