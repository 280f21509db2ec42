"""Spectra of solids whose spectrum is known, what is said at the limits, and creep of the same material."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from flat import fit_oscillation, fit_spectrum
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from dielast.base.errors import DielastWarning, InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation.interconversion import RetardationSpectrum, relaxation_from_retardation, retardation_from_relaxation
from dielast.relaxation.result import SpectrumFit

by_polynomial = partial(fit_spectrum, method="schwarzl-staverman")
Array = NDArray[np.float64]
LEVEL = 2e4  # Pa, shear
TRUTH = Spectrum(np.logspace(3, -3, 7), np.array([1e4, 3e4, 2e4, 5e4, 1e5, 8e4, 2e5]))
TIME = np.logspace(-5, 5, 201)
MODULUS = 3 * TRUTH.relaxation_modulus(TIME, LEVEL)
STORAGE, LOSS = 3 * TRUTH.storage_modulus(TIME, LEVEL), 3 * TRUTH.loss_modulus(TIME)  # over angular frequencies of these numbers
GLASSY = 3 * float(TRUTH.shear_modulus.sum() + LEVEL)
WIDE = np.logspace(-6, 7, 261)
PLATEAUS = 3e4 * 100 ** (0.5 - 0.5 * np.tanh(0.3 * np.log10(WIDE)))  # from 3 MPa to 30 kPa


def relaxation(**options: Any) -> SpectrumFit:
    return fit_spectrum(TIME, MODULUS, method="nnls", branches=7, **options)


def oscillation(**options: Any) -> SpectrumFit:
    return fit_oscillation(TIME, STORAGE, LOSS, branches=7, **options)


FITS: list[Callable[..., SpectrumFit]] = [relaxation, oscillation]


def said(fit: Callable[..., SpectrumFit], **options: Any) -> str:
    """Everything that the fit warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fit(**options)
    assert all(issubclass(entry.category, DielastWarning) for entry in caught)
    return "\n".join(str(entry.message) for entry in caught)


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("stated", [{}, {"equilibrium_modulus": 3 * LEVEL}, {"glassy_modulus": GLASSY}])
def test_the_truth_is_found_on_its_own_times_whatever_of_it_is_stated(
    fit: Callable[..., SpectrumFit], stated: dict[str, float]
) -> None:
    """What is stated is Young's modulus, three times the shear modulus that is found."""
    found = fit(relaxation_time=(1e-3, 1e3), **stated)
    np.testing.assert_allclose(found.spectrum.relaxation_time, TRUTH.relaxation_time, rtol=1e-12)
    np.testing.assert_allclose(found.spectrum.shear_modulus, TRUTH.shear_modulus, rtol=1e-4)
    assert found.equilibrium_shear_modulus == pytest.approx(LEVEL, rel=1e-4)
    assert found.max_relative_error < 1e-4
    assert found.clipped_branches == 0
    assert found.smoothing is not None
    np.testing.assert_allclose(found.model, found.measured, rtol=1e-4)
    assert np.all(np.diff(found.reduced_time) > 0)


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("stated", [0.95, 1.2])
def test_moduli_add_up_to_the_glassy_modulus_with_the_equilibrium_one(fit: Callable[..., SpectrumFit], stated: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        found = fit(relaxation_time=(1e-3, 1e3), glassy_modulus=stated * GLASSY)
    assert 3 * (found.spectrum.shear_modulus.sum() + found.equilibrium_shear_modulus) == pytest.approx(stated * GLASSY, rel=1e-6)


@pytest.mark.parametrize("fit", FITS)
def test_what_is_kept_is_judged_from_its_shortest_time_on(fit: Callable[..., SpectrumFit]) -> None:
    kept = fit(relaxation_time=(1e-3, 1e3), keep=3)
    np.testing.assert_allclose(kept.spectrum.relaxation_time, [1e3, 1e2, 1e1], rtol=1e-12)
    error = np.abs(kept.model / kept.measured - 1)
    late = kept.reduced_time >= kept.spectrum.relaxation_time[-1]
    assert kept.max_relative_error == pytest.approx(error[..., late].max(), rel=1e-12)
    assert kept.rms_relative_error == pytest.approx(np.sqrt(np.mean(error[..., late] ** 2)), rel=1e-12)
    assert error[..., ~late].max() > 2 * kept.max_relative_error


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize(("beyond", "extrapolated"), [(12.0, False), (13.2, True)])
def test_a_process_is_told_by_the_curve_up_to_a_decade_away(
    fit: Callable[..., SpectrumFit], beyond: float, extrapolated: bool
) -> None:
    """And a tenth of a decade more."""
    assert ("extrapolated" in said(fit, relaxation_time=(1e-5 / beyond, 1e3))) == extrapolated
    assert ("extrapolated" in said(fit, relaxation_time=(1e-3, 1e5 * beyond))) == extrapolated


@pytest.mark.parametrize(("beyond", "extrapolated"), [(0.62, False), (0.64, True)])
def test_the_polynomial_tells_processes_whose_double_time_is_on_the_curve(beyond: float, extrapolated: bool) -> None:
    """Times from half of the first to half of the last, and a tenth of a decade more."""

    def fit(**options: Any) -> SpectrumFit:
        return by_polynomial(WIDE, PLATEAUS, equilibrium_modulus=2.9e4, **options)

    assert ("extrapolated" in said(fit, relaxation_time=(1e-6 * 0.25 / beyond, 1e5))) == extrapolated
    assert ("extrapolated" in said(fit, relaxation_time=(1e-5, 1e7 * beyond))) == extrapolated
    np.testing.assert_allclose(fit().spectrum.relaxation_time[[0, -1]], [0.5e7, 0.5e-6], rtol=1e-12)


def test_the_end_of_an_oscillation_is_that_of_its_storage_modulus() -> None:
    """An equilibrium modulus is compared with it, and not with the loss modulus."""
    with pytest.raises(InputError, match=r"is above the end of the curve, 6.00\de\+04 Pa"):
        oscillation(equilibrium_modulus=1.2 * 3 * LEVEL)
    with pytest.warns(DielastWarning, match="above the end of the curve"):
        oscillation(relaxation_time=(1e-3, 1e3), equilibrium_modulus=1.05 * 3 * LEVEL)
    assert "above the end" not in said(oscillation, relaxation_time=(1e-3, 1e3), equilibrium_modulus=1.015 * 3 * LEVEL)


@pytest.mark.filterwarnings("ignore:equilibrium_modulus.* above the end of the curve")
@pytest.mark.parametrize(
    ("options", "advice"),
    [
        ({"equilibrium_modulus": 1.09 * PLATEAUS[-1]}, "a lower equilibrium_modulus"),
        ({"equilibrium_modulus": 1.09 * PLATEAUS[-1], "keep": 29}, "a lower equilibrium_modulus"),
        ({"equilibrium_modulus": 1.09 * PLATEAUS[-1], "glassy_modulus": 2.4e6}, "a larger glassy_modulus"),
    ],
)
def test_advice_names_what_made_a_modulus_negative(options: dict[str, Any], advice: str) -> None:
    """The slowest is what the equilibrium modulus leaves, the fastest what the glassy modulus does."""
    with pytest.raises(InputError, match=f"came out negative .*, {advice}, or method") as refused:
        by_polynomial(WIDE, PLATEAUS, **options)
    assert str(refused.value).count("modulus,") == 1


@pytest.mark.parametrize(
    "parts",
    [
        (np.array([1.0, np.inf]), np.ones(2), 1.0, 0.0),
        (np.array([1.0, np.nan]), np.ones(2), 1.0, 0.0),
        (np.array([1.0, -1.0]), np.ones(2), 1.0, 0.0),
        (np.ones(2), np.array([1.0, -1e-9]), 1.0, 0.0),
        (np.ones(2), np.array([1.0, np.inf]), 1.0, 0.0),
        (np.ones(2), np.ones(2), -1e-9, 1.0),
        (np.ones(2), np.ones(2), np.nan, 0.0),
        (np.ones(2), np.ones(2), 1.0, np.inf),
    ],
)
def test_impossible_retardation_is_refused(parts: tuple[Array, Array, float, float]) -> None:
    with pytest.raises(InputError):
        RetardationSpectrum(*parts)


def test_the_standard_linear_solid() -> None:
    equilibrium, modulus, tau = 2e4, 6e4, 3.0
    creep = retardation_from_relaxation(Spectrum(np.array([tau]), np.array([modulus])), equilibrium)
    assert creep.glassy_compliance == pytest.approx(1 / 8e4, rel=1e-14)
    assert creep.retardation_time[0] == pytest.approx(tau * 8e4 / 2e4, rel=1e-14)
    assert creep.compliance[0] == pytest.approx(1 / 2e4 - 1 / 8e4, rel=1e-13)
    assert creep.fluidity == 0


def test_a_maxwell_and_a_kelvin_element_in_series_relax_by_the_roots_of_a_quadratic() -> None:
    glassy, compliance, own, viscosity = 1e-6, 4e-6, 2.0, 5e6
    spectrum, equilibrium = relaxation_from_retardation(
        RetardationSpectrum(np.array([own]), np.array([compliance]), glassy, 1 / viscosity)
    )
    rates = -np.roots([glassy * viscosity * own, glassy * viscosity + compliance * viscosity + own, 1.0])
    np.testing.assert_allclose(spectrum.relaxation_time, np.sort(1 / rates)[::-1], rtol=1e-13)
    assert equilibrium == 0
    assert spectrum.shear_modulus.sum() == pytest.approx(1 / glassy, rel=1e-13)
    assert spectrum.relaxation_time @ spectrum.shear_modulus == pytest.approx(viscosity, rel=1e-13)


decades = st.lists(st.integers(min_value=-60, max_value=60), min_size=1, max_size=25, unique=True)
strengths = st.lists(st.floats(min_value=1e-3, max_value=1e3), min_size=25, max_size=25)


@given(decades, strengths, st.sampled_from([0.0, 1e-2, 1.0, 1e3]))
def test_there_and_back_again_and_the_product_of_the_two_is_one(
    tenths: list[int], heights: list[float], equilibrium: float
) -> None:
    tau = np.sort(10 ** (np.array(tenths) / 5))[::-1]
    spectrum = Spectrum(tau, np.array(heights[: tau.size]))
    creep = retardation_from_relaxation(spectrum, equilibrium)
    assert np.all(creep.compliance > 0)
    back, level = relaxation_from_retardation(creep)
    np.testing.assert_allclose(back.relaxation_time, spectrum.relaxation_time, rtol=1e-10)
    np.testing.assert_allclose(back.shear_modulus, spectrum.shear_modulus, rtol=1e-10)
    assert level == pytest.approx(equilibrium, rel=1e-10)
    s = np.logspace(-14, 14, 57)[:, None]
    modulus = equilibrium + np.sum(spectrum.shear_modulus * (spectrum.relaxation_time * s) / (1 + spectrum.relaxation_time * s), 1)
    compliance = creep.glassy_compliance + np.sum(creep.compliance / (1 + creep.retardation_time * s), 1) + creep.fluidity / s[:, 0]
    np.testing.assert_allclose(modulus * compliance, 1.0, rtol=1e-12)


def test_impossible_spectra_are_refused() -> None:
    with pytest.raises(InputError, match="a glassy compliance above zero"):
        relaxation_from_retardation(RetardationSpectrum(np.ones(1), np.ones(1), 0.0))
    with pytest.raises(InputError, match="not all zero"):
        retardation_from_relaxation(Spectrum(np.ones(1), np.zeros(1)))
    with pytest.raises(InputError, match="1 retardation times but 2 compliances"):
        RetardationSpectrum(np.ones(1), np.ones(2), 1.0)
    with pytest.raises(InputError, match="must be positive"):
        RetardationSpectrum(np.zeros(1), np.ones(1), 1.0)
    with pytest.raises(InputError, match="not negative"):
        RetardationSpectrum(np.ones(1), np.ones(1), 1.0, -1.0)
