"""`lifetime`: measured failures -> the breakdown field or the damage of a material."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dielast.commands.lifetime.recipe import LifetimeRecipe
from dielast.commands.lifetime.table import read_specimens
from dielast.errors import InputError, NumericsError, Problem, in_keys, warn, without_warnings
from dielast.failures.bounds import TestPlan, plan_test
from dielast.failures.fits import FittedLaw, Lives, bounded_law, fit_law, left_out_score, lives_of
from dielast.failures.law_names import LINES
from dielast.failures.laws import LawModel, LawOptions, law_model, line_model
from dielast.failures.likelihood import Seen
from dielast.failures.specimens import Simulated, Specimens, simulate_specimens
from dielast.handover.material_draws import draw_columns, read_draws_beside
from dielast.handover.material_file import parse_material, write_material
from dielast.io.files import Inputs
from dielast.io.table import Column, Table
from dielast.material.checks import warn_of_material
from dielast.material.material import Material
from dielast.numerics.arrays import Floats
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.execution import Execution

DRAWS = "draws.csv"
FEW, POINTS, LONGER = 25, 13, 100.0
KEYS = {"scatter": "fit.scatter", "thickness": "film.thickness", "relax": "film.relax", "boundary": "film.boundary"}


@dataclass(frozen=True, slots=True, eq=False)
class Ranked:
    """The laws fitted to one kind of failure, the best first, their scores, and why others were not fitted."""

    mode: str
    fitted: list[FittedLaw]
    scores: list[float]
    refused: dict[str, str]


def run(cases: Sequence[Case[LifetimeRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Simulate the specimens, fit the laws, report."""
    recipe = cases[0].recipe
    material = parse_material(inputs.read(recipe.material), recipe.material)
    warn_of_material(material)
    specimens = read_specimens(recipe, material, inputs)
    film = film_of(recipe)
    with in_keys(KEYS):
        tested = simulate_specimens(
            material, specimens, film=film, pull_in_timescale=recipe.pull_in.criterion, rtol=recipe.solver.rtol
        )
    ranks = [_ranked(recipe, material, tested, mode) for mode in _modes(specimens)]
    chosen = _chosen(recipe, ranks)
    best = chosen.fitted[0]
    for rank in ranks:
        _warn_of_fit(rank, specimens)
    fitted = [rank.fitted[0] for rank in ranks]
    lines, on_lines = _lines(recipe, tested)
    lives = _lives(recipe, material, tested, fitted, film)
    tables: dict[str, Table] = {
        "parameters.csv": joined([law.columns() for law in fitted]),
        "specimens.csv": specimen_columns(tested, fitted),
        "life.csv": [*lives.columns(), *on_lines(lives)],
        "laws.csv": law_columns(ranks),
        "lines.csv": lines,
    }
    sections = headline(tested, best, chosen)
    if recipe.plan is not None:
        plan = _plan(recipe, material, tested, best, film)
        tables["plan.csv"] = plan.columns()
    made = replace(best.material(material), name=material.name)
    count = recipe.uncertainty.draws if best.fit.free.size else 0
    if count:
        members = read_draws_beside(inputs, recipe.material, material) or (material,)
        drawn = tuple(best.law.material(members[k % len(members)], best.draws[k]) for k in range(count))
        tables[DRAWS] = draw_columns(np.arange(count), drawn)
    files = {"material.toml": write_material(made, DRAWS if count else None)}

    def figure() -> Any:
        from dielast.plots.failures import plot_failures

        return plot_failures(tested, fitted, lives, recipe.title)

    return Report(tables, sections, figure, files)


def film_of(recipe: LifetimeRecipe) -> dict[str, Any]:
    """What all films share, as arguments of `FilmSetup`."""
    film = recipe.film
    force, width = film.weights
    shares = film.shares
    return {
        "prestretch_rate": film.prestretch_rate,
        "relax": film.relax,
        "boundary": film.boundary,
        "electrode_share": None if shares is None else shares[0],
        **({"mesh_rtol": recipe.solver.mesh_rtol} if film.boundary[0] == "frame" else {}),
        "force": None if force == (None, None) else force,
        "width": None if width == (None, None) else width,
    }


