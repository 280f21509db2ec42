"""Read what a recipe names without running it: every mistake in a file is told with the key that leads there."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from dielast.commands.mastercurve.recipe import MasterCurveRecipe
from dielast.commands.simulation.cases import check_case
from dielast.commands.spectrum.recipe import SpectrumRecipe
from dielast.errors import InputError, NumericsError
from dielast.io.files import Inputs
from dielast.recipe.base import RecipeBase
from dielast.recipe.cases import Case

if TYPE_CHECKING:
    from dielast.handover.mastercurve_folder import ReducedCurve

Read = tuple[str, Any, Callable[[], object]]
"""A recipe's key, what it says there, and how that is read; errors of what has no key begin with one."""


def mistakes(cases: Sequence[Case[Any]], inputs: Inputs) -> list[str]:
    """A line, beginning with the key, for every mistake in the files that `cases` name; each file is read once."""
    found: dict[str, None] = {}
    seen = []
    for case in cases:
        for key, stated, read in _reads(case.recipe, inputs):
            if (key, stated) in seen:
                continue
            seen.append((key, stated))
            try:
                read()
            except (InputError, NumericsError) as error:
                found.update(dict.fromkeys(f"{key}: {line}" if key else line for line in error.messages))
    for index, comparison in enumerate(getattr(cases[0].recipe, "compare", ())):
        try:
            check_case(index, comparison, len(cases))
        except InputError as error:
            found.update(dict.fromkeys(error.messages))
    return list(found)


def _reads(recipe: RecipeBase, inputs: Inputs) -> Iterator[Read]:
    if isinstance(recipe, MasterCurveRecipe):
        yield from _relaxation(recipe, inputs)
    elif isinstance(recipe, SpectrumRecipe):
        yield from _curve(recipe, inputs)
    else:
        yield from _simulation(recipe, inputs)


def _relaxation(recipe: MasterCurveRecipe, inputs: Inputs) -> Iterator[Read]:
    from dielast.readings.read import read_all

    yield ("data.file" if recipe.data.file else "data.files"), recipe.data, lambda: read_all(recipe.data, inputs)


def _curve(recipe: SpectrumRecipe, inputs: Inputs) -> Iterator[Read]:
    from dielast.commands.spectrum.run import curve_of
    from dielast.handover.mastercurve_draws import read_curve_draws

    folder = recipe.mastercurve
    curves: list[ReducedCurve] = []

    def read() -> None:
        curves.append(curve_of(recipe, inputs))
        if folder is not None:
            read_curve_draws(folder, curves[0], inputs)

    yield ("data.file" if folder is None else "mastercurve"), folder or recipe.data, read
    if curves:
        yield "", recipe, lambda: _refuse(recipe, curves[0])


def _refuse(recipe: SpectrumRecipe, curve: ReducedCurve) -> None:
    """Raise what `spectrum` would: the fit alone tells what a card, or a spectrum of fewer branches, can hold, and takes little."""
    from dielast.commands.spectrum.run import characterise

    characterise(recipe, curve)


def _simulation(recipe: Any, inputs: Inputs) -> Iterator[Read]:
    from dielast.commands.simulation.compare import read_points
    from dielast.handover.material_file import parse_material

    yield "material", recipe.material, lambda: parse_material(inputs.read(recipe.material), recipe.material)
    if recipe.uncertainty is not None:
        yield "uncertainty", (recipe.material, recipe.uncertainty), partial(_draws, recipe, inputs)
    for index, step in enumerate(getattr(recipe, "step", ())):
        if step.table is not None:
            yield f"step[{index}].table", step, partial(_follow, recipe, step, inputs)
    for index, comparison in enumerate(getattr(recipe, "compare", ())):
        specimen = getattr(recipe, "specimen", None)
        yield f"compare[{index}].file", (comparison, specimen), partial(read_points, comparison, inputs, specimen)


def _draws(recipe: Any, inputs: Inputs) -> None:
    """The draws of the material; what is wrong with the material itself is told with its own key."""
    from dielast.commands.simulation.uncertainty import sample_of
    from dielast.handover.material_file import parse_material

    try:
        material = parse_material(inputs.read(recipe.material), recipe.material)
    except InputError:
        return
    try:
        sample_of(recipe.material, material, recipe.uncertainty, inputs)
    except InputError as error:
        raise InputError(
            *(line.removeprefix("uncertainty: ").removeprefix("uncertainty.level: ") for line in error.messages)
        ) from None


def _follow(recipe: Any, step: Any, inputs: Inputs) -> object:
    """The history of one step alone."""
    alone = recipe.model_copy(update={"step": [step], "load": None})
    if recipe.kind == "actuate":
        from dielast.commands.actuate.waveform import voltage_entries

        return voltage_entries(alone, inputs)
    from dielast.commands.simulation.history import solver_steps

    return solver_steps(alone, inputs)
