from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from flat import relax
from readings import relaxation_curves

from dielast import WLF, FrequencySweep, Gent, Material, RelaxationCurve, Spectrum, build_master_curve, without_ramp
from dielast.base.errors import InputError
from dielast.io.files import Inputs
from dielast.material.ramp import mean_age, time_of_age
from dielast.mechanics.load import Step
from dielast.readings.recipe import MeasurementData

TEMPERATURES = [0.0, 10.0, 20.0, 30.0]
LAW = WLF(20.0, 13.7, 187.1)


@pytest.fixture(scope="module")
def test_with_a_ramp(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A relaxation test as a machine records it: 1 % strain within 1 s, then held."""
    tau = np.geomspace(1e-6, 1e4, 31)
    material = Material("any", 26e3, Spectrum(tau, 2e4 * tau**-0.3), LAW, Gent(), Gent())
    times = np.concatenate([[0.5], np.geomspace(1.05, 1000, 60)])
    history = relax(material, [Step(stretch=1.01, rate=0.01), Step.hold(999.0)], temperature=TEMPERATURES, times=times)
    rows = ["T [degC],t [s],strain [%],stress [kPa]"]
    for case, temperature in enumerate(TEMPERATURES):
        strain, stress = 100 * (history.stretch_1[case] - 1), history.nominal_stress_1[case] / 1e3
        rows += [
            f"{temperature},{t!r},{e!r},{s!r}" for t, e, s in zip(times.tolist(), strain.tolist(), stress.tolist(), strict=True)
        ]
    path = tmp_path_factory.mktemp("ramp") / "dma.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def curves(path: Path, **options: str) -> list:
    columns = {"temperature": "T", "time": "t", "strain": "strain", "stress": "stress"}
    data = MeasurementData.model_validate({"file": path.name, "columns": columns, **options}, context={"folder": path.parent})
    return relaxation_curves(data, Inputs(path.parent))


def worst_shift_error(found: list) -> float:
    master = build_master_curve(found, reference_temperature=20.0, temperature_stderr=0.0)
    return float(np.max(np.abs(master.log10_shift_factor - LAW.log10_shift_factor(master.temperature))))


def after_ramp(slope: float, time: np.ndarray, ramp: float) -> np.ndarray:
    """Boltzmann's mean of age^slope over the ages from time - ramp to time."""
    return np.asarray((time ** (1 + slope) - (time - ramp) ** (1 + slope)) / ((1 + slope) * ramp))


@pytest.mark.parametrize("slope", [-0.8, -0.4, -0.1, -1e-3, 1e-3, 0.1, 0.4, 0.8])
def test_a_power_law_after_a_ramp_is_that_at_the_mean_log_age(slope: float) -> None:
    """Relaxation falls and creep rises: what is left is s^2 / 2 times the variance of the log age, about (ramp / age)^2 / 12."""
    ramp, time = 0.7, np.array([0.7, 0.8, 1.4, 2.0, 7.0, 700.0])
    age = mean_age(time, ramp)
    off = np.log(after_ramp(slope, time, ramp)) - slope * np.log(age)
    later = time >= 2 * ramp
    np.testing.assert_allclose(off[later], slope**2 / 2 * (ramp / age[later]) ** 2 / 12, rtol=0.06, atol=1e-12)
    middle = np.log(after_ramp(slope, time, ramp)) - slope * np.log(time - ramp / 2)
    if slope < 0.4:  # steady flow, of slope 1, is exact at the middle of the ramp
        assert np.all(np.abs(off[later]) < np.abs(middle[later]))
    np.testing.assert_allclose(time_of_age(age, ramp), time, rtol=1e-12)


def test_a_maxwell_branch_after_a_ramp_is_that_at_the_mean_log_age() -> None:
    """To first order in its slope, which is -age / tau; with branches of many times, as a power law."""
    ramp, time = 1.0, np.geomspace(2.0, 100.0, 50)
    for tau in (3.0, 30.0, 3000.0):
        mean = tau / ramp * (np.exp(-(time - ramp) / tau) - np.exp(-time / tau))
        age = mean_age(time, ramp)
        curvature = (age / tau) ** 2 - age / tau  # of exp over log age, relative to its value
        expected = 1 + curvature / 2 * (ramp / age) ** 2 / 12
        np.testing.assert_allclose(mean / np.exp(-age / tau), expected, atol=0.12 * np.max(np.abs(expected - 1)))
    steps = np.linspace(0.0, 1.0, 100_001)
    integrated = [np.mean(np.log(at - ramp * (steps[:-1] + steps[1:]) / 2)) for at in (1.0, 1.3, 2.0)]
    np.testing.assert_allclose(np.log(mean_age(np.array([1.0, 1.3, 2.0]), ramp)), integrated, atol=5e-6)


@pytest.mark.filterwarnings("ignore:the master curve has no plateau")
def test_mean_ages_of_the_ramp_give_the_true_shift(test_with_a_ramp: Path) -> None:
    # nearly a power law, along which a curve slides by 0.01 decade for an offset of 0.7 %, which is allowed for
    assert worst_shift_error(curves(test_with_a_ramp, ramp="1 s")) < 0.012


def test_points_before_twice_the_ramp_are_dropped(test_with_a_ramp: Path) -> None:
    (first, *_) = curves(test_with_a_ramp, ramp="1 s")
    assert first.time.min() == pytest.approx(1.5, abs=0.2)
    (first, *_) = curves(test_with_a_ramp, ramp="1 s", discard_before="10 s")
    assert first.time.min() >= 9.5
    with pytest.raises(InputError, match="no points are left from 5000 s on"):
        curves(test_with_a_ramp, discard_before="5000 s")


def test_stress_over_strain_is_youngs_modulus(test_with_a_ramp: Path) -> None:
    tau = np.geomspace(1e-6, 1e4, 31)
    reference = curves(test_with_a_ramp, ramp="1 s")[2]
    exact = 3 * Spectrum(tau, 2e4 * tau**-0.3).relaxation_modulus(reference.time, 26e3)
    # at 1 % strain a neo-Hookean strip is 1 % softer than its small-strain limit
    np.testing.assert_allclose(reference.modulus, exact, rtol=0.015)


def test_without_ramp_needs_a_duration_and_tests_over_time() -> None:
    curve = RelaxationCurve(20.0, [1.0, 3.0, 9.0], [3e5, 2e5, 1e5])
    (changed,) = without_ramp([curve], 1.0)
    assert changed.columns[0] == pytest.approx(mean_age(np.array([3.0, 9.0]), 1.0))
    assert without_ramp([curve], 0.0) == [curve]
    with pytest.raises(InputError, match="ramp must be a duration"):
        without_ramp([curve], -1.0)
    with pytest.raises(InputError, match="sweep"):
        without_ramp([FrequencySweep(20.0, [1.0, 3.0, 9.0], [3e5, 2e5, 1e5], [3e4, 2e4, 1e4])], 1.0)