def _modes(specimens: Specimens) -> list[str]:
    """The kinds of failure, the most frequent first; one without a name if none is stated."""
    failed = [mode for mode, seen in zip(specimens.mode, specimens.seen, strict=True) if seen != Seen.SUSPENDED]
    return sorted(dict.fromkeys(failed), key=lambda mode: -failed.count(mode)) or [""]


def _chosen(recipe: LifetimeRecipe, ranks: Sequence[Ranked]) -> Ranked:
    wanted = recipe.fit.mode
    if wanted is None:
        return ranks[0]
    for rank in ranks:
        if rank.mode == wanted:
            return rank
    raise InputError(f'no specimen failed by "{wanted}"; there are {", ".join(rank.mode for rank in ranks)}', key="fit.mode")


def _ranked(recipe: LifetimeRecipe, material: Material, tested: Simulated, mode: str) -> Ranked:
    """All laws of the recipe for one kind of failure; those of other kinds are suspended."""
    other = np.array([stated != mode for stated in tested.specimens.mode])
    tested = replace(tested, seen=np.where(other, Seen.SUSPENDED, tested.seen).astype(np.intp))
    stated, wanted = recipe.fit, recipe.uncertainty
    options = LawOptions(
        stated.scatter, stated.time, stated.prestretch, stated.reference_area, material.reference_temperature, None, stated.known
    )
    fitted, scores, refused = list[FittedLaw](), list[float](), dict[str, str]()
    several = len(stated.ranked) > 1
    for name in stated.ranked:
        try:
            law = law_model(name, tested, options)
            if not law.model.observations.failures:
                fitted.append(_bounded(law, wanted.level))
                scores.append(np.nan)
                continue
            fitted.append(fit_law(law, level=wanted.level, draws=wanted.draws, seed=wanted.seed, mode=mode))
            scores.append(left_out_score(fitted[-1]) if several else np.nan)
        except (InputError, NumericsError) as error:
            if not several:
                raise _placed(error, law=name) from None
            refused[name] = error.messages[0]
    if not fitted:
        raise InputError(*(f"law {name}: {text}" for name, text in refused.items()), key="fit.laws")
    for name, text in refused.items():
        warn(f"law {name} is not fitted: {text}")
    order = sorted(range(len(fitted)), key=lambda k: fitted[k].fit.aic)
    return Ranked(mode, [fitted[k] for k in order], [scores[k] for k in order], refused)


def _placed(error: InputError | NumericsError, law: str) -> InputError | NumericsError:
    """The error with the key of the law, where it is about no specimen."""
    return error.changed(
        lambda problem: problem if problem.file or problem.key else Problem(f"{law}: {problem.text}", key="fit.law")
    )


def _bounded(law: LawModel, level: float) -> FittedLaw:
    """The bound that survivors alone give."""
    lacking = [name for name in law.model.names[1:] if name not in law.known]
    if law.name == "table" and len(law.nodes) > 1:
        raise InputError("nothing has failed: a bound needs one entry, such as fit.prestretch = 1.9", key="fit.prestretch")
    if lacking:
        keys = {"log_scatter": "fit.shape"}
        needed = " and ".join(keys.get(name, f"fit.{name}") for name in lacking)
        raise InputError(f"nothing has failed: a lower bound needs {needed}, from other tests", key="fit")
    warn("nothing has failed: material.toml and life.csv hold lower bounds, not estimates")
    return bounded_law(law, level)


def _warn_of_fit(rank: Ranked, specimens: Specimens) -> None:
    best = rank.fitted[0]
    of = f"failures by {rank.mode}" if rank.mode else "failures"
    kind, count = best.unlike()
    if kind == "early":
        order = np.argsort(np.where(best.law.model.observations.seen == Seen.SUSPENDED, np.inf, best.standing()))
        named = ", ".join(specimens.name[best.law.rows[k]] for k in order[: min(count, 5)].tolist())
        warn(
            f"the {of} are not of one kind: {count} come too early for the others ({named}): state a column mode to fit them apart"
        )
    elif kind:
        warn(f"the {of} are not of one kind: fewer than expected up to the {count}. by exposure; a column mode fits them apart")
    lowest, highest = best.law.model.bounds
    ends = [
        parameter.name
        for parameter in best.law.parameters
        if best.fit.at[parameter.coordinate] in (lowest[parameter.coordinate], highest[parameter.coordinate])
    ]
    if ends:
        warn(f"{', '.join(ends)}: at the end of the range that is looked at: the law {best.name} does not describe these failures")
    open_ones = [
        parameter.name
        for parameter in best.law.parameters
        if not best.fit.fixed[parameter.coordinate] and str(best.interval_of(parameter.coordinate).verdict) == "undetermined"
    ]
    if open_ones:
        warn(f"{', '.join(open_ones)}: not determined by these specimens; state known values in [fit]")


