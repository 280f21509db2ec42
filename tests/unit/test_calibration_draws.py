"""Profiles and draws of posteriors that are known: valleys, bounds, chains, and what R-hat is."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student

from dielast import Gent, Material, NoShift, Spectrum, draw_sample
from dielast.base.errors import DielastWarning
from dielast.calibration import posterior
from dielast.calibration.courses import ACCURATE
from dielast.calibration.posterior import AGREEMENT, FEWEST_MOVES, MOST_WALKERS, draw, r_hat
from dielast.calibration.profiles import Verdict, profiles_of
from dielast.material.intervals import division, strata_of
from dielast.material.material import CalibratedRange

SHARES = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
FREEDOM = 6.0
COUNT = 800
INDEPENDENT = 2 * MOST_WALKERS  # at the least: two draws of each walker
PATHS = ("equilibrium.I2_share", "equilibrium.J_lim", "nonequilibrium.relaxation_time[1]")
WRONG_BY_CHANCE = 3.5 * np.sqrt(SHARES * (1 - SHARES) / INDEPENDENT)


def likelihood_of(
    residuals: Any,
    fit: list[float],
    bounds: tuple[list[float], list[float]],
    covariance: Any,
    positive: bool = True,
    divided: bool = False,
) -> Any:
    """A likelihood with these residuals, which are 0 at the fit, and the `covariance` (p, p) there; with ranges that are `divided`,
    the parameters are constants of springs, else unknown conditions of a test.
    """
    size = len(fit)
    space = SimpleNamespace(bounds=tuple(np.array(bound) for bound in bounds), precision=np.zeros((size, size)))
    space.parameters = [SimpleNamespace(scale=None if positive else 1.0, of_test=not divided, of_shape=True)] * size
    known = np.isfinite(np.diag(covariance))
    information = np.zeros((size, size))
    information[np.ix_(known, known)] = np.linalg.inv(np.array(covariance)[np.ix_(known, known)])
    return SimpleNamespace(
        fit=SimpleNamespace(coordinates=np.array(fit), space=space, problem=SimpleNamespace(space=space)),
        residuals=residuals,
        covariance=np.array(covariance),
        standard_error=np.sqrt(np.diag(covariance)),
        information=information,
        thresholds=lambda level: np.full(size, 2.706 if level == 0.9 else 10.83),
        common_freedom=FREEDOM,
    )


def drawn_from(likelihood: Any, count: int = COUNT) -> Any:
    """Draws that agree: no warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DielastWarning)
        return draw(likelihood, profiles_of(likelihood), count)


def test_draws_of_a_linear_problem_are_students() -> None:
    """Correlated by 0.99, of different sizes, with a parameter that nothing depends on: uniform over its range."""
    error, correlation = np.array([1e-3, 0.5]), np.array([[1.0, 0.99], [0.99, 1.0]])
    covariance = np.full((3, 3), 0.0)
    covariance[:2, :2] = correlation * np.outer(error, error)
    root = np.linalg.cholesky(np.linalg.inv(covariance[:2, :2])).T
    covariance[2, 2] = np.inf
    fit = [1.0, 2.0, 8.0]
    batches = []

    def residuals(at: Any, _: Any) -> Any:
        batches.append(len(at))
        return (at[:, :2] - fit[:2]) @ root.T

    likelihood = likelihood_of(residuals, fit, ([-9.0] * 3, [9.0] * 3), covariance)
    drawn = drawn_from(likelihood)
    assert sum(batches[-FEWEST_MOVES:]) == FEWEST_MOVES * MOST_WALKERS
    assert len(batches) < 2 * FEWEST_MOVES  # with those of profiles and starts
    assert drawn.shape == (COUNT, 3)
    # density (1 + cost / freedom) ** -((freedom + 3) / 2) of two parameters: one degree of freedom more, and a smaller scale
    freedom = FREEDOM + 1
    for j in range(2):
        scaled = (drawn[:, j] - fit[j]) / error[j] * np.sqrt(freedom / FREEDOM)
        below = student.cdf(np.quantile(scaled, SHARES), freedom)
        assert np.all(np.abs(below - SHARES) < WRONG_BY_CHANCE), (j, below)
    below = (np.quantile(drawn[:, 2], SHARES) + 9) / 18
    assert np.all(np.abs(below - SHARES) < WRONG_BY_CHANCE), below
    assert np.corrcoef(drawn[:, :2].T)[0, 1] == pytest.approx(0.99, abs=0.005)


