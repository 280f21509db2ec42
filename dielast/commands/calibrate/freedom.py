"""`[free]` for the library: values in the unit of each constant, keys of the recipe in errors."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from dielast.base.errors import InputError, Mistakes, Problem, quoted, shown, warn
from dielast.base.units import parse
from dielast.calibration.parameters import Free, ParameterSpace, parameter_space
from dielast.commands.calibrate.recipe import FreeValue
from dielast.handover.material_draws import read_draws_beside
from dielast.io.files import Inputs
from dielast.material.material import Material, constants_of

FEWEST_DRAWS = 10  # for a standard deviation


def free_of(free: Mapping[str, FreeValue], materials: Mapping[str, Material], inputs: Inputs) -> dict[str, dict[str, Free]]:
    """The free constants of each material, by its file: those keys of `[free]` that the material has.

    A prior from draws reads the draws of the material.

    Raises `InputError` with a line for every key that no material has, and for every wrong value or bound.
    """
    wrong, found = Mistakes(), dict[str, dict[str, Free]]()
    for path, stated in free.items():
        having = {name: material for name, material in materials.items() if _has(material, path)}
        if not having:
            wrong.tried(partial(_placed, next(iter(materials.values())), {path: Free()}))
        for name, material in having.items():
            value = wrong.tried(partial(_converted, stated, path, name, material, inputs))
            if value is not None:
                found.setdefault(name, {})[path] = value
    for name, material in materials.items():
        if name in found:
            wrong.tried(partial(_placed, material, found[name]))
        elif not wrong:
            wrong.append(Problem(f"nothing of {name} is free", key="free"))
    wrong.sort(
        key=lambda problem: next((k for k, path in enumerate(free) if (problem.key or "").startswith(_key(path))), len(free))
    )
    wrong.refuse()
    for section in ("equilibrium", "nonequilibrium"):
        if any(path.startswith(f"{section}.") for path in free):
            for name, own in found.items():
                branches = section == "equilibrium" or len(materials[name].spectrum)
                if branches and not any(path.startswith(f"{section}.") for path in own):
                    keys = ", ".join(f"{section}.{key}" for key in constants_of(materials[name])[section])
                    warn(
                        f"nothing of [{section}] of {name} is free, unlike that of other materials: its constants are {keys}",
                        key="free",
                    )
    return found


def _placed(material: Material, free: Mapping[str, Free]) -> ParameterSpace:
    """The parameters; errors name the keys of the recipe."""
    try:
        return parameter_space(material, free)
    except InputError as error:
        raise error.changed(lambda problem: Problem(problem.text, key=_key(problem.key))) from None


def _key(path: str | None) -> str:
    return "free" if path is None else f"free.{quoted(path)}"


def _has(material: Material, path: str) -> bool:
    section, _, key = path.partition(".")
    return key.partition("[")[0] in constants_of(material).get(section, {})


def _converted(stated: FreeValue, path: str, name: str, material: Material, inputs: Inputs) -> Free:
    """Bounds and prior in SI."""
    if stated.prior == "draws":
        if stated.relative is not None:
            raise InputError(
                'prior = "draws" takes the standard deviation from the draws: leave relative out', key=f"{_key(path)}.relative"
            )
        members = read_draws_beside(inputs, name, material)
        if len(members) < FEWEST_DRAWS:
            few = f"{name} has {len(members)} draws, at least {FEWEST_DRAWS} are needed"
            raise InputError(f"{few}: mastercurve with [uncertainty] and spectrum make them", key=f"{_key(path)}.prior")
        stated, drawn = stated.model_copy(update={"prior": None}), members
    else:
        drawn = ()
    section, _, key = path.partition(".")
    kind = constants_of(material)[section][key.partition("[")[0]]

    def number(name: str) -> float | None:
        """The value, in SI."""
        value: Any = getattr(stated, name)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            needed = 'a number, or text with a unit such as "26 kPa", is needed'
            raise InputError(f"{shown(value)}: {needed}", key=f"{_key(path)}.{name}")
        try:
            if kind.dimension is not None:
                return parse(value, kind.dimension)
        except InputError as error:
            raise InputError(str(error), key=f"{_key(path)}.{name}") from None
        if isinstance(value, str):
            raise InputError(f"{shown(value)}: a bare number is needed", key=f"{_key(path)}.{name}")
        return float(value)

    wrong = Mistakes()
    least, most, start, prior = (wrong.tried(partial(number, name)) for name in ("min", "max", "start", "prior"))
    wrong.refuse()
    return Free(least, most, start, prior, stated.relative, drawn)
