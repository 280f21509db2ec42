"""The cases of a recipe: one, or one for each combination of swept values."""

import copy
import itertools
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, create_model

from dielast.base.errors import InputError, Mistakes, Problem, as_toml, located, nearest, placed, quoted, shown, shown_path
from dielast.base.registry import adopt_laws
from dielast.io.files import read_file, resolve
from dielast.io.toml import parse_toml
from dielast.recipe.base import Kinds, RecipeBase
from dielast.recipe.fields import Section, dimension_of, on_one_scale
from dielast.recipe.file_fields import is_path
from dielast.recipe.paths import keys_of, read_override, read_path, set_key
from dielast.recipe.validate import Mistake, Place, examine, field_at, in_order, on_the_way, unknown_key

Recipe = TypeVar("Recipe", bound=RecipeBase, covariant=True)
MOST_CASES = 100_000
NOT_SWEPT = ("kind", "title", "plot", "compare")
"""Keys that hold for all cases together and cannot be swept."""
NOT_CHANGED = "draws"
"""The key of a material file that names another file."""
MOST_WRONG_CASES = 100
"""Number of cases whose mistakes are reported: further cases usually repeat them."""


@dataclass(frozen=True, slots=True)
class Case(Generic[Recipe]):
    """A case: its `recipe`, the swept `settings` by key path as the recipe spells them, and `of_material`, the values that it
    states for keys of the material file, by key path.
    """

    recipe: Recipe
    settings: Mapping[str, Any] = field(default_factory=dict)
    of_material: Mapping[str, Any] = field(default_factory=dict)

    def origin(self, key: str) -> str:
        """The sweep or the setting that states a key of the material file, as messages name it."""
        return f"sweep.{quoted(key)}" if key in self.settings else f"--set {key}"

    def on_one_scale(self, key: str, values: Sequence[Any]) -> tuple[list[float], str] | None:
        """The `values` of a swept key as numbers, and their unit; None unless they are quantities of one dimension."""
        material = self.recipe.material_model() if key in self.of_material else None
        path = keys_of(key)
        return on_one_scale(values, None if material is None else dimension_of(field_at(material, path)))


def read_cases(
    kinds: Kinds, path: Path, kind: str | None = None, overrides: Sequence[str] = (), content: bytes | None = None
) -> tuple[Case[Any], ...]:
    """The cases of the recipe in the file `path`, with `overrides` such as `fit.branches=20`.

    The recipe must be of the given `kind`; None allows all `kinds`. `content` is the content of the file, if it has been read
    already. Raises `InputError` with a line for every mistake, in the order of the recipe.
    """
    values, of_material, wrongly_set = _read_values(kinds, path, kind, overrides, content)
    model = kinds[values["kind"]].model
    source, folder = str(path), path.parent
    sweep = values.get("sweep") if "sweep" in model.model_fields else None
    settings, mistakes = _combinations(sweep, source) if isinstance(sweep, dict) else ([{}], [])
    of_material_file = {key: material for key in settings[0] if (material := _material_with(model, keys_of(key)))}
    mistakes += [
        (("sweep", key), Problem(unknown, file=source, key=f"sweep.{quoted(key)}"))
        for key, material in of_material_file.items()
        if (unknown := unknown_key(material, keys_of(key)))
    ]
    # a key that only a wrong list of the sweep would set is not reported as missing
    unset = [keys for place, _ in mistakes if len(place) > 1 and (keys := read_path(str(place[1])))]
    cases, wrong = list[Case[Any]](), 0
    for setting in settings:
        # the sweep is not copied: it grows with the number of cases and is never changed
        case_values = copy.deepcopy(values, {id(sweep): sweep})
        stated_of_material = of_material | {key: value for key, value in setting.items() if key in of_material_file}
        in_recipe = {key: value for key, value in setting.items() if key not in of_material_file}
        case_mistakes, empty = _set(kinds, case_values, in_recipe, model, source, folder)
        recipe = examine(model, case_values, source, folder, kinds)
        if isinstance(recipe, list):
            stated = [mistake for mistake in recipe if not any(on_the_way(mistake[0], keys) for keys in (*empty, *unset))]
            case_mistakes += [(place, problem.adding(_from_sweep(place, in_recipe, values))) for place, problem in stated]
        elif not case_mistakes:
            if cases:
                _share_parts(recipe, cases[-1].recipe)
            cases.append(Case(recipe, setting, stated_of_material))
            continue
        mistakes += case_mistakes
        wrong += 1
        if wrong == MOST_WRONG_CASES:
            break
    if mistakes or wrongly_set:
        raise InputError(*wrongly_set, *in_order(mistakes, values))
    return tuple(cases)


