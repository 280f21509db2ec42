"""Draws of master curves scatter as repeated measurements do."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from dielast.base.errors import InputError
from dielast.commands.mastercurve.run import draws_headline
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.material.shift import WLF
from dielast.relaxation.superposition.bootstrap import MasterCurveDraws, bootstrap_master_curve
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve
from reconstruction import EQUILIBRIUM_MODULUS, spectrum

LAW = WLF(20.0, 13.7, 187.1)
SPECTRUM = spectrum()
TEMPERATURES = np.arange(60.0, -21.0, -10.0)


def measure(seed: int, noise: float = 0.01, points: int = 30, offset: float = 0.0, memory: float = 0.0) -> list[RelaxationCurve]:
    random = np.random.default_rng([5, seed])
    time = np.geomspace(0.1, 1200, points)
    curves = []
    for temperature in TEMPERATURES:
        modulus = 3 * SPECTRUM.relaxation_modulus(time / 10 ** float(LAW.log10_shift_factor(temperature)), EQUILIBRIUM_MODULUS)
        error = random.standard_normal(points)
        for k in range(1, points):
            error[k] = memory * error[k - 1] + np.sqrt(1 - memory**2) * error[k]
        factor = (1 + noise * error) * (1 + offset * random.standard_normal())
        curves.append(RelaxationCurve(float(temperature), time, modulus * factor))
    return curves


def drawn(curves: list[Measurement], draws: int, seed: int = 1) -> tuple[MasterCurve, MasterCurveDraws]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        master = build_master_curve(curves, reference_temperature=20.0, temperature_stderr=0.0)
    return master, bootstrap_master_curve(curves, master, draws=draws, seed=seed)


def test_a_draw_depends_on_the_seed_and_its_number_alone() -> None:
    curves = measure(0)
    master, few = drawn(list(curves), 3)
    more = bootstrap_master_curve(curves, master, draws=5)
    assert np.array_equal(few.log10_shift_factor, more.log10_shift_factor[:3])
    assert np.array_equal(few.smooth_ordinates, more.smooth_ordinates[:3])
    assert len(np.unique(more.log10_shift_factor, axis=0)) == 5
    other = bootstrap_master_curve(curves, master, draws=3, seed=2)
    assert not np.any(other.law_parameters == few.law_parameters)


@pytest.mark.trust
@pytest.mark.parametrize("setting", [{"offset": 0.03}, {"memory": 0.7, "points": 60}])
def test_draws_scatter_as_repeated_tests_do(setting: dict[str, float]) -> None:
    """Specimens that differ, and noise that lasts: within a quarter, which is what so few can tell."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        masters = [build_master_curve(measure(seed, **setting), reference_temperature=20.0) for seed in range(24)]
    repeats = [master.log10_shift_factor for master in masters]
    spread = np.var(drawn(list(measure(50, **setting)), 30)[1].log10_shift_factor, axis=0)
    ratio = np.sqrt(np.sum(spread) / np.sum(np.var(repeats, axis=0)))
    assert 0.75 < ratio < 1.33


@pytest.mark.trust
def test_standard_errors_agree_with_those_of_the_fit() -> None:
    """Also where specimens differ by 2 %."""
    master, draws = drawn(list(measure(1, offset=0.02)), 60)
    for name, value in draws.stderr().items():
        assert value == pytest.approx(master.law_stderr[name], rel=0.4)
    moved = master.temperature != 20.0
    ratio = np.std(draws.log10_shift_factor, axis=0)[moved] / master.log10_shift_factor_stderr[moved]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.2)


