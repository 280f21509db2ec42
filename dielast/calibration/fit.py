"""The fit of a material to tests, from many starts, and its misfit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dielast.base.errors import InputError, NumericsError
from dielast.calibration.estimate import PRIOR_SPECIMENS, estimate
from dielast.calibration.experiment import Experiment, explained, relative_error
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.levenberg import Watcher, minimise
from dielast.calibration.parameters import Free, ParameterSpace, parameter_space, with_conditions
from dielast.calibration.problem import FitProblem, smooth_branches
from dielast.calibration.scatter import FIRST_LENGTH, FIRST_SHARE, USUAL_SCATTER, Curves, Scatter, Weighting, about_factors
from dielast.io.result import Result
from dielast.material.material import Material
from dielast.numerics.arrays import Flags, Floats

STARTS = 8
INSIDE = 0.1  # least distance of starts from the bounds, as a share of the range
ROUNDS = 2  # number of fits, each with the scatter estimated from the previous fit
SAME = 1e-3  # difference of two sums of squares, over the least of them or 100, up to which two starts ended in the same fit

MANY = 0.5  # share of starts that end in the best fit; with fewer, a better fit may exist

Watch = Callable[[str, int, int, float], None]
"""Called with the name of the task, its number of steps done, its greatest number of steps, and the present relative rms misfit."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Fit(Result):
    """A fitted material: `coordinates` (p,) of the `problem`, its `scatter`, and the results of the starts.

    `start_cost` (starts,) are sums of squares, infinite if the material of a start could not follow the tests, NaN before the first
    step; `curves` are measured and modelled values; `slopes` (n, p) are the derivatives of all modelled values by the coordinates.
    """

    problem: FitProblem
    coordinates: Floats
    scatter: Scatter
    curves: Curves
    slopes: Floats
    start_cost: Floats
    finished: bool = True
    left_out: tuple[str, ...] = ()
    """Tests that the material of no start can follow."""

    @property
    def space(self) -> ParameterSpace:
        """The parameters."""
        return self.problem.space

    @property
    def material(self) -> Material:
        """The material of the fit."""
        material = self.space.materials(self.coordinates[None])[0]
        assert material is not None
        return material

    @property
    def misfit(self) -> float:
        """The relative rms error over all fitted tests."""
        tests = self.problem.laboratory.tests
        return relative_error(tests, self.curves.split(self.curves.differences))

    @property
    def explained(self) -> float:
        """The share of the variance that the fit explains, over all fitted tests."""
        tests = self.problem.laboratory.tests
        return explained(tests, self.curves.split(self.curves.differences))

    @property
    def same_share(self) -> float:
        """Share of the starts that ended in the best fit."""
        least = float(np.min(self.start_cost))
        return float(np.mean(self.start_cost <= least + SAME * max(least, 100.0)))

    @property
    def start_misfit(self) -> Floats:
        """The misfit (starts,) of the starts over that of the best fit, ascending; infinite if the tests could not be followed."""
        return np.sort(np.sqrt(self.start_cost / max(float(np.min(self.start_cost)), 1e-300)))

    @property
    def independent_points(self) -> float:
        """The number of independent points of the tests: the length of the curves over the usual length of correlation."""
        return sum(float(place[-1]) for place in self.curves.places) / (2 * FIRST_LENGTH)

    @property
    def mean_square(self) -> float:
        """The mean square of the differences over the level of their curves."""
        return float(np.mean(np.square(self.curves.differences / np.concatenate(self.curves.levels()))))

    @property
    def aic(self) -> float:
        """Akaike's criterion, to compare laws that were fitted to the same tests."""
        return self.independent_points * float(np.log(self.mean_square)) + 2 * len(self.space)

    @property
    def aicc(self) -> float:
        """Akaike's criterion corrected for few points (Hurvich and Tsai 1989, DOI 10.1093/biomet/76.2.297); infinite if the
        independent points do not outnumber the constants, of which the size of the error is one, by more than 1.
        """
        points, constants = self.independent_points, len(self.space) + 1
        left = points - constants - 1
        return self.aic + 2 + 2 * constants * (constants + 1) / left if left > 0 else np.inf

    @property
    def at_bound(self) -> Flags:
        """Whether parameters (p,) are at a bound."""
        lower, upper = self.space.bounds
        return np.asarray((self.coordinates <= lower) | (self.coordinates >= upper))


def starts_of(space: ParameterSpace, count: int) -> Floats:
    """Coordinates (count, p) of the starts: the stated start, and points of a Sobol sequence within the bounds."""
    if count == 1:
        return space.start[None]
    from scipy.stats import qmc

    lower, upper = space.bounds
    power = int(np.ceil(np.log2(max(count, 2))))
    points = qmc.Sobol(len(space), seed=1).random_base2(power)[: count - 1]
    spread = lower + (upper - lower) * (INSIDE + (1 - 2 * INSIDE) * points)
    return np.concatenate((space.start[None], spread))


