"""The continuous spectrum of curves whose spectrum is known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from math import gamma

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast import Plateaus
from dielast.base.errors import DielastWarning, InputError
from dielast.relaxation.continuous import continuous_spectrum
from dielast.relaxation.creep import fit_creep
from dielast.relaxation.fit import fit_oscillation, fit_spectrum
from dielast.relaxation.result import SpectrumFit

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


def fitted(curve: Array, noise: float, level: float = LEVEL) -> SpectrumFit:
    scatter = 1 + noise * np.random.default_rng(1).standard_normal(TIME.size)
    return fit_spectrum(TIME, curve * scatter, method="nnls", plateaus=Plateaus(equilibrium_modulus=3 * level))


@pytest.mark.parametrize(
    ("spectrum", "noise", "rms", "worst"),
    [
        (box, 0.0, 0.04, 0.12),  # edges ring
        (wedge, 0.0, 0.01, 0.03),
        (wedge, 0.005, 0.04, 0.08),
        (log_normal, 0.0, 1e-3, 2e-3),
        (log_normal, 0.005, 0.015, 0.03),
        (log_normal, 0.02, 0.04, 0.1),
    ],
)
def test_a_known_spectrum_is_recovered(spectrum: Callable[[Array], Array], noise: float, rms: float, worst: float) -> None:
    fit = fitted(young(spectrum), noise)
    found = continuous_spectrum(fit)
    tau = found.relaxation_time
    inside = (tau > 1e-2) & (tau < 1e2)
    error = (found.density / np.maximum(spectrum(tau), 1.0) - 1)[inside]
    assert np.sqrt(np.mean(error**2)) < rms
    assert np.max(np.abs(error)) < worst
    assert found.integral == pytest.approx(fit.spectrum.shear_modulus.sum(), rel=1e-4 if noise == 0 else 0.02)
    assert np.all(found.density >= 0)


@pytest.mark.parametrize(("noise", "rms", "worst"), [(0.0, 0.02, 0.08), (0.005, 0.03, 0.1), (0.02, 0.05, 0.12)])
def test_a_power_law_is_recovered_over_ten_decades(noise: float, rms: float, worst: float) -> None:
    exponent = 0.3
    curve = 3e5 * gamma(exponent) * TIME**-exponent  # H = 1e5 tau^-0.3 exactly
    found = continuous_spectrum(fitted(curve, noise, level=0.0))
    tau = found.relaxation_time
    error = (found.density / (1e5 * tau**-exponent) - 1)[(tau > 1e-5) & (tau < 1e5)]
    assert np.sqrt(np.mean(error**2)) < rms
    assert np.max(np.abs(error)) < worst


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
        continuous_spectrum(fitted(young(wedge), 0.0), 0)


def test_a_spectrum_that_falls_apart_is_warned_of() -> None:
    lines = np.logspace(-3, 3, 7)
    time = np.logspace(-4, 4, 400)
    modulus = 3 * (LEVEL + np.exp(-time[:, None] / lines) @ np.full(7, 1e5))
    fit = fit_spectrum(
        time, modulus, method="nnls", branches=7, relaxation_time=(1e-3, 1e3), plateaus=Plateaus(equilibrium_modulus=3 * LEVEL)
    )
    with pytest.warns(DielastWarning, match=r"the continuous spectrum falls apart into \d pieces"):
        continuous_spectrum(fit)