def test_sweeps_and_creep_are_resampled_too() -> None:
    random = np.random.default_rng(4)
    omega = np.geomspace(0.1, 100, 20)
    creeps: list[Measurement] = []
    sweeps: list[Measurement] = []
    for temperature in TEMPERATURES:
        a = 10 ** float(LAW.log10_shift_factor(temperature))
        x = omega[:, None] * a * SPECTRUM.relaxation_time
        storage = 3 * (EQUILIBRIUM_MODULUS + (x**2 / (1 + x**2)) @ SPECTRUM.shear_modulus)
        loss = 3 * ((x / (1 + x**2)) @ SPECTRUM.shear_modulus)
        noise = 1 + 0.01 * random.standard_normal((3, omega.size))
        sweeps.append(FrequencySweep(float(temperature), omega, storage * noise[0], loss * noise[1]))
        time = np.geomspace(1, 1000, 20)
        # good enough for a superposition: what creeps is one over what relaxes
        compliance = 1 / (3 * SPECTRUM.relaxation_modulus(time / a, EQUILIBRIUM_MODULUS))
        creeps.append(CreepCurve(float(temperature), time, compliance * noise[2]))
    for curves, channels in ((sweeps, 2), (creeps, 1)):
        master, draws = drawn(curves, 12)
        assert draws.smooth_ordinates.shape == (12, channels, draws.smooth_abscissa.size)
        moved = master.temperature != 20.0
        ratio = np.std(draws.log10_shift_factor, axis=0)[moved] / master.log10_shift_factor_stderr[moved]
        assert 0.5 < np.median(ratio) < 2


def test_one_draw_is_none() -> None:
    curves = measure(0)
    master, _ = drawn(list(curves), 2)
    with pytest.raises(InputError, match="at least 2"):
        bootstrap_master_curve(curves, master, draws=1)


def test_a_stated_drift_is_in_the_level_of_the_draws() -> None:
    """A walk raises all curves from the first step on: no draw knows the level better than by that step."""
    curves, level = list(measure(50, noise=0.002)), []
    for drift in (0.0, 0.03):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            master = build_master_curve(curves, reference_temperature=20.0, temperature_stderr=0.0, drift=drift)
        draws = bootstrap_master_curve(curves, master, draws=60)
        level.append(np.std(np.log(draws.smooth_ordinates[:, 0, 30:70]), axis=0).mean())
    assert level[0] < 0.006
    assert 0.024 < level[1] < 0.06


def test_an_error_of_a_temperature_moves_its_shift_factor_and_not_its_curve() -> None:
    curves = list(measure(3, noise=0.001))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        master = build_master_curve(curves, reference_temperature=20.0, temperature_stderr=1.0)
    draws = bootstrap_master_curve(curves, master, draws=80)
    moved = master.temperature != 20.0
    ratio = np.std(draws.log10_shift_factor, axis=0, ddof=1)[moved] / master.log10_shift_factor_stderr[moved]
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.1)
    # the curve moves along time by the error at the reference temperature alone
    time, moduli = np.log10(draws.smooth_abscissa), np.log10(draws.smooth_ordinates[:, 0])
    slope = np.gradient(moduli.mean(axis=0), time)
    reference = int(np.flatnonzero(~moved)[0])
    np.testing.assert_allclose(
        np.std(moduli, axis=0)[20:70], np.abs(slope)[20:70] * master.placing.thermometer[reference], rtol=0.35
    )


def test_what_is_not_determined_has_no_finite_error_in_the_summary() -> None:
    """Two temperatures: the draws keep to the C2 that the fit assumes, and their scatter is no error of it."""
    curves = list(measure(50, noise=0.002))[:2]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        master = build_master_curve(curves, reference_temperature=curves[0].temperature, temperature_stderr=0.0)
        draws = bootstrap_master_curve(curves, master, draws=4)
    numbers = draws_headline(draws, master, 4, 1)
    assert numbers["C2_K_stderr"] == np.inf
    assert np.all(np.isfinite(numbers["log10_shift_factor_stderr"]))
    lost = replace(draws, log10_shift_factor=np.full_like(draws.log10_shift_factor, np.nan))
    assert draws_headline(lost, master, 4, 1)["log10_shift_factor_stderr"] == [np.inf, np.inf]


def test_the_draws_of_a_table_of_shift_factors_have_a_headline() -> None:
    curves = list(measure(50, noise=0.002))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        master = build_master_curve(curves, reference_temperature=curves[0].temperature, law="table")
        draws = bootstrap_master_curve(curves, master, draws=4, law="table")
    assert len(draws_headline(draws, master, 4, 1)["log10_shift_factor_stderr"]) == len(curves)
