"""Equations 16 to 20: identities of the discrete and the cumulative spectrum."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.polynomial import Chebyshev

from dielast.base.errors import InputError
from dielast.relaxation.schwarzl_staverman import cumulative_spectrum, discrete_moduli, fit_polynomial

levels = st.lists(st.floats(min_value=0, max_value=1e9), min_size=3, max_size=40)


def test_bunched_times_do_not_determine_a_polynomial() -> None:
    x = np.concatenate([np.linspace(0, 1e-9, 20), np.linspace(1, 1 + 1e-9, 20)])
    with pytest.raises(InputError, match="too bunched for a polynomial of degree 7"):
        fit_polynomial(x, -x, 7, np.ones(x.size))


@given(levels, st.floats(min_value=0, max_value=1e10))
def test_moduli_are_those_of_equation_20_and_add_up_to_the_total(heights: list[float], total: float) -> None:
    cumulative = np.sort(heights)
    moduli = discrete_moduli(cumulative, total)
    scale = max(total, cumulative[-1], 1e-300)
    np.testing.assert_allclose(moduli[0], (cumulative[0] + cumulative[1]) / 2, atol=1e-12 * scale)
    np.testing.assert_allclose(moduli[1:-1], (cumulative[2:] - cumulative[:-2]) / 2, atol=1e-12 * scale)
    np.testing.assert_allclose(moduli.sum(), total, atol=1e-12 * scale)


@given(levels)
def test_the_staircase_of_the_moduli_runs_through_the_cumulative_spectrum(heights: list[float]) -> None:
    cumulative = np.sort(heights)
    slower = np.cumsum(discrete_moduli(cumulative, 2 * cumulative[-1]))[:-1]
    slack = 1e-12 * max(cumulative[-1], 1e-300)
    assert np.all(slower >= cumulative[:-1] - slack)
    assert np.all(slower <= cumulative[1:] + slack)
    np.testing.assert_allclose(slower, (cumulative[:-1] + cumulative[1:]) / 2, atol=slack)


@given(st.floats(min_value=0.01, max_value=0.9), st.floats(min_value=0, max_value=1e5))
def test_a_power_law_has_a_power_law_for_its_cumulative_spectrum(exponent: float, equilibrium: float) -> None:
    curve = Chebyshev.fit([-5, 5], [6 + 5 * exponent, 6 - 5 * exponent], 1)  # G = 1e6 t^-exponent
    tau = np.logspace(-4, 4, 9)
    expected = 1e6 * (2 * tau) ** -exponent * (1 + exponent) - equilibrium
    np.testing.assert_allclose(cumulative_spectrum(curve, equilibrium, tau), expected, rtol=1e-10)


@given(st.integers(min_value=1, max_value=9), st.floats(min_value=-20, max_value=20), st.integers(min_value=0, max_value=2**31))
def test_a_polynomial_is_recovered_wherever_the_origin_of_time_lies(degree: int, origin: float, seed: int) -> None:
    coefficients = np.random.default_rng(seed).uniform(-1, 1, degree + 1)
    x = np.linspace(-7, 5, 200)
    y = np.asarray(np.polynomial.chebyshev.chebval((x + 1) / 6, coefficients), dtype=np.float64)
    fitted = fit_polynomial(x + origin, y, degree, np.ones(x.size))
    np.testing.assert_allclose(fitted(x + origin), y, atol=1e-11)