def _groups(tested: Simulated) -> list[np.ndarray[Any, Any]]:
    """Specimens of one prestretch, thickness and temperature."""
    specimens = tested.specimens
    keys = [
        (*specimens.prestretch[k].tolist(), float(specimens.thickness[k]), float(specimens.temperature[k]))
        for k in range(len(specimens))
    ]
    return [np.array([k for k, key in enumerate(keys) if key == one]) for one in sorted(set(keys))]


def _lines(recipe: LifetimeRecipe, tested: Simulated) -> tuple[Table, Any]:
    """Laws of the time over the voltage without physics, for each film that failed at several voltages, and a function for further
    columns of lives.
    """
    rows: list[tuple[Any, ...]] = []
    fitted: dict[tuple[float, float, str], FittedLaw] = {}
    specimens = tested.specimens
    for members in _groups(tested):
        alive = tested.end[members] > 0
        members = members[alive & np.isfinite(specimens.voltage[members])]
        failed = members[tested.seen[members] != Seen.SUSPENDED]
        if failed.size < 3 or len(set(np.round(tested.voltage[failed], 6).tolist())) < 2:
            continue
        for name in LINES:
            law = line_model(name, tested, members, recipe.fit.scatter)
            try:
                fit = fit_law(law, level=recipe.uncertainty.level, draws=0, seed=recipe.uncertainty.seed)
            except (InputError, NumericsError):
                continue
            pair = tuple(specimens.prestretch[members[0]].tolist())
            fitted[(*pair, name)] = fit
            table = fit.columns()
            for k, parameter in enumerate(table[0].values):
                rows.append(
                    (
                        name,
                        *pair,
                        len(members),
                        failed.size,
                        str(parameter),
                        *(column.values[k] for column in table[1:6]),
                        fit.fit.value,
                    )
                )
    names = (
        "law",
        "prestretch_1",
        "prestretch_2",
        "specimens",
        "failures",
        "parameter",
        "value",
        "standard_error",
        "lower",
        "upper",
    )
    units = (None, "1", "1", None, None, None, None, None, None, None)
    parts = list(zip(*rows, strict=True)) if rows else [()] * 12
    texts = ("law", "parameter")
    table = [
        Column(
            name,
            unit,
            list(map(str, values))
            if name in texts
            else np.array(values, dtype=float if name not in ("specimens", "failures") else np.int64),
        )
        for name, unit, values in zip(names, units, parts, strict=False)
    ]
    table += [Column("verdict", None, list(map(str, parts[10]))), Column("log_likelihood", "1", np.array(parts[11], dtype=float))]

    def of_lives(lives: Lives) -> Table:
        columns = []
        for name in LINES:
            values = np.full((3, lives.voltage.size), np.nan)
            for k in range(lives.voltage.size):
                law = fitted.get((*lives.prestretch[k].tolist(), name))
                if law is not None:
                    values[:, k] = law.line_life(float(lives.voltage[k]), 0.1)
            for k, end in enumerate(("", "_lower", "_upper")):
                columns.append(Column(f"{name.replace('-', '_')}_time_b10{end}", "s", values[k]))
        return columns if fitted else []

    return table, of_lives


def _films(recipe: LifetimeRecipe, voltage: Floats, prestretch: Floats, end: float, material: Material) -> Simulated:
    """Films of the recipe under constant voltages (films,) up to a time in s."""
    n, usual = voltage.size, recipe.film.thickness
    unknown, empty = np.full(n, np.nan), ("",) * n
    at = material.reference_temperature if recipe.temperature is None else recipe.temperature
    films = Specimens(
        tuple(f"{volt:g} V" for volt in voltage),
        np.full(n, int(Seen.SUSPENDED)),
        np.full(n, end),
        voltage,
        np.full(n, np.inf),
        prestretch,
        np.full(n, usual),
        np.full(n, at),
        unknown,
        unknown,
        unknown,
        empty,
        empty,
        np.full(n, -1),
    )
    with without_warnings():
        return simulate_specimens(
            material,
            films,
            film=film_of(recipe),
            pull_in_timescale=recipe.pull_in.criterion,
            rtol=recipe.solver.rtol,
            points_per_decade=30,
        )


