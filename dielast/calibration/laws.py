"""Laws side by side: how well each predicts a test that it was not fitted to, in which modes its springs are stable, how likely it
is beside the others, and which are drawn from.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import compress

import numpy as np
from scipy.special import fdtrc

from dielast.base.errors import and_more, warn
from dielast.calibration.experiment import relative_error
from dielast.calibration.fit import Fit
from dielast.calibration.levenberg import minimise
from dielast.calibration.proposals import film_voltages, predicted_film
from dielast.calibration.result import Calibration, range_of
from dielast.calibration.scatter import Weighting, level_of
from dielast.calibration.voltage import VoltageTest
from dielast.io.result import Result
from dielast.material.material import Material
from dielast.material.springs.stable_range import SECOND, stable_range
from dielast.numerics.arrays import Floats
from dielast.numerics.random_streams import stream

MOST_FOLDS = 12
STEADY = 0.5  # share of the mean square of the whole curve in the squared level of a point
BOOTSTRAPS = 2000
ITERATIONS = 12
PRECISE = 1e-4
# Choices, for draws: the least weight of a law that is drawn from beside the best, and the most laws.
ALIKE, MOST_ALIKE = 0.05, 5
CONTRADICTED = 0.05  # probability of an error by chance, below which a law is not drawn from


@dataclass(frozen=True, slots=True, eq=False)
class CrossValidation:
    """The errors of tests that are predicted from fits to the others: the `relative_error` over all points, and the mean `square`
    (tests,) of each test's differences over the level of its curve.
    """

    relative_error: float
    square: Floats


def cross_validation(fit: Fit) -> CrossValidation | None:
    """Predict each test of a fit from fits to the others, all at once (Stone 1974); tests of one specimen are left out together if
    there are several specimens. None for a single test.
    """
    tests, curves = fit.problem.laboratory.tests, fit.curves
    specimens = np.unique(curves.specimen)
    group = curves.specimen if specimens.size > 1 else np.arange(len(tests))
    fold = np.asarray(np.unique(group, return_inverse=True)[1]) % MOST_FOLDS
    folds = int(fold.max()) + 1
    if folds < 2:
        return None
    chosen = (fold[None, :] != np.arange(folds)[:, None]).astype(float)
    start = np.repeat(fit.coordinates[None], folds, axis=0)
    residuals = fit.problem.weighted(curves, Weighting.of(curves, fit.scatter), chosen)
    solutions = minimise(residuals, start, fit.space.bounds, iterations=ITERATIONS, settled=PRECISE)
    answers = fit.problem.answers_of_tests(solutions.coordinates)
    misses = [answers[k][fold[k]] - values for k, values in enumerate(curves.values)]
    levels = [level_of(values, STEADY) for values in curves.values]
    square = [np.mean(np.square(miss / (wide * level))) for miss, wide, level in zip(misses, curves.wide, levels, strict=True)]
    return CrossValidation(relative_error(tests, misses), np.array(square))


def law_weights(found: Sequence[CrossValidation], pieces: Floats) -> Floats:
    """The weight (laws,) of each law, from its cross-validation over tests with so many independent `pieces` (tests,).

    They are those of pseudo Bayesian model averaging (Yao et al. 2018, DOI 10.1214/17-BA1091): the densities of the tests that were
    left out, multiplied, and averaged over the Bayesian bootstrap of the tests, so that few tests do not decide. A law that cannot
    follow a test that others follow has no weight; tests that no law can follow do not count.
    """
    square = np.array([each.square for each in found])
    followed = np.isfinite(square)
    square, pieces = (values[..., followed.any(axis=0)] for values in (np.where(followed, square, np.inf), pieces))
    # the size of the error is not known: the density of m pieces goes with its root mean square to the power -m
    density = -0.5 * pieces * np.log(square)
    share = stream(1, "laws").dirichlet(np.ones(pieces.size), BOOTSTRAPS) * pieces.size
    total = share @ density.T
    weight = np.exp(total - np.max(total, axis=1, keepdims=True))
    return np.asarray(np.mean(weight / np.sum(weight, axis=1, keepdims=True), axis=0))


def weights_by_one_test(fits: Sequence[Fit]) -> Floats:
    """The weight (laws,) of each law that was fitted to one and the same test, of which cross-validation leaves nothing to fit.

    They are those of Akaike's criterion (Burnham and Anderson 2004, DOI 10.1177/0049124104268644), corrected for few points. Most
    tests have fewer independent points than laws have constants: the criterion then has no value, and without its correction it
    would count constants rather than errors. Laws then have equal weights, but none if they are contradicted: if their mean square
    is larger than the least one by a ratio that two mean squares of so many independent points have with a probability below
    `CONTRADICTED` (Fisher's distribution of the variance ratio; errors of two laws in one test are alike, so that their ratio
    varies less).
    """
    aicc = np.array([fit.aicc for fit in fits])
    if np.all(np.isfinite(aicc)):
        weight = np.exp(-0.5 * (aicc - np.min(aicc)))
    else:
        square = np.maximum([fit.mean_square for fit in fits], 1e-30)  # a law may fit exactly
        points = max(fits[0].independent_points, 1.0)
        weight = (fdtrc(points, points, square / np.min(square)) >= CONTRADICTED).astype(float)
    return np.asarray(weight / np.sum(weight))


def pieces_of(fit: Fit) -> Floats:
    """The number (tests,) of independent pieces of each curve, at least 1."""
    return np.maximum([float(place[-1]) / fit.scatter.piece for place in fit.curves.places], 1.0)


def mixed_draws(results: Sequence[Calibration], weights: Sequence[float]) -> tuple[Material, ...]:
    """Draws of the material of several laws, as many of each as its share of the weights, at least one. They take turns, so that
    the first of them have about the same shares.
    """
    share = np.array(weights[: len(results)]) if len(results) > 1 else np.ones(1)
    parts = [result.materials for result in results]
    counts = [max(round(part * len(drawn)), 1) for part, drawn in zip(share / np.sum(share), parts, strict=True)]
    turns = [((k + 0.5) / count, law, k) for law, count in enumerate(counts) for k in range(min(count, len(parts[law])))]
    return tuple(parts[law][k] for _, law, k in sorted(turns))


@dataclass(frozen=True, slots=True)
class StableRange(Result):
    """The stretch up to which the equilibrium spring and the branches are stable in a `mode`; `furthest` is the stretch to check,
    and `tested` whether a fitted test of this mode reached it.
    """

    mode: str
    highest: float
    furthest: float
    tested: bool = False
    at_equilibrium: bool = True
    """Whether `highest` is of the equilibrium spring, which alone acts in slow loading; else it is of the branches' springs."""

    @property
    def holds(self) -> bool:
        """Whether the springs are stable up to `furthest`."""
        return self.highest >= self.furthest

    @property
    def in_words(self) -> str:
        """The finding in a sentence."""
        which, rate = ("equilibrium spring", "slower") if self.at_equilibrium else ("branches' spring", "faster")
        limit = f"in {self.mode} loading, the {which} by itself locks or becomes unstable at a stretch of {self.highest:.4g}"
        needed = f"{self.furthest:.4g} is needed"
        if self.tested:
            return f"{limit}; {needed}: a simulation of loading {rate} than in the tests may end there"
        return f"{limit}; {needed}: to check the law, measure in this mode up to this stretch"


