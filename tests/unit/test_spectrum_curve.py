"""Weights and ends of a relaxation curve."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast import Plateaus
from dielast.relaxation.ends import least_modulus, long_time_end, short_time_end, votes
from dielast.relaxation.fit import fit_spectrum


def test_points_far_apart_count_one_each_and_crowds_share() -> None:
    x = np.array([-5.0, 0.0, 0.01, 0.02, 3.0, 3.0])
    np.testing.assert_allclose(votes(x), [1, 1 / 3, 1 / 3, 1 / 3, 1 / 2, 1 / 2])


@given(st.lists(st.floats(min_value=-10, max_value=10), min_size=1, max_size=200))
def test_a_curve_has_no_more_votes_than_points_nor_than_forty_a_decade(times: list[float]) -> None:
    x = np.sort(times)
    weight = votes(x)
    assert np.all((weight > 0) & (weight <= 1))
    assert weight.sum() <= 40 * (x[-1] - x[0]) + 1.001


def test_ends_are_read_from_a_straight_line_through_a_decade_of_noisy_points() -> None:
    x = np.linspace(-4, 4, 401)
    rng = np.random.default_rng(7)
    curve = 10 ** (6 - 0.2 * np.clip(x, -3, 3)) * (1 + 0.02 * rng.standard_normal(x.size))
    short, long = short_time_end(x, curve), long_time_end(x, curve)
    assert short.modulus == pytest.approx(10**6.6, rel=0.02)
    assert long.modulus == pytest.approx(10**5.4, rel=0.02)
    assert abs(short.slope) < 0.01
    assert abs(long.slope) < 0.01
    falling = 10 ** (6 - 0.2 * x)
    assert long_time_end(x, falling).slope == pytest.approx(-0.2)
    assert long_time_end(x, falling).modulus == pytest.approx(10**5.2)


def test_a_lone_end_point_speaks_for_itself() -> None:
    assert long_time_end(np.array([-3.0, 0.0, 4.0]), np.array([3.0, 2.0, 1.0])) == (1.0, 0.0)


def test_the_least_modulus_is_not_below_a_curve_that_bends_to_its_plateau() -> None:
    x = np.linspace(-2, 3, 200)
    modulus = 3e4 + 3e5 * np.exp(-(10**x) / 100)
    assert long_time_end(x, modulus).modulus < 0.8 * modulus[-1]
    assert modulus[-1] <= least_modulus(x, modulus) < 1.02 * modulus[-1]
    straight = 1e6 * 10 ** (-0.5 * x)
    assert 1 <= least_modulus(x, straight) / straight[-1] < 10 ** (0.5 * 0.13)


def test_the_true_equilibrium_modulus_of_a_late_process_is_taken() -> None:
    time = np.logspace(-4, 4, 400)
    modulus = 3e4 + 3e5 * np.exp(-time[:, None] / np.array([1e-2, 1e3])).sum(axis=1)
    fit = fit_spectrum(
        time, modulus, method="nnls", branches=6, relaxation_time=(1e-2, 1e3), plateaus=Plateaus(equilibrium_modulus=3e4)
    )
    assert fit.rms_relative_error < 1e-6
