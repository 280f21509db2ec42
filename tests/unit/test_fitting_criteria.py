"""What judges a joint fit: correlation of neighbours, Akaike's criterion, and how close knots may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.relaxation.superposition import joint_problem
from dielast.relaxation.superposition.joint_fit import knot_spacings
from dielast.relaxation.superposition.joint_problem import LOOSE
from dielast.relaxation.superposition.points import FitPoints, Weights

Array = NDArray[np.float64]

TRUTH = np.array([3.0, 1.5, 0.0, -1.2, -2.5])


def with_residual(residual: Array, variance: float) -> tuple[FitPoints, joint_problem.State]:
    """A state of two series of fifty points that misses them by this."""
    curve = np.repeat([0, 1], 50)
    x = np.tile(np.linspace(0.0, 3.0, 50), 2)
    points = FitPoints(curve, x, 7 - x, np.full(100, variance), 2, np.zeros(100, dtype=int), np.ones(100))
    prior = joint_problem.Prior(np.zeros(4), np.eye(4) * LOOSE, np.array([1]), 1.0)
    weights = Weights(np.full(100, 1 / variance), np.full(100, variance), 0.0)
    state = joint_problem.assemble(points, np.zeros(4), prior, weights, 0.5)
    return points, replace(state, parts=replace(state.parts, residual=residual))


def test_neighbours_that_miss_alike_widen_the_errors() -> None:
    """By (1 + r)/(1 - r), of neighbours on one curve; a correlation that chance makes counts for nothing."""
    sign = np.repeat([1.0, -1.0], 50)
    assert joint_problem.correlation(*with_residual(0.1 * sign, 0.01)) == pytest.approx(1.98 / 0.02)
    assert joint_problem.correlation(*with_residual(0.1 * np.tile([1.0, -1.0], 50), 0.01)) == 1.0
    blocks = np.tile(np.repeat([1.0, -1.0], 5), 10)  # of ten neighbours two differ in sign
    assert joint_problem.correlation(*with_residual(blocks, 0.01)) == pytest.approx(1.6 / 0.4, rel=0.1)
    weak = np.tile([1.0, 1.0, -1.0, -1.0, 1.0], 20)  # r = 0.2, with a standard error of 0.1
    assert joint_problem.correlation(*with_residual(weak, 0.01)) == 1.0


def test_akaike_corrected_for_small_samples() -> None:
    """Hurvich and Tsai's 2 p n/(n - p - 1), the log likelihood of normal errors, and sixteen at most for one point."""
    residual = np.concatenate(([0.5, -0.9], np.full(98, 0.1)))
    _, state = with_residual(residual, 0.01)
    p = state.splines[0].coefficient.size + 1
    assert state.parameters == p
    expected = 100 * np.log(0.01) + 16 + 16 + 98 + 2 * p * 100 / (100 - p - 1)
    assert joint_problem.akaike(state, 0.0) == pytest.approx(expected, rel=1e-12)
    for spare in (2, 1, 0, -5):  # points beyond the parameters and one; what is divided by is one at least
        many = replace(state, freedom=100.0 - 1 - spare - (p - 1))
        assert joint_problem.akaike(many, 0.0) - expected == pytest.approx(
            200 * (99 - spare) / max(spare, 1) - 200 * p / (99 - p), rel=1e-12
        )


def test_knots_are_never_closer_than_three_points_are() -> None:
    for size, channels in ((4, 1), (10, 1), (30, 1), (200, 1), (30, 2)):
        x = np.linspace(0.0, 3.0, size)
        curve = np.tile(np.repeat(np.arange(5), size), channels)
        count = curve.size
        points = FitPoints(
            *(curve, np.tile(x, 5 * channels), np.zeros(count), np.zeros(count), 5),
            *(np.repeat(np.arange(channels), 5 * size), np.ones(count), channels),
        )
        theta = np.concatenate((TRUTH, np.zeros(5)))
        spacings = knot_spacings(points, theta, 4)
        span = 3.0 + np.ptp(TRUTH)
        assert np.all(np.diff(spacings) < 0)
        assert np.all(spacings[:-1] / spacings[1:] <= 1.5 + 1e-9)
        assert span / spacings[-1] <= (5 * size - 4) / 3 + 1e-9
        assert spacings[0] <= max(1.6, spacings[-1]) + 1e-9
        assert spacings[-1] <= max(0.15, 3 * span / (5 * size - 4)) + 1e-9  # and as close as that, if it takes it
