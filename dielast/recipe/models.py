"""The recipe model of each kind, built only when a recipe of that kind is met."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dielast.recipe.base import RecipeBase

_MODELS = {
    "mastercurve": ("mastercurve", "MasterCurveRecipe"),
    "spectrum": ("spectrum", "SpectrumRecipe"),
    "relax": ("simulation", "RelaxRecipe"),
    "creep": ("simulation", "CreepRecipe"),
    "actuate": ("voltage", "ActuateRecipe"),
    "failure-map": ("voltage", "FailureMapRecipe"),
}
KINDS = tuple(_MODELS)
"""Every kind of recipe, in the order of a workflow."""


def recipe_model(kind: str) -> type[RecipeBase]:
    """The model of recipes of `kind`; raises `KeyError` for an unknown one."""
    module, name = _MODELS[kind]
    model: type[RecipeBase] = getattr(import_module(f"dielast.recipe.{module}"), name)
    return model