def stabilities(material: Material, furthest: float, tested: Collection[str] = ()) -> tuple[StableRange, ...]:
    """The stability in uniaxial, equibiaxial and pure-shear loading, up to the stretch `furthest`.

    `tested` are the modes with a fitted test up to this stretch.
    """
    laws = [material.equilibrium_law] if material.equilibrium_modulus > 0 else []
    if len(material.spectrum):
        laws.append(material.nonequilibrium_law)
    stabilities = []
    for mode in SECOND:
        ends = [stable_range(law, mode)[1] for law in laws]
        first = int(np.argmin(ends))
        at_equilibrium = first == 0 and material.equilibrium_modulus > 0
        stabilities.append(StableRange(mode, ends[first], furthest, mode in tested, at_equilibrium))
    return tuple(stabilities)


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A fitted law: the file or the laws that it started from, its cross-validation, its range of stability, its `weight` among all
    laws, and the voltage in V of the predicted film.
    """

    name: str
    fit: Fit
    found: CrossValidation | None
    stability: tuple[StableRange, ...]
    interrupted: bool = False
    weight: float = np.nan
    film_voltage: float = np.nan

    @property
    def prediction_error(self) -> float | None:
        """The error of the cross-validation."""
        return None if self.found is None else self.found.relative_error


def in_order(candidates: Sequence[Candidate]) -> list[Candidate]:
    """The laws, the best first: by the error of cross-validation, and after them those without one by the error of the fit; of a
    single test by their weight, and of equal weights the one with the fewest constants.
    """
    if _single(candidates):
        fits = [each.fit for each in candidates]
        square, constants = np.array([(fit.mean_square, len(fit.space)) for fit in fits]).T
        order = np.lexsort((square, constants, -weights_by_one_test(fits)))
    else:
        errors = [(each.found is None, each.fit.misfit if each.found is None else each.found.relative_error) for each in candidates]
        order = np.lexsort(np.array(errors).T[::-1])
    return [candidates[k] for k in order]


def _single(candidates: Sequence[Candidate]) -> bool:
    """Whether all laws were fitted to one and the same test."""
    return {len(each.fit.problem.laboratory.tests) for each in candidates} == {1}


def usual_prediction(fit: Fit) -> VoltageTest:
    """The film that is predicted if none is stated."""
    known = range_of(fit)
    return predicted_film(known.largest_invariant, float(np.mean(known.temperature)))


def weighed(ranked: Sequence[Candidate], asked: VoltageTest) -> list[Candidate]:
    """The laws with their weights and the voltage of the film that is `asked` for, if all have a cross-validation of the same
    tests, or one test.
    """
    found = [each.found for each in ranked if each.found is not None]
    if len(ranked) < 2:
        return list(ranked)
    if _single(ranked):
        weights = weights_by_one_test([each.fit for each in ranked])
    elif len({each.square.size for each in found}) != 1 or len(found) < len(ranked):
        return list(ranked)
    else:
        weights = law_weights(found, pieces_of(ranked[0].fit))
    volts = film_voltages([each.fit.material for each in ranked], asked)
    return [
        replace(each, weight=weight, film_voltage=volt)
        for each, weight, volt in zip(ranked, weights.tolist(), volts.tolist(), strict=True)
    ]


def drawn_beside(ranked: Sequence[Candidate]) -> list[Candidate]:
    """The laws that are drawn from beside the best; warns of those that should be, but cannot stand in one table with it."""
    best = ranked[0].fit.material
    alike = [each for each in ranked[1:] if each.weight >= min(ALIKE, ranked[0].weight)]
    joins = [
        len(each.fit.material.spectrum) == len(best.spectrum) and type(each.fit.material.shift) is type(best.shift)
        for each in alike
    ]
    if apart := [f"{each.name} ({100 * each.weight:.0f} %)" for each, join in zip(alike, joins, strict=True) if not join]:
        other = "as their number of branches or their shift law is another"
        warn(f"these tests cannot tell {', '.join(apart)} from {ranked[0].name}: draws leave them out, {other}")
    beside = list(compress(alike, joins))
    if len(beside) < MOST_ALIKE:
        return beside
    # of many, those whose films differ most are among the drawn
    volts = np.nan_to_num([each.film_voltage for each in beside])
    first = sorted({int(np.argmin(volts)), int(np.argmax(volts))})
    kept = sorted([*first, *(k for k in range(len(beside)) if k not in first)][: MOST_ALIKE - 1])
    left = [beside[k].name for k in range(len(beside)) if k not in kept]
    named = ", ".join(left[:MOST_ALIKE]) + and_more(len(left) - MOST_ALIKE)
    warn(f"draws are of {MOST_ALIKE} laws at most, and leave out {named}, which the tests allow as well")
    return [beside[k] for k in kept]
