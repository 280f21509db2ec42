"""A material as a card for a finite-element code."""

from __future__ import annotations

from functools import partial

from dielast.errors import InputError, Mistakes, nearest, shown
from dielast.export import abaqus, ansys, comsol, febio, mfront
from dielast.export.code import Code
from dielast.export.options import CardOptions
from dielast.export.prepare import prepare
from dielast.material.law import Registry
from dielast.material.material import Material

CODES: Registry[Code] = Registry("finite-element code", abaqus.CODE, ansys.CODE, febio.CODE, comsol.CODE, mfront.CODE)


def spring_names() -> tuple[str, ...]:
    """The springs that some code has."""
    return tuple(sorted({name for code in CODES for name in code.springs}))


def export_card(material: Material, form: str, options: CardOptions | None = None) -> dict[str, str]:
    """The material as text files (name -> ASCII text) for the finite-element code `form`, one of `CODES`.

    Every card states its conventions and what it leaves out. Raises `InputError` with the option to change where the code cannot
    represent the material and the options do not allow a replacement.
    """
    if form not in CODES:
        raise InputError(f"{shown(form)}: {nearest(form, CODES.names)}", argument="formats")
    options = options or CardOptions()
    known = spring_names()
    if options.hyperelastic is not None and options.hyperelastic not in known:
        raise InputError(f"{shown(options.hyperelastic)}: {nearest(options.hyperelastic, known)}", argument="hyperelastic")
    code = CODES[form]
    return code.write(prepare(material, code, options))


def export_cards(material: Material, formats: tuple[str, ...], options: CardOptions | None = None) -> dict[str, str]:
    """The files of several codes; raises `InputError` with a line for every code that cannot carry the material."""
    files: dict[str, str] = {}
    wrong = Mistakes()
    for form in formats:
        files |= wrong.tried(partial(export_card, material, form, options)) or {}
    wrong.refuse()
    return files
