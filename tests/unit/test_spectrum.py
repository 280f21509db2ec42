"""The spectrum from a master curve, a sweep or creep: what goes in, what comes out, and what is refused."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from flat import fit_creep, fit_oscillation, fit_spectrum
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from dielast.base.errors import DielastWarning, InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation.checks import POOR_FIT
from dielast.relaxation.interconversion import RetardationSpectrum, relaxation_from_retardation, retardation_from_relaxation
from dielast.relaxation.result import Method

by_polynomial = partial(fit_spectrum, method="schwarzl-staverman")
Array = NDArray[np.float64]
METHODS: list[Method] = ["schwarzl-staverman", "nnls"]
PLATEAU = 3e4  # Pa, Young's


def smooth_curve(points_per_decade: int = 20) -> tuple[Array, Array]:
    """A relaxation from 3 MPa to 30 kPa, most of it over six decades, between two plateaus."""
    time = np.logspace(-6, 7, 13 * points_per_decade + 1)
    return time, PLATEAU * 100 ** (0.5 - 0.5 * np.tanh(0.3 * np.log10(time)))


@pytest.mark.parametrize("method", METHODS)
def test_the_fit_reports_the_model_it_returns(method: Method) -> None:
    time, modulus = smooth_curve()
    shuffled = np.random.default_rng(3).permutation(time.size)
    fit = fit_spectrum(time[shuffled], modulus[shuffled], method=method)
    np.testing.assert_array_equal(fit.reduced_time, time)
    np.testing.assert_array_equal(fit.measured, modulus)
    expected = 3 * fit.spectrum.relaxation_modulus(time, fit.equilibrium_shear_modulus)
    np.testing.assert_allclose(fit.model, expected, rtol=1e-13)
    error = fit.model / modulus - 1
    assert fit.rms_relative_error == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)
    assert fit.max_relative_error == pytest.approx(np.abs(error).max(), rel=1e-9)
    assert fit.rms_relative_error < (0.002 if method == "nnls" else 0.08)
    count = 65 if method == "nnls" else 30  # 5 a decade
    assert (fit.method, fit.branches, len(fit.spectrum), fit.clipped_branches) == (method, count, count, 0)
    assert fit_spectrum(time[-100:], modulus[-100:], method=method).branches == 30
    some = fit_spectrum(time, modulus, method=method, relaxation_time=(1e-4, 1e6))  # of which 5 a decade are 50
    assert some.branches == (50 if method == "nnls" else 30)
    assert 3 * fit.equilibrium_shear_modulus == pytest.approx(PLATEAU, rel=0.08)  # the curve ends 7 % above it


def test_smoothing_follows_the_noise_and_fits_neither_noise_nor_bias() -> None:
    time, modulus = smooth_curve()
    truth = fit_spectrum(time, modulus, method="nnls", branches=34, relaxation_time=(1e-6, 1e7))
    assert truth.smoothing is not None
    assert truth.smoothing < 0.01
    for seed in range(5):
        noisy = modulus * (1 + 0.02 * np.random.default_rng(seed).standard_normal(time.size))
        fit = fit_spectrum(time, noisy, method="nnls", branches=34, relaxation_time=(1e-6, 1e7))
        assert fit.smoothing is not None
        assert fit.smoothing > 10 * truth.smoothing
        assert fit.rms_relative_error == pytest.approx(0.02, rel=0.15)
        assert np.sqrt(np.mean((fit.model / modulus - 1) ** 2)) < 0.008


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.filterwarnings("ignore:1 of 30 moduli came out negative")  # and changes G(t) by 0.04 %
@pytest.mark.parametrize("stated", [[], ["glassy_modulus"], ["equilibrium_modulus", "glassy_modulus"]])
def test_what_the_curve_tells_may_be_stated(method: Method, stated: list[str]) -> None:
    """Of a curve that falls to half of its height: the glassy modulus is not by how much it falls."""
    time = np.logspace(-6, 7, 261)
    modulus = 3e5 * 2 ** (0.5 - 0.5 * np.tanh(0.3 * np.log10(time)))
    ends = {"equilibrium_modulus": float(modulus[-1]), "glassy_modulus": float(modulus[0])}
    fit = fit_spectrum(time, modulus, method=method, **{name: ends[name] for name in stated})
    assert 3 * fit.spectrum.shear_modulus.sum() == pytest.approx(modulus[0] - modulus[-1], rel=0.02)
    assert 3 * fit.equilibrium_shear_modulus == pytest.approx(modulus[-1], rel=0.01)
    assert fit.max_relative_error < 0.02


@pytest.mark.filterwarnings("ignore:the spectrum misses the curve", "ignore:the spectrum is .* below the curve at its end")
@pytest.mark.parametrize("method", METHODS)
def test_an_equilibrium_modulus_far_below_a_plateau_is_warned_of(method: Method) -> None:
    time, modulus = smooth_curve()
    with pytest.warns(DielastWarning, match=r"has levelled off at .* far above equilibrium_modulus = 20000 Pa$"):
        fit_spectrum(time, modulus, method=method, equilibrium_modulus=2e4)
    with pytest.warns(DielastWarning, match="three times the shear modulus"):
        fit_spectrum(time, modulus, method=method, equilibrium_modulus=1e4)


@pytest.mark.parametrize("method", METHODS)
def test_a_solid_that_does_not_relax_has_no_processes(method: Method) -> None:
    fit = fit_spectrum(np.logspace(-3, 3, 50), np.full(50, 6e4), method=method)
    assert fit.equilibrium_shear_modulus == pytest.approx(2e4)
    assert fit.spectrum.shear_modulus.max() < 1e-6


def test_a_melt_has_no_equilibrium_modulus() -> None:
    time = np.logspace(-3, 3, 121)
    melt = Spectrum(np.array([100.0, 3.0, 0.1]), np.array([1e4, 4e4, 1e5]))
    fit = fit_spectrum(time, 3 * melt.relaxation_modulus(time), method="nnls", branches=40, equilibrium_modulus=0.0)
    assert fit.equilibrium_shear_modulus == 0
    assert fit.max_relative_error < 0.05  # the curve falls by exp(-10) in its last decade
    with pytest.warns(DielastWarning, match="has not levelled off"):
        fit_spectrum(time, 3 * melt.relaxation_modulus(time), method="nnls", branches=40)


def test_a_poor_polynomial_and_a_poor_fit_are_warned_of() -> None:
    with pytest.warns(DielastWarning) as caught:
        by_polynomial(*smooth_curve(), polynomial_degree=1, equilibrium_modulus=0.0)
    said = " | ".join(str(each.message) for each in caught)
    assert "polynomial of degree 1 misses the curve" in said
    assert "spectrum misses the curve" in said


@pytest.mark.parametrize(
    ("options", "found"),
    [
        ({"method": "best"}, 'method: "best"'),
        ({"branches": "5"}, 'branches: "5": a number in SI units'),
        ({"branches": 5.5}, r"branches: 5\.5: a whole number is needed"),
        ({"method": "schwarzl-staverman", "branches": 2}, "branches: 2: schwarzl-staverman needs at least 3"),
        ({"branches": 0, "method": "nnls"}, "branches: 0: nnls needs at least 1"),
        ({"polynomial_degree": None}, "polynomial_degree: .* is needed"),
        ({"method": "schwarzl-staverman", "polynomial_degree": 0}, "polynomial_degree: 0"),
        ({"method": "schwarzl-staverman", "polynomial_degree": 300}, "a polynomial of degree 300 needs points at 301"),
        ({"relaxation_time": (10.0, 1.0)}, "min = 10 s must be shorter than max = 1 s"),
        ({"relaxation_time": (1.0, 1.0)}, "must be shorter"),
        ({"relaxation_time": (0.0, 1.0)}, "relaxation_time: min = 0 s"),
        ({"relaxation_time": (None, np.nan)}, "relaxation_time: max = nan s"),
        ({"relaxation_time": 5.0}, "relaxation_time: 5.0: a pair of numbers is needed"),
        ({"relaxation_time": ("1 s", None)}, 'relaxation_time: "1 s": a number in SI units'),
        ({"relaxation_time": (1e9, None)}, "no relaxation time lies between"),
        ({"equilibrium_modulus": -1.0}, "equilibrium_modulus: -1 Pa"),
        ({"equilibrium_modulus": "29 kPa"}, 'equilibrium_modulus: "29 kPa": a number'),
        ({"equilibrium_modulus": 4e4}, "is above the end of the curve"),
        ({"equilibrium_modulus": 2e4, "glassy_modulus": 1e4}, "must be smaller than glassy_modulus"),
        ({"glassy_modulus": 0.0}, "glassy_modulus: 0 Pa"),
        ({"keep": [3]}, "keep: an array of shape"),
        ({"keep": 0}, "cannot keep 0 of 30"),
        ({"keep": 31}, "cannot keep 31 of 30"),
    ],
)
def test_impossible_arguments_are_refused_in_one_line(options: dict[str, Any], found: str) -> None:
    with pytest.raises(InputError, match=found) as caught:
        fit_spectrum(*smooth_curve(), **options)
    assert "\n" not in str(caught.value)


def test_a_rising_modulus_is_named_with_the_least_misfit_of_any_spectrum() -> None:
    """As more branches do not help: no sum of decaying exponentials rises."""
    time = np.geomspace(1.0, 1e6, 61)
    bump = np.where((time > 99) & (time < 1.01e4), 4e5 * np.sqrt(time / 100), 1e7 / np.sqrt(time))
    rise = r"the modulus rises with time in parts of it, most from 4e\+05 Pa at 100 s to 4e\+06 Pa at 1e\+04 s"
    least = r"no spectrum misses the curve by less than \d\d\.\d% rms, as"
    with pytest.warns(DielastWarning, match=f"{least} {rise}"):
        fit = by_polynomial(time, bump, method="nnls", branches=60, liquid=True)
    with pytest.raises(InputError, match=f"came out negative .*: {least} {rise}"), pytest.warns(DielastWarning, match="polynomial"):
        by_polynomial(time, bump, liquid=True)
    falling = isotonic_regression(bump, weights=bump**-2.0, increasing=False).x
    assert 0.1 < np.sqrt(np.mean((falling / bump - 1) ** 2)) <= fit.rms_relative_error
    rises = "the inverse compliance rises with time in parts of it, most from 1e.06 Pa at 1 s to 1.58e.07 Pa"
    with pytest.warns(DielastWarning, match=rises), pytest.warns(DielastWarning, match="shows no flow"):
        fit_creep(time, 1e-6 / time**0.2, liquid=True)
    falls = "the storage modulus falls with frequency in parts of it, most from 6.34e.06 Pa at 1e-06 rad/s to 4e"
    with pytest.warns(DielastWarning, match=falls):
        fit_oscillation(1 / time, 4e5 * time**0.2, np.full(time.size, 1e4), liquid=True)


@pytest.mark.parametrize(
    ("time", "modulus", "found"),
    [
        ([1.0, 0.0, 2.0], [3.0, 2.0, 1.0], r"reduced time\[1\] = 0 s"),
        ([1.0, 2.0, np.inf], [3.0, 2.0, 1.0], r"reduced time\[2\] = inf s"),
        ([1.0, 2.0, 3.0], [3.0, np.nan, -1.0], r"modulus\[1\] = nan Pa \(and 1 more\)"),
        ([1.0, 2.0], [3.0], "same length"),
        ([], [], "at least two"),
        ([1.0, 1.0], [3.0, 2.0], "at least two"),
    ],
)
@pytest.mark.parametrize("method", METHODS)
def test_impossible_points_are_refused(method: Method, time: list[float], modulus: list[float], found: str) -> None:
    with pytest.raises(InputError, match=found):
        fit_spectrum(time, modulus, method=method)


def test_fewer_points_than_unknowns_are_enough_for_nnls() -> None:
    """Many spectra pass through them exactly; rounding errors, which differ between machines, must not choose among these."""
    time = np.array([1e-3, 1e-1, 10.0, 100.0])
    modulus = np.array([3e6, 1e6, 3.1e4, 3e4])
    rounding = 1 + 1e-14 * np.random.default_rng(0).standard_normal((20, 4))
    fits = [
        fit_spectrum(time, values, method="nnls", branches=10, equilibrium_modulus=2.9e4)
        for values in (modulus, *(rounding * modulus))
    ]
    assert fits[0].rms_relative_error < POOR_FIT
    for fit in fits[1:]:
        np.testing.assert_allclose(fit.spectrum.shear_modulus, fits[0].spectrum.shear_modulus, rtol=1e-8, atol=1e-3)


@pytest.mark.filterwarnings("ignore:relaxation times from")
def test_relaxation_times_beyond_all_bounds_are_refused_with_advice() -> None:
    with pytest.raises(InputError, match=r"so far off the curve .* keep them between 5e-07 and 5e\+06 s"):
        by_polynomial(*smooth_curve(), relaxation_time=(1e-60, 1e60))


SLOW = Spectrum(np.logspace(6, -6, 61), 2e3 * np.logspace(6, -6, 61) ** -0.25)  # four decades slower than the curves below
SHORT = np.logspace(0, 2, 60)


@pytest.mark.parametrize("equilibrium", [2.6e4, 1e4, 0.0])
def test_what_has_not_relaxed_at_the_end_of_a_curve_relaxes_after_it(equilibrium: float) -> None:
    """A stated equilibrium modulus below the end of a curve neither drags its last points down nor what follows soon after."""
    modulus = 3 * SLOW.relaxation_modulus(SHORT, equilibrium)
    fit = fit_spectrum(SHORT, modulus, method="nnls", equilibrium_modulus=3 * equilibrium)
    assert SHORT[-1] < fit.spectrum.relaxation_time[0] <= 10 * SHORT[-1]
    np.testing.assert_allclose(fit.model[-30:], modulus[-30:], rtol=2e-3)
    twice = SLOW.relaxation_modulus(2 * SHORT[-1:], equilibrium)
    np.testing.assert_allclose(fit.spectrum.relaxation_modulus(2 * SHORT[-1:], fit.equilibrium_shear_modulus), twice, rtol=0.02)


def test_the_end_of_a_sweep_or_of_a_creep_curve_is_followed_as_well() -> None:
    omega = 1 / SHORT
    storage, loss = 3 * np.stack((SLOW.storage_modulus(omega), SLOW.loss_modulus(omega)))
    sweep = fit_oscillation(omega, storage, loss, liquid=True)
    assert sweep.spectrum.relaxation_time[0] > 10**0.5 * SHORT[-1]
    assert sweep.max_relative_error < 0.05
    slow = RetardationSpectrum(SLOW.relaxation_time, 1e-6 * SLOW.relaxation_time**0.1, 1e-7, 0.0)
    compliance = slow.creep_compliance(SHORT) / 3
    level = 3 / (slow.glassy_compliance + float(slow.compliance.sum()))
    creep = fit_creep(SHORT, compliance, equilibrium_modulus=level)
    np.testing.assert_allclose(creep.model, compliance, rtol=0.01)


def test_a_spectrum_that_misses_the_end_of_its_curve_is_warned_of() -> None:
    modulus = 3 * SLOW.relaxation_modulus(SHORT, 2e4)
    with pytest.warns(DielastWarning, match=r"the spectrum is \d+\.\d% below the curve at its end, 100 s: check"):
        by_polynomial(SHORT, modulus, equilibrium_modulus=6e4)


TRUTH = Spectrum(np.logspace(3, -4, 8), np.array([1e4, 3e4, 2e4, 9e4, 4e5, 3e5, 8e5, 2e6]))
LEVEL = 5e4
FREQUENCY = np.logspace(-5, 6, 221)
TIME = np.logspace(-7, 6, 261)
STORAGE, LOSS = 3 * TRUTH.storage_modulus(FREQUENCY, LEVEL), 3 * TRUTH.loss_modulus(FREQUENCY)
COMPLIANCE = retardation_from_relaxation(TRUTH, LEVEL).creep_compliance(TIME) / 3


def test_an_oscillation_predicts_the_relaxation_of_the_same_material() -> None:
    scatter = 1 + 0.01 * np.random.default_rng(1).standard_normal((2, FREQUENCY.size))
    fit = fit_oscillation(FREQUENCY, STORAGE * scatter[0], LOSS * scatter[1], branches=50)
    time = np.logspace(-5, 5, 101)
    predicted = fit.spectrum.relaxation_modulus(time, fit.equilibrium_shear_modulus)
    np.testing.assert_allclose(predicted, TRUTH.relaxation_modulus(time, LEVEL), rtol=0.02)
    assert fit.rms_relative_error == pytest.approx(0.01, rel=0.15)


def test_creep_gives_the_relaxation_spectrum_back_on_its_own_times() -> None:
    truth = RetardationSpectrum(np.logspace(4, -4, 9), 1e-6 * np.array([5, 3, 4, 1, 2, 0.5, 1, 0.2, 0.3]), 2e-7)
    spectrum, level = relaxation_from_retardation(truth)
    time = np.logspace(-6, 6, 241)
    fit = fit_creep(time, truth.creep_compliance(time) / 3, branches=9, retardation_time=(1e-4, 1e4))
    assert fit.retardation is not None
    assert fit.retardation.fluidity < 1e-16
    assert fit.max_relative_error < 1e-6
    fast = np.logspace(-6, 4, 41)
    expected = spectrum.relaxation_modulus(fast, level)
    np.testing.assert_allclose(fit.spectrum.relaxation_modulus(fast, fit.equilibrium_shear_modulus), expected, rtol=1e-5)


@pytest.mark.parametrize("stated", [{}, {"equilibrium_modulus": 3 * LEVEL}])
def test_the_glassy_modulus_of_creep_is_that_of_all_springs(stated: dict[str, float]) -> None:
    """Stated with the equilibrium modulus or without."""
    whole = 1.05 * (TRUTH.shear_modulus.sum() + LEVEL)
    fit = fit_creep(TIME, COMPLIANCE, branches=20, glassy_modulus=3 * whole, **stated)
    assert fit.spectrum.shear_modulus.sum() + fit.equilibrium_shear_modulus == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize(
    ("columns", "options", "found"),
    [
        (([1.0, 2.0], [3.0, -2.0]), {}, r"creep compliance\[1\] = -2 1/Pa"),
        ((TIME, COMPLIANCE), {"glassy_modulus": 1e3}, "glassy_modulus: 1000 Pa is below the start of the curve"),
        ((TIME, COMPLIANCE), {"equilibrium_modulus": 1e6}, "is above the end of the curve"),
        ((TIME, COMPLIANCE), {"retardation_time": (1e9, None)}, "no relaxation time lies between"),
        ((TIME, COMPLIANCE), {"retardation_time": (2.0, 1.0)}, "must be shorter"),
        ((TIME, COMPLIANCE), {"branches": 0}, "branches: 0: nnls needs at least 1"),
        ((TIME, COMPLIANCE), {"keep": 0}, "cannot keep 0 of 30 branches"),
        ((TIME, COMPLIANCE), {"branches": 8, "keep": 9}, "cannot keep 9 of 8 branches"),
    ],
)
def test_impossible_creep_is_refused_in_one_line(columns: Any, options: dict[str, Any], found: str) -> None:
    with pytest.raises(InputError, match=found) as caught:
        fit_creep(*columns, **options)
    assert "\n" not in str(caught.value)
