"""Spectra from oscillation and from creep: known materials come back, and what allows no fit is refused in one line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flat import fit_creep, fit_oscillation

from dielast.base.errors import InputError
from dielast.material.spectrum import Spectrum
from dielast.relaxation.interconversion import RetardationSpectrum, relaxation_from_retardation, retardation_from_relaxation

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


@pytest.mark.parametrize("stated", [None, 3 * LEVEL])
def test_creep_predicts_the_relaxation_of_the_same_material(stated: float | None) -> None:
    scatter = 1 + 0.01 * np.random.default_rng(1).standard_normal(TIME.size)
    fit = fit_creep(TIME, COMPLIANCE * scatter, branches=25, equilibrium_modulus=stated)
    time = np.logspace(-6, 4, 101)
    predicted = fit.spectrum.relaxation_modulus(time, fit.equilibrium_shear_modulus)
    np.testing.assert_allclose(predicted, TRUTH.relaxation_modulus(time, LEVEL), rtol=0.04)
    assert np.all(fit.spectrum.shear_modulus > 0)
    if stated is not None:
        assert 3 * fit.equilibrium_shear_modulus == pytest.approx(stated, rel=1e-12)


@pytest.mark.parametrize("stated", [{}, {"equilibrium_modulus": 3 * LEVEL}])
def test_the_glassy_modulus_of_creep_is_that_of_all_springs(stated: dict[str, float]) -> None:
    """Stated with the equilibrium modulus or without."""
    whole = 1.05 * (TRUTH.shear_modulus.sum() + LEVEL)
    fit = fit_creep(TIME, COMPLIANCE, branches=20, glassy_modulus=3 * whole, **stated)
    assert fit.spectrum.shear_modulus.sum() + fit.equilibrium_shear_modulus == pytest.approx(whole, rel=1e-9)


@pytest.mark.parametrize(
    ("columns", "options", "found"),
    [
        (([1.0, 2.0], [3.0, -2.0], [1.0, 1.0]), {}, r"storage modulus\[1\] = -2 Pa: a positive, finite number is needed"),
        (([1.0, 2.0], [3.0, 2.0], [np.nan, 0.0]), {}, r"loss modulus\[0\] = nan Pa \(and 1 more\)"),
        (([1.0, 2.0], [3.0, 2.0], [1.0]), {}, "same length"),
        (([1.0, 1.0], [3.0, 2.0], [1.0, 1.0]), {}, "at a single angular frequency: at least two different angular frequencies"),
        ((FREQUENCY, STORAGE, LOSS), {"branches": 0}, "branches: 0: nnls needs at least 1"),
        ((FREQUENCY, STORAGE, LOSS), {"equilibrium_modulus": 1e6}, "is above the end of the curve"),
        ((FREQUENCY, STORAGE, LOSS), {"relaxation_time": (2.0, 1.0)}, "must be shorter"),
        ((FREQUENCY, STORAGE, LOSS), {"keep": 31}, "cannot keep 31 of 30"),
    ],
)
def test_impossible_oscillations_are_refused_in_one_line(columns: Any, options: dict[str, Any], found: str) -> None:
    with pytest.raises(InputError, match=found) as caught:
        fit_oscillation(*columns, **options)
    assert "\n" not in str(caught.value)


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
