"""What `dielast validate` reads for `spectrum`."""

from collections.abc import Iterator, Sequence

from dielast.commands.spectrum.cards import card_of
from dielast.commands.spectrum.recipe import SpectrumRecipe
from dielast.commands.spectrum.run import characterise, curve_of
from dielast.handover.mastercurve_folder import ReducedCurve, read_curve_draws
from dielast.io.files import Inputs
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[SpectrumRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The master curve or the test, and its fit: without the fit it is not known what a card or fewer branches can hold."""
    recipe = cases[0].recipe
    if recipe.prony is not None:
        yield "prony", recipe, lambda: card_of(recipe, inputs)
        return
    folder = recipe.mastercurve
    curves: list[ReducedCurve] = []

    def read() -> None:
        curves.append(curve_of(recipe, inputs))
        if folder is not None:
            read_curve_draws(folder, curves[0], inputs)

    yield "data.file" if folder is None else "mastercurve", folder or recipe.data, read
    if curves:
        yield "", recipe, lambda: characterise(recipe, curves[0])
