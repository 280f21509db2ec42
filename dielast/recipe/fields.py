"""The field types that recipe and material models are made of: quantities with units, and paths of inputs."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainValidator, ValidationInfo, WithJsonSchema

from dielast import units
from dielast.errors import InputError
from dielast.files import resolve


class Section(BaseModel):
    """Base of every table of a recipe: unknown keys are errors, nothing is converted behind the user's back."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


def quantity(dimension: units.Dimension, *, at_least: float | None = None, above: float | None = None) -> Any:
    """A number in `dimension.unit`, given as text with a unit; optionally bounded."""

    def read(value: Any) -> float:
        number = units.parse(value, dimension)
        if above is not None and number <= above:
            raise InputError(f'"{value}": {dimension.name} above {above:g} {dimension.unit} is needed')
        if at_least is not None and number < at_least:
            raise InputError(f'"{value}": {dimension.name} of at least {at_least:g} {dimension.unit} is needed')
        return number

    description = f'{dimension.name[0].upper()}{dimension.name[1:]} with its unit, such as "{dimension.example}".'
    schema = {"type": "string", "description": description, "examples": [dimension.example]}
    return Annotated[float, BeforeValidator(read), WithJsonSchema(schema)]


Time = quantity(units.TIME, at_least=0.0)
PositiveTime = quantity(units.TIME, above=0.0)
Temperature = quantity(units.TEMPERATURE, above=-units.ZERO_CELSIUS)
TemperatureDifference = quantity(units.TEMPERATURE_DIFFERENCE, above=0.0)
ThermalExpansion = quantity(units.THERMAL_EXPANSION)
Modulus = quantity(units.STRESS, at_least=0.0)
PositiveModulus = quantity(units.STRESS, above=0.0)
Permittivity = quantity(units.PERMITTIVITY, above=0.0)
MolarEnergy = quantity(units.MOLAR_ENERGY)


def quantities(dimension: units.Dimension, *, above: float) -> Any:
    """One quantity or a list of them, as a tuple of numbers in `dimension.unit`."""

    def read(value: Any) -> tuple[float, ...]:
        numbers = tuple(units.parse(entry, dimension) for entry in (value if isinstance(value, list) else [value]))
        if not numbers or min(numbers) <= above:
            raise InputError(f"{dimension.name} above {above:g} {dimension.unit} is needed, or a list of them")
        return numbers

    one = {"type": "string", "examples": [dimension.example]}
    return Annotated[
        tuple[float, ...], PlainValidator(read), WithJsonSchema({"anyOf": [one, {"type": "array", "items": one, "minItems": 1}]})
    ]


BreakdownFields = quantities(units.FIELD, above=0.0)


def _existing(name: Any, info: ValidationInfo, kind: str, test: Callable[[Path], bool]) -> str:
    if not isinstance(name, str) or not name:
        raise InputError(f"the path of a {kind} is needed")
    folder = (info.context or {}).get("folder")
    if folder is not None:
        path = resolve(folder, name)
        if not path.exists():
            raise InputError(f'"{name}": no such {kind}')
        if not test(path):
            raise InputError(f'"{name}": a {kind} is needed')
    return name


def _file(name: Any, info: ValidationInfo) -> str:
    return _existing(name, info, "file", Path.is_file)


def _folder(name: Any, info: ValidationInfo) -> str:
    return _existing(name, info, "folder", Path.is_dir)


def _files(names: Any, info: ValidationInfo) -> tuple[str, ...]:
    """The files of a list as they stand, or those that a glob pattern matches, sorted by name."""
    if isinstance(names, list) and names:
        return tuple(_file(name, info) for name in names)
    if not isinstance(names, str) or not names:
        raise InputError("a list of files or a glob pattern is needed")
    folder = (info.context or {}).get("folder")
    if folder is None:
        return (names,)
    base = Path(names).anchor
    try:
        found = sorted(str(path) for path in (Path(base) if base else folder).glob(names.removeprefix(base)) if path.is_file())
    except (ValueError, NotImplementedError) as error:
        raise InputError(f'"{names}": not a glob pattern: {error}') from None
    if not found:
        raise InputError(f'"{names}": no file matches')
    return tuple(found if base else (os.path.relpath(path, folder) for path in found))


def _column(name: Any) -> str | int:
    if isinstance(name, bool) or (not (isinstance(name, str) and name) and not (isinstance(name, int) and name >= 1)):
        raise InputError(f"{name}: a column's name, or its number from 1, is needed")
    return name


_PATH = {"type": "string", "description": "Path relative to the recipe, or example:NAME for a file that ships with dielast."}
InputFile = Annotated[str, PlainValidator(_file), WithJsonSchema(_PATH)]
InputFolder = Annotated[str, PlainValidator(_folder), WithJsonSchema(_PATH)]
InputFiles = Annotated[
    tuple[str, ...], PlainValidator(_files), WithJsonSchema({"anyOf": [{"type": "array", "items": _PATH}, {"type": "string"}]})
]
ColumnName = Annotated[
    str | int,
    PlainValidator(_column),
    WithJsonSchema(
        {"type": ["string", "integer"], "description": "A column's header, its name without the unit, or its number from 1."}
    ),
]
