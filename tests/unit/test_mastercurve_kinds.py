"""Master curves of frequency sweeps and creep tests: closed forms, invariants and what is refused."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dielast.base.errors import DielastWarning, InputError
from dielast.material.measurement import CreepCurve, FrequencySweep, RelaxationCurve
from dielast.material.shift import WLF
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve

LAW = WLF(20.0, 13.7, 187.1)
TEMPERATURES = np.arange(0.0, 41.0, 10.0)
TRUTH = LAW.log10_shift_factor(TEMPERATURES)
FREQUENCY = np.logspace(-2, 2, 25)
TIME = np.logspace(0, 3, 40)


def build(curves: list[Any], **options: Any) -> MasterCurve:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        return build_master_curve(curves, **{"reference_temperature": 20.0, **options})


def maxwell(noise: float = 0.0, frequency: np.ndarray = FREQUENCY) -> list[FrequencySweep]:
    """One Maxwell element of 1e5 Pa and 1 s at 20 degC."""
    rng = np.random.default_rng(0)
    curves = []
    for temperature, shift in zip(TEMPERATURES.tolist(), TRUTH, strict=True):
        x = frequency * 10**shift
        storage, loss = (1e5 * part / (1 + x**2) * (1 + noise * rng.standard_normal(x.size)) for part in (x**2, x))
        curves.append(FrequencySweep(temperature, frequency, storage, loss))
    return curves


def critical_gel(noise: float = 0.0) -> list[FrequencySweep]:
    """Both moduli follow one power law: tan delta is the same everywhere."""
    rng = np.random.default_rng(0)
    curves = []
    for temperature, shift in zip(TEMPERATURES.tolist(), TRUTH, strict=True):
        x = (FREQUENCY * 10**shift) ** 0.4
        storage, loss = (level * x * (1 + noise * rng.standard_normal(x.size)) for level in (1e5, 7e4))
        curves.append(FrequencySweep(temperature, FREQUENCY, storage, loss))
    return curves


def kelvin(noise: float = 0.0, level: float = 1.0) -> list[CreepCurve]:
    """A spring, twelve Kelvin elements and a dashpot."""
    rng = np.random.default_rng(0)
    own = np.logspace(-3, 4, 12)
    curves = []
    for temperature, shift in zip(TEMPERATURES.tolist(), TRUTH, strict=True):
        t = TIME / 10**shift
        compliance = level * (1e-8 + 3e-8 * np.sum(-np.expm1(-t[:, None] / own), axis=1) + 1e-11 * t)
        curves.append(CreepCurve(temperature, TIME, compliance * (1 + noise * rng.standard_normal(t.size))))
    return curves


@pytest.mark.parametrize(
    ("on", "vertical"),
    [
        *(("auto", "none"), ("moduli", "free"), ("tan-delta", "free"), ("storage", "none")),
        *(pytest.param(on, "none", marks=pytest.mark.trust) for on in ("moduli", "tan-delta")),
    ],
)
def test_one_maxwell_element_is_shifted_exactly(on: str, vertical: str) -> None:
    master = build(maxwell(), on=on, vertical=vertical)
    np.testing.assert_allclose(master.log10_shift_factor, TRUTH, atol=2e-4)
    np.testing.assert_allclose(master.vertical_shift, 1.0, atol=1e-3)
    np.testing.assert_allclose(master.law_parameters["C2"], 187.1, rtol=0.01)
    x = master.reduced_angular_frequency
    assert np.all(np.diff(x) >= 0)
    np.testing.assert_allclose(master.storage_modulus, 1e5 * x**2 / (1 + x**2), rtol=2e-3)
    np.testing.assert_allclose(master.loss_modulus, 1e5 * x / (1 + x**2), rtol=2e-3)
    here = master.point_temperature == 40.0
    assert np.all(x[here] < master.angular_frequency[here])  # hot is fast: a sweep moves to lower frequencies
    smooth = master.smooth_abscissa
    np.testing.assert_allclose(master.smooth_ordinates[0], 1e5 * smooth**2 / (1 + smooth**2), rtol=0.01)
    assert master.glassy_modulus == pytest.approx(1e5, rel=0.01)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_critical_gel_needs_its_moduli(noise: float) -> None:
    """Without a feature in tan delta the moduli alone tell the shift, and nothing does if they may slide vertically."""
    master = build(critical_gel(noise))
    assert master.shifted_on == "moduli"
    assert np.all(np.abs(master.log10_shift_factor - TRUTH) <= 3 * master.log10_shift_factor_stderr + 1e-12)
    with pytest.raises(InputError, match=r"no shift factor is determined: at .* tan delta is level"):
        build(critical_gel(noise), on="tan-delta")
    with pytest.raises(InputError, match="straight line in log-log"):
        build(critical_gel(noise), vertical="free")


def test_a_level_tan_delta_is_filled_in_by_the_law() -> None:
    """At 0 degC the sweep is a power law, so that tan delta says nothing there, while the others say all."""
    flat = critical_gel(0.003)[0]
    with pytest.warns(DielastWarning) as caught:
        master = build_master_curve([flat, *maxwell(0.003)[1:]], reference_temperature=20.0, on="tan-delta")
    said = [str(entry.message) for entry in caught]
    assert "0 degC: the shift factor is not determined: tan delta is level; its points are placed by the shift law" in said
    assert np.isnan(master.log10_shift_factor[0])
    assert np.isinf(master.log10_shift_factor_stderr[0])
    assert np.any(master.point_temperature == 0.0)
    table = build([flat, *maxwell(0.003)[1:]], on="tan-delta", law="table")
    assert not np.any(table.point_temperature == 0.0)


def test_creep_is_shifted_along_its_inverse() -> None:
    master = build(kelvin())
    assert master.measurement == "creep"
    np.testing.assert_allclose(master.log10_shift_factor, TRUTH, atol=2e-4)
    assert np.all(np.diff(master.creep_compliance) > 0)
    assert master.equilibrium_modulus == pytest.approx(1 / master.creep_compliance[-1], rel=0.01)
    assert master.glassy_modulus == pytest.approx(1 / master.creep_compliance[0], rel=0.01)
    noisy = build(kelvin(0.01))
    moved = TEMPERATURES != 20.0
    score = (noisy.log10_shift_factor - TRUTH)[moved] / noisy.log10_shift_factor_stderr[moved]
    assert np.max(np.abs(score)) < 3


@cache
def as_they_come() -> tuple[list[FrequencySweep], MasterCurve]:
    curves = maxwell(0.01)
    return curves, build(curves)


@settings(max_examples=2)
@given(st.permutations(range(5)), st.floats(-6, 6), st.floats(-6, 6))
def test_order_and_units_do_not_matter(order: list[int], faster: float, stiffer: float) -> None:
    curves, own = as_they_come()
    moved = build(
        [
            FrequencySweep(
                c.temperature,
                c.angular_frequency[::-1] * 10**faster,
                c.storage_modulus[::-1] * 10**stiffer,
                c.loss_modulus[::-1] * 10**stiffer,
            )
            for c in (curves[k] for k in order)
        ]
    )
    np.testing.assert_allclose(moved.log10_shift_factor, own.log10_shift_factor, atol=2e-6)
    np.testing.assert_allclose(moved.log10_shift_factor_stderr, own.log10_shift_factor_stderr, rtol=1e-3)
    np.testing.assert_allclose(moved.storage_modulus, own.storage_modulus * 10**stiffer, rtol=1e-9)
    np.testing.assert_allclose(moved.reduced_abscissa, own.reduced_abscissa * 10**faster, rtol=1e-5)


def test_kinds_are_not_mixed_and_have_their_own_quantities() -> None:
    relaxation = RelaxationCurve(0.0, TIME, 1e6 * TIME**-0.3)
    with pytest.raises(InputError, match="relaxation curves and frequency sweeps cannot be shifted together"):
        build([relaxation, *maxwell()])
    with pytest.raises(InputError, match="is for frequency sweeps; creep curves have one modulus only"):
        build(kelvin(), on="moduli")
    sweeps, creep = build(maxwell()), build(kelvin())
    for name in ("time", "reduced_time", "smooth_reduced_time", "relaxation_modulus", "smooth_modulus", "creep_compliance"):
        with pytest.raises(InputError, match="a master curve of oscillation has no"):
            getattr(sweeps, name)
    for name in ("angular_frequency", "reduced_angular_frequency", "relaxation_modulus", "storage_modulus", "loss_modulus"):
        with pytest.raises(InputError, match="a master curve of creep has no"):
            getattr(creep, name)


def test_a_sweep_whose_moduli_are_not_positive_is_refused() -> None:
    curves = maxwell()
    wrong = np.where(np.arange(25) < 20, -1.0, curves[1].loss_modulus)
    curves[1] = FrequencySweep(10.0, FREQUENCY, curves[1].storage_modulus, wrong)
    with pytest.raises(InputError, match="10 degC: 20 of 25 storage or loss moduli are zero or negative, the first at point 0"):
        build(curves)
    compliant = kelvin()
    compliant[2] = CreepCurve(20.0, TIME, -compliant[2].compliance)
    with pytest.raises(InputError, match="20 degC: 40 of 40 compliances are zero or negative"):
        build(compliant)


def test_sweeps_without_overlap_are_refused() -> None:
    with pytest.raises(InputError, match=r"no overlap between 0 degC \(storage modulus .* measure over more frequencies"):
        build([curve for curve in maxwell(frequency=np.logspace(-1, -0.5, 12)) if curve.temperature in (0.0, 40.0)])
    with pytest.raises(InputError, match=r"inverse compliance .* measure longer"):
        build([kelvin()[0], CreepCurve(20.0, TIME, kelvin()[4].compliance * 1e3)])


GLASSY_LAW = WLF(25.0, 12.3, 95.0)
GLASSY_TEMPERATURES = (-20.0, -10.0, 0.0, 10.0, 25.0, 40.0, 55.0, 70.0)


def glassy_sweeps(temperatures: tuple[float, ...], noise: float = 0.005, seed: int = 0) -> list[FrequencySweep]:
    """Sweeps of 3.7 decades of a wide spectrum: that at -20 degC begins 0.2 decades beyond the end of the next, all glass."""
    tau = np.geomspace(1e-7, 1e5, 37)
    decade = np.log10(tau) + 3
    moduli = 10 ** (6.5 - 0.55 * decade - 0.02 * decade**2)
    frequency = np.geomspace(0.01, 50, 16)
    curves = []
    for temperature in temperatures:
        rng = np.random.default_rng([seed, round(temperature) + 100])
        x = np.outer(2 * np.pi * frequency * 10 ** float(GLASSY_LAW.log10_shift_factor(temperature)), tau)
        loss = (x / (1 + x**2)) @ moduli * np.exp(noise * rng.standard_normal(16))
        storage = (5e4 + (x**2 / (1 + x**2)) @ moduli) * np.exp(noise * rng.standard_normal(16))
        curves.append(FrequencySweep(temperature, 2 * np.pi * frequency, 3 * storage, 3 * loss))
    return curves


@pytest.mark.parametrize(
    ("on", "vertical"),
    [
        ("auto", "none"),
        *(
            pytest.param(*each, marks=pytest.mark.trust)
            for each in (("moduli", "free"), ("tan-delta", "none"), ("tan-delta", "free"))
        ),
    ],
)
def test_a_sweep_apart_from_the_others_is_named_and_spoils_nothing(on: Any, vertical: Any) -> None:
    with pytest.warns(DielastWarning) as caught:
        found = build_master_curve(glassy_sweeps(GLASSY_TEMPERATURES), reference_temperature=25.0, on=on, vertical=vertical)
    said = " ".join(str(one.message) for one in caught)
    assert "-20 degC: the shift factor is not determined: " in said
    assert "second process" not in said
    assert [entry.temperature for entry in found.undetermined] == [-20.0]
    without = build(glassy_sweeps(GLASSY_TEMPERATURES[1:]), reference_temperature=25.0, on=on, vertical=vertical)
    assert found.shifted_on == without.shifted_on
    assert on == "auto" or found.shifted_on == on
    np.testing.assert_allclose(found.log10_shift_factor[1:], without.log10_shift_factor, atol=1e-4)
    np.testing.assert_allclose(found.log10_shift_factor_stderr[1:], without.log10_shift_factor_stderr, rtol=1e-2, atol=1e-5)
    assert np.isnan(found.log10_shift_factor[0])
    truth = GLASSY_LAW.log10_shift_factor(np.array(GLASSY_TEMPERATURES[1:]))
    away = np.abs(found.log10_shift_factor - np.append(np.nan, truth))[1:]
    assert np.all(away <= 4 * found.log10_shift_factor_stderr[1:])
    assert found.rms_residual_decades < 0.01
