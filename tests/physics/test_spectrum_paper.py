"""The spectra of DOI 10.1115/1.4030850 from a reconstruction of its master curve, and of curves that others measured."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast import Plateaus
from dielast.base.errors import DielastWarning
from dielast.relaxation.fit import fit_spectrum
from reconstruction import LOG_MODULUS

Array = NDArray[np.float64]
Find = Callable[[str], Path]

EQUILIBRIUM, GLASSY = 0.078e6, 690e6
FULL, SHORTENED = (3.98e-8, 1.59e5), (3.98e-8, 1.59e4)
KEPT = [(10, 39.58e6, 3.16e-5), (5, 0.1103e6, 2.16), (3, 0.02477e6, 185.0)]


def reconstruction(points: int, noise: float = 0.0, seed: int = 0) -> tuple[Array, Array]:
    x = np.linspace(-7.4, 5.51, points)
    scatter = 1 + noise * np.random.default_rng(seed).standard_normal(points)
    return 10**x, 3 * 10 ** LOG_MODULUS(x) * scatter


@pytest.mark.filterwarnings("ignore:the spectrum misses the curve")  # thirteen branches over twelve decades ripple by 30 %
@pytest.mark.parametrize(("keep", "total", "shortest"), KEPT)
def test_table_1_truncated(keep: int, total: float, shortest: float) -> None:
    fit = fit_spectrum(
        *reconstruction(1000),
        branches=13,
        relaxation_time=SHORTENED,
        plateaus=Plateaus(equilibrium_modulus=EQUILIBRIUM, glassy_modulus=GLASSY),
        keep=keep,
        method="schwarzl-staverman",
    )
    assert fit.branches == keep
    assert fit.clipped_branches == 0
    assert fit.spectrum.shear_modulus.sum() == pytest.approx(total, rel=5e-4)
    assert fit.spectrum.relaxation_time[-1] == pytest.approx(shortest, rel=5e-3)


@pytest.mark.filterwarnings("ignore:the spectrum misses the curve")
@pytest.mark.parametrize(("keep", "total", "shortest"), KEPT)
def test_table_1_truncated_survives_one_percent_of_noise(keep: int, total: float, shortest: float) -> None:
    sums = [
        fit_spectrum(
            *reconstruction(400, 0.01, seed),
            branches=13,
            relaxation_time=SHORTENED,
            plateaus=Plateaus(equilibrium_modulus=EQUILIBRIUM, glassy_modulus=GLASSY),
            keep=keep,
            method="schwarzl-staverman",
        ).spectrum.shear_modulus.sum()
        for seed in range(10)
    ]
    np.testing.assert_allclose(sums, total, rtol=0.02)


@pytest.mark.parametrize("branches", [30, 20])
def test_table_1_full_range(branches: int) -> None:
    fit = fit_spectrum(
        *reconstruction(1000),
        branches=branches,
        relaxation_time=FULL,
        plateaus=Plateaus(equilibrium_modulus=EQUILIBRIUM, glassy_modulus=GLASSY),
        method="schwarzl-staverman",
    )
    assert fit.spectrum.shear_modulus.sum() + fit.equilibrium_shear_modulus == pytest.approx(230e6)
    assert fit.equilibrium_shear_modulus == pytest.approx(26e3)
    if branches == 30:
        assert np.argmax(fit.spectrum.shear_modulus) == 29  # largest at the shortest time, as the paper notes of its Fig. 6
    assert fit.clipped_branches == 0
    assert fit.rms_relative_error < (0.03 if branches == 30 else 0.06)


def test_defaults_find_the_papers_equilibrium_modulus_and_clip_nothing() -> None:
    fit = fit_spectrum(*reconstruction(1000), method="schwarzl-staverman")
    assert 3 * fit.equilibrium_shear_modulus == pytest.approx(EQUILIBRIUM, rel=0.01)
    assert fit.clipped_branches == 0
    assert fit.rms_relative_error < 0.03


def test_nnls_meets_the_reconstruction_far_more_closely() -> None:
    fit = fit_spectrum(*reconstruction(1000), method="nnls")
    assert fit.rms_relative_error < 1e-3
    assert 3 * fit.equilibrium_shear_modulus == pytest.approx(EQUILIBRIUM, rel=0.02)


def ansys(shared_data: Find) -> tuple[Array, Array]:
    table = np.loadtxt(shared_data("ansys_prony/time_user_master.csv"), delimiter=",", skiprows=2)
    return table[:, 0], 1e6 * table[:, 1]


@pytest.mark.filterwarnings("ignore:the curve has not levelled off")
@pytest.mark.parametrize(("branches", "reached"), [(31, 0.0023), (20, 0.008), (19, 0.0095)])
def test_thirty_one_decades_by_nnls(shared_data: Find, branches: int, reached: float) -> None:
    fit = fit_spectrum(*ansys(shared_data), method="nnls", branches=branches)
    assert fit.rms_relative_error < reached


@pytest.mark.filterwarnings("ignore:the curve has not levelled off")
def test_thirty_one_decades_by_nnls_on_times_prescribed(shared_data: Find) -> None:
    time, modulus = ansys(shared_data)
    fit = fit_spectrum(time, modulus, method="nnls", branches=31, relaxation_time=(time.min(), time.max()))
    assert fit.rms_relative_error < 0.0027
    np.testing.assert_allclose(fit.spectrum.relaxation_time[[-1, 0]], [time.min(), time.max()])


@pytest.mark.filterwarnings("ignore:the curve has not levelled off")
def test_thirty_one_decades_by_schwarzl_staverman_are_limited_by_the_polynomial(shared_data: Find) -> None:
    fit = fit_spectrum(*ansys(shared_data), method="schwarzl-staverman")
    assert fit.polynomial_rms_relative_error == pytest.approx(0.022, abs=0.001)
    assert fit.rms_relative_error < 0.025


SHIFT = {130: (2.4607, 1.1743), 145: (1.0465, 1.0917), 160: (0.0, 1.0), 175: (-0.7832, 0.9586), 190: (-1.4393, 0.8858)}


def polystyrene(shared_data: Find, floor: float) -> tuple[Array, Array]:
    """Master curve at 160 degC (Polym. Chem. 15 (2024) 815) with its published shift, above the noise floor; Young's."""
    parts = []
    for temperature, (log10_shift, factor) in SHIFT.items():
        table = np.loadtxt(shared_data(f"polystyrene/stressrelaxation_ps{temperature}_data.csv"), skiprows=1)
        table = table[table[:, 1] > floor]
        parts.append(np.column_stack([table[:, 0] / 10**log10_shift, 3 * factor * table[:, 1]]))
    time, modulus = np.concatenate(parts).T
    return time, modulus


