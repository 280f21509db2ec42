"""`lifetime`: measured failures -> the breakdown field or the damage of a material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.base.errors import reached_by
from dielast.calibration.failures.likelihood import Seen
from dielast.commands.lifetime.recipe import LifetimeRecipe
from dielast.commands.lifetime.table import read_specimens
from dielast.handover.material_draws import draw_columns, read_draws_beside
from dielast.handover.material_file import parse_material, write_material
from dielast.io.files import Inputs
from dielast.io.table import Column, Table, joined
from dielast.material.checks import warn_of_material
from dielast.material.material import Material, paths_of
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution

if TYPE_CHECKING:
    from dielast.calibration.failures.fits import FailureFit
    from dielast.calibration.failures.specimens import Simulated, Specimens
    from dielast.commands.lifetime.ranking import Ranked

DRAWS = "draws.csv"


def run(cases: Sequence[Case[LifetimeRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Simulate the specimens, fit the laws, report."""
    # `prepared` needs none of these
    from dielast.commands.lifetime.lives import lines_of, lives_under, planned
    from dielast.commands.lifetime.ranking import chosen_of, simulated_and_ranked, warn_of_fit

    recipe = cases[0].recipe
    material, specimens = prepared(cases, inputs)
    tested, ranks = simulated_and_ranked(recipe, material, specimens)
    best = chosen_of(recipe, ranks).fitted[0]
    for rank in ranks:
        warn_of_fit(rank, specimens)
    fitted = [rank.fitted[0] for rank in ranks]
    lines = lines_of(recipe, material, tested)
    lives = lives_under(recipe, material, tested, fitted)
    tables: dict[str, Table] = {
        "parameters.csv": joined([law.columns() for law in fitted]),
        "specimens.csv": specimen_columns(tested, fitted),
        "life.csv": [*lives.columns(), *lines.of_lives(lives)],
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

        return plot_failures(tested, fitted, lives, recipe.title, lines.drawn("inverse-power", lives))

    return RunReport(tables, sections, figure, files)


def with_origin(material: Material, fitted: FailureFit, file: str) -> Material:
    """The material, which says of its constants of failure whether they are fitted, and to which file."""
    law = "damage" if fitted.law.is_damage else "breakdown"
    origin = {path: text for path, text in material.origin.items() if path.partition(".")[0] not in ("breakdown", "damage")}
    origin |= {path: "stated" for path in paths_of(material) if path.startswith(f"{law}.")}
    for parameter in fitted.law.parameters:
        if parameter.name.startswith(f"{law}.") and not fitted.fit.fixed[parameter.coordinate]:
            origin[parameter.name.partition("[")[0]] = f"fitted: {file}"
    return replace(material, origin=origin)


def prepared(cases: Sequence[Case[LifetimeRecipe]], inputs: Inputs) -> tuple[Material, Specimens]:
    """The material, and the specimens."""
    recipe = cases[0].recipe
    with reached_by("material"):
        material = parse_material(inputs.read(recipe.material), recipe.material)
    warn_of_material(material)
    with reached_by("data.file"):
        return material, read_specimens(recipe, material, inputs)


def specimen_columns(tested: Simulated, fitted: Sequence[FailureFit]) -> Table:
    """A row for each specimen: its state at its end, and its rank among the failures of its kind."""
    specimens, n = tested.specimens, len(tested.specimens)
    field, stretch = tested.state
    rank, exposure = np.full(n, np.nan), np.full(n, np.nan)
    for law in fitted:
        rows = law.law.rows
        ranks = law.ranks()
        rank[rows] = np.where(np.isfinite(ranks), ranks, rank[rows])
        mine = np.array([not law.mode or specimens.mode[row] in (law.mode, "") for row in rows])
        exposure[rows] = np.where(mine, np.exp(law.plain_standing()), exposure[rows])
    return [
        Column("specimen", None, list(specimens.name)),
        Column("voltage", "V", tested.voltage),
        Column("prestretch_1", "1", specimens.prestretch[:, 0]),
        Column("prestretch_2", "1", specimens.prestretch[:, 1]),
        Column("time", "s", tested.end),
        Column("suspended", None, ["yes" if seen == Seen.SUSPENDED else "no" for seen in tested.seen]),
        Column("true_field", "V/m", field),
        Column("stretch", "1", stretch),
        Column("exposure", "1", exposure),
        Column("rank", None, rank),
        *([Column("batch", None, list(specimens.batch))] if any(specimens.batch) else []),
        *([Column("mode", None, list(specimens.mode))] if any(specimens.mode) else []),
    ]


def law_columns(ranks: Sequence[Ranked]) -> Table:
    """A row for each law and kind of failure, the best first."""
    rows = [
        (rank.mode, law.name, law.law.options.scatter, law.law.rows.size, law.fit.free.size, law.fit.value, law.fit.aic, score)
        for rank in ranks
        for law, score in zip(rank.fitted, rank.scores, strict=True)
    ]
    mode, name, scatter, count, free, value, aic, score = zip(*rows, strict=True)
    return [
        *([Column("mode", None, list(mode))] if any(mode) else []),
        Column("law", None, list(name)),
        Column("scatter", None, list(scatter)),
        Column("specimens", None, np.array(count)),
        Column("parameters", None, np.array(free)),
        Column("log_likelihood", "1", np.array(value)),
        Column("aic", "1", np.array(aic)),
        Column("left_out_log_likelihood", "1", np.array(score)),
    ]


def headline(tested: Simulated, best: FailureFit) -> dict[str, dict[str, Any]]:
    """The numbers of specimens, and the fitted law."""
    table = {column.name: list(column.values[:]) for column in best.columns()}
    options = best.law.options
    references = {
        "reference_area_m2": options.reference_area,
        "reference_humidity": options.reference_humidity if "humidity_exponent" in table["parameter"] else None,
    }
    return {
        "lifetime": {
            "specimens": len(tested.specimens),
            "failed": int(np.count_nonzero(tested.seen != Seen.SUSPENDED)),
            "law": best.name,
            "log_likelihood": best.fit.value,
            **{name: value for name, value in references.items() if value is not None},
        },
        "parameters": {
            name.replace(".", "_").replace("[", "_").replace("]", ""): float(value)
            for name, value in zip(table["parameter"], table["value"], strict=True)
        },
    }
