"""`calibrate`: tests -> a material with intervals, or a comparison of several laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dielast.calibration.experiment import Experiment, MeasuredTest
from dielast.calibration.fit import MANY, Watch
from dielast.calibration.laws import Stability, cross_validation_error, stabilities
from dielast.calibration.parameters import Free
from dielast.calibration.profiles import Verdict
from dielast.calibration.result import Calibration, calibrate, range_of
from dielast.calibration.scatter import USUAL_SCATTER
from dielast.commands.calibrate.freedom import free_of
from dielast.commands.calibrate.recipe import CalibrateRecipe
from dielast.commands.calibrate.tests import read_tests
from dielast.errors import InputError, Mistakes, NumericsError, and_more, in_keys, warn
from dielast.handover.material_draws import draw_columns
from dielast.handover.material_file import parse_material, write_material
from dielast.io.files import Inputs
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.material.use_checks import BEYOND_TESTS, LONGER
from dielast.mechanics.load import Mode
from dielast.recipe.cases import Case
from dielast.report.report import Report
from dielast.sharing.execution import Execution

DRAWS = "draws.csv"
STRETCHED = 2.0  # default of fit.stable_up_to if no test prescribes the stretch
FAR = 3.0  # usual scatters of specimens: no such specimen is expected
MISSED = 0.25  # relative rms error: several times that of a model that describes a test
KEPT = "the best fit so far is written, if there is one"


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """The inputs of a recipe: tests to fit and to predict, materials by file, and their free constants by file."""

    tests: list[Experiment]
    predicted: list[Experiment]
    materials: dict[str, Material]
    free: dict[str, dict[str, Free]]


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A fitted law: the file that it started from, its cross-validation, and its range of stability."""

    name: str
    calibration: Calibration
    prediction_error: float | None
    stability: tuple[Stability, ...]
    interrupted: bool = False


def ask(recipe: CalibrateRecipe, inputs: Inputs) -> Asked:
    """Read all files that a recipe names; raises `InputError` with a line for every mistake."""
    wrong, materials = Mistakes(), dict[str, Material]()
    for name in recipe.started_from:
        if material := wrong.tried(partial(_read_material, name, inputs)):
            materials[name] = material
    at = next((material.reference_temperature for material in materials.values()), 20.0)
    fixed = [] if recipe.frees_shift else list(materials.values())
    tests = wrong.tried(partial(read_tests, recipe.test, inputs, at, "test", fixed)) or []
    further = wrong.tried(partial(read_tests, recipe.validate_, inputs, at, "validate")) or []
    # without its material a free constant cannot be checked
    free = wrong.tried(partial(free_of, recipe.free, materials, inputs)) if len(materials) == len(recipe.started_from) else None
    wrong.refuse()
    assert free is not None
    electric = [test.name for test in (*tests, *further) if isinstance(test, MeasuredTest) and test.nominal_field]
    for name, material in materials.items():
        if electric and material.dielectric is None:
            needed = f"test {electric[0]} is under voltage: state [dielectric] permittivity"
            raise InputError(needed, file=name)
    return Asked(tests, further, materials, free)


def _read_material(name: str, inputs: Inputs) -> Material:
    return parse_material(inputs.read(name), name)


