"""Contract of the master curve: invariances, input errors, warnings."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import RelaxationCurve
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


def build(data: list[RelaxationCurve], reference: float = 20.0, **keywords: Any) -> MasterCurve:
    """Build without regard to warnings, which other tests look at."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        return build_master_curve(data, reference_temperature=reference, **keywords)


def said(data: list[RelaxationCurve], reference: float = 20.0, **keywords: Any) -> str:
    """Everything that building warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        build_master_curve(data, reference_temperature=reference, **keywords)
    assert all(issubclass(entry.category, DielastWarning) for entry in caught)
    return "\n".join(str(entry.message) for entry in caught)


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
    assert "40 degC: 2 of 40 moduli are zero or negative" in said(data)
    assert np.count_nonzero(build(data).point_temperature == 40.0) == 38
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
    master = build(wide, law="arrhenius")
    found = said(wide, law="arrhenius")
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
