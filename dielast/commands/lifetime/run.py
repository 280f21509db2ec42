"""`lifetime`: measured failures -> the breakdown field or the damage of a material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.commands.lifetime.films import lives_under, planned
from dielast.commands.lifetime.lines import lines_of
from dielast.commands.lifetime.ranking import chosen_of, simulated_and_ranked, warn_of_fit
from dielast.commands.lifetime.recipe import LifetimeRecipe
from dielast.commands.lifetime.table import read_specimens
from dielast.commands.lifetime.tables import headline, joined, law_columns, specimen_columns
from dielast.failures.fits import FittedLaw
from dielast.handover.material_draws import draw_columns, read_draws_beside
from dielast.handover.material_file import parse_material, write_material
from dielast.io.files import Inputs
from dielast.io.table import Table
from dielast.material.checks import warn_of_material
from dielast.material.material import Material, paths_of
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution

DRAWS = "draws.csv"


def run(cases: Sequence[Case[LifetimeRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Simulate the specimens, fit the laws, report."""
    recipe = cases[0].recipe
    material = parse_material(inputs.read(recipe.material), recipe.material)
    warn_of_material(material)
    specimens = read_specimens(recipe, material, inputs)
    tested, ranks = simulated_and_ranked(recipe, material, specimens)
    best = chosen_of(recipe, ranks).fitted[0]
    for rank in ranks:
        warn_of_fit(rank, specimens)
    fitted = [rank.fitted[0] for rank in ranks]
    lines = lines_of(recipe, tested)
    usual = material.reference_temperature if recipe.temperature is None else recipe.temperature
    lives = lives_under(recipe, material, tested, fitted)
    tables: dict[str, Table] = {
        "parameters.csv": joined([law.columns() for law in fitted]),
        "specimens.csv": specimen_columns(tested, fitted),
        "life.csv": [*lives.columns(), *lines.of_lives(lives, recipe.film.thickness, usual)],
        "laws.csv": law_columns(ranks),
        "lines.csv": lines.columns(),
    }
    sections = headline(tested, best)
    if recipe.plan is not None:
        tables["plan.csv"] = planned(recipe.plan, recipe, material, tested, best).columns()
    made = with_origin(best.material(material), best, recipe.data.file)
    count = recipe.uncertainty.draws if best.fit.free.size else 0
    if count:
        members = read_draws_beside(inputs, recipe.material, material) or (material,)
        drawn = tuple(best.law.material(members[k % len(members)], best.draws[k]) for k in range(count))
        tables[DRAWS] = draw_columns(np.arange(count), drawn)
    files = {"material.toml": write_material(made, DRAWS if count else None)}

    def figure() -> Any:
        from dielast.plots.failures import plot_failures

        line = lines.lives("inverse-power", lives, recipe.film.thickness, usual, 0.5)[0]
        return plot_failures(tested, fitted, lives, recipe.title, line)

    return RunReport(tables, sections, figure, files)


def with_origin(material: Material, fitted: FittedLaw, file: str) -> Material:
    """The material, which says of its constants of failure whether they are fitted, and to which file."""
    law = "damage" if fitted.law.is_damage else "breakdown"
    origin = {path: text for path, text in material.origin.items() if path.partition(".")[0] not in ("breakdown", "damage")}
    origin |= {path: "stated" for path in paths_of(material) if path.startswith(f"{law}.")}
    for parameter in fitted.law.parameters:
        if parameter.name.startswith(f"{law}.") and not fitted.fit.fixed[parameter.coordinate]:
            origin[parameter.name.partition("[")[0]] = f"fitted: {file}"
    return replace(material, origin=origin)