def test_a_polystyrene_melt_by_nnls(shared_data: Find) -> None:
    time, modulus = polystyrene(shared_data, 100.0)
    fit = fit_spectrum(time, modulus, method="nnls", branches=20, plateaus=Plateaus(equilibrium_modulus=0.0))
    assert fit.equilibrium_shear_modulus == 0
    assert fit.rms_relative_error < 0.03
    slow = fit.spectrum.relaxation_time > 10
    plateau = fit.spectrum.shear_modulus[~slow & (fit.spectrum.relaxation_time > 0.01)].sum()
    assert 3e4 < plateau < 3e5  # the entanglement plateau of polystyrene, 200 kPa, as far as it is resolved
    viscosity = fit.spectrum.relaxation_time @ fit.spectrum.shear_modulus
    in_order = np.argsort(time, kind="stable")
    integral = np.trapezoid(modulus[in_order] / 3, time[in_order])
    assert viscosity == pytest.approx(integral, rel=0.1)


def test_a_melt_without_a_given_equilibrium_modulus_is_warned_of(shared_data: Find) -> None:
    with pytest.warns(DielastWarning, match="0 for a melt"):
        fit = fit_spectrum(*polystyrene(shared_data, 100.0), method="nnls", branches=20)
    assert 3 * fit.equilibrium_shear_modulus < 500
