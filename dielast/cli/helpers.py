"""`new`, `validate` and `schema`."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from dielast.errors import InputError
from dielast.recipe.models import KINDS, recipe_model


def print_starter(kind: str) -> int:
    """Print the starter recipe of `kind`."""
    if kind not in KINDS:
        raise InputError(f'"{kind}" is no kind of recipe; there are {", ".join(KINDS)}')
    sys.stdout.write((resources.files("dielast") / "starters" / f"{kind}.toml").read_text(encoding="utf-8"))
    return 0


def validate_files(paths: Sequence[Path]) -> int:
    """Check recipes and material files; every mistake of every file is told before the error code."""
    from dielast.recipe.cases import read_cases
    from dielast.recipe.validate import parse_toml

    mistakes: list[str] = []
    for path in paths:
        try:
            if path.is_file() and "kind" not in parse_toml(path.read_bytes(), str(path)) and _looks_like_material(path):
                from dielast.recipe.material import read_material

                read_material(path)
            else:
                read_cases(path)
        except InputError as error:
            mistakes += error.messages
        else:
            print(f"{path}: ok")
    if mistakes:
        raise InputError(*mistakes)
    return 0


def print_schema() -> int:
    """Print one JSON Schema for recipes of every kind, told apart by `kind`."""
    from pydantic.json_schema import models_json_schema

    references, definitions = models_json_schema([(recipe_model(kind), "validation") for kind in KINDS])
    schema: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "dielast recipe",
        "oneOf": list(references.values()),
        **definitions,
    }
    print(json.dumps(schema, indent=2, sort_keys=False))
    return 0


def _looks_like_material(path: Path) -> bool:
    from dielast.recipe.validate import parse_toml

    return bool({"equilibrium", "nonequilibrium"} & parse_toml(path.read_bytes(), str(path)).keys())
