"""Profiles of a chain of parameters in a narrow curved valley, whose ends are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast.calibration.courses import ACCURATE
from dielast.calibration.profiles import Verdict, profiles_of

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


def likelihood_of(residuals: Any, fit: list[float], bounds: tuple[list[float], list[float]], precision: Any) -> Any:
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

    profile = profiles_of(likelihood_of(residuals, [0.0, 0.0], ([-9.0, -99.0], [9.0, 99.0]), np.diag([width**-2, 9.0])))[0]
    assert profile.verdict is Verdict.UPPER  # below, the rise tends to 1/w^2 = 6.25
    assert np.isnan(profile.lower)
    assert profile.upper == pytest.approx(np.log1p(width * np.sqrt(2.706)), rel=1e-3)
    assert profile.points[:, 1] == pytest.approx(profile.coordinate**2, abs=1e-3)
    assert profile.rise == pytest.approx(np.square((np.exp(profile.coordinate) - 1) / width), rel=1e-2)


def test_an_undetermined_parameter_has_the_interval_of_its_level_alone() -> None:
    """The rise tends to 9 below, beyond the line of the interval but not the decisive one, and to 1 above."""

    def residuals(at: Any, fits: Any) -> Any:
        return np.where(at < 0, 3.0, 1.0) * np.tanh(at / np.where(at < 0, 3.0, 1.0))

    (profile,) = profiles_of(likelihood_of(residuals, [0.0], ([-99.0], [99.0]), np.array([[1.0]])))
    assert profile.verdict is Verdict.UNDETERMINED
    assert profile.lower == pytest.approx(-3 * np.arctanh(np.sqrt(2.706) / 3), rel=ACCURATE)
    assert np.isnan(profile.upper)


def test_where_the_model_cannot_be_evaluated_is_ruled_out() -> None:
    """Below -0.5 there is no model; the root of the rise is 2|x|, and 1 there, below that of the interval."""

    def residuals(at: Any, fits: Any) -> Any:
        return np.where(at < -0.5, np.nan, 2 * at)

    (profile,) = profiles_of(likelihood_of(residuals, [0.0], ([-4.0], [4.0]), np.array([[4.0]])))
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
    profiles = profiles_of(likelihood_of(residuals, [0.0] * size, ([-9.0] * size, [9.0] * size), precision))
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
    profile = profiles_of(likelihood_of(residuals, [0.0, 0.0], ([-9.0, -9.0], [9.0, 9.0]), slopes.T @ slopes))[0]
    assert profile.upper == pytest.approx(np.sqrt(2.706), rel=ACCURATE)
    assert profile.rise == pytest.approx(np.square(profile.coordinate), rel=0.02)


def test_a_profile_is_that_of_the_lower_of_two_minima() -> None:
    """Beyond x = 0.5, y = 1 is better than y = 0; a hump between them hides it until x is larger."""

    def residuals(at: Any, fits: Any) -> Any:
        x, y = at.T
        return np.stack((x * (1 - 0.8 * y), 4 * y * (1 - y), 0.5 * y), axis=1)

    precision = np.array([[1.0, 0.0], [0.0, 16.25]])
    profile = profiles_of(likelihood_of(residuals, [0.0, 0.0], ([-99.0, -0.5], [99.0, 1.0]), precision))[0]
    y = np.linspace(-0.5, 1.0, 3001)
    for place, rise in zip(profile.coordinate, profile.rise, strict=True):
        at = np.column_stack((np.full(y.size, place), y))
        assert rise == pytest.approx(float(np.min(np.sum(np.square(residuals(at, y)), axis=1))), rel=0.02, abs=1e-6)
    assert profile.upper == pytest.approx(np.sqrt((2.706 - 0.25) / 0.04), rel=ACCURATE)  # y = 1
