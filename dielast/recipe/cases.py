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

from dielast.errors import InputError, quoted, shown, shown_path
from dielast.files import read_file, resolve
from dielast.recipe.base import RecipeBase
from dielast.recipe.fields import Section
from dielast.recipe.models import recipe_model
from dielast.recipe.paths import read_path, set_key
from dielast.recipe.validate import Mistake, Place, check, examine, in_order, parse_toml, read_values

Recipe = TypeVar("Recipe", bound=RecipeBase, covariant=True)
MOST_CASES = 100_000
ENOUGH_WRONG = 100  # cases whose mistakes are told: those of all others are most likely the same


@dataclass(frozen=True, slots=True)
class Case(Generic[Recipe]):
    """One case: its `recipe`, and the swept `settings` by key path as the recipe spells them."""

    recipe: Recipe
    settings: Mapping[str, Any] = field(default_factory=dict)


def read_cases(
    path: Path, kind: str | None = None, overrides: Sequence[str] = (), content: bytes | None = None
) -> tuple[Case[Any], ...]:
    """The cases of the recipe in the file `path`, of the given `kind` if one is given, with `overrides` such as `fit.branches=20`.

    `content` is what the file holds, if it has been read.

    Raises `InputError` with a line for every mistake, in the order of the recipe.
    """
    values = read_values(path, kind, overrides, content)
    model = recipe_model(values["kind"])
    source, folder = str(path), path.parent
    sweep = values.get("sweep") if "sweep" in model.model_fields else None
    settings, mistakes = _combinations(sweep, source) if isinstance(sweep, dict) else ([{}], [])
    # what a wrong list would have set is not missed
    unset = [keys for place, _ in mistakes if len(place) > 1 and (keys := read_path(str(place[1])))]
    cases, wrong = [], 0
    for setting in settings:
        own = copy.deepcopy(values, {id(sweep): sweep})  # as long as there are cases, and the same in all
        found, lost = _set(own, setting, model, source, folder)
        recipe = examine(model, own, source, folder)
        if isinstance(recipe, list):
            found += [(place, line) for place, line in recipe if not any(_on_the_way(place, path) for path in (*lost, *unset))]
        elif not found:
            cases.append(Case(recipe, setting))
            continue
        mistakes += found
        wrong += 1
        if wrong == ENOUGH_WRONG:
            break
    if mistakes:
        raise InputError(*in_order(mistakes, values))
    return tuple(cases)


def _set(
    values: dict[str, Any], setting: Mapping[str, Any], model: type[RecipeBase], source: str, folder: Path
) -> tuple[list[Mistake], list[Place]]:
    """Put the steps of a load file and a case's `setting` into the recipe; what went wrong, and the places left empty."""
    mistakes: list[Mistake] = []
    lost: list[Place] = []
    # the steps that a load file brings are there for other keys to set
    if "load" in setting:
        values["load"] = setting["load"]
    try:
        _take_load(values, model, source, folder)
    except InputError as error:
        mistakes += [(("load",), line) for line in error.messages]
        lost += [("load",)] if isinstance(values.get("step"), list) else [("load",), ("step",)]
    for key, value in setting.items():
        path = read_path(key) or (key,)
        try:
            set_key(values, path, value, f"{source}: sweep.{quoted(key)}")
        except InputError as error:
            mistakes.append((("sweep", key), str(error)))
            lost.append(path)
    return mistakes, lost


def _on_the_way(place: Place, path: Place) -> bool:
    """Whether one of two places is within the other, or both are the same."""
    return all(str(one) == str(other) for one, other in zip(place, path, strict=False))


def _combinations(sweep: dict[str, Any], source: str) -> tuple[list[dict[str, Any]], list[Mistake]]:
    """The settings of every case: each combination of the listed values, or with mode = "zip" the first of each, the second ...

    With them, what is wrong with the sweep; the settings are then those of the rest of it.
    """
    mistakes: list[Mistake] = []
    stated = isinstance(sweep.get("mode"), str)
    paired = stated and sweep["mode"] == "zip"
    if stated and not paired:
        needed = '"zip" is needed, or leave it out for every combination'
        mistakes.append((("sweep",), f'{source}: sweep.mode: "{sweep["mode"]}": {needed}'))
    lists = {}
    for key in [key for key in sweep if not (key == "mode" and stated)]:
        if (wrong := _not_swept(key, sweep[key])) is None:
            lists[key] = sweep[key]
        else:
            mistakes.append((("sweep", key), f"{source}: sweep.{quoted(key)}: {wrong}"))
    if not lists:
        # a key that is wrong has been told
        return [{}], mistakes or [(("sweep",), f"{source}: sweep: lists of values by key path are needed")]
    lengths = [len(values) for values in lists.values()]
    if paired and len(set(lengths)) > 1:
        found = ", ".join(map(str, lengths))
        mistakes.append((("sweep",), f'{source}: sweep: mode = "zip" pairs lists of one length, these have {found} values'))
    count = min(lengths) if paired else math.prod(lengths)
    if count > MOST_CASES:
        mistakes.append((("sweep",), f"{source}: sweep: {count} cases, at most {MOST_CASES} are allowed"))
    rows = zip(*lists.values(), strict=False) if paired else itertools.product(*lists.values())
    first = itertools.islice(rows, count if count <= MOST_CASES else 1)
    return [dict(zip(lists, row, strict=True)) for row in first], mistakes


def _not_swept(key: str, values: Any) -> str | None:
    """What is wrong with a key of a sweep, if anything is."""
    path = read_path(key)
    if path is None:
        return 'the path of a key is needed, such as "step.0.rate"'
    if path[0] == "sweep":
        return "a sweep cannot be swept"
    if isinstance(values, dict) and values:
        while isinstance(values, dict) and values:
            inner, values = next(iter(values.items()))
            path = (*path, inner)
        return f"a list of values is needed; a path goes in quotes: {quoted(shown_path(path))}"
    return None if isinstance(values, list) and values else "a list of values is needed"


def _take_load(values: dict[str, Any], model: type[RecipeBase], source: str, folder: Path) -> None:
    """Put the steps of the load file, if there is one, into the recipe's place for them."""
    if "load" not in values or "load" not in model.model_fields:
        return
    name = values["load"]
    if not isinstance(name, str) or not name:
        raise InputError(f"{source}: load: the path of a file is needed")
    if isinstance(values.get("step"), dict):  # a key that --set has set
        raise InputError(f'{source}: step: the steps are in {shown(name)}: change them there, or sweep them: "step.0.rate" = [...]')
    if "step" in values:
        raise InputError(f"{source}: either [[step]] or load is needed, not both")
    try:
        path = resolve(folder, name)
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
    steps: Any = model.model_fields["step"].rebuild_annotation()
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
