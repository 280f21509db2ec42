"""What holds for the spectrum of any relaxing solid, and for the parts that find it: ends, weights, Equations 16 to 20, levels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation.ends import least_modulus, long_time_end, short_time_end, votes
from dielast.relaxation.fit import cumulative_spectrum, discrete_moduli, fit_polynomial, fit_spectrum
from dielast.relaxation.levels import likely_levels
from dielast.relaxation.result import Method, SpectrumFit

strengths = st.lists(st.floats(min_value=0, max_value=1), min_size=8, max_size=8).filter(lambda found: max(found) > 0.01)


@given(
    strengths, st.floats(min_value=0.05, max_value=1), st.floats(min_value=-12, max_value=12), st.floats(min_value=0, max_value=9)
)
@settings(max_examples=20)
def test_noise_free_series_give_their_curve_back(heights: list[float], level: float, decade: float, size: float) -> None:
    truth = Spectrum(10**decade * np.logspace(3, -4, 8), 10**size * np.array(heights))
    time = 10**decade * np.logspace(-5, 5, 201)
    young = 3 * truth.relaxation_modulus(time, 10**size * level)
    fit = fit_spectrum(time, young, method="nnls", branches=8, relaxation_time=(10**decade * 1e-4, 10**decade * 1e3))
    assert fit.max_relative_error < 1e-6
    assert np.all(fit.spectrum.shear_modulus >= 0)


@given(
    st.sampled_from(["schwarzl-staverman", "nnls"]),
    st.integers(min_value=0, max_value=2**31),
    st.integers(min_value=9, max_value=80),
    st.integers(min_value=3, max_value=40),
)
@settings(max_examples=25)
@pytest.mark.filterwarnings("ignore::dielast.base.errors.DielastWarning")
def test_any_curve_gives_a_finite_spectrum_or_a_refusal(method: Method, seed: int, points: int, branches: int) -> None:
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(-6, 6, points))
    modulus = 10 ** (rng.uniform(3, 9) - np.cumsum(rng.exponential(rng.uniform(0, 0.2), points)))
    noisy = modulus * np.exp(rng.uniform(0, 0.05) * rng.standard_normal(points))
    refused = ""
    try:
        fit = fit_spectrum(10**x, noisy, method=method, branches=branches)
    except InputError as refusal:
        refused = str(refusal)
    if refused:
        assert "moduli came out negative" in refused or "exceeds all numbers" in refused  # a polynomial across a wide gap
        return
    assert np.all(np.isfinite(fit.model))
    assert np.isfinite(fit.rms_relative_error)
    assert np.all(fit.spectrum.shear_modulus >= 0)
    assert fit.equilibrium_shear_modulus >= 0


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


def test_the_least_modulus_is_not_below_a_curve_that_bends_to_its_plateau() -> None:
    x = np.linspace(-2, 3, 200)
    modulus = 3e4 + 3e5 * np.exp(-(10**x) / 100)
    assert long_time_end(x, modulus).modulus < 0.8 * modulus[-1]
    assert modulus[-1] <= least_modulus(x, modulus) < 1.02 * modulus[-1]
    straight = 1e6 * 10 ** (-0.5 * x)
    assert 1 <= least_modulus(x, straight) / straight[-1] < 10 ** (0.5 * 0.13)


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


LONGER = np.geomspace(0.01, 1e4, 240)  # s
NOISE = 0.005
CHANCE = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
NORMAL = np.array([-1.6449, -0.6745, 0.0, 0.6745, 1.6449])  # at these chances


def fitted(time: NDArray[np.float64], slowest: float, seed: int) -> SpectrumFit:
    """A fit to noisy readings of three branches, of which the slowest one has this modulus."""
    truth = Spectrum(np.array([100.0, 1.0, 0.01]), np.array([slowest, 2e5, 3e5]))
    noise = NOISE * np.random.default_rng(seed).standard_normal(time.size)
    modulus = 3 * truth.relaxation_modulus(time, 1e5) * (1 + noise)
    return fit_spectrum(time, modulus, branches=3, relaxation_time=(0.01, 100.0))


def test_where_no_modulus_is_near_zero_it_is_least_squares() -> None:
    """Mean and standard deviation are then those of the linear problem, and so is every quantile."""
    fit = fitted(LONGER, 1e5, 5)
    design = np.column_stack([np.exp(-LONGER[:, None] / fit.spectrum.relaxation_time), np.ones(LONGER.size)])
    rows = design / (fit.measured[:, None] / 3)
    best, square, *_ = np.linalg.lstsq(rows, np.ones(LONGER.size), rcond=None)
    deviation = np.sqrt(float(square[0]) / (LONGER.size - 4) * np.linalg.inv(rows.T @ rows)[-1, -1])
    level = likely_levels(fit, CHANCE) * fit.equilibrium_shear_modulus
    np.testing.assert_allclose(level, best[-1] + NORMAL * deviation, rtol=0, atol=0.02 * deviation)


def test_a_curve_without_noise_leaves_nothing_open() -> None:
    truth = Spectrum(np.array([100.0, 1.0, 0.01]), np.array([1e5, 2e5, 3e5]))
    fit = fit_spectrum(LONGER, 3 * truth.relaxation_modulus(LONGER, 1e5), branches=3, relaxation_time=(0.01, 100.0))
    np.testing.assert_allclose(likely_levels(fit, CHANCE) * fit.equilibrium_shear_modulus, 1e5, rtol=1e-5)
