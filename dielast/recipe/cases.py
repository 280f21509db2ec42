"""A recipe as the cases it asks for: one, or one for each combination of swept values."""

from __future__ import annotations

import copy
import itertools
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import create_model

from dielast.errors import InputError, shown
from dielast.files import read_file, resolve
from dielast.recipe.base import RecipeBase
from dielast.recipe.fields import Section
from dielast.recipe.models import recipe_model
from dielast.recipe.validate import check, parse_toml, read_values, set_key

Recipe = TypeVar("Recipe", bound=RecipeBase, covariant=True)
MOST_CASES = 100_000
ENOUGH_WRONG = 100  # cases whose mistakes are told: those of all others are most likely the same


@dataclass(frozen=True, slots=True)
class Case(Generic[Recipe]):
    """One case: its `recipe`, and the swept `settings` by key path as the recipe spells them."""

    recipe: Recipe
    settings: Mapping[str, Any] = field(default_factory=dict)


def read_cases(path: Path, kind: str | None = None, overrides: Sequence[str] = ()) -> tuple[Case[Any], ...]:
    """The cases of the recipe in the file `path`, of the given `kind` if one is given, with `overrides` such as `fit.branches=20`.

    Raises `InputError` with a line for every mistake.
    """
    values = read_values(path, kind, overrides)
    model = recipe_model(values["kind"])
    source, folder = str(path), path.parent
    sweep = values.get("sweep") if "sweep" in model.model_fields else None
    if not isinstance(sweep, dict):
        _take_load(values, model, source, folder)
        return (Case(check(model, values, source, folder)),)
    settings = _combinations(sweep, source)
    cases, mistakes, wrong = [], dict[str, None](), 0
    for setting in settings:
        own = copy.deepcopy(values, {id(sweep): sweep})  # as long as there are cases, and the same in all
        try:
            # the steps that a load file brings are there for other keys to set
            if "load" in setting:
                own["load"] = setting["load"]
            _take_load(own, model, source, folder)
            for key, value in setting.items():
                set_key(own, key, value, f'{source}: sweep."{key}"')
            cases.append(Case(check(model, own, source, folder), setting))
        except InputError as error:
            mistakes.update(dict.fromkeys(error.messages))
            wrong += 1
        if wrong == ENOUGH_WRONG:
            break
    if mistakes:
        raise InputError(*mistakes)
    return tuple(cases)


def _combinations(sweep: dict[str, Any], source: str) -> list[dict[str, Any]]:
    """The settings of every case: each combination of the listed values, or with mode = "zip" the first of each, the second ..."""
    keys = [key for key, value in sweep.items() if not (key == "mode" and isinstance(value, str))]
    paired = len(keys) < len(sweep)
    if paired and sweep["mode"] != "zip":
        raise InputError(f'{source}: sweep.mode: "{sweep["mode"]}": "zip" is needed, or leave it out for every combination')
    for key in keys:
        if key.split(".")[0] == "sweep":
            raise InputError(f'{source}: sweep."{key}": a sweep cannot be swept')
        if not isinstance(sweep[key], list) or not sweep[key]:
            raise InputError(f'{source}: sweep."{key}": a list of values is needed')
    if not keys:
        raise InputError(f"{source}: sweep: lists of values by key path are needed")
    lengths = [len(sweep[key]) for key in keys]
    if paired and len(set(lengths)) > 1:
        found = ", ".join(map(str, lengths))
        raise InputError(f'{source}: sweep: mode = "zip" pairs lists of one length, these have {found} values')
    count = lengths[0] if paired else math.prod(lengths)
    if count > MOST_CASES:
        raise InputError(f"{source}: sweep: {count} cases, at most {MOST_CASES} are allowed")
    lists = [sweep[key] for key in keys]
    rows = zip(*lists, strict=True) if paired else itertools.product(*lists)
    return [dict(zip(keys, row, strict=True)) for row in rows]


def _take_load(values: dict[str, Any], model: type[RecipeBase], source: str, folder: Path) -> None:
    """Put the steps of the load file, if there is one, into the recipe's place for them."""
    if "load" not in values or "load" not in model.model_fields:
        return
    name = values["load"]
    if not isinstance(name, str):
        raise InputError(f"{source}: load: the path of a file is needed")
    if "step" in values:
        raise InputError(f"{source}: either [[step]] or load is needed, not both")
    path = resolve(folder, name)
    try:
        content = read_file(path, shown(name))
    except InputError as error:
        raise InputError(f"{source}: load: {error}") from None
    history = parse_toml(content, name)
    if set(history) != {"step"} or not isinstance(history["step"], list):
        raise InputError(f"{name}: a load file holds [[step]] and nothing else")
    # checked by itself first, so that a mistake is told of the file it is in
    check(load_file(model), history, name, path.parent)
    values["step"] = [_beside(step, path.parent, folder) for step in history["step"]]


def load_file(model: type[RecipeBase]) -> type[Section]:
    """The model of a load file for recipes of `model`: their steps alone."""
    steps: Any = model.model_fields["step"].annotation
    return create_model("LoadFile", __base__=Section, step=(steps, ...))


def read_load(path: Path) -> None:
    """Check a load file by itself: whether it suits any kind of recipe. Raises `InputError` with the mistakes of the likeliest."""
    history, found = parse_toml(read_file(path, str(path)), str(path)), []
    for kind in ("relax", "creep", "actuate"):
        try:
            check(load_file(recipe_model(kind)), history, str(path), path.parent)
        except InputError as error:
            found.append(error)
        else:
            return
    raise min(found, key=lambda error: len(error.messages))


def _beside(step: dict[str, Any], home: Path, folder: Path) -> dict[str, Any]:
    """A step of a load file in `home`, its table's path made relative to the recipe's `folder`."""
    if "table" not in step or home == folder:
        return step
    return {**step, "table": os.path.relpath(home / step["table"], folder)}