def _share_parts(recipe: BaseModel, other: BaseModel) -> None:
    """Let the recipe hold the parts of the other one that equal its own, which takes a fraction of the memory of many cases."""
    own, others = recipe.__dict__, other.__dict__
    if recipe.model_fields_set == other.model_fields_set:
        object.__setattr__(recipe, "__pydantic_fields_set__", other.model_fields_set)
    for name, part in own.items():
        if isinstance(part, BaseModel | list):
            own[name] = _shared(part, others.get(name))


def _shared(part: Any, other: Any) -> Any:
    """The other part of a recipe if both are equal, else the part, in which what is equal is shared."""
    if part == other:
        return other
    if isinstance(part, list) and isinstance(other, list):
        part[: len(other)] = map(_shared, part, other)
    elif isinstance(part, BaseModel) and type(part) is type(other):
        _share_parts(part, other)
    return part


def settings(overrides: Sequence[str], model: type[BaseModel]) -> list[str]:
    """The `overrides` of a recipe of `model` in one spelling, absolute paths without their folders, which depend on the machine."""
    stated = [read_override(override) for override in overrides]
    return [f"{shown_path(keys)} = {as_toml(_without_folders(model, keys, value))}" for keys, value in stated]


def _without_folders(model: type[BaseModel], keys: Place, value: Any) -> Any:
    if isinstance(value, list):
        return [_without_folders(model, keys, entry) for entry in value]
    if isinstance(value, dict):
        return {key: _without_folders(model, (*keys, key), entry) for key, entry in value.items()}
    if not isinstance(value, str) or not Path(value).is_absolute():
        return value
    if len(keys) > 1 and keys[0] == "sweep":  # the last key is the path of the swept key
        keys = read_path(str(keys[-1])) or keys
    field = field_at(model, keys)
    return Path(value).name if field is not None and is_path(field) else value


def _read_values(
    kinds: Kinds, path: Path, kind: str | None, overrides: Sequence[str], content: bytes | None
) -> tuple[dict[str, Any], dict[str, Any], Mistakes]:
    """The unchecked values of a recipe with `overrides`, those for keys of the material file, and the mistakes in the overrides.

    Raises `InputError` if the file is not TOML, or if its kind is unknown or differs from `kind`.
    """
    values = parse_toml(read_file(path, str(path)) if content is None else content, str(path))
    wrong, of_material = Mistakes(), dict[str, Any]()
    read = [(override, setting) for override in overrides if (setting := wrong.tried(partial(read_override, override)))]
    for _, (keys, value) in read:
        if keys == ("kind",):
            values["kind"] = value
    adopt_laws(values)  # before the model is loaded, whose keys are those of the laws
    stated = values.get("kind")
    model = kinds[stated].model if isinstance(stated, str) and stated in kinds else None
    for override, (keys, value) in read:
        material = None if model is None else _material_with(model, keys)
        if material is not None:
            if unknown := unknown_key(material, keys):
                wrong.append(Problem(unknown, key=f"--set {override}"))
            of_material[shown_path(keys)] = value
        else:
            wrong.tried(partial(_override, values, override, keys, value))
    if "kind" not in values and {"equilibrium", "nonequilibrium"} <= values.keys():
        raise InputError(f"a material file; a recipe names it: material = {shown(path.name)}", file=path)
    if stated not in tuple(kinds):
        needed = f"{shown(stated)}: {nearest(stated, kinds)}" if "kind" in values else f"is needed: one of {', '.join(kinds)}"
        raise InputError(*wrong, Problem(needed, file=path, key="kind"))
    if kind is not None and stated != kind:
        other = f'the recipe is for "{stated}": run it with "dielast {stated}"'
        raise InputError(*wrong, Problem(other, file=path, key="kind"))
    return values, of_material, wrong


def _override(values: dict[str, Any], override: str, keys: Sequence[str], value: Any) -> None:
    with located(key=f"--set {override}"):
        set_key(values, keys, value)


def _material_with(model: type[RecipeBase], path: Place) -> type[BaseModel] | None:
    """The model of the material file if a path leads to a key of this file, and not of the recipe; else None."""
    material = model.material_model()
    if material is None or path[0] not in material.model_fields or path[0] == NOT_CHANGED or field_at(model, path) is not None:
        return None
    return material if field_at(model, path[:1]) is None or field_at(material, path) is not None else None


def _set(
    kinds: Kinds, values: dict[str, Any], setting: Mapping[str, Any], model: type[RecipeBase], source: str, folder: Path
) -> tuple[list[Mistake], list[Place]]:
    """Put the steps of a load file and the `setting` of a case into the recipe; returns mistakes, and places that stay empty."""
    mistakes: list[Mistake] = []
    empty: list[Place] = []
    # the steps of a load file come first: other keys may set keys within them
    if "load" in setting:
        values["load"] = setting["load"]
    try:
        _take_load(kinds, values, model, source, folder)
    except InputError as error:
        mistakes += [(("load",), problem) for problem in error.problems]
        empty += [("load",)] if isinstance(values.get("step"), list) else [("load",), ("step",)]
    for key, value in setting.items():
        path = keys_of(key)
        try:
            with located(file=source, key=f"sweep.{quoted(key)}"):
                if path == ("step",) and "load" in values:
                    raise InputError('the steps are in a load file: sweep load, or "step.0.rate"')
                # a copy, as another key may set a key within the value for this case alone
                set_key(values, path, copy.deepcopy(value))
        except InputError as error:
            mistakes += [(("sweep", key), problem) for problem in error.problems]
            empty.append(path)
    return mistakes, empty


