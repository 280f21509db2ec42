"""Master curves: invariances, curves whose truth is known, errors and warnings."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.material.measurement_kind import RELAXATION
from dielast.material.shift import WLF
from dielast.relaxation.superposition.checks import warn_if_no_plateau
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve
from dielast.relaxation.superposition.spline import Spline

LAW = WLF(20.0, 8.0, 120.0)
TIME = np.geomspace(0.1, 1000, 40)


def modulus(temperature: float, time: np.ndarray = TIME) -> np.ndarray:
    """A stretched transition between 1 MPa and 1 GPa, in closed form."""
    x = np.log10(time) - float(LAW.log10_shift_factor(temperature))
    return 10 ** (7.5 - 1.5 * np.tanh(x / 5))


def curves(*temperatures: float, noise: float = 0.01, seed: int = 1) -> list[RelaxationCurve]:
    rng = np.random.default_rng(seed)
    return [RelaxationCurve(t, TIME, modulus(t) * (1 + noise * rng.standard_normal(TIME.size))) for t in temperatures]


def heard(curves: Sequence[Measurement], reference: float = 20.0, **options: Any) -> tuple[MasterCurve, str]:
    """The master curve, and everything that building it warned of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        master = build_master_curve(curves, reference_temperature=reference, **options)
    assert all(issubclass(entry.category, DielastWarning) for entry in caught)
    return master, "\n".join(str(entry.message) for entry in caught)


def build(data: Sequence[Measurement], reference: float = 20.0, **options: Any) -> MasterCurve:
    """The master curve alone."""
    return heard(data, reference, **options)[0]


def said(data: Sequence[Measurement], reference: float = 20.0, **options: Any) -> str:
    """Everything that building warns of."""
    return heard(data, reference, **options)[1]


ALL = curves(0, 10, 20, 30, 40)


