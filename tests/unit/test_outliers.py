"""Points far off the master curve are named with their size, rows that stand twice and contradicting moduli are told."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.stats import norm

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.material.shift import WLF
from dielast.numerics.robust import robust_deviation, robust_variance
from dielast.readings.kramers_kronig import viscosity_factor, warn_if_inconsistent
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve

LAW = WLF(20.0, 13.7, 187.1)
TEMPERATURES = (-20.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0)
TIME = np.geomspace(1.0, 1200.0, 20)


def modulus(temperature: float, time: np.ndarray = TIME) -> np.ndarray:
    return np.asarray(1e5 + 3e8 / (1 + (time / 10 ** float(LAW.log10_shift_factor(temperature)) / 1e-3) ** 0.5))


def relaxation(noise: float = 0.01) -> list[RelaxationCurve]:
    rng = np.random.default_rng(1)
    return [RelaxationCurve(t, TIME, modulus(t) * (1 + noise * rng.standard_normal(TIME.size))) for t in TEMPERATURES]


def heard(curves: list[Measurement]) -> tuple[MasterCurve, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        master = build_master_curve(curves, reference_temperature=20.0)
    return master, [str(one.message) for one in caught if issubclass(one.category, DielastWarning)]


def changed(curve: RelaxationCurve, place: int, factor: float) -> RelaxationCurve:
    values = curve.modulus.copy()
    values[place] *= factor
    return RelaxationCurve(curve.temperature, curve.time, values)


@pytest.mark.parametrize("seed", [2, 3])
def test_a_bend_between_sparse_points_is_no_outlier(seed: int) -> None:
    """All curves have a point there, and it is the smooth curve that is off."""
    rng, time, curves = np.random.default_rng(seed), np.geomspace(0.1, 1200.0, 12), []
    for t in np.linspace(-40.0, 60.0, 14).round(1).tolist():
        stretched = np.exp(-((time / 10 ** float(LAW.log10_shift_factor(t)) / 10) ** 0.25))
        curves.append(RelaxationCurve(t, time, (1e5 + 1e8 * stretched) * (1 + 0.005 * rng.standard_normal(time.size))))
    assert not [one for one in heard(list(curves))[1] if "far off" in one]


@pytest.mark.parametrize(("factor", "place"), [(1e6, 0), (3.0, 9), (0.5, 19), (1e-3, 9)])
def test_one_point_is_named_with_its_size(factor: float, place: int) -> None:
    curves = relaxation()
    curves[3] = changed(curves[3], place, factor)
    master, said = heard(list(curves))
    (found,) = [one for one in said if "far off" in one]
    assert found.startswith(f"a point lies far off the master curve: 10 degC at {TIME[place]:.4g} s, ")
    size = float(found.split(" s, ")[1].split(" times")[0])
    assert size == pytest.approx(factor, rel=0.05)
    assert "next to no weight in the shift factors, but is still in the master curve" in found
    without, _ = heard(list(relaxation()))
    np.testing.assert_allclose(master.log10_shift_factor, without.log10_shift_factor, atol=0.01)


def test_the_worst_of_many_are_named() -> None:
    curves = [changed(curve, 5 + k, 10.0 ** (k + 1)) for k, curve in enumerate(relaxation())]
    (found,) = [one for one in heard(list(curves))[1] if "far off" in one]
    assert found.startswith("7 points lie far off the master curve: 0 degC at")
    assert "; and 2 more: they have" in found


def test_a_compliance_and_a_loss_modulus_are_named_as_such() -> None:
    creep: list[Measurement] = [CreepCurve(c.temperature, c.time, 1 / c.modulus) for c in relaxation()]
    creep[2] = CreepCurve(0.0, TIME, 1 / changed(relaxation()[2], 7, 0.1).modulus)
    (found,) = [one for one in heard(creep)[1] if "far off" in one]
    assert f"0 degC at {TIME[7]:.4g} s, " in found
    assert 9 < float(found.split(" s, ")[1].split(" times")[0]) < 11
    rng = np.random.default_rng(2)
    sweeps: list[Measurement] = []
    for t in TEMPERATURES:
        phase = (1j / TIME * 10 ** float(LAW.log10_shift_factor(t)) * 1e-2) ** 0.5
        star = 1e5 + 3e8 * phase / (1 + phase)
        storage, loss = (part * (1 + 0.01 * rng.standard_normal(TIME.size)) for part in (star.real, star.imag))
        loss[4] *= 5.0 if t == 20.0 else 1.0
        sweeps.append(FrequencySweep(t, 1 / TIME, storage, loss))
    (found,) = [one for one in heard(sweeps)[1] if "far off" in one]
    assert f"20 degC at {1 / TIME[4]:.4g} rad/s (loss), " in found


def test_rows_that_stand_twice_are_said_to_and_taken_once() -> None:
    curves = relaxation()
    own = curves[4]
    order = np.r_[0:6, 5, 6:20]
    curves[4] = RelaxationCurve(20.0, own.time[order], own.modulus[order])
    master, said = heard(list(curves))
    assert f"20 degC: time {TIME[5]:g} s appears twice, with the same values: each is taken once" in said
    without, silent = heard(list(relaxation()))
    assert not [one for one in silent if "twice" in one]
    np.testing.assert_array_equal(master.log10_shift_factor, without.log10_shift_factor)
    values = own.modulus[order].copy()
    values[6] *= 1.02
    curves[4] = RelaxationCurve(20.0, own.time[order], values)
    assert f"20 degC: time {TIME[5]:g} s appears twice, with different values: all are taken" in heard(list(curves))[1]
    # a second run on the same times is a second run
    assert not [one for one in heard([*relaxation(), changed(own, 3, 1.01)])[1] if "different values" in one]


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


def test_robust_scatter_is_that_of_normal_numbers_whatever_a_few_outliers() -> None:
    quantiles = norm.ppf((np.arange(999) + 0.5) / 999)  # of a standard normal distribution, without chance
    values = np.append(3.0 * quantiles, [1e6, -1e6])
    assert robust_deviation(values) == pytest.approx(3.0, rel=5e-3)
    assert robust_variance(values) == pytest.approx(9.0, rel=1e-2)
