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

from dielast.errors import InputError, Mistakes, Problem, located, placed, quoted, shown, shown_path
from dielast.io.files import read_file, resolve
from dielast.recipe.base import RecipeBase
from dielast.recipe.fields import Section
from dielast.recipe.models import recipe_model
from dielast.recipe.paths import read_path, set_key
from dielast.recipe.toml import parse_toml
from dielast.recipe.validate import Mistake, Place, check, examine, in_order, read_values

Recipe = TypeVar("Recipe", bound=RecipeBase, covariant=True)
MOST_CASES = 100_000
OF_ALL = ("kind", "title", "plot", "compare")  # keys that no case has for itself
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
    values, wrongly_set = read_values(path, kind, overrides, content)
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
            told = [(place, each) for place, each in recipe if not any(_on_the_way(place, path) for path in (*lost, *unset))]
            found += [(place, each.adding(_from_sweep(place, setting, values))) for place, each in told]
        elif not found:
            cases.append(Case(recipe, setting))
            continue
        mistakes += found
        wrong += 1
        if wrong == ENOUGH_WRONG:
            break
    if mistakes or wrongly_set:
        raise InputError(*wrongly_set, *in_order(mistakes, values))
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
        mistakes += [(("load",), problem) for problem in error.problems]
        lost += [("load",)] if isinstance(values.get("step"), list) else [("load",), ("step",)]
    for key, value in setting.items():
        path = read_path(key) or (key,)
        try:
            with located(file=source, key=f"sweep.{quoted(key)}"):
                if path == ("step",) and "load" in values:
                    raise InputError('the steps are in a load file: sweep load, or "step.0.rate"')
                # what is set within it by another key is this case's alone
                set_key(values, path, copy.deepcopy(value))
        except InputError as error:
            mistakes += [(("sweep", key), problem) for problem in error.problems]
            lost.append(path)
    return mistakes, lost


def _from_sweep(place: Place, setting: Mapping[str, Any], values: Mapping[str, Any]) -> str:
    """Which key of a sweep brought what stands at `place`, if one did, to be said behind what is wrong with it."""
    inner: Any = values
    for key in place:
        known = key in inner if isinstance(inner, dict) else isinstance(inner, list) and isinstance(key, int) and key < len(inner)
        inner = inner[key] if known else None
    for key in setting:
        path = read_path(key) or (key,)
        # what is within a swept value comes with it, and so do the tables that lead to it, unless the recipe has them itself
        if _on_the_way(place, path) and (len(place) >= len(path) or inner is None):
            return f" (from sweep.{quoted(key)})"
    return ""


def _on_the_way(place: Place, path: Place) -> bool:
    """Whether one of two places is within the other, or both are the same."""
    return all(str(one) == str(other) for one, other in zip(place, path, strict=False))


def _combinations(sweep: dict[str, Any], source: str) -> tuple[list[dict[str, Any]], list[Mistake]]:
    """The settings of every case: each combination of the listed values, or with mode = "zip" the first of each, the second ...

    With them, what is wrong with the sweep; the settings are then those of the rest of it.
    """
    mistakes: list[Mistake] = []

    def refuse(text: str, key: str | None = None) -> None:
        place = ("sweep",) if key is None else ("sweep", key)
        mistakes.append((place, Problem(text, file=source, key="sweep" if key is None else f"sweep.{quoted(key)}")))

    stated = isinstance(sweep.get("mode"), str)
    paired = stated and sweep["mode"] == "zip"
    if stated and not paired:
        needed = '"zip" is needed, or leave it out for every combination'
        mistakes.append((("sweep",), Problem(f'"{sweep["mode"]}": {needed}', file=source, key="sweep.mode")))
    lists: dict[str, list[Any]] = {}
    for key in [key for key in sweep if not (key == "mode" and stated)]:
        path = shown_path(read_path(key) or (key,))  # step[0].rate is step.0.rate
        wrong = _not_swept(key, sweep[key]) or (f"{path} is swept twice" if path in lists else None)
        if wrong is None:
            lists[path] = sweep[key]
        else:
            refuse(wrong, key)
    if not lists:
        if not mistakes:
            refuse("lists of values by key path are needed")
        return [{}], mistakes
    lengths = [len(values) for values in lists.values()]
    if paired and len(set(lengths)) > 1:
        found = ", ".join(map(str, lengths))
        refuse(f'mode = "zip" pairs lists of one length, these have {found} values')
    count = min(lengths) if paired else math.prod(lengths)
    if count > MOST_CASES:
        refuse(f"{count} cases, at most {MOST_CASES} are allowed")
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
    if path[0] in OF_ALL:
        return f"{path[0]} is about all cases together"
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
        raise InputError("the path of a file is needed", file=source, key="load")
    if isinstance(values.get("step"), dict):  # a key that --set has set
        there = f'the steps are in {shown(name)}: change them there, or sweep them: "step.0.rate" = [...]'
        raise InputError(there, file=source, key="step")
    if "step" in values:
        raise InputError("either [[step]] or load is needed, not both", file=source)
    with placed(lambda problem: problem.within(file=source, key="load")):
        path = resolve(folder, name)
        content = read_file(path, shown(name))
    history = parse_toml(content, name, f"a table of points goes into [[step]]: table = {shown(name)}")
    steps = history.get("step")
    wrong = Mistakes()
    if set(history) != {"step"} or not isinstance(steps, list):
        wrong.append(Problem("a load file holds [[step]] and nothing else", file=name))
    if isinstance(steps, list):
        # checked by itself first, so that a mistake is told of the file it is in
        found = examine(load_file(model), {"step": steps}, name, path.parent)
        wrong += in_order(found, history) if isinstance(found, list) else []
    wrong.refuse()
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
