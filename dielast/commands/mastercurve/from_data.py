"""The recipe of `mastercurve` for given files."""

import numpy as np

from dielast.base.errors import InputError, without_warnings
from dielast.commands.mastercurve.recipe import MasterCurveRecipe
from dielast.io.toml import parse_toml
from dielast.material.measurement import Measurement
from dielast.readings.read import read_all
from dielast.readings.seen import Given
from dielast.readings.stated import state_data
from dielast.recipe.lines import FILL, RecipeLines


def from_data(kind: str, given: Given) -> RecipeLines:
    """The recipe; raises `InputError` for files that are no tests at several temperatures."""
    recipe = RecipeLines(kind, "Tests at several temperatures -> master curve and shift factors.")
    levels = state_data(recipe, given, one=False)
    recipe.option('temperature_stderr = "0.3 K"', "of each temperature: enters all standard errors and draws")
    recipe.section("[shift]")
    reference, why = _reference(recipe, given, levels)
    recipe.key("reference_temperature", reference, why)
    recipe.key("law", "wlf", "wlf | vft | arrhenius | table")
    recipe.key("vertical", "none", "none | density-temperature | free")
    return recipe


def _reference(recipe: RecipeLines, given: Given, levels: list[float] | None) -> tuple[str, str]:
    """A reference temperature and a comment: where the measured curve is steepest, its shift is determined best."""
    if not levels:
        return FILL, "measured or not"
    chosen, why = levels[len(levels) // 2], "in the middle of those measured"
    if not recipe.missing:
        try:
            with without_warnings():
                data = MasterCurveRecipe.model_fields["data"].annotation
                assert data is not None
                stated = parse_toml(str(recipe).encode(), "recipe")["data"]
                curves = read_all(data.model_validate(stated, context={"folder": given.inputs.folder}), given.inputs).measurements
            chosen, why = max(curves, key=_steepness).temperature, "where the measured curves are steepest"
        except InputError:
            pass  # what is wrong with the data is reported when the recipe is checked
    return f"{chosen:g} degC", f"{why}; any other will do"


def _steepness(curve: Measurement) -> float:
    """The slope of a curve in decades of its first ordinate per decade of time or frequency."""
    abscissa, ordinate = np.asarray(curve.columns)[:2]
    kept = (abscissa > 0) & (ordinate > 0)
    if np.count_nonzero(kept) < 2 or np.ptp(abscissa[kept]) == 0:
        return 0.0
    return abs(float(np.polyfit(np.log10(abscissa[kept]), np.log10(ordinate[kept]), 1)[0]))
