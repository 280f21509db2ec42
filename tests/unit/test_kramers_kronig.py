"""What the two moduli of a sweep say of each other, and what they cannot say of the frequency."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import FrequencySweep
from dielast.readings.kramers_kronig import viscosity_factor, warn_if_inconsistent

OMEGA = np.geomspace(0.01, 100, 25)


def sweep(
    tau: np.ndarray, moduli: np.ndarray, equilibrium: float = 0.0, frequency_scale: float = 1.0, loss_scale: float = 1.0
) -> FrequencySweep:
    x = np.outer(OMEGA, tau)
    storage, loss = equilibrium + x**2 / (1 + x**2) @ moduli, x / (1 + x**2) @ moduli
    return FrequencySweep(20.0, OMEGA * frequency_scale, storage, loss_scale * loss)


def broad(slope: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    tau = np.geomspace(1e-6, 1e6, 60)
    return tau, 1e5 * tau**-slope


@given(
    slope=st.floats(0.05, 0.9),
    equilibrium=st.floats(0, 1e8),
    frequency_scale=st.floats(1e-6, 1e6),
    noise=st.floats(0, 0.02),
    seed=st.integers(0, 99),
)
def test_a_material_never_contradicts_itself(
    slope: float, equilibrium: float, frequency_scale: float, noise: float, seed: int
) -> None:
    clean = sweep(*broad(slope), equilibrium, frequency_scale)
    scatter = 1 + noise * np.random.default_rng(seed).uniform(-1, 1, (2, OMEGA.size))
    noisy = FrequencySweep(20.0, clean.angular_frequency, clean.storage_modulus * scatter[0], clean.loss_modulus * scatter[1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_if_inconsistent([noisy])


@pytest.mark.parametrize(
    ("loss_scale", "said"), [(1e-6, "1e6"), (1e-3, "1e3"), (1e3, "1e-3"), (1e6, "1e-6"), (1e9, "1e-9"), (1e2, "1e-2")]
)
def test_moduli_in_different_units_are_told(loss_scale: float, said: str) -> None:
    with pytest.warns(DielastWarning, match=f"different units: the loss moduli fit .* if they are {said} times as large"):
        warn_if_inconsistent([sweep(*broad(), loss_scale=loss_scale)])


def test_swapped_moduli_are_told() -> None:
    right = sweep(*broad(0.2))
    with pytest.warns(DielastWarning, match="look swapped"):
        warn_if_inconsistent([FrequencySweep(20.0, OMEGA, right.loss_modulus, right.storage_modulus)])


def test_moduli_of_two_materials_are_told() -> None:
    right = sweep(*broad(0.6))
    with pytest.warns(DielastWarning, match="do not belong together"):
        warn_if_inconsistent([FrequencySweep(20.0, OMEGA, right.storage_modulus, 0.05 * right.loss_modulus[::-1])])


@pytest.mark.parametrize(("scale", "factor"), [(1.0, 1.0), (2 * np.pi, 1 / (2 * np.pi)), (1 / (2 * np.pi), 2 * np.pi)])
def test_a_viscosity_knows_the_unit_of_the_frequency(scale: float, factor: float) -> None:
    right = sweep(*broad())
    viscosity = np.hypot(right.storage_modulus, right.loss_modulus) / OMEGA
    assert viscosity_factor(sweep(*broad(), frequency_scale=scale), viscosity) == pytest.approx(factor, rel=1e-12)


def test_a_viscosity_must_fit_the_sweep() -> None:
    with pytest.raises(InputError, match="3 complex viscosities for 25 angular frequencies"):
        viscosity_factor(sweep(*broad()), np.ones(3))
    with pytest.raises(InputError, match="no complex viscosity is positive"):
        viscosity_factor(sweep(*broad()), np.zeros(25))


def polystyrene(shared_data: Callable[[str], Path]) -> list[FrequencySweep]:
    found = []
    for temperature in (130, 145, 160, 175, 190):
        path = shared_data(f"polystyrene/oscillation_ps{temperature}_data.csv")
        omega, storage, loss = np.loadtxt(path, skiprows=1).T
        found.append(FrequencySweep(float(temperature), omega, storage, loss))
    return found


def test_measured_polystyrene(shared_data: Callable[[str], Path]) -> None:
    sweeps = polystyrene(shared_data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_if_inconsistent(sweeps)
    with pytest.warns(DielastWarning, match="look swapped"):
        warn_if_inconsistent(
            [FrequencySweep(s.temperature, s.angular_frequency, s.loss_modulus, s.storage_modulus) for s in sweeps]
        )
    with pytest.warns(DielastWarning, match="1e-6 times as large"):
        warn_if_inconsistent(
            [FrequencySweep(s.temperature, s.angular_frequency, s.storage_modulus, 1e6 * s.loss_modulus) for s in sweeps]
        )
