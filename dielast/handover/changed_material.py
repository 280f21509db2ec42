"""A material file with keys that a recipe changes, by a sweep or on the command line."""

import copy
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from dielast.base.errors import InputError, Problem, shown
from dielast.base.registry import adopt_laws
from dielast.handover.law_section import LawSection
from dielast.handover.material_file import MaterialFile, material_file, read_values
from dielast.material.material import Material
from dielast.recipe.paths import read_path, set_key
from dielast.recipe.validate import Place, check, examine, in_order, on_the_way

Origin = Callable[[str], str]
"""key path -> what changes it, for messages: a key of the sweep or --set."""


def parse_changed_material(content: bytes, source: str, changes: Mapping[str, Any], origin: Origin) -> Material:
    """The material in the bytes of a material file, with `changes`: values by key path.

    A spring with a new law keeps its modulus; its other constants come from the changes only. Any other new law keeps the constants
    that it shares with the law in the file. Raises `InputError` for mistakes in the file and, with the `origin`, in the changes.
    """
    values = read_values(content, source)
    plain = check(material_file(), values, source, Path())
    if not changes:
        return plain.material()
    values, paths = copy.deepcopy(values), {key: read_path(key) or (key,) for key in changes}
    problems: list[Problem] = []

    def tried(key: str, change: Callable[[], None]) -> None:
        try:
            change()
        except InputError as error:
            problems.extend(Problem(f"{problem.text} (from {origin(key)})", key=key) for problem in error.problems)

    # laws first: they decide which constants a table takes
    for key, path in paths.items():
        if path[-1] == "law" and isinstance(values.get(path[0]), dict):
            tried(key, partial(_restate, values, plain, path[0], str(changes[key]), list(paths.values())))
    for key, path in paths.items():
        tried(key, partial(set_key, values, path, copy.deepcopy(changes[key])))
    if not problems:
        adopt_laws(values)
        checked = examine(material_file(), values, source, Path())
        if not isinstance(checked, list):
            return checked.material()
        problems = in_order([(place, _from(place, problem, paths, origin)) for place, problem in checked], values)
    raise InputError(*problems)


def _restate(values: dict[str, Any], plain: MaterialFile, section: str, law: str, paths: list[Place]) -> None:
    """Prepare a table for a new law, some of whose constants are at `paths` of changes."""
    stated = getattr(plain, section, None)
    if not isinstance(stated, LawSection) or law not in stated.FAMILY or stated.law_stated() == law:
        return
    changed = {str(path[1]) for path in paths if len(path) > 1 and path[0] == section}
    constants = stated.FAMILY[law].constants
    optional = [constant.file_key for constant in constants if constant.left_out is not None]
    if optional and not any(constant.is_needed for constant in constants) and not changed & set(optional):
        needed = f"law {shown(law)} needs {' or '.join(optional)}, which the material file does not state"
        raise InputError(f"{needed}: state one of them, even if it is 0")
    values[section] = stated.restated(values[section], law, changed)


def _from(place: Place, problem: Problem, paths: Mapping[str, Place], origin: Origin) -> Problem:
    """The problem, with the changes that may have caused it."""
    near = [key for key, path in paths.items() if on_the_way(place, path)] or list(paths)
    return Problem(f"{problem.text} (from {' and '.join(map(origin, near))})", key=problem.key)
