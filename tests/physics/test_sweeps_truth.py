"""Master curves of frequency sweeps and creep tests whose shift factors are known: reconstructed VHB 4905, measured polymers."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dielast.base.errors import DielastWarning
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement
from dielast.material.shift import WLF
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve
from reconstruction import spectrum

LAW = WLF(20.0, 13.7, 187.1)
EQUILIBRIUM = 26e3  # Pa
SPECTRUM = spectrum()
TEMPERATURES = np.arange(60.0, -41.0, -5.0)
POLYSTYRENE = (130, 145, 160, 175, 190)
BY_RELAXATION = np.array([2.4607, 1.0465, 0.0, -0.7832, -1.4393])
BY_OSCILLATION = np.array([2.4218, 1.0218, 0.0, -0.7697, -1.3556])


def sweep(
    temperatures: np.ndarray = TEMPERATURES,
    *,
    points: int = 20,
    noise: float = 0.01,
    common: float = 0.0,
    level: float = 0.0,
    seed: int = 0,
) -> list[FrequencySweep]:
    """Young's moduli with relative noise of each, noise `common` to both, and whole curves off by `level`."""
    rng = np.random.default_rng(seed)
    frequency = np.logspace(-1, 2, points)
    curves = []
    for temperature in temperatures:
        reduced = (frequency * 10 ** float(LAW.log10_shift_factor(temperature)))[:, None] * SPECTRUM.relaxation_time
        storage = 3 * (EQUILIBRIUM + np.sum(SPECTRUM.shear_modulus * reduced**2 / (1 + reduced**2), axis=1))
        loss = 3 * np.sum(SPECTRUM.shear_modulus * reduced / (1 + reduced**2), axis=1)
        both = (1 + common * rng.standard_normal(points)) * (1 + level * rng.standard_normal())
        storage, loss = (modulus * both * (1 + noise * rng.standard_normal(points)) for modulus in (storage, loss))
        curves.append(FrequencySweep(float(temperature), frequency, storage, loss))
    return curves


def build(curves: list[Any], reference: float = 20.0, **options: Any) -> MasterCurve:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        return build_master_curve(curves, reference_temperature=reference, **options)


def error(master: MasterCurve) -> np.ndarray:
    return np.asarray(master.log10_shift_factor - LAW.log10_shift_factor(master.temperature))


def test_paper_constants_from_noisy_sweeps() -> None:
    master = build(sweep())
    assert master.shifted_on == "moduli"
    assert np.sqrt(np.mean(error(master) ** 2)) < 0.005
    for name, truth in (("C1", 13.7), ("C2", 187.1)):
        assert abs(master.law_parameters[name] - truth) < 1.96 * master.law_stderr[name]
        np.testing.assert_allclose(master.law_parameters[name], truth, rtol=0.01)
    np.testing.assert_allclose(master.rms_residual_decades, 0.01 / np.log(10), rtol=0.1)
    np.testing.assert_allclose(master.glassy_modulus, 3 * (SPECTRUM.shear_modulus.sum() + EQUILIBRIUM), rtol=0.03)


@pytest.mark.parametrize("on", ["moduli", "tan-delta", "storage"])
def test_without_noise_the_shift_factors_are_exact(on: str) -> None:
    master = build(sweep(noise=0.0), on=on)
    assert master.shifted_on == on
    assert np.max(np.abs(error(master))) < 5e-4
    np.testing.assert_allclose(master.law_parameters["C2"], 187.1, rtol=1e-4)


@pytest.mark.trust  # tests/unit/test_fitting_masterfit.py draws from the model that errors are made of
@pytest.mark.parametrize(
    ("kind", "options", "repeats"),
    [
        ({}, {}, 5),
        ({}, {"on": "tan-delta"}, 5),
        ({"level": 0.02}, {"on": "storage"}, 30),
        ({"common": 0.03, "noise": 0.003}, {"on": "moduli"}, 5),
        ({"level": 0.05}, {}, 5),
        ({"level": 0.05}, {"vertical": "free"}, 5),
    ],
    ids=["separate noise", "tan delta", "storage", "common noise", "specimen scatter", "vertical shifts"],
)
def test_standard_errors_cover_the_truth(kind: dict[str, Any], options: dict[str, Any], repeats: int) -> None:
    """95 % intervals hold the truth in 90-99 % of cases: they allow for tilts and offsets, and here there may be none."""
    score: list[float] = []
    for seed in range(repeats):
        master = build(sweep(TEMPERATURES[::2], seed=seed, **kind), temperature_stderr=0.0, **options)
        moved = master.temperature != 20.0
        score += (error(master)[moved] / master.log10_shift_factor_stderr[moved]).tolist()
    assert 0.90 <= np.mean(np.abs(score) < 1.96) <= 0.99


def test_shared_scatter_is_taken_out() -> None:
    """With 3 % scatter of the amplitude and 0.3 % of the phase, both moduli tell as much as if the amplitude did not scatter."""
    rms = [np.sqrt(np.mean(error(build(sweep(common=common, noise=0.003, seed=5), on="moduli")) ** 2)) for common in (0.0, 0.03)]
    assert rms[1] < 8 * rms[0]
    assert rms[1] < 0.01


def test_vertical_shifts_are_recovered() -> None:
    truth = 1 / (1 + 0.002 * (TEMPERATURES - 20.0))
    curves = [
        FrequencySweep(c.temperature, c.angular_frequency, c.storage_modulus / b, c.loss_modulus / b)
        for c, b in zip(sweep(), truth, strict=True)
    ]
    for on in ("moduli", "tan-delta"):
        master = build(curves, vertical="free", on=on)
        away = (master.vertical_shift - truth[::-1]) / np.where(master.temperature == 20.0, 1.0, master.vertical_shift_stderr)
        assert np.max(np.abs(away)) < 4
        assert np.mean(np.abs(away) < 1.96) > 0.8


