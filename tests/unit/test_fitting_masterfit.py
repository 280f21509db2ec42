"""The joint fit of smooth curve and shifts: derivatives, spreads of offsets, criteria, and errors that hold what they promise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from dielast.base.errors import DielastWarning
from dielast.relaxation.superposition import joint_fit, joint_problem
from dielast.relaxation.superposition.checks import find_undetermined
from dielast.relaxation.superposition.effects import (
    LEAST,
    NONE,
    OFFSET,
    SPREAD_RATIO,
    Drift,
    Effect,
    RandomEffect,
    likeliest,
    probable,
)
from dielast.relaxation.superposition.joint_fit import MasterFit, fit_held, fit_master
from dielast.relaxation.superposition.joint_problem import LOOSE, MAX_STEP
from dielast.relaxation.superposition.points import FitPoints, Weights, even_weights
from dielast.relaxation.superposition.spline import Spline, roughness

Array = NDArray[np.float64]
TRUTH = np.array([3.0, 1.5, 0.0, -1.2, -2.5])
ANCHOR = 2
SIZE = 30


def transition(u: Array) -> Array:
    """Two decades of modulus between two plateaus, in closed form."""
    return np.asarray(7 - np.tanh(u / 2))


def measured(noise: float = 0.005, seed: int = 0, offset: ArrayLike = 0.0, second: float | None = None) -> FitPoints:
    """Five curves of the transition, each raised by its `offset`; with a `second` channel, lifted that many times as much."""
    rng = np.random.default_rng(seed)
    m, channels = TRUTH.size, 1 if second is None else 2
    curve = np.tile(np.repeat(np.arange(m), SIZE), channels)
    channel = np.repeat(np.arange(channels), m * SIZE)
    x = np.tile(np.linspace(0.0, 3.0, SIZE), m * channels)
    u = x - TRUTH[curve]
    lift = np.where(channel == 1, second or 0.0, 1.0)
    y = np.where(channel == 1, 5 - 0.3 * np.cos(u), transition(u)) + lift * np.broadcast_to(offset, m)[curve]
    return FitPoints(curve, x, y + noise * rng.standard_normal(u.size), np.full(u.size, noise**2), m, channel, lift, channels)


def off(points: FitPoints, fit: MasterFit, splines: Sequence[Spline]) -> Array:
    """What every point misses the smooth curves by."""
    u = points.log_time - fit.shift[points.curve]
    raised = points.log_modulus + points.lift * fit.vertical[points.curve]
    return np.asarray(raised - np.choose(points.channel, [spline(u) for spline in splines]))


@pytest.mark.parametrize("vertical", [False, True])
@pytest.mark.parametrize("second", [None, 0.4])
def test_placed_curves_go_through_the_points_as_they_lie(vertical: bool, second: float | None) -> None:
    """Vertical shifts count only if they are free: offsets that are merely allowed for are part of what is missed."""
    offset = np.array([0.02, -0.03, 0.01, -0.01, 0.03])
    points = measured(0.002, offset=offset, second=second)
    fit = fit_master(points, [TRUTH + 0.2], ANCHOR, vertical)
    missed = np.mean(off(points, fit, fit.splines) ** 2)
    assert np.mean(off(points, fit, fit.placed) ** 2) <= missed * (1.0 if vertical else 0.95)
    np.testing.assert_allclose(fit.shift - fit.shift[ANCHOR], TRUTH, atol=0.06)
    assert fit.shift[ANCHOR] == 0.2
    if vertical:
        np.testing.assert_allclose(fit.vertical, -(offset - offset[ANCHOR]), atol=0.01)
        assert np.all(fit.covariance[ANCHOR] == 0)
        assert np.all(np.delete(np.diag(fit.covariance), [ANCHOR, TRUTH.size + ANCHOR]) > 0)
        assert fit.offset_spread == 0
    else:
        assert np.all(fit.vertical == 0)
        assert np.all(fit.covariance[TRUTH.size :] == 0)
        assert np.all(fit.covariance[:, TRUTH.size :] == 0)
        assert np.sqrt(missed) > 0.01


@pytest.mark.parametrize("second", [None, 0.4])
def test_standard_errors_are_true(second: float | None) -> None:
    """Over many repetitions, errors in units of their standard errors have a mean square of one at most: offsets and tilts, of
    which there are none, are allowed for."""
    score = []
    for seed in range(12):
        fit = fit_master(measured(seed=seed, second=second), [TRUTH], ANCHOR, False)
        assert fit.offset_spread < 0.01
        score.append(np.delete((fit.shift - TRUTH) / np.sqrt(np.diag(fit.covariance)[:5] + 1e-300), ANCHOR))
        np.testing.assert_allclose(fit.noise_stderr, np.sqrt(np.diag(fit.covariance)[:5]))
    assert 0.3 < np.mean(np.square(score)) < 1.4


def test_without_information_the_spread_is_none_or_the_usual_one() -> None:
    """The sum over few spreads is that of the prior; data of the offsets outweigh it."""
    dense = np.geomspace(1e-6, OFFSET.most, 100_000)
    prior = dense**2 / (1 + (dense / OFFSET.usual) ** 2) ** 1.5
    # of the sum over a step h, the last spread counts whole: this is the integral and h/2 of the integrand there (Euler, Maclaurin)
    dense_step, step = np.log(dense[1] / dense[0]), np.log(SPREAD_RATIO) / (OFFSET.nodes - 1)
    prior[-1] += prior[-1] * (step - dense_step) / (2 * dense_step)
    mean_square = (1 - NONE) * float(prior @ dense**2 / np.sum(prior))
    curves, effects = 9, [RandomEffect(OFFSET, OFFSET.first)]
    for size, wanted in ((0.0, mean_square**0.5), (0.03, 0.03)):
        known = 0.0 if size == 0 else 1e8  # of each offset, to 0.0001 decades
        offsets = size * np.where(np.arange(curves) % 2, 1.0, -1.0)
        probability, precisions = probable(effects, known * np.eye(curves), known * offsets)
        square = 1 / precisions[:, 0, 0]
        assert np.sqrt(probability @ square) == pytest.approx(wanted, rel=0.15)
        assert np.sum(probability[square < 2 * LEAST**2]) == pytest.approx(NONE if size == 0 else 0.0, abs=0.01)


def test_a_shift_factor_that_offsets_hide_says_so() -> None:
    """A curve that falls by 0.02 decades a decade, where offsets are 0.01 decades."""
    points = measured()
    slow = np.where(points.curve == 0, 8 - 0.02 * points.log_time, points.log_modulus)
    points = replace(points, log_modulus=slow + 1e-4 * np.random.default_rng(1).standard_normal(slow.size))
    fit = replace(fit_master(points, [TRUTH], ANCHOR, False), noise_stderr=np.full(5, 0.6), offset_spread=0.01)
    with pytest.warns(DielastWarning, match="not determined"):
        first, _, steep, *_ = find_undetermined(np.arange(5.0), points, fit.splines, fit, False, False, "")
    offset = "the curve changes by 4.7 % a decade, and an offset of 2.3 %, as the curves have, looks like a shift by 0.5 decades"
    assert first.reason == f"it is known to +- 0.6 decades only: {offset}"
    assert steep.reason == "it is known to +- 0.6 decades only"


@pytest.mark.trust
def test_a_stated_drift_is_in_the_standard_errors() -> None:
    """A walk that is stated to the fit: standard errors are 0.85 to 1.6 times the actual ones."""
    order, score, without = np.array([4, 3, 2, 1, 0]), [], []
    for seed in range(40):
        walked = np.empty(5)
        walked[order] = np.cumsum(0.01 * np.random.default_rng(200 + seed).standard_normal(5))
        points = measured(0.003, seed, walked)
        for drift, where in ((Drift.of(order, 0.01), score), (None, without)):
            fit = fit_master(points, [TRUTH], ANCHOR, False, drift)
            where.append(np.delete((fit.shift - TRUTH) / np.sqrt(np.diag(fit.covariance)[:5] + 1e-300), ANCHOR))
    assert 1.6**-2 < np.mean(np.square(score)) < 0.85**-2
    assert np.mean(np.square(score)) < np.mean(np.square(without)) * 1.1


def state_of(
    points: FitPoints, theta: Array, prior: joint_problem.Prior, weight: Array, spacing: float = 0.5
) -> joint_problem.State:
    weights = Weights(weight, 1 / weight, 0.0)
    return joint_problem.State.of(points, theta, prior, weights, spacing)


def prior_of(theta: Array, free: list[int]) -> joint_problem.Prior:
    rng = np.random.default_rng(5)
    mean, root = theta + rng.normal(0.0, 0.3, theta.size), rng.normal(0.0, 3.0, (theta.size, theta.size))
    return joint_problem.Prior(mean, root @ root.T + 50 * np.eye(theta.size), np.array(free), float(len(free)))


INNER = [1, 2, 3, 5, 6, 7, 8, 9]  # shifts that leave the ends of the smooth curve where they are, and all vertical shifts


@pytest.mark.parametrize("second", [None, 0.4])
@pytest.mark.parametrize("free", [INNER, [1, 2, 3]])
def test_the_gradient_is_half_the_slope_of_what_is_minimised(second: float | None, free: list[int]) -> None:
    """The weighted squares, the prior of the shifts, and that of the coefficients, all after the coefficients were fitted."""
    points = measured(0.05, second=second)
    rng = np.random.default_rng(3)
    weight = rng.uniform(10.0, 300.0, points.curve.size)
    theta = np.concatenate((TRUTH, np.zeros(5))) + rng.normal(0.0, 0.1, 10)
    prior = prior_of(theta, free)

    def cost(theta: Array) -> float:
        state = state_of(points, theta, prior, weight)
        each = state.splines[0].coefficient.size
        parts = [spline.coefficient @ roughness(each, 0.5) @ spline.coefficient for spline in state.splines]
        away = theta - prior.mean
        assert state.cost == pytest.approx(weight @ state.residual**2 + away @ prior.precision @ away, rel=1e-12)
        return float(state.cost + sum(parts))

    slope = [(cost(theta + move) - cost(theta - move)) / 2e-5 for move in 1e-5 * np.eye(10)[free]]
    np.testing.assert_allclose(state_of(points, theta, prior, weight).gradient, np.array(slope) / 2, rtol=1e-5)


@pytest.mark.parametrize("away", [0.05, 0.4, -2.0])
def test_a_step_is_bounded_and_never_goes_uphill(away: float) -> None:
    points = measured(0.01)
    theta = np.concatenate((TRUTH + away * np.array([1.0, -1.0, 0.0, 0.5, 1.0]), np.zeros(5)))
    prior = joint_problem.Prior(theta, np.eye(10) * LOOSE, np.array([0, 1, 3, 4]), 4.0)
    state = state_of(points, theta, prior, even_weights(points.variance).weight)
    for _ in range(12):
        new, moved = joint_problem.gauss_newton_step(state)
        assert np.max(np.abs(new.theta - state.theta)) <= MAX_STEP * (1 + 1e-12)
        if moved >= joint_problem.CONVERGED:
            assert new.cost <= state.cost
        state = new
    if abs(away) < 1:  # from farther off, curves may come to rest on plateaus
        np.testing.assert_allclose(state.theta[:5], TRUTH, atol=0.1)


def line(slope: float, noise: float, seed: int = 0) -> FitPoints:
    """Five straight lines, whose horizontal and vertical shifts mean the same."""
    points = measured(noise, seed)
    straight = 7 - slope * (points.log_time - TRUTH[points.curve])
    rng = np.random.default_rng(seed)
    return replace(points, log_modulus=straight + noise * rng.standard_normal(straight.size))


def held(shift: Array, covariance: Array) -> MasterFit:
    fit = fit_master(measured(), [TRUTH], ANCHOR, False)
    whole = np.zeros((10, 10))
    whole[:5, :5] = covariance
    return replace(fit, shift=shift, covariance=whole)


SHIFT_COVARIANCE = np.diag([0.04, 0.02, 0.0, 0.01, 0.03])
SHIFT_COVARIANCE[0, 1] = SHIFT_COVARIANCE[1, 0] = 0.01


def test_errors_of_shifts_that_are_held_go_on_to_the_vertical_shifts() -> None:
    """Of a line with slope p: b moves by p times the shift, and so do its errors, beside those of its own noise."""
    slope, wrong = 0.3, np.array([0.4, -0.2, 0.0, 0.1, -0.3])
    fit = fit_held(line(slope, 1e-4), held(TRUTH + wrong, SHIFT_COVARIANCE), ANCHOR, True)
    np.testing.assert_allclose(fit.vertical, slope * wrong, atol=1e-3)
    np.testing.assert_array_equal(fit.shift, TRUTH + wrong)
    np.testing.assert_array_equal(fit.covariance[:5, :5], SHIFT_COVARIANCE)
    np.testing.assert_allclose(fit.covariance[5:, :5], slope * SHIFT_COVARIANCE, atol=1e-5)
    np.testing.assert_allclose(fit.covariance[:5, 5:], slope * SHIFT_COVARIANCE, atol=1e-5)
    np.testing.assert_allclose(fit.covariance[5:, 5:], slope**2 * SHIFT_COVARIANCE, atol=1e-5)


@pytest.mark.parametrize(("slope", "ambiguous"), [(0.03, True), (2.0, False)])
def test_bends_too_small_to_see_widen_the_errors_if_they_move_the_shifts(slope: float, ambiguous: bool) -> None:
    """Curves bend by half a percent one way or the other: on shallow ones that is a tenth of a decade and more."""
    points = measured(2e-4)
    u, x = points.log_time - TRUTH[points.curve], points.log_time - 1.5
    bent = 7 - slope * u + 0.006 * (x**2 - 1) * np.array([1.0, -1.0, 0.0, 1.0, -1.0])[points.curve]
    fit = fit_master(replace(points, log_modulus=bent + points.log_modulus - transition(u)), [TRUTH], ANCHOR, False)
    assert fit.misfit.rms < 0.01
    far = np.sqrt(np.max(np.diag(fit.covariance)[:5]))
    assert (far > joint_fit.AMBIGUOUS) == ambiguous
    assert np.all(np.sqrt(np.diag(fit.covariance)[:5]) >= fit.noise_stderr)


def spread_of(effects: Array, stderr: Array, kind: Effect = OFFSET, drift: Drift | None = None) -> float:
    """The likeliest spread of effects (k,) with these standard errors (k,)."""
    normal = np.diag(stderr**-2.0)
    return likeliest([RandomEffect(kind, kind.first, drift)], normal, normal @ effects, 500)[0][0].spread


def test_effects_that_are_known_exactly_tell_their_root_mean_square() -> None:
    effects = 0.01 * np.random.default_rng(1).standard_normal(400)
    assert spread_of(effects, np.full(400, 1e-5)) == pytest.approx(np.sqrt(np.mean(effects**2)), rel=0.02)


def test_the_spread_is_unbiased_where_some_are_hardly_known() -> None:
    found = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        stderr = np.where(np.arange(60) % 3 == 0, 0.05, 0.004)
        found.append(spread_of(0.01 * rng.standard_normal(60) + stderr * rng.standard_normal(60), stderr))
    assert np.median(found) == pytest.approx(0.01, rel=0.1)


def test_noise_alone_makes_a_spread_that_is_no_larger_than_noise() -> None:
    for seed in range(20):
        stderr = np.full(12, 0.003)
        assert spread_of(stderr * np.random.default_rng(seed).standard_normal(12), stderr) < 0.004


def test_a_walk_is_as_far_from_its_beginning_as_there_are_steps() -> None:
    order = np.array([2, 0, 1])
    drift = Drift.of(order, 0.02)
    covariance = 0.02**2 * drift.walk
    np.testing.assert_allclose(np.diag(covariance)[order], 0.02**2 * np.array([1, 2, 3]))
    draws = np.empty((200_000, 3))
    draws[:, order] = np.cumsum(0.02 * np.random.default_rng(0).standard_normal((200_000, 3)), axis=1)
    np.testing.assert_allclose(np.cov(draws, rowvar=False), covariance, rtol=0.02, atol=1e-5)
    np.testing.assert_allclose(
        RandomEffect(OFFSET, 1e-3, drift).precision(3) @ (covariance + 1e-6 * np.eye(3)), np.eye(3), atol=1e-9
    )


def test_what_a_stated_drift_explains_is_no_spread_besides() -> None:
    order = np.arange(40)
    rng = np.random.default_rng(5)
    walked = np.cumsum(0.01 * rng.standard_normal(40))
    assert spread_of(walked, np.full(40, 1e-3)) > 0.02
    assert spread_of(walked, np.full(40, 1e-3), drift=Drift.of(order, 0.01)) < 0.005
