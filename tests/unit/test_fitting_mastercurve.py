"""Master curves whose truth is known: what is said of offsets, noise floors and sparse curves, and what the numbers mean."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.material.shift import WLF
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve

Array = NDArray[np.float64]
LAW = WLF(20.0, 8.0, 120.0)
TIME = np.geomspace(0.1, 1000, 40)
TEMPERATURES = np.arange(-20.0, 61.0, 10.0)
TRUTH = LAW.log10_shift_factor(TEMPERATURES)


def modulus(temperature: float, time: Array = TIME) -> Array:
    """A transition from 1 GPa to 1 MPa, in closed form."""
    x = np.log10(time) - float(LAW.log10_shift_factor(temperature))
    return np.asarray(10 ** (7.5 - 1.5 * np.tanh(x / 3)))


def relaxation(noise: float = 0.0, factor: float | Array = 1.0, seed: int = 0, size: int = 40) -> list[RelaxationCurve]:
    rng = np.random.default_rng(seed)
    time = np.geomspace(0.1, 1000, size)
    return [
        RelaxationCurve(float(t), time, each * modulus(t, time) * (1 + noise * rng.standard_normal(size)))
        for t, each in zip(TEMPERATURES, np.broadcast_to(factor, TEMPERATURES.size), strict=True)
    ]


def creep(noise: float = 0.0) -> list[CreepCurve]:
    return [CreepCurve(c.temperature, c.time, 1 / c.modulus) for c in relaxation(noise)]


def sweeps(noise: float = 0.0) -> list[FrequencySweep]:
    """A loss modulus that peaks where the storage modulus falls, half as high as that."""
    rng = np.random.default_rng(1)
    result = []
    for t in TEMPERATURES:
        storage = modulus(t, 1 / TIME)
        x = -np.log10(TIME) - float(LAW.log10_shift_factor(t))
        loss = storage * 0.5 / np.cosh(x / 3) ** 2
        one, other = (1 + noise * rng.standard_normal(TIME.size) for _ in range(2))
        result.append(FrequencySweep(float(t), TIME, storage * one, loss * other))
    return result


def heard(curves: Sequence[Measurement], reference: float = 20.0, **options: Any) -> tuple[MasterCurve, str]:
    """The master curve, and everything that building it warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        master = build_master_curve(curves, reference_temperature=reference, **options)
    assert all(issubclass(entry.category, DielastWarning) for entry in caught)
    return master, "\n".join(str(entry.message) for entry in caught)


OFFSET = np.array([1.06, 0.94, 1.05, 0.97, 1.0, 1.07, 0.93, 1.04, 0.95])


def test_offsets_of_whole_curves_are_said_and_free_vertical_shifts_measure_them() -> None:
    """By as much as they are: of OFFSET some 5 %."""
    data = relaxation(0.003, OFFSET)
    master, said = heard(data, temperature_stderr=0.0)
    (found,) = re.findall(r"the curves differ vertically by about (\d+) % beyond their noise", said)
    assert 3 <= int(found) <= 8
    assert np.all(master.vertical_shift == 1)
    assert np.all(master.vertical_shift_stderr == 0)
    score = (master.log10_shift_factor - TRUTH) / np.maximum(master.log10_shift_factor_stderr, 1e-9)
    assert 0.1 < np.mean(np.delete(score, 4) ** 2) < 3
    free, said = heard(data, vertical="free")
    assert "differ vertically" not in said
    np.testing.assert_allclose(free.vertical_shift, 1 / OFFSET, rtol=0.02)
    score = np.delete((free.vertical_shift - 1 / OFFSET) / np.maximum(free.vertical_shift_stderr, 1e-9), 4)
    assert 0.2 < np.mean(score**2) < 3
    assert free.vertical_shift_stderr[4] == 0
    assert "differ vertically" not in heard(relaxation(0.003))[1]


def test_standard_errors_of_free_vertical_shifts_are_true() -> None:
    """And relative: of a modulus in other units they are the same. The reference lies half way between two temperatures."""
    score = []
    for seed in range(6):
        free, _ = heard(relaxation(0.01, OFFSET, seed), 25.0, vertical="free")
        b = 1 / OFFSET * np.sqrt(OFFSET[4] * OFFSET[5])
        score.append((free.vertical_shift - b) / free.vertical_shift_stderr)
    assert 0.5 < np.mean(np.square(score)) < 1.7


