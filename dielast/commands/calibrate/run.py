"""`calibrate`: tests -> a material with intervals, or a comparison of several laws."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dielast.base.errors import NumericsError, in_keys, listed, warn
from dielast.calibration.comparison import hull
from dielast.calibration.experiment import MeasuredTest
from dielast.calibration.fit import Watch, fit_material
from dielast.calibration.laws import (
    Candidate,
    cross_validation,
    drawn_beside,
    in_order,
    mixed_draws,
    stabilities,
    usual_prediction,
    weighed,
)
from dielast.calibration.profiles import Verdict
from dielast.calibration.proposals import FEWEST_DRAWS, proposals
from dielast.calibration.result import Calibration, Intervals, assessed
from dielast.commands.calibrate.checks import known_of, warn_of_few_points, warn_of_fit, warn_of_laws_alike
from dielast.commands.calibrate.recipe import CalibrateRecipe
from dielast.commands.calibrate.task import CalibrationTask, prepared as prepared
from dielast.handover.material_draws import draw_columns
from dielast.handover.material_file import write_material
from dielast.io.files import Inputs
from dielast.io.table import Column, Table
from dielast.material.material import SCALE, Material, paths_of
from dielast.mechanics.load import Mode
from dielast.recipe.cases import Case
from dielast.report.report import RunReport
from dielast.sharing.execution import Execution

DRAWS = "draws.csv"
NOTHING = (
    "these tests determine no free constant: free fewer of them, state priors or narrower bounds, add tests at other rates and "
    "stretches, and look in calibrate.png at what the model misses (unit, mode, slack, ringing: see discard and ignore of a test)"
)
STRETCHED = 2.0  # default of fit.stable_up_to if no test prescribes the stretch


def run(cases: Sequence[Case[CalibrateRecipe]], inputs: Inputs, execution: Execution) -> RunReport:
    """Fit every material, rank them, report the best, with draws of all that cannot be told apart from it."""
    recipe = cases[0].recipe
    task = prepared(cases, inputs)
    watch = watcher(execution)
    several = len(task.materials) > 1
    candidates: list[Candidate] = []
    failures: list[str] = []
    interrupted = False
    for name, material in task.materials.items():
        try:
            candidates.append(_candidate(recipe, task, name, material, several, watch))
        except NumericsError as error:
            failures.append(f"{name}: {error}")
        except KeyboardInterrupt:  # before this law has a fit
            if not candidates:
                raise
            interrupted = True
        interrupted = interrupted or any(candidate.interrupted for candidate in candidates)
        if interrupted:
            break
    if not candidates:
        raise NumericsError(*failures)
    ranked = in_order(candidates)
    asked = task.asked or usual_prediction(ranked[0].fit)
    ranked = weighed(ranked, asked)
    alike = drawn_beside(ranked)
    if interrupted:  # whoever stops a run waits for no intervals
        ranked[0] = replace(ranked[0], fit=replace(ranked[0].fit, finished=False))
    intervals = Intervals(recipe.uncertainty.level, recipe.uncertainty.draws, recipe.uncertainty.seed)
    results = [
        assessed(each.fit, validate=task.predicted, intervals=intervals, watch=watch)
        for each in (ranked[0], *([] if interrupted else alike))
    ]
    best = replace(results[0], comparisons=hull([each.comparisons for each in results]))
    interrupted = interrupted or any(not each.fit.finished for each in results)
    failures += [f"test {name}: left out, the material cannot follow it" for name in dict.fromkeys(best.not_followed)]
    if interrupted:
        failures.append("interrupted: the best fit so far is written" + _lacking(recipe, candidates, len(task.materials), best))
    words = set(best.verdicts.values())
    if Verdict.UNDETERMINED in words and Verdict.DETERMINED not in words:
        failures.append(NOTHING)
    warn_of_fit(best)
    for stability in ranked[0].stability:
        if not stability.holds:
            warn(stability.in_words)
    warn_of_few_points([each.fit for each in ranked])
    spread = None
    drawn = (ranked[0], *alike)
    volts = [each.film_voltage for each in drawn]
    if len(results) > 1 and np.all(np.array(volts) > 0):
        spread = max(volts) / min(volts)
    members = mixed_draws(results, [each.weight for each in (ranked[0], *alike)])
    fitted = with_origin(best)
    if fitted.calibrated is not None:
        undetermined = tuple(dict.fromkeys(path for each in results for path in each.range.undetermined))
        fitted = replace(fitted, calibrated=replace(fitted.calibrated, law_spread=spread, undetermined=undetermined))
    if recipe.name is not None:
        fitted = replace(fitted, name=recipe.name)
    files = {"material.toml": write_material(fitted, DRAWS if members else None)}
    tables: dict[str, Table] = {
        "parameters.csv": best.columns(),
        "tests.csv": best.test_columns(),
        "correlations.csv": best.correlation_columns(),
        "residuals.csv": best.residual_columns(),
        "profiles.csv": best.profile_columns(),
        "laws.csv": law_columns(ranked),
    }
    scatter, calibrated = best.fit.scatter, best.material.calibrated
    if members and calibrated is not None:
        tables[DRAWS] = draw_columns(np.arange(len(members)), members)
        if proposed := proposals(members, asked, calibrated.largest_invariant, scatter.specimen, scatter.model_error):
            removed = np.array(list(proposed.values()))
            tables["next_tests.csv"] = [Column("test", None, list(proposed)), Column("variance_removed", "1", removed)]
    if task.asked is not None and "next_tests.csv" not in tables and not interrupted:
        needed = f"it takes at least {FEWEST_DRAWS} draws that can follow this film"
        warn(f"prediction: no next_tests.csv is written, {needed}: raise uncertainty.draws, or state a smaller prestretch")
    if len(results) > 1:
        warn_of_laws_alike({each.name: each.weight for each in drawn}, volts, tables)

    def figure() -> Any:
        from dielast.plots.calibration import plot_calibration

        return plot_calibration(best, recipe.title)

    return RunReport(tables, headline(best), figure, files, failures, interrupted=interrupted)


def with_origin(calibration: Calibration) -> Material:
    """The fitted material, which says of its constants whether they are fitted, to which tests, and what these tests leave open;
    others are as before.
    """
    material, space, fitted = calibration.material, calibration.fit.space, dict[str, str]()
    profiles = dict(zip(space.names, calibration.profiles, strict=False))
    tests = ", ".join(dict.fromkeys(test.name for test in calibration.fit.problem.laboratory.tests))
    plainly = f"fitted: {tests}"
    for parameter in space.parameters:
        said, profile = plainly, profiles.get(parameter.name)
        if profile is not None and profile.verdict is not Verdict.DETERMINED:
            known = known_of(parameter, profile)
            said = f"fitted: not determined{f', {known} at {100 * calibration.level:g} %' if known else ''}, by {tests}"
        if not parameter.of_test:
            fitted[parameter.name.replace(f".{SCALE}", ".shear_modulus")] = said
    for path in ("nonequilibrium.shear_modulus", "nonequilibrium.relaxation_time"):
        entries = [name for name in fitted if name.startswith(f"{path}[")]
        if entries and len(entries) == len(material.spectrum):
            fitted |= {path: plainly}
            fitted = {name: said for name, said in fitted.items() if name not in entries or said != plainly}
    return replace(material, origin={path: material.origin.get(path, "stated") for path in paths_of(material)} | fitted)


def _lacking(recipe: CalibrateRecipe, candidates: Sequence[Candidate], materials: int, best: Calibration) -> str:
    """What an interrupted run did not come to, for its message."""
    several = materials > 1
    across = several if recipe.fit.cross_validation is None else recipe.fit.cross_validation
    parts = {
        "intervals": not best.profiles,
        "draws": recipe.uncertainty.draws > 0 and not best.draws.size,
        "cross-validation": across and any(each.prediction_error is None for each in candidates),
        "the laws not yet fitted": len(candidates) < materials,
    }
    lacking = [name for name, lacks in parts.items() if lacks]
    return f", without {listed(lacking, 'and')}" if lacking else ""


def watcher(execution: Execution) -> Watch | None:
    """Shows the progress of a calibration, and the present misfit."""
    show = execution.progress
    if show is None:
        return None

    def watch(what: str, done: int, total: int, misfit: float) -> None:
        show(min(done, total), total, f"{what}, misfit {100 * misfit:.2f} %")

    return watch


def _candidate(
    recipe: CalibrateRecipe, task: CalibrationTask, name: str, material: Material, several: bool, watch: Watch | None
) -> Candidate:
    """Fit one material."""
    options = recipe.fit
    with in_keys({"tests": "test"}):
        fit = fit_material(
            material, task.tests, task.free[name], starts=options.starts, specimen_scatter=options.specimen_scatter, watch=watch
        )
    across = options.cross_validation if options.cross_validation is not None else several
    found, interrupted = None, not fit.finished
    try:
        found = cross_validation(fit) if across and fit.finished else None
    except KeyboardInterrupt:
        interrupted = True
    fitted = [test for test in fit.problem.laboratory.tests if isinstance(test, MeasuredTest)]
    furthest = options.stable_up_to or max((float(np.max(test.stretch)) for test in fitted), default=STRETCHED)
    tested = {Mode(test.mode).value for test in fitted if np.max(test.stretch) >= furthest}
    return Candidate(name, fit, found, stabilities(fit.material, furthest, tested), interrupted)


def headline(best: Calibration) -> Mapping[str, Mapping[str, Any]]:
    """The numbers of the summary."""
    fit, (fitted, explained), (foreseen, foreseen_explained) = best.fit, best.total(True), best.total(False)
    inside = [each.coverage for each in best.comparisons if not each.fitted and each.followed]
    sections: dict[str, dict[str, Any]] = {
        "fit": {
            "law": best.material.equilibrium_law.name,
            "tests": len(fit.problem.laboratory.tests),
            "points": int(fit.curves.measured.size),
            "parameters": len(fit.space),
            "rms_relative_error": fitted,
            "r_squared": explained,
            "starts": int(fit.start_cost.size),
            "starts_in_the_best": fit.same_share,
            "median_start_over_best": float(np.median(fit.start_misfit)),
            "worst_start_over_best": float(fit.start_misfit[-1]),
            "finished": fit.finished,
        },
        "scatter": {
            "noise": float(np.mean(fit.scatter.noise)),
            "model_error": fit.scatter.model_error,
            "specimens": len(best.specimen_factors),
            "specimen_scatter": fit.scatter.specimen,
        },
    }
    if inside:
        sections["validation"] = {
            "tests": len(inside),
            "rms_relative_error": foreseen,
            "r_squared": foreseen_explained,
            "coverage": float(np.mean([share for share in inside if np.isfinite(share)] or [np.nan])),
        }
    if best.profiles:
        verdicts = list(best.verdicts.values())
        sections["verdicts"] = {word.replace(" ", "_"): verdicts.count(word) for word in dict.fromkeys(verdicts)}
    if best.draws.size:
        sections["uncertainty"] = {"draws": len(best.draws), "level": best.level}
    return sections


def law_columns(ranked: Sequence[Candidate]) -> Table:
    """A row for each law, the best first."""
    errors = [np.nan if each.prediction_error is None else each.prediction_error for each in ranked]
    modes = [stability.mode for stability in ranked[0].stability]
    table = [
        Column("material", None, [Path(each.name).name for each in ranked]),
        Column("equilibrium_law", None, [each.fit.material.equilibrium_law.name for each in ranked]),
        Column("nonequilibrium_law", None, [each.fit.material.nonequilibrium_law.name for each in ranked]),
        Column("parameters", None, np.array([len(each.fit.space) for each in ranked])),
        Column("rms_relative_error", "1", np.array([each.fit.misfit for each in ranked])),
        Column("r_squared", "1", np.array([each.fit.explained for each in ranked])),
        Column("cross_validation_error", "1", np.array(errors)),
        Column("aic", "1", np.array([each.fit.aic for each in ranked])),
        Column("aicc", "1", np.array([each.fit.aicc for each in ranked])),
        *(
            Column(f"stable_to_{mode.replace('-', '_')}", "1", np.array([each.stability[k].highest for each in ranked]))
            for k, mode in enumerate(modes)
        ),
    ]
    if len(ranked) > 1:
        table.append(Column("weight", "1", np.array([each.weight for each in ranked])))
        table.append(Column("film_voltage", "V", np.array([each.film_voltage for each in ranked])))
    return table