def _from_sweep(place: Place, setting: Mapping[str, Any], values: Mapping[str, Any]) -> str:
    """The end of a message about the value at `place`: the swept key that set the value, empty if none did."""
    inner: Any = values
    for key in place:
        known = key in inner if isinstance(inner, dict) else isinstance(inner, list) and isinstance(key, int) and key < len(inner)
        inner = inner[key] if known else None
    for key in setting:
        path = keys_of(key)
        # a swept value sets all that it contains, and the tables on its path that the recipe lacks
        if on_the_way(place, path) and (len(place) >= len(path) or inner is None):
            return f" (from sweep.{quoted(key)})"
    return ""


def _combinations(sweep: dict[str, Any], source: str) -> tuple[list[dict[str, Any]], list[Mistake]]:
    """The settings of every case: all combinations of the listed values; with mode = "zip" the first value of each list, and so on.

    Also returns the mistakes in the sweep; the settings leave the mistaken keys out.
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
        path = shown_path(keys_of(key))  # step[0].rate is step.0.rate
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
        counts = ", ".join(map(str, lengths))
        refuse(f'mode = "zip" needs lists of equal length; these have {counts} values')
    count = min(lengths) if paired else math.prod(lengths)
    if count > MOST_CASES:
        refuse(f"{count} cases: at most {MOST_CASES} are allowed")
    rows = zip(*lists.values(), strict=False) if paired else itertools.product(*lists.values())
    first = itertools.islice(rows, count if count <= MOST_CASES else 1)
    return [dict(zip(lists, row, strict=True)) for row in first], mistakes


def _not_swept(key: str, values: Any) -> str | None:
    """The mistake in a key of a sweep, or None."""
    path = read_path(key)
    if path is None:
        return 'the path of a key is needed, such as "step.0.rate"'
    if path[0] == "sweep":
        return "a sweep cannot be swept"
    if path[0] in NOT_SWEPT:
        return f"{path[0]} holds for all cases together and cannot be swept"
    if isinstance(values, dict) and values:
        while isinstance(values, dict) and values:
            inner, values = next(iter(values.items()))
            path = (*path, inner)
        return f"a list of values is needed; write the path in quotes: {quoted(shown_path(path))}"
    return None if isinstance(values, list) and values else "a list of values is needed"


def _take_load(kinds: Kinds, values: dict[str, Any], model: type[RecipeBase], source: str, folder: Path) -> None:
    """Put the steps of the load file, if the recipe names one, into the recipe; raises `InputError`."""
    if "load" not in values or "load" not in model.model_fields:
        return
    name = values["load"]
    if not isinstance(name, str) or not name:
        raise InputError("the path of a file is needed", file=source, key="load")
    if isinstance(values.get("step"), dict):  # made by --set step.0...
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
        wrong.append(Problem("a load file must hold [[step]] and no other key", file=name))
    if isinstance(steps, list):
        # checked by itself first, so that the message names the load file
        wrong += _mistakes_in_load(kinds, model, {"step": steps}, name, path.parent)
    wrong.refuse()
    values["step"] = [_with_paths_from(step, path.parent, folder) for step in history["step"]]


def _mistakes_in_load(kinds: Kinds, model: type[RecipeBase], history: dict[str, Any], source: str, folder: Path) -> list[Problem]:
    """The mistakes in the steps of a load file for recipes of `model`."""
    steps: Any = model.model_fields["step"].rebuild_annotation()
    checked = examine(create_model("LoadFile", __base__=Section, step=(steps, ...)), history, source, folder, kinds)
    return in_order(checked, history) if isinstance(checked, list) else []


def check_load(kinds: Kinds, path: Path) -> None:
    """Check a load file by itself; raises `InputError` with the mistakes for the kind of recipe that it fits best."""
    history = parse_toml(read_file(path, str(path)), str(path))
    models = [kind.model for kind in kinds.values()]
    wrong = [_mistakes_in_load(kinds, model, history, str(path), path.parent) for model in models if "load" in model.model_fields]
    if all(wrong):
        raise InputError(*min(wrong, key=len))


def _with_paths_from(step: dict[str, Any], home: Path, folder: Path) -> dict[str, Any]:
    """A step of a load file in `home`, its table's path made relative to the recipe's `folder`."""
    if "table" not in step or home == folder:
        return step
    return {**step, "table": os.path.relpath(home / step["table"], folder)}
