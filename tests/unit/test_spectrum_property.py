"""What holds for the spectrum of any relaxing solid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dielast.base.errors import InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation.fit import fit_spectrum
from dielast.relaxation.nnls import WeightedCurve, fit_strengths
from dielast.relaxation.result import Method

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


@given(st.integers(min_value=0, max_value=2**31), st.floats(min_value=0, max_value=0.1), st.integers(min_value=1, max_value=25))
@settings(max_examples=20)
def test_nnls_copes_with_any_scattered_curve(seed: int, noise: float, branches: int) -> None:
    rng = np.random.default_rng(seed)
    x = np.sort(rng.uniform(-4, 4, 60))
    modulus = 1e5 * 10 ** (1 - np.tanh(x)) * np.exp(noise * rng.standard_normal(x.size))
    tau = np.logspace(4, -4, branches)
    solution = fit_strengths(WeightedCurve(10**x, modulus[None], np.ones(x.size)), tau, (None,))
    model = Spectrum(tau, solution.strength).relaxation_modulus(10**x, float(solution.constants[0]))
    assert np.all(solution.strength >= 0)
    assert solution.constants[0] >= 0
    assert np.mean((model / modulus - 1) ** 2) <= 1  # never worse than no model at all
