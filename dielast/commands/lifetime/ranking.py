"""The laws of a recipe fitted to the failures of one kind, ranked, and what speaks against them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np

from dielast.base.errors import InputError, NumericsError, Problem, in_keys, warn, without_warnings
from dielast.calibration.failures.fits import FailureFit, bounded_law, fit_law, history_error, left_out_score
from dielast.calibration.failures.law_models import law_model
from dielast.calibration.failures.laws import LawModel, LawOptions
from dielast.calibration.failures.likelihood import Seen
from dielast.calibration.failures.specimens import POINTS_PER_DECADE, Simulated, Specimens
from dielast.commands.lifetime.lives import fine_enough, simulated
from dielast.commands.lifetime.recipe import LifetimeRecipe
from dielast.material.material import Material

KEYS = {"scatter": "fit.scatter", "thickness": "film.thickness", "relax": "film.relax", "boundary": "film.boundary"}


def accepted(specimens: int) -> float:
    """The accepted change of a log exposure over its scatter if every second row is left out: a third of it, the error, is then a
    tenth of the standard error 1/sqrt(n) of a location.
    """
    return float(0.3 / np.sqrt(specimens))


@dataclass(frozen=True, slots=True, eq=False)
class Ranked:
    """The laws fitted to one kind of failure, the best first, and their scores."""

    mode: str
    fitted: list[FailureFit]
    scores: list[float]
    error: float
    """What every second row of the histories changes in the best of them (see `history_error`)."""


def simulated_and_ranked(recipe: LifetimeRecipe, material: Material, specimens: Specimens) -> tuple[Simulated, list[Ranked]]:
    """Simulate the specimens and fit the laws to each kind of failure, with rows close enough for the fitted laws."""

    def solve(factor: int) -> tuple[tuple[Simulated, list[Ranked]], float]:
        with nullcontext() if factor == 1 else without_warnings():  # no warning twice
            with in_keys(KEYS):
                tested = simulated(recipe, material, specimens, factor * POINTS_PER_DECADE)
            ranks = [ranked(recipe, material, tested, mode) for mode in modes_of(specimens)]
        return (tested, ranks), max(rank.error for rank in ranks)

    found, error = fine_enough(solve, accepted(len(specimens)))
    if error > accepted(len(specimens)):
        warn(f"log exposures of specimens have numerical errors of {error / 3:.1g} of their scatter: is the scatter so small?")
    return found


def modes_of(specimens: Specimens) -> list[str]:
    """The kinds of failure, the most frequent first; one without a name if none is stated."""
    failed = [mode for mode, seen in zip(specimens.mode, specimens.seen, strict=True) if seen != Seen.SUSPENDED]
    return sorted(dict.fromkeys(failed), key=lambda mode: -failed.count(mode)) or [""]


def chosen_of(recipe: LifetimeRecipe, ranks: Sequence[Ranked]) -> Ranked:
    """The kind of failure that goes into material.toml: the one that `fit.mode` names, or the most frequent one."""
    wanted = recipe.fit.mode
    if wanted is None:
        return ranks[0]
    for rank in ranks:
        if rank.mode == wanted:
            return rank
    raise InputError(f'no specimen failed by "{wanted}"; there are {", ".join(rank.mode for rank in ranks)}', key="fit.mode")


def ranked(recipe: LifetimeRecipe, material: Material, tested: Simulated, mode: str) -> Ranked:
    """All laws of the recipe for one kind of failure; those of other kinds are suspended."""
    other = np.array([stated != mode for stated in tested.specimens.mode])
    tested = replace(tested, seen=np.where(other, Seen.SUSPENDED, tested.seen).astype(np.intp))
    stated, wanted = recipe.fit, recipe.uncertainty
    options = LawOptions(
        stated.scatter,
        stated.time,
        stated.prestretch,
        stated.reference_area,
        material.reference_temperature,
        stated.reference_humidity,
        stated.known,
    )
    fitted, scores, refused = list[FailureFit](), list[float](), dict[str, str]()
    several = len(stated.ranked) > 1
    for name in stated.ranked:
        try:
            law = law_model(name, tested, options)
            if not law.model.observations.failures:
                fitted.append(_bounded(law, wanted.level))
                scores.append(np.nan)
                continue
            fitted.append(fit_law(law, level=wanted.level, draws=max(wanted.draws, 1), seed=wanted.seed, mode=mode))
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
    left = history_error(fitted[order[0]], tested)
    return Ranked(mode, [fitted[k] for k in order], [scores[k] for k in order], left)


def _placed(error: InputError | NumericsError, law: str) -> InputError | NumericsError:
    """The error with the key of the law, where it is about no specimen."""
    return error.changed(
        lambda problem: problem if problem.file or problem.key else Problem(f"{law}: {problem.text}", key="fit.law")
    )


def _bounded(law: LawModel, level: float) -> FailureFit:
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


def warn_of_fit(rank: Ranked, specimens: Specimens) -> None:
    """Warn of failures that are not of one kind, of parameters at the end of their range, and of those not determined."""
    best = rank.fitted[0]
    of = f"failures by {rank.mode}" if rank.mode else "failures"
    if not best.fit.settled:
        warn(f"the likelihood of the {of} has no maximum: some parameters of {best.name} are bounds at most, whatever their value")
    kind, count = best.unlike()
    if kind == "early":
        order = np.argsort(np.where(best.law.model.observations.seen == Seen.SUSPENDED, np.inf, best.standing()))
        named = ", ".join(specimens.name[best.law.rows[k]] for k in order[: min(count, 5)].tolist())
        warn(
            f"the {of} are not of one kind: {count} come too early for the others ({named}): state a column mode to fit them apart"
        )
    elif kind:
        warn(
            f"the {of} are not of one kind: the {count} after the least exposure come later than {best.name} says: state a column "
            "mode to fit them apart, or try other laws"
        )
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
