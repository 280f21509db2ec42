"""What `dielast validate` reads for `measure`."""

from collections.abc import Iterator, Sequence

from dielast.commands.measure.recipe import MeasureRecipe
from dielast.commands.measure.run import Prepared
from dielast.io.files import Inputs
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[MeasureRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The reference, and the times: a photograph of the series that cannot be read does not stop a run."""
    recipe = cases[0].recipe
    yield "", recipe, lambda: Prepared(recipe, inputs)
