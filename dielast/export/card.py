"""A material as a card for a finite-element code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

from dielast.errors import InputError, Mistakes, shown
from dielast.export import abaqus, ansys, comsol, febio, mfront
from dielast.export.conventions import CardOptions
from dielast.material.material import Material

WRITERS: Mapping[str, Callable[[Material, CardOptions], dict[str, str]]] = MappingProxyType(
    {"abaqus": abaqus.write, "ansys": ansys.write, "febio": febio.write, "comsol": comsol.write, "mfront": mfront.write}
)
FORMATS = tuple(WRITERS)


def export_card(material: Material, form: str, options: CardOptions | None = None) -> dict[str, str]:
    """The material as text files (name -> ASCII text) for the finite-element code `form`: one of `FORMATS`.

    Every card states its conventions and what it leaves out. Raises `InputError` with the option to change
    for what the code cannot carry and the options do not allow to be replaced.
    """
    if form not in WRITERS:
        raise InputError(f"{shown(form)}: one of {', '.join(FORMATS)} is needed", argument="formats")
    return WRITERS[form](material, options or CardOptions())


def export_cards(material: Material, formats: tuple[str, ...], options: CardOptions | None = None) -> dict[str, str]:
    """The files of several codes; raises `InputError` with a line for every code that cannot carry the material."""
    files: dict[str, str] = {}
    wrong = Mistakes()
    for form in formats:
        files |= wrong.tried(partial(export_card, material, form, options)) or {}
    wrong.refuse()
    return files
