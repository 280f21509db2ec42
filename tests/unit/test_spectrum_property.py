"""What holds for the spectrum of any relaxing solid, discrete or continuous, and for the parts that find it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray

from dielast import Plateaus
from dielast.base.errors import DielastWarning, InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation.continuous import continuous_spectrum
from dielast.relaxation.creep import fit_creep
from dielast.relaxation.ends import least_modulus, long_time_end, short_time_end, votes
from dielast.relaxation.fit import cumulative_spectrum, discrete_moduli, fit_oscillation, fit_polynomial, fit_spectrum
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


Array = NDArray[np.float64]
TIME = np.logspace(-6, 6, 241)
LEVEL = 1e4  # Pa, shear


def box(tau: Array) -> Array:
    return np.where((tau > 1e-3) & (tau < 1e3), 1e5, 0.0)


def wedge(tau: Array) -> Array:
    return np.where((tau > 1e-3) & (tau < 1e3), 1e5 * tau**-0.5, 0.0)


def log_normal(tau: Array) -> Array:
    return np.asarray(1e5 * np.exp(-0.5 * (np.log(tau) / 3) ** 2))


def young(spectrum: Callable[[Array], Array]) -> Array:
    """Young's relaxation modulus by the midpoint rule in ln tau."""
    edges = np.linspace(np.log(1e-10), np.log(1e10), 20001)
    tau, width = np.exp((edges[1:] + edges[:-1]) / 2), edges[1] - edges[0]
    present = spectrum(tau) > 0
    return np.asarray(3 * (LEVEL + np.exp(-TIME[:, None] / tau[present]) @ spectrum(tau[present]) * width))


def fitted_to(curve: Array, noise: float, level: float = LEVEL) -> SpectrumFit:
    scatter = 1 + noise * np.random.default_rng(1).standard_normal(TIME.size)
    return fit_spectrum(TIME, curve * scatter, method="nnls", plateaus=Plateaus(equilibrium_modulus=3 * level))


@pytest.mark.parametrize(
    ("spectrum", "noise", "rms", "worst"),
    [
        (box, 0.0, 0.04, 0.12),  # edges ring
        (wedge, 0.005, 0.04, 0.08),
        (log_normal, 0.0, 1e-3, 2e-3),
        (log_normal, 0.02, 0.04, 0.1),
    ],
)
def test_a_known_spectrum_is_recovered(spectrum: Callable[[Array], Array], noise: float, rms: float, worst: float) -> None:
    fit = fitted_to(young(spectrum), noise)
    found = continuous_spectrum(fit)
    tau = found.relaxation_time
    inside = (tau > 1e-2) & (tau < 1e2)
    error = (found.density / np.maximum(spectrum(tau), 1.0) - 1)[inside]
    assert np.sqrt(np.mean(error**2)) < rms
    assert np.max(np.abs(error)) < worst
    assert found.integral == pytest.approx(fit.spectrum.shear_modulus.sum(), rel=1e-4 if noise == 0 else 0.02)
    assert np.all(found.density >= 0)


def power(tau: Array) -> Array:
    return np.asarray(1e5 * tau**-0.3)


def melt(tau: Array) -> Array:
    """Entangled melt (M. Baumgaertel, A. Schausberger, H. H. Winter, Rheol. Acta 29 (1990) 400), far from its glass."""
    return np.where(tau <= 1e2, 2e5 * (0.23 * (tau / 1e2) ** 0.23 + 0.67 * (tau / 1e-4) ** -0.67), 0.0)


@pytest.mark.parametrize(
    ("spectrum", "noise", "limit"), [(power, 0.0, 0.04), (power, 0.01, 0.15), (melt, 0.0, 0.2), (melt, 0.01, 0.4)]
)
def test_processes_beyond_an_oscillation_stay_out_of_its_spectrum(
    spectrum: Callable[[Array], Array], noise: float, limit: float
) -> None:
    """Six decades of processes faster than the curve, and six of slower ones."""
    frequency, edges = np.logspace(-4, 6, 101), np.linspace(np.log(1e-12), np.log(1e10), 4001)
    tau, width = np.exp((edges[1:] + edges[:-1]) / 2), edges[1] - edges[0]
    phase = frequency[:, None] * tau
    moduli = [3 * part @ spectrum(tau) * width for part in (phase**2 / (1 + phase**2), phase / (1 + phase**2))]
    moduli *= 1 + noise * np.random.default_rng(1).standard_normal((2, frequency.size))
    found = continuous_spectrum(fit_oscillation(frequency, *moduli, plateaus=Plateaus(equilibrium_modulus=0.0)))
    assert found.relaxation_time[[0, -1]] == pytest.approx([1e4, 1e-6])
    inside = found.relaxation_time < (10.0 if spectrum is melt else 1e5)  # beyond, the melt ends at a step
    np.testing.assert_allclose(found.density[inside], spectrum(found.relaxation_time[inside]), rtol=limit)


def test_what_has_no_continuous_spectrum_is_refused() -> None:
    with pytest.raises(InputError, match="a creep curve has no continuous relaxation spectrum"):
        continuous_spectrum(fit_creep(TIME, 1e-6 * TIME**0.1, branches=15, plateaus=Plateaus(equilibrium_modulus=0.0)))
    with pytest.raises(InputError, match="0 points per decade"):
        continuous_spectrum(fitted_to(young(wedge), 0.0), 0)


def test_a_spectrum_that_falls_apart_is_warned_of() -> None:
    lines = np.logspace(-3, 3, 7)
    time = np.logspace(-4, 4, 400)
    modulus = 3 * (LEVEL + np.exp(-time[:, None] / lines) @ np.full(7, 1e5))
    fit = fit_spectrum(
        time, modulus, method="nnls", branches=7, relaxation_time=(1e-3, 1e3), plateaus=Plateaus(equilibrium_modulus=3 * LEVEL)
    )
    with pytest.warns(DielastWarning, match=r"the continuous spectrum falls apart into \d pieces"):
        continuous_spectrum(fit)
