"""Points far off the master curve are named with their size, and rows that stand twice are said to."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import brentq

from dielast.base.errors import DielastWarning
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.material.ramp import mean_age
from dielast.material.shift import WLF
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


@pytest.mark.parametrize("factor", [1e6, 3.0, 0.5, 1e-3])
@pytest.mark.parametrize("place", [0, 9, 19])
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


def test_a_named_point_is_not_in_the_residual_and_its_time_is_as_measured() -> None:
    clean, _ = heard(list(relaxation()))
    curves = [RelaxationCurve(c.temperature, c.time, c.modulus, ramp_taken_out=0.5) for c in relaxation()]
    curves[2] = RelaxationCurve(0.0, TIME, changed(relaxation()[2], 7, 3.0).modulus, ramp_taken_out=0.5)
    master, said = heard(list(curves))
    (found,) = [one for one in said if "far off" in one]
    measured = brentq(lambda time: mean_age(np.array([time]), 0.5)[0] - TIME[7], 0.5, 1e9)
    assert f"0 degC at {measured:.4g} s, " in found
    assert (clean.outlying_points, master.outlying_points) == (0, 1)
    assert master.rms_residual_decades == pytest.approx(clean.rms_residual_decades, rel=0.1)
