"""The spread of offsets and tilts of whole curves: as large as they were made, whatever is known of each."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.relaxation.superposition.effects import LEAST, OFFSET, TILT, Drift, Effect, RandomEffect, likeliest

Array = NDArray[np.float64]


def told(effects: Array, stderr: Array, kind: Effect = OFFSET, drift: Drift | None = None) -> float:
    """The spread that effects tell which are each known to a standard error of their own."""
    normal = np.diag(stderr**-2.0)
    return likeliest([RandomEffect(kind, kind.first, drift)], normal, normal @ effects, 500).effects[0].spread


def test_effects_that_are_known_exactly_tell_their_root_mean_square() -> None:
    effects = 0.01 * np.random.default_rng(1).standard_normal(400)
    assert told(effects, np.full(400, 1e-5)) == pytest.approx(np.sqrt(np.mean(effects**2)), rel=0.02)


def test_the_spread_is_unbiased_where_some_are_hardly_known() -> None:
    found = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        stderr = np.where(np.arange(60) % 3 == 0, 0.05, 0.004)
        found.append(told(0.01 * rng.standard_normal(60) + stderr * rng.standard_normal(60), stderr))
    assert np.median(found) == pytest.approx(0.01, rel=0.1)


def test_noise_alone_makes_a_spread_that_is_no_larger_than_noise() -> None:
    for seed in range(20):
        stderr = np.full(12, 0.003)
        assert told(stderr * np.random.default_rng(seed).standard_normal(12), stderr) < 0.004


def test_where_nothing_is_known_the_spread_is_about_that_of_specimens_and_never_without_bounds() -> None:
    nothing = np.full(3, 1e3)
    assert 0.2 * OFFSET.usual < told(np.zeros(3), nothing) < OFFSET.usual
    assert told(np.array([0.5, -0.5, 0.5]), np.full(3, 1e-4)) == OFFSET.most
    assert told(np.zeros(3), np.full(3, 1e-9)) >= LEAST
    assert told(np.full(3, 0.1) * [1, -1, 1], np.full(3, 1e-4), TILT) == TILT.most


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
    assert told(walked, np.full(40, 1e-3)) > 0.02
    assert told(walked, np.full(40, 1e-3), drift=Drift.of(order, 0.01)) < 0.005