def sum_of_two(at: Any, _: Any) -> Any:
    """Only the sum of two moduli is seen: a valley with a corner, in which either of them may be anything small."""
    return ((np.exp(at[:, 0]) + np.exp(at[:, 1])) / 2 - 1)[:, None] / 0.05


def product_and_curve(at: Any, _: Any) -> Any:
    """A bent valley that is open at a bound."""
    return np.stack((at[:, 0] / 2, (at[:, 1] - at[:, 0] ** 2) / 0.3), axis=1)


@pytest.mark.trust
@pytest.mark.parametrize(
    ("residuals", "slope", "bounds", "positive"),
    [
        (sum_of_two, [[10.0, 10.0]], ([-4.0, -4.0], [2.0, 2.0]), True),
        (sum_of_two, [[10.0, 10.0]], ([-4.0, -4.0], [2.0, 2.0]), False),
        (product_and_curve, [[0.5, 0.0], [0.0, 1 / 0.3]], ([-3.0, -1.0], [1.0, 6.0]), True),
    ],
)
def test_draws_of_curved_problems_are_those_on_a_grid(
    residuals: Callable[..., Any],
    slope: list[list[float]],
    bounds: tuple[list[float], list[float]],
    positive: bool,
) -> None:
    information = np.array(slope).T @ np.array(slope)
    covariance = np.linalg.inv(information + 1e-12 * np.eye(2) * np.max(information))
    likelihood = likelihood_of(residuals, [0.0, 0.0], bounds, covariance, positive)
    drawn = drawn_from(likelihood)
    lines = [low + (high - low) * (np.arange(1500) + 0.5) / 1500 for low, high in zip(*bounds, strict=True)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
    cost = np.sum(np.square(residuals(grid, None)), axis=1)
    density = ((1 + cost / FREEDOM) ** (-(FREEDOM + 2) / 2)).reshape(1500, 1500)
    for j in range(2):
        below = np.cumsum(np.sum(density, axis=1 - j)) / np.sum(density)
        reached = np.interp(np.quantile(drawn[:, j], SHARES), lines[j], below)
        assert np.all(np.abs(reached - SHARES) < WRONG_BY_CHANCE), (j, reached)


def test_draws_divide_the_range_of_what_is_not_determined() -> None:
    """Of 320 draws in a bent valley, each quarter of the open range has 80, distributed in it as on a grid."""
    slope = np.array([[0.5, 0.0], [0.0, 1 / 0.3]])
    bounds = ([-3.0, -1.0], [1.0, 10.0])
    likelihood = likelihood_of(product_and_curve, [0.0, 0.0], bounds, np.linalg.inv(slope.T @ slope), divided=True)
    drawn = drawn_from(likelihood, 320)
    number = strata_of(drawn[:, [0]])
    assert np.bincount(number).tolist() == [80] * 4
    edges = np.linspace(-3, 1, 5)
    for k, (low, high) in enumerate(pairwise(edges.tolist())):
        own = drawn[number == k]
        assert np.all((own[:, 0] >= low) & (own[:, 0] <= high))
        lines = [np.linspace(low, high, 400), np.linspace(-1, 10, 2000)]
        grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
        cost = np.sum(np.square(product_and_curve(grid, None)), axis=1).reshape(400, 2000)
        density = (1 + cost / FREEDOM) ** (-(FREEDOM + 2) / 2)
        for j in range(2):
            below = np.cumsum(np.sum(density, axis=1 - j)) / np.sum(density)
            reached = np.interp(np.quantile(own[:, j], SHARES), lines[j], below)
            assert np.all(np.abs(reached - SHARES) < 3.5 * np.sqrt(SHARES * (1 - SHARES) / 40)), (k, j, reached)


def test_strata_of_draws_are_those_of_their_constants() -> None:
    """Halves of the first constants that the draws are enough for; a constant that the law does not have is left out."""
    random = np.random.default_rng(6)
    limit, time = 20 + 200 * random.random(100), np.exp(random.standard_normal((100, 2)))
    known = CalibratedRange(("uniaxial",), 9.0, (1.0, 2.0), (20.0, 20.0), undetermined=PATHS)
    members = [
        Material("m", 1e4, Spectrum([100.0 * t, t], [1e4, 1e4]), NoShift(20.0), Gent(limited), calibrated=known)
        for limited, (t, _) in zip(limit.tolist(), time.tolist(), strict=True)
    ]
    laws = draw_sample(members, 100, specimens=False).laws
    assert laws is not None
    assert np.array_equal(laws, 2 * (limit > np.median(limit)) + (time[:, 0] > np.median(time[:, 0])))
    # equal values share a part, as those of a draw that is repeated, and one value for all is no range
    repeated = np.repeat(limit, 2)[:, None]
    assert np.array_equal(strata_of(repeated), np.repeat(strata_of(limit[:, None]), 2))
    assert np.array_equal(strata_of(np.column_stack((np.ones(200), repeated))), strata_of(repeated))
    pinned = strata_of(np.minimum(limit, np.quantile(limit, 0.4))[:, None])
    assert np.unique(pinned[limit >= np.quantile(limit, 0.4)]).size == 1
    # no part has fewer draws than have bounds
    for equal in (1, 12, 23):
        assert np.unique(strata_of(np.append(np.ones(equal), np.arange(2, 26 - equal))[:, None])).size == (2 if equal <= 12 else 1)
    assert division(200, 6) == (4, 2)
    assert division(200, 1) == (1, 4)
    assert division(20, 3) == (0, 1)


def test_walkers_that_do_not_agree_are_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two narrow valleys with different heights of the same kind, which no move joins: R-hat is large."""

    def residuals(at: Any, _: Any) -> Any:
        return np.sin(at * 10)[:, :1] / 1e-3 + 0 * at

    likelihood = likelihood_of(residuals, [0.0, 0.0], ([-5.0, -5.0], [5.0, 5.0]), np.diag([1e-4**2, np.inf]))
    profiles = profiles_of(likelihood)
    spread = np.pi / 10 * np.arange(-15, 16)
    wide: Any = SimpleNamespace(
        verdict="", coordinate=spread, rise=np.zeros(31), points=np.stack((spread + 1e-5 * np.sin(spread), 0 * spread), axis=1)
    )
    seen: list[tuple[int, int]] = []
    most = 40
    monkeypatch.setattr(posterior, "MOST_MOVES", most)
    with pytest.warns(DielastWarning, match=rf"after {most} moves R-hat is .*, at most {AGREEMENT} is wanted"):
        draw(likelihood, [wide, profiles[1]], 60, watch=lambda check, done: seen.append((check, done)))
    # 60 draws are counted up to each of the checks
    assert [check for check, done in seen if done == 60] == [16, 32, most]
    assert [done for check, done in seen if check == most] == [7, 15, 22, 30, 37, 45, 52, 60]


def test_r_hat_is_that_of_its_definition() -> None:
    """Of normal chains whose means differ, sqrt(1 + between/within); chains of one value agree, walkers that never moved do not."""
    random = np.random.default_rng(3)
    alike = random.standard_normal((400, 50, 1))
    apart = alike + random.standard_normal((50, 1))
    wider = alike * np.where(np.arange(50) % 2, 1.0, 3.0)[:, None]
    drifting = alike + np.linspace(0, 3, 400)[:, None, None]
    still = np.repeat(random.standard_normal((1, 50, 1)), 400, axis=0)
    ratio = r_hat(np.concatenate((alike, apart, wider, drifting, still, np.ones_like(alike)), axis=2))
    assert ratio[0] == pytest.approx(1.0, abs=0.01)
    assert ratio[1] == pytest.approx(np.sqrt(2), rel=0.1)
    assert ratio[2] > 1.05
    # halves with means of -0.75 and 0.75, and a variance of 1.1875 in each
    assert ratio[3] == pytest.approx(np.sqrt(1 + 0.75**2 / 1.1875), rel=0.02)
    assert ratio[4] > 1e3
    assert ratio[5] == 1.0


def test_draws_are_the_same_for_a_seed() -> None:
    likelihood = likelihood_of(lambda at, _: at / 0.1, [0.0, 0.0], ([-5.0, -5.0], [5.0, 5.0]), np.diag([0.01, 0.01]))
    profiles = profiles_of(likelihood)
    first, again, other = (draw(likelihood, profiles, 30, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


WIDTH, NARROW = 0.2, 1e-3


@pytest.mark.parametrize(("size", "bound"), [(3, 3.0), (4, 3.0), (4, 9.0)])
def test_profiles_follow_a_narrow_valley_to_the_end_of_the_interval(size: int, bound: float) -> None:
    """The first parameter is known to 0.2, each further one follows the one before, y = x + x^2, to 0.001: the ends of its interval
    are those of the first, carried along, and so is the rise at a bound. An end before a bound that is not ruled out is open.
    """
    level, decisive = 0.9, 10.83
    slopes = (np.eye(size) - np.eye(size, k=-1)) / NARROW
    slopes[0, 0] = 1 / WIDTH
    information = slopes.T @ slopes
    covariance = np.linalg.inv(information)

    def residuals(at: Any, fits: Any) -> Any:
        follows = (at[:, 1:] - at[:, :-1] - at[:, :-1] ** 2) / NARROW
        return np.concatenate((at[:, :1] / WIDTH, follows), axis=1)

    space = SimpleNamespace(bounds=(np.full(size, -bound), np.full(size, bound)), precision=np.zeros((size, size)))
    fit = SimpleNamespace(coordinates=np.zeros(size), space=space, problem=SimpleNamespace(space=space))
    likelihood: Any = SimpleNamespace(
        fit=fit,
        residuals=residuals,
        covariance=covariance,
        standard_error=np.sqrt(np.diag(covariance)),
        information=information,
        thresholds=lambda own: np.full(size, 2.706 if own == level else decisive),
    )
    ends = WIDTH * np.sqrt(2.706) * np.array([-1.0, 1.0])
    for place, profile in enumerate(profiles_of(likelihood, level)):
        first = bound
        for _ in range(place):
            first = np.sqrt(0.25 + first) - 0.5
        ruled_out = (first / WIDTH) ** 2 >= decisive
        assert profile.verdict is (Verdict.DETERMINED if ruled_out else Verdict.LOWER)
        assert profile.lower == pytest.approx(ends[0], rel=ACCURATE)
        if ruled_out:
            assert profile.upper == pytest.approx(ends[1], rel=ACCURATE)
        else:
            assert np.isnan(profile.upper)
            assert [profile.coordinate[-1], profile.rise[-1]] == pytest.approx([bound, (first / WIDTH) ** 2], rel=1e-3)
        ends = ends + ends**2


def likelihood_with(residuals: Any, fit: list[float], bounds: tuple[list[float], list[float]], precision: Any) -> Any:
    """A likelihood with these residuals, which are 0 at the fit, and the information `precision` (p, p) there."""
    size = len(fit)
    space = SimpleNamespace(bounds=tuple(np.array(bound) for bound in bounds), precision=np.zeros((size, size)))
    problem = SimpleNamespace(space=space)
    covariance = np.linalg.inv(precision)
    return SimpleNamespace(
        fit=SimpleNamespace(coordinates=np.array(fit), space=space, problem=problem),
        residuals=residuals,
        covariance=covariance,
        standard_error=np.sqrt(np.diag(covariance)),
        information=np.array(precision),
        thresholds=lambda level: np.full(size, 2.706 if level == 0.9 else 10.83),
    )


def test_ends_are_exact_where_the_root_of_the_rise_is_curved() -> None:
    """r = (exp(x) - 1)/w and 3 (y - x^2) rise by t^2 at x = ln(1 +- w t), whatever y is."""
    width = 0.4

    def residuals(at: Any, fits: Any) -> Any:
        return np.stack(((np.exp(at[:, 0]) - 1) / width, 3 * (at[:, 1] - at[:, 0] ** 2)), axis=1)

    profile = profiles_of(likelihood_with(residuals, [0.0, 0.0], ([-9.0, -99.0], [9.0, 99.0]), np.diag([width**-2, 9.0])))[0]
    assert profile.verdict is Verdict.UPPER  # below, the rise tends to 1/w^2 = 6.25
    assert np.isnan(profile.lower)
    assert profile.upper == pytest.approx(np.log1p(width * np.sqrt(2.706)), rel=1e-3)
    assert profile.points[:, 1] == pytest.approx(profile.coordinate**2, abs=1e-3)
    assert profile.rise == pytest.approx(np.square((np.exp(profile.coordinate) - 1) / width), rel=1e-2)


def test_an_undetermined_parameter_has_the_interval_of_its_level_alone() -> None:
    """The rise tends to 9 below, beyond the line of the interval but not the decisive one, and to 1 above."""

    def residuals(at: Any, fits: Any) -> Any:
        return np.where(at < 0, 3.0, 1.0) * np.tanh(at / np.where(at < 0, 3.0, 1.0))

    (profile,) = profiles_of(likelihood_with(residuals, [0.0], ([-99.0], [99.0]), np.array([[1.0]])))
    assert profile.verdict is Verdict.UNDETERMINED
    assert profile.lower == pytest.approx(-3 * np.arctanh(np.sqrt(2.706) / 3), rel=ACCURATE)
    assert np.isnan(profile.upper)


def test_where_the_model_cannot_be_evaluated_is_ruled_out() -> None:
    """Below -0.5 there is no model; the root of the rise is 2|x|, and 1 there, below that of the interval."""

    def residuals(at: Any, fits: Any) -> Any:
        return np.where(at < -0.5, np.nan, 2 * at)

    (profile,) = profiles_of(likelihood_with(residuals, [0.0], ([-4.0], [4.0]), np.array([[4.0]])))
    assert profile.verdict is Verdict.DETERMINED
    assert profile.lower == pytest.approx(-0.5, rel=ACCURATE)
    assert profile.upper == pytest.approx(np.sqrt(2.706) / 2, rel=1e-4)
    assert np.isinf(profile.rise[0])
    assert profile.rise[-1] > 10.83


def test_all_profiles_of_a_straight_problem_take_few_batches() -> None:
    """With linear residuals each of the four points of a side takes one batch; what follows is known."""
    random, size = np.random.default_rng(5), 6
    matrix = random.standard_normal((20, size))
    batches = []

    def residuals(at: Any, fits: Any) -> Any:
        batches.append(at.shape[0])
        return at @ matrix.T

    precision = matrix.T @ matrix
    profiles = profiles_of(likelihood_with(residuals, [0.0] * size, ([-9.0] * size, [9.0] * size), precision))
    error = np.sqrt(np.diag(np.linalg.inv(precision)))
    for profile, sigma in zip(profiles, error, strict=True):
        assert [profile.lower, profile.upper] == pytest.approx([-sigma * np.sqrt(2.706), sigma * np.sqrt(2.706)], rel=1e-6)
    assert len(batches) == 4
    assert max(batches) == 2 * size * (size + 1)


def test_a_start_that_cannot_be_evaluated_is_not_where_the_parameter_is_ruled_out() -> None:
    """y follows tanh(10^4 x)/2, and the model cannot be evaluated above 0.6: where the tangent at the fit leads within 10^-4."""

    def residuals(at: Any, fits: Any) -> Any:
        x, y = at.T
        return np.where(at[:, 1:] > 0.6, np.nan, np.stack((x, 10 * (y - 0.5 * np.tanh(1e4 * x))), axis=1))

    slopes = np.array([[1.0, 0.0], [-5e4, 10.0]])
    profile = profiles_of(likelihood_with(residuals, [0.0, 0.0], ([-9.0, -9.0], [9.0, 9.0]), slopes.T @ slopes))[0]
    assert profile.upper == pytest.approx(np.sqrt(2.706), rel=ACCURATE)
    assert profile.rise == pytest.approx(np.square(profile.coordinate), rel=0.02)


def test_a_profile_is_that_of_the_lower_of_two_minima() -> None:
    """Beyond x = 0.5, y = 1 is better than y = 0; a hump between them hides it until x is larger."""

    def residuals(at: Any, fits: Any) -> Any:
        x, y = at.T
        return np.stack((x * (1 - 0.8 * y), 4 * y * (1 - y), 0.5 * y), axis=1)

    precision = np.array([[1.0, 0.0], [0.0, 16.25]])
    profile = profiles_of(likelihood_with(residuals, [0.0, 0.0], ([-99.0, -0.5], [99.0, 1.0]), precision))[0]
    y = np.linspace(-0.5, 1.0, 3001)
    for place, rise in zip(profile.coordinate, profile.rise, strict=True):
        at = np.column_stack((np.full(y.size, place), y))
        assert rise == pytest.approx(float(np.min(np.sum(np.square(residuals(at, y)), axis=1))), rel=0.02, abs=1e-6)
    assert profile.upper == pytest.approx(np.sqrt((2.706 - 0.25) / 0.04), rel=ACCURATE)  # y = 1