def run(cases: Sequence[Case[CalibrateRecipe]], inputs: Inputs, execution: Execution) -> Report:
    """Fit every material, rank them, report the best."""
    recipe = cases[0].recipe
    asked = ask(recipe, inputs)
    if execution.keep is not None:
        execution.keep(KEPT)
    watch = watcher(execution)
    several = len(asked.materials) > 1
    candidates: list[Candidate] = []
    failures: list[str] = []
    interrupted = False
    for name, material in asked.materials.items():
        try:
            candidates.append(_candidate(recipe, asked, name, material, several, watch))
        except NumericsError as error:
            failures.append(f"{name}: {error}")
        except KeyboardInterrupt:  # before this law has a fit
            if not candidates:
                raise
            interrupted = True
        if interrupted or (candidates and candidates[-1].interrupted):
            interrupted = True
            break
    if not candidates:
        raise NumericsError(*failures)
    ranked = _ranked(candidates)
    best = ranked[0].calibration
    failures += [f"test {name}: left out, the material cannot follow it" for name in dict.fromkeys(best.not_followed)]
    if interrupted:
        failures.append("interrupted: the best fit so far is written, without intervals and draws")
    _warn(ranked[0])
    members = best.materials
    files = {"material.toml": write_material(best.material, DRAWS if members else None)}
    tables: dict[str, Table] = {
        "parameters.csv": best.columns(),
        "tests.csv": best.test_columns(),
        "correlations.csv": best.correlation_columns(),
        "residuals.csv": best.residual_columns(),
        "profiles.csv": best.profile_columns(),
        "laws.csv": law_columns(ranked),
    }
    if members:
        tables[DRAWS] = draw_columns(np.arange(len(members)), members)

    def figure() -> Any:
        from dielast.plots.calibration import plot_calibration

        return plot_calibration(best, recipe.title)

    return Report(tables, headline(ranked), figure, files, failures, interrupted=interrupted)


def watcher(execution: Execution) -> Watch | None:
    """Shows the progress of a calibration, and the present misfit."""
    progress = execution.progress
    if progress is None:
        return None
    heard = progress

    def watch(what: str, done: int, total: int, misfit: float) -> None:
        heard(min(done, total), total, f"{what}, misfit {100 * misfit:.2f} %")

    return watch


def _candidate(
    recipe: CalibrateRecipe, asked: Asked, name: str, material: Material, several: bool, watch: Watch | None
) -> Candidate:
    """Fit one material."""
    options, wanted = recipe.fit, recipe.uncertainty
    with in_keys({"tests": "test"}):
        result = calibrate(
            asked.tests,
            material,
            asked.free[name],
            validate=asked.predicted,
            starts=options.starts,
            specimen_scatter=options.specimen_scatter,
            draws=wanted.draws,
            seed=wanted.seed,
            level=wanted.level,
            watch=watch,
        )
    across = options.cross_validation if options.cross_validation is not None else several
    error, interrupted = None, not result.fit.finished
    try:
        error = cross_validation_error(result.fit) if across and result.fit.finished else None
    except KeyboardInterrupt:
        interrupted = True
    fitted = [test for test in result.fit.problem.laboratory.tests if isinstance(test, MeasuredTest)]
    furthest = options.stable_up_to or max((float(np.max(test.stretch)) for test in fitted), default=STRETCHED)
    tested = {Mode(test.mode).value for test in fitted if np.max(test.stretch) >= furthest}
    return Candidate(name, result, error, stabilities(result.material, furthest, tested), interrupted)