def _lives(
    recipe: LifetimeRecipe, material: Material, tested: Simulated, fitted: Sequence[FittedLaw], film: Mapping[str, Any]
) -> Lives:
    """The lives under the voltages of the recipe, or those of the tests."""
    axis, specimens = recipe.life, tested.specimens
    if axis.values:
        voltage = np.array(axis.values)
    elif axis.points is not None:
        voltage = np.linspace(axis.start or 0.0, axis.to or 0.0, axis.points)
    else:
        held = specimens.voltage[np.isinf(specimens.ramp) & np.isfinite(specimens.voltage)]
        levels = np.array(sorted(set(np.round(held, 9).tolist())))
        ends = tested.voltage[tested.voltage > 0]
        voltage = levels if 1 < levels.size <= FEW else np.linspace(float(ends.min()), float(ends.max()), POINTS)
    pairs = [recipe.film.prestretch] if recipe.film.prestretch else sorted(set(map(tuple, specimens.prestretch.tolist())))
    volts, prestretch = np.tile(voltage, len(pairs)), np.repeat(np.array(pairs, dtype=float), voltage.size, axis=0)
    horizon = axis.horizon or LONGER * float(tested.end.max())
    films = _films(recipe, volts, prestretch, horizon, material)
    with without_warnings():
        return lives_of(
            fitted,
            films.histories.of(films.film),
            prestretch=prestretch,
            thickness=films.specimens.thickness,
            temperature=films.specimens.temperature,
            voltage=volts,
            pulled_in=films.pulled_in,
        )


def _plan(recipe: LifetimeRecipe, material: Material, tested: Simulated, best: FittedLaw, film: Mapping[str, Any]) -> TestPlan:
    """The test that would show the goal of the recipe."""
    goal = recipe.plan
    assert goal is not None
    if best.law.model.scatter.name != "weibull":
        raise InputError("a test plan is for Weibull scatter", key="plan")
    pair = goal.prestretch or recipe.film.prestretch or tuple(tested.specimens.prestretch[0].tolist())
    durations = goal.life * np.array([0.25, 0.5, 1.0, 2.0, 4.0])
    films = _films(recipe, np.array([goal.voltage]), np.array([pair]), float(durations[-1]), material)
    if films.pulled_in[0] < goal.life:
        raise InputError(f"the film pulls in after {films.pulled_in[0]:.4g} s", key="plan.life")
    with np.errstate(divide="ignore"):
        hazard = best.hazard_along(films.histories, films.specimens)
        at = np.interp(np.log(durations), np.log(np.maximum(films.histories.time[0], 1e-300)), np.log(np.maximum(hazard, 1e-300)))
    exposure = np.exp(at)
    usable = durations <= films.histories.end[0] * (1 + 1e-9)
    return plan_test(
        durations[usable],
        exposure[usable],
        float(exposure[2]),
        1.0,
        goal.failure_share,
        goal.confidence,
        shown=float(np.sum(best.hazard)),
        failures=best.law.model.observations.failures,
    )


def specimen_columns(tested: Simulated, fitted: Sequence[FittedLaw]) -> Table:
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


def joined(tables: Sequence[Table]) -> Table:
    """Tables with the same columns, one below the other."""
    result = []
    for parts in zip(*tables, strict=True):
        values = [part.values for part in parts]
        text = isinstance(values[0], list)
        result.append(
            Column(parts[0].name, parts[0].unit, [cell for part in values for cell in part] if text else np.concatenate(values))
        )
    return result


def headline(tested: Simulated, best: FittedLaw, chosen: Ranked) -> dict[str, dict[str, Any]]:
    """The numbers of specimens, and the fitted law."""
    table = {column.name: list(column.values) for column in best.columns()}
    return {
        "lifetime": {
            "specimens": len(tested.specimens),
            "failed": int(np.count_nonzero(tested.seen != Seen.SUSPENDED)),
            "law": best.name,
            "log_likelihood": best.fit.value,
        },
        "parameters": {
            name.replace(".", "_").replace("[", "_").replace("]", ""): float(value)
            for name, value in zip(table["parameter"], table["value"], strict=True)
        },
    }
