"""Relaxation and retardation spectra of one material: closed forms, the identity that joins them, and there and back again."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation.interconversion import RetardationSpectrum, relaxation_from_retardation, retardation_from_relaxation


def test_the_standard_linear_solid() -> None:
    equilibrium, modulus, tau = 2e4, 6e4, 3.0
    creep = retardation_from_relaxation(Spectrum(np.array([tau]), np.array([modulus])), equilibrium)
    assert creep.glassy_compliance == pytest.approx(1 / 8e4, rel=1e-14)
    assert creep.retardation_time[0] == pytest.approx(tau * 8e4 / 2e4, rel=1e-14)
    assert creep.compliance[0] == pytest.approx(1 / 2e4 - 1 / 8e4, rel=1e-13)
    assert creep.fluidity == 0


def test_one_maxwell_element_only_flows() -> None:
    creep = retardation_from_relaxation(Spectrum(np.array([3.0]), np.array([6e4])))
    assert creep.retardation_time.size == 0
    assert creep.fluidity == pytest.approx(1 / 18e4, rel=1e-14)
    np.testing.assert_allclose(creep.creep_compliance([0.0, 3.0]), [1 / 6e4, 2 / 6e4], rtol=1e-14)
    back, equilibrium = relaxation_from_retardation(creep)
    assert equilibrium == 0
    assert back.relaxation_time[0] == pytest.approx(3.0, rel=1e-14)
    assert back.shear_modulus[0] == pytest.approx(6e4, rel=1e-14)


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
