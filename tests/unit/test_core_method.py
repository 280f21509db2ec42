"""Dense output of the method: an order of its own, at every fraction of the step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dielast.numerics.rosenbrock import RODAS5P
from dielast.numerics.stride import TriedStep

NOTHING: Any = None  # dense output asks no system


@pytest.mark.parametrize("theta", [0.1, 0.35, 0.5, 0.8, 1.0])
def test_dense_output_meets_the_conditions_of_order_four(theta: float) -> None:
    """Hairer and Wanner, Solving ODEs II, table IV.7.1, each with the power of theta that the exact solution has there."""
    method, size = RODAS5P, RODAS5P.stages
    gamma = np.linalg.inv(np.eye(size) / method.gamma - method.c)
    alpha, beta = method.a @ gamma, method.a @ gamma + gamma
    # the increments of one stage alone, so that the state at theta is that stage's weight
    columns, none = np.arange(size), np.zeros(size)
    weights = method.a[-1] + np.eye(size)[-1]
    stride = TriedStep(
        NOTHING,
        method,
        columns,
        np.ones(size, dtype=bool),
        none,
        none + 1,
        none + 1,
        np.zeros((1, size)),
        weights[None],
        np.eye(size)[:, None],
        columns,
        none,
        none + 1,
        none + 1,
    )
    b = stride.dense(slice(None), columns, np.full(size, theta))[0] @ gamma
    a, t = alpha.sum(axis=1), beta.sum(axis=1)
    for value, wanted in (
        (b.sum(), theta),
        (b @ t, theta**2 / 2),
        (b @ a**2, theta**3 / 3),
        (b @ beta @ t, theta**3 / 6),
        (b @ a**3, theta**4 / 4),
        (b @ (a * (alpha @ t)), theta**4 / 8),
        (b @ beta @ a**2, theta**4 / 12),
        (b @ beta @ beta @ t, theta**4 / 24),
    ):
        assert value == pytest.approx(wanted, abs=1e-12)


def test_dense_output_ends_where_the_step_does() -> None:
    random = np.random.default_rng(0)
    before, after, increments = random.normal(size=(3, 2)), random.normal(size=(3, 2)), random.normal(size=(8, 3, 2))
    one = np.ones(2)
    stride = TriedStep(
        NOTHING, RODAS5P, np.arange(2), one > 0, one, one, one, before, after, increments, np.arange(2), one, one, one
    )
    assert np.array_equal(stride.dense(slice(None), np.arange(2), np.zeros(2)), before)
    assert np.array_equal(stride.dense(slice(None), np.arange(2), one), after)
    assert np.array_equal(stride.dense(slice(1, None), np.array([1]), one[:1]), after[1:, 1:])
    assert stride.halfway() == pytest.approx(stride.dense(slice(None), np.arange(2), 0.5 * one), rel=1e-14)
