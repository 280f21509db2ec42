"""Texts of figures: swept quantities, names of cases, and the line with material, temperature and film."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from dielast.commands.simulation.film_recipe import FilmBase
from dielast.material.material import Material
from dielast.plots.looks import Swept
from dielast.plots.texts import FIXED, UNITS, degrees, lasting, number, prestretched, typeset, unit_for
from dielast.recipe.cases import Case

UNNAMED = "unnamed"  # default name in a material file
TIMES = " \N{MULTIPLICATION SIGN} "


def swept(cases: Sequence[Case[Any]], materials: Sequence[Material] = ()) -> list[Swept]:
    """The swept quantities, in the units of figures or else of the recipe; materials by name."""
    factors = []
    for key, name in _short(list(cases[0].settings)).items():
        values = [case.settings[key] for case in cases]
        scale = _on_a_scale(values, cases[0].on_one_scale(key, values))
        if scale is not None:
            numbers, unit = scale
            label = f"{name} [{unit}]" if unit else name
            texts = [f"{name} = {number(value, 6)} {unit}".rstrip() for value in numbers]
            if unit == "s" and not all(str(value).rstrip().endswith("s") for value in values):
                # stated in several units: take the unit of figures that suits the value
                texts = [f"{name} = {lasting(value, 6)}" for value in numbers]
            factors.append(Swept(label, tuple(numbers), tuple(texts)))
            continue
        texts = [f"{name} = {_printed(value)}" for value in values]
        if key == "material" and materials:
            names = _names(materials)
            texts = names if len(set(names)) == len(set(values)) else texts
        factors.append(Swept(name, texts=tuple(texts)))
    return factors


def labels(cases: Sequence[Case[Any]], materials: Sequence[Material]) -> list[str]:
    """The labels of the cases for a legend; a material by the part of its name that differs from the others."""
    factors = swept(cases, materials)
    return [", ".join(factor.text(case) for factor in factors) for case in range(len(cases))]


def _on_a_scale(values: Sequence[Any], scale: tuple[list[float], str] | None) -> tuple[list[float], str] | None:
    """The values as numbers in the unit of figures, with that unit; None if the key has no unit."""
    if scale is None:
        return None
    numbers, unit = scale
    if unit in UNITS:
        shown, factor = unit_for(unit, max(map(abs, numbers)))
        # without the rounding errors of a change of units
        return [float(f"{value * factor:.12g}") for value in numbers], shown
    # the texts of plain numbers share no unit, even if they share their last digit
    stated = [re.fullmatch(r"\s*([-+.\deE]+)\s*(\S.*?)\s*", value) if isinstance(value, str) else None for value in values]
    matches = [match for match in stated if match is not None]
    if len(matches) == len(values) and len(units := {match[2] for match in matches}) == 1:
        return [float(match[1]) for match in matches], typeset(units.pop())
    return numbers, "" if unit == "1" else unit


def _printed(value: Any) -> str:
    """A value of the recipe, for print."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return number(value, 6)
    if isinstance(value, list):
        numbers = all(isinstance(entry, int | float) for entry in value)
        return (TIMES if numbers and len(value) == 2 else ", ").join(map(_printed, value))
    if isinstance(value, dict):
        return ", ".join(f"{key.replace('_', ' ')} {_printed(inner)}" for key, inner in value.items())
    text = str(value)
    return typeset(Path(text).name if Path(text).is_absolute() else text)


def _short(keys: Sequence[str]) -> dict[str, str]:
    """Names of the keys in a figure: their last part, if these differ."""
    ends = [" ".join(key.split(".")[-2:]) if key.split(".")[-1].isdecimal() else key.split(".")[-1] for key in keys]
    short = zip(keys, ends, strict=True)
    return {key: (end if ends.count(end) == 1 else key.replace(".", " ")).replace("_", " ") for key, end in short}


def _names(materials: Sequence[Material]) -> list[str]:
    """The parts of the names of materials that differ."""
    parts = [material.name.split(", ") for material in materials]
    while all(len(words) > 1 and words[0] == parts[0][0] for words in parts):
        parts = [words[1:] for words in parts]
    return [", ".join(words) for words in parts]


def titled(title: str | None, cases: Sequence[Case[Any]], materials: Sequence[Material], more: str = "") -> str:
    """The title of a figure with a line below it for material, temperature and film, and `more`."""
    recipes = [case.recipe for case in cases]
    temperatures: list[float] = []
    for recipe, material in zip(recipes, materials, strict=True):
        stated = material.reference_temperature if recipe.temperature is None else recipe.temperature
        temperatures += stated if isinstance(stated, list | tuple) else [stated]
    parts = [_range(temperatures, degrees)]
    films: list[FilmBase] = [recipe.film for recipe in recipes if hasattr(recipe, "film")]
    if films:
        parts += [*_films(films), _shared([_boundary(recipe) for recipe in recipes])]
    else:
        parts.append(_shared([recipe.mode for recipe in recipes]))
        sections = [
            f"section {number(1e3 * specimen.width)}{TIMES}{number(1e3 * specimen.thickness)} mm"
            for specimen in (recipe.specimen for recipe in recipes)
            if specimen is not None and specimen.area is not None
        ]
        if len(sections) == len(recipes):
            parts.append(_shared(sections))
    return headed(title, [material.name for material in materials], *parts, more)


def headed(title: str | None, names: Sequence[str], *more: str) -> str:
    """The title with a line below it: the name of the material, if all cases share it and the title lacks it, and `more`."""
    name = _shared(names)
    parts = [part for part in (name if name != UNNAMED and name not in (title or "") else "", *more) if part]
    # a line that is too long is broken between two parts
    line = ", ".join(part.replace(" ", FIXED) for part in parts)
    return "\n".join(part for part in (title, line) if part)


def _films(films: Sequence[FilmBase]) -> list[str]:
    """Thickness, prestretch and time at the prestretch of films."""
    thickness = _range([1e3 * value for film in films for value in film.thicknesses], number)
    pairs = [pair for film in films for pair in film.prestretches]
    if all(first == second for first, second in pairs):
        prestretch = "prestretch " + _range([first for first, _ in pairs], number)
    else:
        prestretch = _shared(list(map(prestretched, pairs)))
    relaxed = _shared([f"relaxed {lasting(film.relax)}" if film.relax > 0 else "" for film in films])
    return [f"film {thickness} mm", prestretch, relaxed]


def _boundary(recipe: Any) -> str:
    """What holds the edges of the film; empty where steps change it."""
    held = recipe.held if hasattr(recipe, "held") else recipe.film.boundary
    return TIMES.join(dict.fromkeys(held)).replace("-", " ")


def _range(values: Sequence[float], spelled: Callable[[float], str]) -> str:
    low, high = spelled(min(values)), spelled(max(values))
    return low if low == high else f"{low} to {high}"


def _shared(texts: Sequence[str]) -> str:
    """The text that all share, or empty text."""
    return texts[0] if len(set(texts)) == 1 else ""
