"""What `dielast validate` reads for `mastercurve`."""

from collections.abc import Iterator, Sequence

from dielast.commands.mastercurve.recipe import MasterCurveRecipe
from dielast.io.files import Inputs
from dielast.readings.read import read_all
from dielast.recipe.base import Reading
from dielast.recipe.cases import Case


def readings(cases: Sequence[Case[MasterCurveRecipe]], inputs: Inputs) -> Iterator[Reading]:
    """The measurements."""
    data = cases[0].recipe.data
    yield "data.file" if data.file else "data.files", data, lambda: read_all(data, inputs)
