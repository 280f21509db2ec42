"""Fitting a law to shift factors that come with a covariance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import DielastWarning, InputError
from dielast.material.shift import WLF, Arrhenius
from dielast.relaxation.superposition.shiftfit import fit_shift_law

TEMPERATURE = np.arange(-40.0, 61.0, 10.0)
INDEPENDENT = np.eye(TEMPERATURE.size) * 1e-4


def relative(values: np.ndarray, anchor: int) -> np.ndarray:
    return values - values[anchor]


def pinned(covariance: np.ndarray, anchor: int) -> np.ndarray:
    move = np.eye(len(covariance))
    move[:, anchor] -= 1
    return move @ covariance @ move.T


@given(C1=st.floats(2, 40), C2=st.floats(110, 600), anchor=st.integers(0, 10))
def test_exact_wlf_from_any_anchor(C1: float, C2: float, anchor: int) -> None:
    law = WLF(20.0, C1, C2)
    fit = fit_shift_law(
        "wlf", TEMPERATURE, relative(law.log10_shift_factor(TEMPERATURE), anchor), pinned(INDEPENDENT * 1e-6, anchor), anchor, 20.0
    )
    np.testing.assert_allclose([fit.parameters["C1"], fit.parameters["C2"]], [C1, C2], rtol=1e-6)


def test_the_anchor_does_not_matter() -> None:
    """Generalised least squares carries the noise of the curve that the others are relative to."""
    noisy = WLF(20.0, 13.7, 187.1).log10_shift_factor(TEMPERATURE) + 0.01 * np.random.default_rng(0).standard_normal(
        TEMPERATURE.size
    )
    fits = [fit_shift_law("wlf", TEMPERATURE, relative(noisy, k), pinned(INDEPENDENT, k), k, 25.0) for k in (0, 6, 10)]
    for fit in fits[1:]:
        np.testing.assert_allclose(fit.values, fits[0].values, rtol=1e-6)
        np.testing.assert_allclose(fit.covariance, fits[0].covariance, rtol=1e-4)


@pytest.mark.parametrize("law", ["wlf", "arrhenius"])
def test_standard_errors_are_true(law: str) -> None:
    truth = WLF(20.0, 13.7, 187.1) if law == "wlf" else Arrhenius(20.0, 9e4)
    values = [13.7, 187.1] if law == "wlf" else [9e4]
    rng = np.random.default_rng(5)
    deviations = []
    for _ in range(200):
        noisy = truth.log10_shift_factor(TEMPERATURE) + 0.01 * rng.standard_normal(TEMPERATURE.size)
        fit = fit_shift_law(law, TEMPERATURE, relative(noisy, 6), pinned(INDEPENDENT, 6), 6, 20.0)
        deviations.append((fit.values - values) / np.sqrt(np.diag(fit.covariance)))
    assert 0.92 <= np.mean(np.abs(deviations) < 1.96) <= 0.99


def test_misfit_widens_the_errors() -> None:
    """Of a misfit without correlation by its square root, and by more if the law may miss smoothly."""
    curved = Arrhenius(20.0, 9e4).log10_shift_factor(TEMPERATURE) + 0.1 * np.cos(TEMPERATURE)
    fit = fit_shift_law("arrhenius", TEMPERATURE, relative(curved, 6), pinned(INDEPENDENT, 6), 6, 20.0)
    exact = relative(Arrhenius(20.0, 9e4).log10_shift_factor(TEMPERATURE), 6)
    narrow = fit_shift_law("arrhenius", TEMPERATURE, exact, pinned(INDEPENDENT, 6), 6, 20.0)
    assert fit.misfit > 10
    widened = fit.stderr["activation_energy"] / narrow.stderr["activation_energy"]
    assert 0.9 < widened / fit.misfit**0.5 < 1.6  # as far as errors may be stated too large


@pytest.mark.parametrize("change", [0.1, -0.1])
def test_two_processes_are_in_the_errors_of_the_constants(change: float) -> None:
    """The slope of log10 a changes by a tenth over three decades: the law fits nearly, and its constants are far off."""
    temperature, truth, held, plain = np.linspace(-40.0, 60.0, 14), np.array([13.7, 187.1]), [], []
    exact = WLF(20.0, *truth).log10_shift_factor(temperature)
    fine = np.linspace(exact.min(), exact.max(), 400)
    for seed in range(20):
        random = np.random.default_rng([10, seed])
        slow = np.clip((random.uniform(-1, 5) + 1.5 - fine) / 3, 0, 1)  # hot: slow processes
        extra = np.concatenate(([0.0], np.cumsum(slow[1:] * np.diff(fine)))) * change
        values = exact + np.interp(exact, fine, extra) + 0.005 * random.standard_normal(14)
        fit = fit_shift_law("wlf", temperature, relative(values, 7), pinned(np.eye(14) * 25e-6, 7), 7, 20.0)
        held.append(np.abs(fit.values - truth) < 1.645 * np.sqrt(np.diag(fit.covariance)))
        others = np.delete(np.arange(14), 7)
        whiten = np.linalg.inv(np.linalg.cholesky(pinned(np.eye(14) * 25e-6, 7)[np.ix_(others, others)]))
        law = WLF.fit(float(temperature[7]), (temperature - temperature[7])[others], relative(values, 7)[others], whiten)
        turned = law.about(20.0 - float(temperature[7])).to_constants
        without = np.diag(turned @ law.moments @ turned.T) * max(law.misfit, 1.0)
        plain.append(np.abs(fit.values - truth) < 1.645 * np.sqrt(without))
    assert np.mean(held) > 0.838  # of 90 % intervals, if errors are stated by the factor 0.85 too small: 2 Phi(0.85 x 1.645) - 1
    assert np.mean(held) > np.mean(plain) + 0.4


def test_two_temperatures_give_the_ratio_only() -> None:
    temperature = np.array([0.0, 20.0])
    with pytest.warns(DielastWarning, match=r"2 temperatures do not determine the WLF constants C1 and C2 separately"):
        fit = fit_shift_law("wlf", temperature, np.array([1.6, 0.0]), np.diag([1e-4, 0.0]), 1, 20.0)
    assert np.isinf(fit.stderr["C1"])
    assert np.isinf(fit.stderr["C2"])
    np.testing.assert_allclose(fit.law.log10_shift_factor(temperature), [1.6, 0.0], atol=1e-12)
    arrhenius = fit_shift_law("arrhenius", temperature, np.array([1.6, 0.0]), np.diag([1e-4, 0.0]), 1, 20.0)
    np.testing.assert_allclose(fit.law.log10_shift_factor([-10, 35]), arrhenius.law.log10_shift_factor([-10, 35]), rtol=1e-9)


@pytest.mark.parametrize("C2", [60.0, 100.0, 187.1, 400.0, 1e6])
@pytest.mark.parametrize("reference", [-30.0, 40.0, 80.0])
def test_an_assumed_constant_is_in_the_error_of_the_origin(C2: float, reference: float) -> None:
    """Two temperatures, and a reference far from both: whatever C2 the material has, the origin is within two standard errors."""
    truth = WLF(0.0, 0.07 * C2, C2)
    temperature = np.array([0.0, 20.0])
    values = truth.log10_shift_factor(temperature)
    with pytest.warns(DielastWarning, match=rf"log10 a at {reference:g} degC is known to .* only, for want of C2"):
        fit = fit_shift_law("wlf", temperature, values, np.diag([0.0, 1e-6]), 0, reference)
    miss = fit.origin - float(truth.log10_shift_factor(reference))
    assert abs(miss) < 2 * np.sqrt(fit.origin_excess)


@pytest.mark.parametrize(("bend", "said"), [(0.0, r"are a straight line .* above 7.\d+e\+03 K"), (5e-4, "bend the other way")])
def test_shift_factors_as_straight_as_a_line_or_bent_the_wrong_way_have_the_closest_law(bend: float, said: str) -> None:
    """Which of all C2 is an infinite one: the straight line through the reference temperature with the smallest squares."""
    values = -0.05 * (TEMPERATURE - 20) - bend * (TEMPERATURE - 20) ** 2
    covariance = pinned(INDEPENDENT, 6)
    with pytest.warns(DielastWarning, match=f"{said}.* holds between these temperatures only"):
        fit = fit_shift_law("wlf", TEMPERATURE, values, covariance, 6, 20.0)
    others = np.arange(TEMPERATURE.size) != 6
    weight = np.linalg.inv(covariance[np.ix_(others, others)])
    distance = TEMPERATURE[others] - 20
    slope = (distance @ weight @ values[others]) / (distance @ weight @ distance)
    np.testing.assert_allclose(fit.law.log10_shift_factor(TEMPERATURE), slope * (TEMPERATURE - 20), atol=1e-3)
    assert np.isinf(fit.stderr["C2"])
    assert "is a straight line over temperature" in fit.law.warning()


def test_rising_activation_is_said() -> None:
    with pytest.warns(DielastWarning, match="slower with temperature"):
        fit_shift_law("arrhenius", TEMPERATURE, 0.05 * (TEMPERATURE - 20), pinned(INDEPENDENT, 6), 6, 20.0)


@pytest.mark.parametrize("anchor", [0, 6])
def test_vogel_fulcher_tammann_is_fitted_as_wlf_is(anchor: int) -> None:
    noisy = WLF(20.0, 13.7, 187.1).log10_shift_factor(TEMPERATURE) + 0.01 * np.random.default_rng(3).standard_normal(
        TEMPERATURE.size
    )
    wlf, vft = (
        fit_shift_law(law, TEMPERATURE, relative(noisy, anchor), pinned(INDEPENDENT, anchor), anchor, 35.0)
        for law in ("wlf", "vft")
    )
    c1, c2 = wlf.values
    np.testing.assert_allclose(vft.values, [np.log(10) * c1 * c2, 35 - c2], rtol=1e-9)
    slopes = np.array([[np.log(10) * c2, np.log(10) * c1], [0, -1]])
    np.testing.assert_allclose(vft.covariance, slopes @ wlf.covariance @ slopes.T, rtol=1e-6)
    at = np.linspace(-30, 60, 7)
    np.testing.assert_allclose(vft.law.log10_shift_factor(at), wlf.law.log10_shift_factor(at), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("reference", [0.0, 3.0, 12.0, 29.0, 44.0, 58.0, 60.0])
@pytest.mark.parametrize(
    "temperature", [[0.0, 60.0], [0.0, 25.0, 60.0], [0.0, 10.0, 40.0, 60.0], [0.0, 10.0, 20.0, 35.0, 50.0, 60.0]]
)
def test_a_table_is_a_polynomial_through_four_neighbours(temperature: list[float], reference: float) -> None:
    """Exact for a polynomial of one degree less than there are neighbours."""
    degree = min(len(temperature), 4) - 1
    shape = np.polynomial.Polynomial([0.3, -0.07, 4e-4, -2e-6][: degree + 1])
    at, anchor = np.array(temperature), 1
    fit = fit_shift_law("table", at, shape(at) - shape(at[anchor]), np.zeros((len(at), len(at))), anchor, reference)
    assert fit.law.log10_shift_factor(at) == pytest.approx(shape(at) - shape(reference), abs=1e-12)
    assert fit.origin == pytest.approx(shape(reference) - shape(at[anchor]), abs=1e-12)
    assert fit.origin_weight @ (shape(at) - shape(at[anchor])) == pytest.approx(fit.origin, abs=1e-12)


@pytest.mark.parametrize("reference", [-0.1, 60.1])
def test_a_table_knows_nothing_beyond_its_ends(reference: float) -> None:
    at = np.array([0.0, 30.0, 60.0])
    with pytest.raises(InputError, match="where the shift table ends"):
        fit_shift_law("table", at, -0.1 * at, np.zeros((3, 3)), 0, reference)