def _ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The laws, the best first: by the error of cross-validation, or by that of the fit if a law lacks a cross-validation."""
    foreseen = [each.prediction_error for each in candidates if each.prediction_error is not None]
    errors = foreseen if len(foreseen) == len(candidates) else [each.calibration.total(True)[0] for each in candidates]
    return [candidates[k] for k in np.argsort(errors, kind="stable")]


def _warn(best: Candidate) -> None:
    """Warn of parameters that the tests do not determine, and of an unstable law."""
    result = best.calibration
    fit = result.fit
    expected = dict(zip(fit.space.names, np.diag(fit.space.precision) > 0, strict=True))
    left_open = [name for name, verdict in result.verdicts.items() if verdict == Verdict.UNDETERMINED]
    for prior, spread in ((False, "spread over the whole range between the bounds"), (True, "follow the prior")):
        if names := [name for name in left_open if expected[name] == prior]:
            verb = "is" if len(names) == 1 else "are"
            warn(f"{', '.join(names)} {verb} not determined by these tests: draws {spread}")
    if result.profiles and np.all(fit.at_bound):
        warn("every free parameter is at a bound: check the units and signs of the tests, and widen the bounds")
    for parameter, profile in zip(fit.space.parameters, result.profiles, strict=False):
        if profile.verdict in (Verdict.LOWER, Verdict.UPPER):
            side, end = ("least", profile.lower) if profile.verdict is Verdict.LOWER else ("most", profile.upper)
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            warn(f"these tests give only a bound of {parameter.name}: at {side} {float(parameter.value(end)):.4g}{unit}")
    warn_of_contradictions(result)
    warn_of_tests_beyond(result)
    if fit.same_share < MANY:
        median = float(np.median(fit.start_misfit))
        others = f"the median misfit is {median:.3g} times as large" if np.isfinite(median) else "many cannot follow the tests"
        warn(f"only {100 * fit.same_share:.0f} % of the starts end in the best fit, {others}: raise fit.starts")
    for stability in best.stability:
        if not stability.holds:
            warn(stability.said)


def warn_of_contradictions(result: Calibration) -> None:
    """Warn of specimens whose factor is far beyond the usual or a larger stated scatter, and of fitted tests that are missed."""
    scatter = result.fit.scatter
    stated = not np.isfinite(scatter.specimens)
    usual = max(USUAL_SCATTER, scatter.specimen) if stated else USUAL_SCATTER
    far = {name: factor for name, factor in result.specimen_factors.items() if abs(np.log(factor)) > FAR * usual}
    if far:
        listed = ", ".join(f"{name} {factor:.3g}" for name, factor in far.items())
        warn(f"stress over that of the material, by specimen: {listed}: check unit, cross-section, temperature and mode")
    missed = [each for each in result.comparisons if each.fitted and each.followed and each.rms_relative_error > MISSED]
    if missed:
        listed = ", ".join(f"{each.test.name} by {100 * each.rms_relative_error:.0f} %" for each in missed)
        warn(f"the material misses fitted tests, {listed}: they contradict each other, or the model cannot describe them")


def warn_of_tests_beyond(result: Calibration) -> None:
    """Warn of predicted tests that are longer, or at larger stretches, than all fitted tests: the model is extrapolated."""
    known = range_of(result.fit)
    measured = [each.test for each in result.comparisons if not each.fitted and isinstance(each.test, MeasuredTest)]
    late = [test for test in measured if test.time[-1] > LONGER * known.time[1]]
    if late:
        last, longest = max(test.time[-1] for test in late), known.time[1]
        lasting = f"lasts {last:.4g} s, the fitted tests at most {longest:.4g} s"
        warn(f"test {late[0].name}{and_more(len(late) - 1)} {lasting}: slower relaxation is unknown")
    far = [test for test in measured if test.largest_invariant > known.largest_invariant * (1 + BEYOND_TESTS)]
    if far:
        reach = f"reaches I1 = {max(test.largest_invariant for test in far):.4g}, the fitted tests {known.largest_invariant:.4g}"
        warn(f"test {far[0].name}{and_more(len(far) - 1)} {reach}: the springs are extrapolated")


def headline(ranked: Sequence[Candidate]) -> Mapping[str, Mapping[str, Any]]:
    """The numbers of the summary."""
    best = ranked[0].calibration
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
            "coverage": float(np.mean(inside)),
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
    return [
        Column("material", None, [Path(each.name).name for each in ranked]),
        Column("equilibrium_law", None, [each.calibration.material.equilibrium_law.name for each in ranked]),
        Column("nonequilibrium_law", None, [each.calibration.material.nonequilibrium_law.name for each in ranked]),
        Column("parameters", None, np.array([len(each.calibration.fit.space) for each in ranked])),
        Column("rms_relative_error", "1", np.array([each.calibration.total(True)[0] for each in ranked])),
        Column("r_squared", "1", np.array([each.calibration.total(True)[1] for each in ranked])),
        Column("cross_validation_error", "1", np.array(errors)),
        Column("aic", "1", np.array([each.calibration.fit.aic for each in ranked])),
        *(
            Column(f"stable_to_{mode.replace('-', '_')}", "1", np.array([each.stability[k].highest for each in ranked]))
            for k, mode in enumerate(modes)
        ),
    ]