@pytest.mark.parametrize("reference", [20.0, 25.0])
@pytest.mark.parametrize("curves", [relaxation(), creep(), sweeps()])
def test_the_smooth_curve_runs_through_the_reduced_points(curves: Sequence[Measurement], reference: float) -> None:
    """Those of every channel; and its ends are the moduli that are read off it."""
    master, _ = heard(curves, reference)
    np.testing.assert_allclose(
        master.log10_shift_factor, LAW.log10_shift_factor(TEMPERATURES) - LAW.log10_shift_factor(reference), atol=0.01
    )
    assert np.all(np.diff(master.smooth_abscissa) > 0)
    assert np.all(np.diff(master.reduced_abscissa) >= 0)
    np.testing.assert_allclose(master.smooth_abscissa[[0, -1]], master.reduced_abscissa[[0, -1]], rtol=1e-6)
    for points, smooth in zip(master.ordinates, master.smooth_ordinates, strict=True):
        read = np.interp(np.log(master.reduced_abscissa), np.log(master.smooth_abscissa), np.log(smooth))
        np.testing.assert_allclose(read, np.log(points), atol=0.02)
    first = master.smooth_ordinates[0]
    falling = first if master.measurement == "relaxation" else 1 / first if master.measurement == "creep" else first[::-1]
    assert master.equilibrium_modulus == pytest.approx(falling[-1], rel=1e-12)
    assert master.glassy_modulus == pytest.approx(falling.max(), rel=1e-12)
    own = dict(zip(master.temperature, master.log10_shift_factor, strict=True))
    factor = 10 ** np.array([own[t] for t in master.point_temperature])
    reduced = master.abscissa * factor if master.measurement == "oscillation" else master.abscissa / factor
    np.testing.assert_allclose(master.reduced_abscissa, reduced, rtol=1e-12)
    assert master.abscissa.size == 9 * TIME.size


def test_density_and_temperature_are_taken_out_before_the_shifts_are_sought() -> None:
    """Moduli in proportion to density times absolute temperature superpose exactly once that is imposed."""
    kelvin = TEMPERATURES + 273.15
    b = 293.15 / kelvin * (1 + 7e-4 * (TEMPERATURES - 20))
    data = relaxation(factor=1 / b)
    master, said = heard(data, vertical="density-temperature", thermal_expansion=7e-4)
    np.testing.assert_allclose(master.vertical_shift, b, rtol=1e-12)
    np.testing.assert_allclose(master.log10_shift_factor, TRUTH, atol=1e-3)
    assert "differ" not in said
    crept, _ = heard(
        [CreepCurve(c.temperature, c.time, 1 / c.modulus) for c in data], vertical="density-temperature", thermal_expansion=7e-4
    )
    np.testing.assert_allclose(crept.log10_shift_factor, TRUTH, atol=1e-3)
    np.testing.assert_allclose(crept.creep_compliance, 1 / master.relaxation_modulus, rtol=1e-3)


@pytest.mark.parametrize(("expansion", "temperature"), [(0.1, 0), (-0.1, 30), (0.05, 0), (0.02, None), (-0.02, None)])
def test_a_density_must_be_positive_at_every_temperature(expansion: float, temperature: float | None) -> None:
    """1 + alpha (T - T_ref) reaches zero at 0 degC for alpha of 1/20 per K and a reference of 20 degC."""
    data = [curve for curve in relaxation() if 0 <= curve.temperature <= 40]
    if temperature is None:
        heard(data, vertical="density-temperature", thermal_expansion=expansion)
        return
    with pytest.raises(InputError, match=rf"thermal_expansion: {expansion} /K gives no positive density at {temperature} degC"):
        heard(data, vertical="density-temperature", thermal_expansion=expansion)


def crowd(x: float) -> Array:
    """Readings that all fall into one bin of log time."""
    return np.asarray(10.0 ** (x + np.linspace(0, 0.04, 4)))