def fit_material(
    material: Material,
    tests: Sequence[Experiment],
    free: Mapping[str, Free],
    *,
    starts: int = STARTS,
    specimen_scatter: float | None = None,
    watch: Watch | None = None,
) -> Fit:
    """Fit the `free` constants of a material to tests by weighted least squares, from several starts at once.

    `specimen_scatter` is the relative scatter between specimens; None: it is estimated. Ctrl-C ends with the best fit so far and
    `finished` False. Raises `InputError` for parameters that the material does not have and temperatures at which its shift law
    does not hold, if none of its constants is free, and `NumericsError` if no start can follow all tests.
    """
    if not tests:
        raise InputError("at least one test is needed", argument="tests")
    space = parameter_space(material, free)
    if (points := sum(test.measured.size for test in tests)) <= len(space):
        fewer = f"{points} measured points for {len(space)} free parameters: more points or fewer parameters are needed"
        raise InputError(fewer, argument="tests")
    space = with_conditions(space, tests)
    start = starts_of(space, starts)
    laboratory = Laboratory(tests)
    if not any(name.startswith("shift.") for name in space.names):
        for test in laboratory.machine.values():  # a fixed shift law must hold at their temperatures
            try:
                material.relaxation_time(test.temperature)
            except InputError as error:
                raise InputError(f"{test.name}: {error.problems[0].text}", argument="tests") from None
    answers = laboratory.answers(space.materials(start), space.conditions(start))
    kept = [test for test, values in zip(tests, answers, strict=True) if np.any(np.all(np.isfinite(values), axis=1))]
    if not kept:
        raise NumericsError(f"no start can follow any of the tests{_furthest(tests)}")
    fit = _fit(FitProblem(space, Laboratory(kept), np.zeros((len(space),) * 2)), start, specimen_scatter, watch)
    return replace(fit, left_out=tuple(test.name for test in tests if test not in kept))


def _fit(problem: FitProblem, start: Floats, specimen_scatter: float | None, watch: Watch | None) -> Fit:
    """The best fit from the coordinates `start` (starts, p)."""
    bounds = problem.space.bounds
    curves = problem.curves()
    stated = (USUAL_SCATTER, PRIOR_SPECIMENS) if specimen_scatter is None else (specimen_scatter, np.inf)
    scatter = Scatter(np.full(len(curves.values), 0.01), FIRST_SHARE, FIRST_LENGTH, stated[0], specimens=stated[1])
    best, ends, ended = np.clip(start, *bounds)[0], np.full(len(start), np.nan), False  # so far, for an interrupt

    def watcher(task: str, every: int, before: int = 0) -> Watcher:
        total, error = sum(float(place[-1]) for place in curves.places) / scatter.piece, scatter.model_error

        def watched(settled: int, cost: Floats, at: Floats) -> None:
            nonlocal best, ends
            if not ended:
                ends = cost.copy()
            least = int(np.argmin(cost))
            best = at[least].copy()
            if watch is not None:
                watch(task, before + settled, every, error * float(np.sqrt(cost[least] / max(total, 1e-12))))

        return watched

    finished, first = True, problem.weighted(curves, Weighting.of(curves, scatter))
    try:
        solutions = minimise(first, start, bounds, watch=watcher("starts", len(start)))
        if not np.isfinite(solutions.cost[solutions.best]):
            raise NumericsError(f"no start can follow all tests{_furthest(problem.laboratory.tests)}")
        ended, ends, best = True, solutions.cost, solutions.coordinates[solutions.best]
        for k in range(ROUNDS):
            curves = problem.curves(best)
            slopes = problem.slopes(best)
            scatter = estimate(curves, slopes, problem.prior, scatter)
            problem = replace(problem, smoothness=smooth_branches(problem, curves, scatter, slopes, best))
            refined = problem.weighted(about_factors(curves, scatter), Weighting.of(curves, scatter))
            best = minimise(refined, best[None], bounds, watch=watcher("refinements", ROUNDS, k)).coordinates[0]
    except KeyboardInterrupt:
        finished = False
    curves = problem.curves(best)
    if not np.all(np.isfinite(np.concatenate(curves.model))):
        raise KeyboardInterrupt
    slopes = problem.slopes(best)
    if finished:
        scatter = estimate(curves, slopes, problem.prior, scatter)
    return Fit(problem, best, scatter, curves, slopes, ends, finished)


def _furthest(tests: Sequence[Experiment]) -> str:
    """A hint on the largest stretch of the tests, which may be why no start can follow them."""
    reached = [(float(np.max(test.stretch)), test.name) for test in tests if test.stretch is not None]
    if not reached:
        return ""
    stretch, name = max(reached)
    return f"; {name} reaches a stretch of {stretch:.4g}: check its unit, and the limits of the springs"