def test_order_of_curves_and_points_does_not_matter() -> None:
    rng = np.random.default_rng(2)
    shuffled = []
    for k in rng.permutation(len(ALL)):
        order = rng.permutation(TIME.size)
        shuffled.append(RelaxationCurve(ALL[k].temperature, ALL[k].time[order], ALL[k].modulus[order]))
    one, other = build(ALL), build(shuffled)
    for name in ("log10_shift_factor", "covariance", "reduced_time", "relaxation_modulus", "point_temperature", "smooth_modulus"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_reference_temperature_only_moves_the_origin() -> None:
    at_20, at_25, at_35 = build(ALL), build(ALL, 25.0), build(ALL, 35.0)  # one measured, two not
    for other in (at_20, at_25):
        step = other.log10_shift_factor - at_35.log10_shift_factor
        np.testing.assert_allclose(step, step[0], atol=1e-12)
        for temperature in (0.0, 25.0, 40.0):
            moved = other.law.log10_shift_factor(temperature) - other.law.log10_shift_factor(35.0)
            np.testing.assert_allclose(at_35.law.log10_shift_factor(temperature), moved, atol=1e-9)
    step = at_25.log10_shift_factor - at_35.log10_shift_factor
    np.testing.assert_allclose(step[0], at_25.law.log10_shift_factor(35.0), atol=1e-3)  # but for how far the curves lie off the law
    assert np.all(at_35.log10_shift_factor_stderr > 0)


def test_two_runs_of_one_temperature_are_one() -> None:
    parts = [RelaxationCurve(20.0, ALL[2].time[part], ALL[2].modulus[part]) for part in (slice(None, None, 2), slice(1, None, 2))]
    np.testing.assert_array_equal(build([*ALL[:2], *parts, *ALL[3:]]).log10_shift_factor, build(ALL).log10_shift_factor)
    with pytest.raises(InputError, match=r"20 degC was measured twice .* factor of 2"):
        build([*ALL, RelaxationCurve(20.0, TIME, ALL[2].modulus * 2)])
    assert "20 degC: two runs differ by a factor of 1.1" in said([*ALL, RelaxationCurve(20.0, TIME, ALL[2].modulus * 1.1)])
    assert "20 degC: two runs differ by a factor of 1.03" in said([*ALL, RelaxationCurve(20.0, TIME, ALL[2].modulus * 1.03)])
    assert "two runs differ" not in said([*ALL, RelaxationCurve(20.0, TIME, ALL[2].modulus * 1.01)])
    aged = RelaxationCurve(20.0, TIME, np.interp(np.log10(TIME) - 0.3, np.log10(TIME), ALL[2].modulus))
    assert re.search(r"20 degC: two runs differ .* or by 0.\d+ decades of time, as after ageing", said([*ALL, aged]))


@given(data=st.data())
@settings(max_examples=15)
def test_partial_overlap_and_uneven_sampling(data: st.DataObject) -> None:
    """Exact curves of unequal lengths and samplings give exact shift factors."""
    temperatures = data.draw(st.lists(st.integers(-10, 60), min_size=2, max_size=8, unique=True))
    temperatures = sorted(temperatures)
    kept = [temperatures[0]]  # neighbours no more than 2.5 decades apart, so that curves of 3.4 decades and more overlap
    for temperature in temperatures[1:]:
        if LAW.log10_shift_factor(kept[-1]) - LAW.log10_shift_factor(temperature) < 2.5:
            kept.append(temperature)
    if len(kept) < 2:
        kept.append(kept[0] + 8)
    drawn = []
    for temperature in kept:
        start, length = data.draw(st.floats(-1, 0)), data.draw(st.floats(3.4, 4.5))
        rng = np.random.default_rng(data.draw(st.integers(0, 99)))
        inner = rng.uniform(start, start + length, data.draw(st.integers(25, 80)))
        time = 10 ** np.concatenate(([start], inner, [start + length]))
        drawn.append(RelaxationCurve(float(temperature), time, modulus(temperature, time)))
    master = build(drawn, float(kept[0]))
    truth = LAW.log10_shift_factor(master.temperature) - LAW.log10_shift_factor(float(kept[0]))
    np.testing.assert_allclose(master.log10_shift_factor, truth, atol=1e-3)


def test_moduli_that_rise_are_no_want_of_overlap() -> None:
    rising = [RelaxationCurve(t, TIME, 1e11 / modulus(t)) for t in (-20.0, 0.0, 20.0)]
    with pytest.raises(InputError, match=r"at -20, 0, 20 degC the modulus rises with time, which no modulus does"):
        build(rising)


def test_a_curve_that_joins_no_other_is_left_out() -> None:
    """One that shares no modulus with any other, and one of two points, cost no run: they are named, with their file."""
    alone = RelaxationCurve(-40.0, TIME, modulus(-40.0), source="cold.csv")
    short = RelaxationCurve(25.0, TIME[:2], modulus(25.0)[:2], source="short.csv")
    rest = [RelaxationCurve(c.temperature, c.time, c.modulus, source="rest.csv") for c in curves(10, 20, 30)]
    with pytest.warns(DielastWarning) as caught:
        master = build_master_curve([alone, *rest, short], reference_temperature=20.0)
    said = [str(one.message) for one in caught]
    assert any(one.startswith("-40 degC (cold.csv): its modulus, ") and "overlaps with that of no other" in one for one in said)
    assert any(one.startswith("25 degC (short.csv): only 2 distinct points in log time") for one in said)
    assert master.temperature.tolist() == [10.0, 20.0, 30.0]
    np.testing.assert_array_equal(master.log10_shift_factor, build(rest).log10_shift_factor)


def test_reference_outside_the_measured_range() -> None:
    assert "60 degC is outside the measured 0 to 40 degC" in said(ALL, 60.0)
    with pytest.raises(InputError, match="where the shift table ends"):
        build(ALL, 60.0, law="table")
    with pytest.raises(InputError, match="pole of the WLF law"):
        build(ALL, -110.0)
    with pytest.raises(InputError, match="above absolute zero"):
        build(ALL, float("nan"))


def test_mixed_up_temperatures_are_noticed() -> None:
    swapped = [RelaxationCurve(40.0 - c.temperature, c.time, c.modulus) for c in ALL]
    assert re.search(r"are temperatures mixed up\?, or, .* take law = \"arrhenius\"", said(swapped))
    assert "mixed up" not in said(swapped, law="arrhenius")  # a gel that dries: its law has a negative energy
    assert "mixed up" in said(
        [
            *ALL[:2],
            RelaxationCurve(ALL[2].temperature, TIME, ALL[3].modulus),
            RelaxationCurve(ALL[3].temperature, TIME, ALL[2].modulus),
            *ALL[4:],
        ],
        law="arrhenius",
    )


def test_an_end_that_rises_is_warned_of_if_its_points_rise() -> None:
    rising, x = Spline(0.0, 0.5, 0.25 * np.arange(7.0), 2.0), np.linspace(0.0, 2.0, 41)
    warn_if_no_plateau(rising, RELAXATION, x, np.sin(40 * x))  # scatter, which the end of the curve follows
    with pytest.warns(Warning, match="no modulus rises in the course of time"):
        warn_if_no_plateau(rising, RELAXATION, x, 0.5 * x + 0.01 * np.sin(40 * x))


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        ([1, 2, 3], [1, 2], "30 degC: 3 times but 2 moduli"),
        ([1, 2, float("nan")], [3, 2, 1], "30 degC: time of point 2 is nan"),
        ([1, 2, 3], [3, float("inf"), 1], "30 degC: modulus of point 1 is inf"),
        ([0, 2, 3], [3, 2, 1], "30 degC: time of point 0 is 0 s"),
        ([1, -2, 3], [3, 2, 1], "30 degC: time of point 1 is -2 s"),
    ],
)
def test_a_bad_curve_says_where(time: list[float], values: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        RelaxationCurve(30.0, np.array(time), np.array(values))


def test_too_little_is_refused() -> None:
    with pytest.raises(InputError, match="there are no curves"):
        build([])
    with pytest.raises(InputError, match="all curves are at 20 degC"):
        build([ALL[2], ALL[2]])


def test_readings_below_zero() -> None:
    few = ALL[4].modulus.copy()
    few[-2:] = -1.0
    data = [*ALL[:4], RelaxationCurve(40.0, TIME, few)]
    master, found = heard(data)
    assert "40 degC: 2 of 40 moduli are zero or negative" in found
    assert np.count_nonzero(master.point_temperature == 40.0) == 38
    many = ALL[4].modulus.copy()
    many[5:] = 0.0
    with pytest.raises(InputError, match="40 degC: 35 of 40 moduli are zero or negative, the first at point 5"):
        build([*ALL[:4], RelaxationCurve(40.0, TIME, many)])


@pytest.mark.parametrize("late", [0.3, -0.09])
def test_time_counted_from_the_wrong_moment_is_noticed(late: float) -> None:
    """From too early a moment, as after a ramp of twice the time; from too late a one, as after none."""
    tests = curves(-20, -10, 0, 10, 20, 30, 40)
    found = said([RelaxationCurve(c.temperature, c.time + late, c.modulus) for c in tests])
    if late > 0:
        assert "all curves bend as after a ramp of the strain of 0." in found
    else:
        assert "the curves do not superpose: they miss the master curve by" in found
        assert "and at short times" in found
        assert "discard_before" in found
    assert not any(words in said(tests) for words in ("the curves do not superpose", "ramp"))


def test_a_law_that_does_not_fit_is_said() -> None:
    wide = curves(-20, -10, 0, 10, 20, 30, 40, 50, 60)
    master, found = heard(wide, law="arrhenius")
    assert (
        f"at -20 degC it gives log10 a = {master.log10_shift_factor_fit[0]:.2f}, measured is {master.log10_shift_factor[0]:.2f} +-"
        in (found)
    )
    assert master.shift_fit.misfit > 50
    assert "the law does not fit" not in said(wide) + said(wide, law="table")
    assert "check the temperature of that test" not in found


@pytest.mark.parametrize("reference", [20.0, 35.0, 40.0])
def test_one_mistaken_temperature_is_named_whatever_the_reference(reference: float) -> None:
    """The test at 20 degC was done at 28 degC."""
    mistaken = [replace(curve, temperature=20.0) if curve.temperature == 28 else curve for curve in curves(0, 10, 28, 30, 40, 50)]
    found = said(mistaken, reference)
    assert "without 20 degC it fits (" in found
    assert found.count("these temperatures hardly determine") == 1  # the fits without a temperature are not the user's


Array = NDArray[np.float64]


TEMPERATURES = np.arange(-20.0, 61.0, 10.0)


TRUTH = LAW.log10_shift_factor(TEMPERATURES)


def steep(temperature: float, time: Array = TIME) -> Array:
    """A transition from 1 GPa to 1 MPa, in closed form."""
    x = np.log10(time) - float(LAW.log10_shift_factor(temperature))
    return np.asarray(10 ** (7.5 - 1.5 * np.tanh(x / 3)))


def relaxation(noise: float = 0.0, factor: float | Array = 1.0, seed: int = 0, size: int = 40) -> list[RelaxationCurve]:
    rng = np.random.default_rng(seed)
    time = np.geomspace(0.1, 1000, size)
    return [
        RelaxationCurve(float(t), time, each * steep(t, time) * (1 + noise * rng.standard_normal(size)))
        for t, each in zip(TEMPERATURES, np.broadcast_to(factor, TEMPERATURES.size), strict=True)
    ]


def creep(noise: float = 0.0) -> list[CreepCurve]:
    return [CreepCurve(c.temperature, c.time, 1 / c.modulus) for c in relaxation(noise)]


def sweeps(noise: float = 0.0) -> list[FrequencySweep]:
    """A loss modulus that peaks where the storage modulus falls, half as high as that."""
    rng = np.random.default_rng(1)
    result = []
    for t in TEMPERATURES:
        storage = steep(t, 1 / TIME)
        x = -np.log10(TIME) - float(LAW.log10_shift_factor(t))
        loss = storage * 0.5 / np.cosh(x / 3) ** 2
        one, other = (1 + noise * rng.standard_normal(TIME.size) for _ in range(2))
        result.append(FrequencySweep(float(t), TIME, storage * one, loss * other))
    return result


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
    data += [RelaxationCurve(t, time, steep(t, time)) for t in (30.0, 10.0)]
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


def test_a_bad_temperature_is_refused() -> None:
    with pytest.raises(InputError, match="above absolute zero"):
        RelaxationCurve(-300.0, TIME, TIME)