@pytest.mark.parametrize("bins", [1, 2, 3])
def test_a_curve_needs_three_points_that_are_distinct_in_log_time(bins: int) -> None:
    """However many readings it has; each such curve is named and left out."""
    time = np.concatenate([crowd(x) for x in (0.0, 1.0, 2.0)[:bins]])
    data: list[Measurement] = [curve for curve in relaxation() if curve.temperature not in (10.0, 30.0)]
    data += [RelaxationCurve(t, time, modulus(t, time)) for t in (30.0, 10.0)]
    if bins == 3:
        assert heard(data)[0].temperature.size == 9
        return
    found, said = heard(data)
    points = ("1 distinct point", "2 distinct points")[bins - 1]
    assert f"10 degC: only {points} in log time; at least 3 are needed; this curve is left out" in said
    assert f"30 degC: only {points} in log time" in said
    assert found.temperature.size == 7
    swept = sweeps()
    swept[0] = FrequencySweep(swept[0].temperature, swept[0].angular_frequency[:2], *(np.ones(2) * 1e6 for _ in range(2)))
    assert f"{swept[0].temperature:g} degC: only 2 distinct points in log frequency" in heard(swept)[1]


def test_noise_floors_of_sweeps_are_those_of_low_frequencies() -> None:
    """FitPoints are counted once, whichever of the two moduli is lost, and what was negative anyway is not counted again."""
    data = sweeps()
    frequency = np.geomspace(1e-3, 1e-1, 160)
    noise = np.resize([1.4, 0.6, 0.6, 1.4], 160)
    late = np.concatenate((frequency, TIME[1:]))
    warm = data[-1]
    loss = np.concatenate((1e-4 * warm.loss_modulus[0] * (0.1 + 4 * (noise - 1)).clip(1e-3), warm.loss_modulus[1:]))
    storage = np.concatenate((np.full(160, warm.storage_modulus[0]), warm.storage_modulus[1:]))
    master, said = heard([*data[:-1], FrequencySweep(60.0, late, storage, loss)])
    (where,) = re.findall(r"points at the low-frequency end of curves that are lost in noise are left out: (.*)", said)
    (dropped,) = re.findall(r"^60 degC \((\d+)\)$", where)
    assert np.count_nonzero(master.point_temperature == 60.0) == late.size - int(dropped)
    assert int(dropped) > 100


def test_what_is_not_determined_has_no_number_and_spoils_none() -> None:
    """A plateau at one end: its shift is unknown, infinitely uncertain, and all others are what they are without it."""
    data = relaxation(0.005)
    rng = np.random.default_rng(3)
    flat = RelaxationCurve(260.0, TIME, data[-1].modulus[-1] * (1 + 0.005 * rng.standard_normal(TIME.size)))
    (without, _), (master, said) = heard(data), heard([*data, flat])
    assert "260 degC: the shift factor is not determined: the curve is a plateau; its points are placed by the shift law" in said
    (known,) = re.findall(r"at 260 degC the shift law is extrapolated and knows log10 a to \+- (\S+), if it holds there", said)
    C1, C2 = master.law_parameters.values()
    slope = np.array([-240 / (C2 + 240) + 40 / (C2 + 40), C1 * (240 / (C2 + 240) ** 2 - 40 / (C2 + 40) ** 2)])
    assert float(known) == pytest.approx(np.sqrt(slope @ master.shift_fit.covariance @ slope), rel=0.05)
    assert [entry.temperature for entry in master.undetermined] == [260.0]
    np.testing.assert_allclose(master.log10_shift_factor[:-1], without.log10_shift_factor, atol=4e-3)
    np.testing.assert_allclose(master.log10_shift_factor_stderr[:-1], without.log10_shift_factor_stderr, rtol=0.1, atol=1e-6)
    assert np.isnan(master.log10_shift_factor[-1])
    assert np.isinf(master.covariance[-1, -1])
    assert np.all(master.covariance[-1, :-1] == 0)
    own = master.point_temperature == 260.0
    np.testing.assert_allclose(
        master.abscissa[own] / master.reduced_abscissa[own], 10 ** master.log10_shift_factor_fit[-1], rtol=1e-9
    )
    table, said = heard([*data, flat], law="table")
    assert "its points are left out" in said
    assert not np.any(table.point_temperature == 260.0)
    assert np.isnan(table.log10_shift_factor_fit[-1])
