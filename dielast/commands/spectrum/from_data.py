"""The recipe of `spectrum` for a test at one temperature, a card with a Prony series, or a folder of `mastercurve`."""

import os

from dielast.base.errors import InputError, without_warnings
from dielast.handover.export.code import SCALES, UNITS
from dielast.handover.prony_card import read_prony
from dielast.io.files import resolve
from dielast.readings.seen import Given
from dielast.readings.stated import state_data
from dielast.recipe.lines import FILL, RecipeLines


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe; raises `InputError` for files that are none of these."""
    name = given.names[0]
    if len(given.names) == 1 and os.path.isdir(resolve(given.inputs.folder, name)):
        recipe = RecipeLines(kind, "Master curve -> discrete relaxation spectrum and material file.")
        recipe.key("mastercurve", name, "a folder that dielast mastercurve wrote")
    elif (card := _card(given)) is not None:
        return card
    else:
        recipe = RecipeLines(kind, "A test at one temperature, or a curve from elsewhere -> spectrum and material file.")
        state_data(recipe, given, one=True)
    recipe.section("[fit]")
    recipe.option("branches = 30", "default: 30, or 5 a decade if these are more")
    recipe.option('equilibrium_modulus = "0.078 MPa"', "Young's, if known; default: from the long-time end of the curve")
    recipe.section("[material]", "constants that no relaxation test gives: see recipes/guide/what-to-state.md")
    recipe.key("name", "unnamed", "of the material")
    return recipe


def _card(given: Given) -> RecipeLines | None:
    """The recipe for a Prony series; None if the file holds none."""
    name = given.names[0]
    if len(given.names) > 1:
        return None
    content = given.inputs.read(name)
    try:
        with without_warnings():
            card = read_prony(content, name, "SI", "degC")
    except InputError:
        return None
    recipe = RecipeLines("spectrum", "A Prony series from elsewhere -> material file.")
    recipe.key("prony", name, f"{len(card.g)} branches")
    if card.modulus is not None or _has_keywords(content):
        recipe.key("prony_units", FILL, f"a card does not state its units: {' | '.join(UNITS)}")
    if card.shift is not None:
        recipe.key("prony_temperature_scale", FILL, f"of the temperatures of its shift law: {' | '.join(SCALES)}")
    if card.modulus is None:
        recipe.section("[fit]")
        recipe.key("glassy_modulus", FILL, "Young's, instantaneous, which the card lacks; or equilibrium_modulus")
    recipe.section("[material]")
    recipe.key("name", card.name)
    return recipe


def _has_keywords(content: bytes) -> bool:
    return b"VISCOELASTIC" in content.upper() or b"TB," in content.upper().replace(b" ", b"")
