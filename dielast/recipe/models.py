"""The recipe model of each kind, built only when a recipe of that kind is met."""

from __future__ import annotations

import difflib
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dielast.recipe.base import RecipeBase

_MODELS = {
    "mastercurve": ("mastercurve", "MasterCurveRecipe"),
    "spectrum": ("spectrum", "SpectrumRecipe"),
    "relax": ("simulation", "RelaxRecipe"),
    "creep": ("simulation", "CreepRecipe"),
    "actuate": ("actuate", "ActuateRecipe"),
    "failure-map": ("actuate", "FailureMapRecipe"),
}
KINDS = tuple(_MODELS)
"""Every kind of recipe, in the order of a workflow."""


def or_kind(wrong: str, others: tuple[str, ...] = ()) -> str:
    """What to write instead of a `wrong` kind of recipe, or of one of the `others` that are known there."""
    known = (*KINDS, *others)
    text = "-".join(wrong.casefold().replace("_", " ").split())
    near = difflib.get_close_matches(text, known, n=1) or [kind for kind in known if text and text in kind.split("-")]
    return f'did you mean "{near[0]}"?' if near else f"one of {', '.join(known)} is needed"


def recipe_model(kind: str) -> type[RecipeBase]:
    """The model of recipes of `kind`; raises `KeyError` for an unknown one."""
    module, name = _MODELS[kind]
    model: type[RecipeBase] = getattr(import_module(f"dielast.commands.{module}.recipe"), name)
    return model