def test_losses_of_the_instrument_are_not_shifted() -> None:
    """A loss that belongs to the frequency, not to the material, must not move the shift factors unnoticed."""
    spoilt = [
        FrequencySweep(
            c.temperature, c.angular_frequency, c.storage_modulus, c.loss_modulus + 0.003 * c.angular_frequency * c.storage_modulus
        )
        for c in sweep(np.arange(-40.0, 21.0, 5.0), noise=0.003)
    ]
    with pytest.warns(DielastWarning) as caught:
        master = build_master_curve(spoilt, reference_temperature=20.0)
    said = " ".join(str(entry.message) for entry in caught)
    assert "are those of the storage modulus alone" in said
    assert "second process" not in said  # what was seen is told, not a guess at its cause
    assert master.shifted_on == "storage"
    moved = master.temperature != 20.0
    assert np.max(np.abs(error(master)[moved] / master.log10_shift_factor_stderr[moved])) < 4


def polystyrene(shared_data: Callable[[str], Path], kind: str) -> list[Measurement]:
    """Polystyrene of Ricarte and Shanbhag, Polym. Chem. 15 (2024) 815; shear moduli and compliances."""
    curves: list[Measurement] = []
    for temperature in POLYSTYRENE:
        path = shared_data(f"polystyrene/{kind}_ps{temperature}_data.csv")
        abscissa, *values = np.loadtxt(path, delimiter="\t", skiprows=1, unpack=True)
        if kind == "creep":
            curves.append(CreepCurve(float(temperature), abscissa, values[0] / 3))
        else:
            curves.append(FrequencySweep(float(temperature), abscissa, 3 * values[0], 3 * values[1]))
    return curves


@pytest.mark.parametrize(
    ("vertical", "on"),
    [
        *(("none", "auto"), ("free", "storage")),
        *(pytest.param(*each, marks=pytest.mark.trust) for each in (("free", "auto"), ("none", "moduli"), ("none", "tan-delta"))),
    ],
)
def test_measured_polystyrene_sweeps(shared_data: Callable[[str], Path], vertical: str, on: str) -> None:
    master = build(polystyrene(shared_data, "oscillation"), 160.0, vertical=vertical, on=on)
    if on != "storage":  # one modulus alone says less
        assert np.max(np.abs(master.log10_shift_factor - BY_OSCILLATION)) <= 0.05
    moved = master.temperature != 160.0
    # relaxation and oscillation of the same material, both published, differ by 0.04 decade and more
    likely = 1.96 * np.hypot(master.log10_shift_factor_stderr, 0.04)
    assert np.all(np.abs(master.log10_shift_factor - BY_OSCILLATION)[moved] < likely[moved])


def test_measured_polystyrene_creep(shared_data: Callable[[str], Path]) -> None:
    """Creep shifts as the relaxation and the oscillation of the same material do, to their own disagreement."""
    master = build(polystyrene(shared_data, "creep"), 160.0, vertical="free")
    assert np.max(np.abs(master.log10_shift_factor - BY_OSCILLATION)) < 0.05
    assert np.max(np.abs(master.log10_shift_factor - BY_RELAXATION)) < 0.1
    assert np.all(np.diff(master.smooth_ordinates[0]) > 0)
    with pytest.warns(DielastWarning) as caught:
        plain = build_master_curve(polystyrene(shared_data, "creep"), reference_temperature=160.0)
    assert any("differ vertically by about" in str(entry.message) for entry in caught)
    assert np.max(np.abs(plain.log10_shift_factor - BY_OSCILLATION)) < 0.05


def test_a_measured_polymer_through_its_glass_transition(shared_data: Callable[[str], Path]) -> None:
    """Sweeps at 21 temperatures whose loss at high frequency is the instrument's, against its own software's shift factors.

    In the glass the storage moduli are level, so that offsets of 1 %, of which the software knows nothing, hide the shift; above,
    the two differ by half a decade.
    """
    rows = np.loadtxt(shared_data("ansys_prony/freq_user_raw.csv"), delimiter=",", skiprows=2)
    curves = [
        FrequencySweep(float(np.mean(own[:, 3])), 2 * np.pi * own[:, 0], 1e6 * own[:, 1], 1e6 * own[:, 2])
        for own in (rows[rows[:, 4] == k] for k in np.unique(rows[:, 4]))
    ]
    path = shared_data("ansys_prony/freq_Eplexor_raw__shift_factors.csv")
    software = np.loadtxt(path, delimiter=",", skiprows=2, encoding="utf-8-sig")[::-1, 1]
    with pytest.warns(DielastWarning) as caught:
        master = build_master_curve(curves, reference_temperature=curves[14].temperature)
    said = " ".join(str(entry.message) for entry in caught)
    assert "storage and loss modulus do not shift together: points that are left out are missed by" in said
    assert "the shift factors are those of the storage modulus alone" in said
    assert "placed by the shift law" in said
    assert master.shifted_on == "storage"
    known = np.isfinite(master.log10_shift_factor)
    assert [entry.temperature for entry in master.undetermined] == master.temperature[~known].tolist()
    assert np.all(master.temperature[~known] < 40)
    assert np.count_nonzero(known) >= 9
    away = (master.log10_shift_factor - software)[known]
    assert np.ptp(away) / 2 < 0.7
