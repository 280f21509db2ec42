"""Fitting a law to shift factors that come with a covariance, and what a ramp does to the curves that they are of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from flat import relax
from hypothesis import given, strategies as st
from readings import relaxation_curves

from dielast import FrequencySweep, Gent, Material, RelaxationCurve, Spectrum, build_master_curve, without_ramp
from dielast.base.errors import DielastWarning, InputError
from dielast.io.files import Inputs
from dielast.material.ramp import mean_age, time_of_age
from dielast.material.shift import WLF, Arrhenius
from dielast.material.shift.wlf import SMALLEST_C2
from dielast.mechanics.load import Step
from dielast.readings.recipe import MeasurementData
from dielast.relaxation.superposition.shiftfit import fit_shift_law

TEMPERATURE = np.arange(-40.0, 61.0, 10.0)
INDEPENDENT = np.eye(TEMPERATURE.size) * 1e-4


def relative(values: np.ndarray, anchor: int) -> np.ndarray:
    return values - values[anchor]


def pinned(covariance: np.ndarray, anchor: int) -> np.ndarray:
    move = np.eye(len(covariance))
    move[:, anchor] -= 1
    return move @ covariance @ move.T


@given(C1=st.floats(2, 40), C2=st.floats(110, 600), anchor=st.integers(0, 10))
def test_exact_wlf_from_any_anchor(C1: float, C2: float, anchor: int) -> None:
    law = WLF(20.0, C1, C2)
    fit = fit_shift_law(
        "wlf", TEMPERATURE, relative(law.log10_shift_factor(TEMPERATURE), anchor), pinned(INDEPENDENT * 1e-6, anchor), anchor, 20.0
    )
    np.testing.assert_allclose([fit.parameters["C1"], fit.parameters["C2"]], [C1, C2], rtol=1e-6)


def test_the_anchor_does_not_matter() -> None:
    """Generalised least squares carries the noise of the curve that the others are relative to."""
    noisy = WLF(20.0, 13.7, 187.1).log10_shift_factor(TEMPERATURE) + 0.01 * np.random.default_rng(0).standard_normal(
        TEMPERATURE.size
    )
    fits = [fit_shift_law("wlf", TEMPERATURE, relative(noisy, k), pinned(INDEPENDENT, k), k, 25.0) for k in (0, 6, 10)]
    for fit in fits[1:]:
        np.testing.assert_allclose(fit.values, fits[0].values, rtol=1e-6)
        np.testing.assert_allclose(fit.covariance, fits[0].covariance, rtol=1e-4)


def test_temperatures_without_any_shift_have_a_law_that_says_so() -> None:
    with pytest.warns(DielastWarning, match=r"do not determine the WLF constants C1 and C2 separately"):
        fit = fit_shift_law("wlf", TEMPERATURE, np.zeros_like(TEMPERATURE), pinned(INDEPENDENT, 6), 6, 20.0)
    assert fit.law.log10_shift_factor(TEMPERATURE) == pytest.approx(0.0, abs=1e-12)
    assert fit.doubt == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("law", ["wlf", "arrhenius"])
def test_standard_errors_are_true(law: str) -> None:
    truth = WLF(20.0, 13.7, 187.1) if law == "wlf" else Arrhenius(20.0, 9e4)
    values = [13.7, 187.1] if law == "wlf" else [9e4]
    rng = np.random.default_rng(5)
    deviations = []
    for _ in range(200):
        noisy = truth.log10_shift_factor(TEMPERATURE) + 0.01 * rng.standard_normal(TEMPERATURE.size)
        fit = fit_shift_law(law, TEMPERATURE, relative(noisy, 6), pinned(INDEPENDENT, 6), 6, 20.0)
        deviations.append((fit.values - values) / np.sqrt(np.diag(fit.covariance)))
    assert 0.92 <= np.mean(np.abs(deviations) < 1.96) <= 0.99


def test_two_temperatures_give_the_ratio_only() -> None:
    temperature = np.array([0.0, 20.0])
    with pytest.warns(DielastWarning, match=r"2 temperatures do not determine the WLF constants C1 and C2 separately"):
        fit = fit_shift_law("wlf", temperature, np.array([1.6, 0.0]), np.diag([1e-4, 0.0]), 1, 20.0)
    assert np.isinf(fit.stderr["C1"])
    assert np.isinf(fit.stderr["C2"])
    np.testing.assert_allclose(fit.law.log10_shift_factor(temperature), [1.6, 0.0], atol=1e-12)
    arrhenius = fit_shift_law("arrhenius", temperature, np.array([1.6, 0.0]), np.diag([1e-4, 0.0]), 1, 20.0)
    np.testing.assert_allclose(fit.law.log10_shift_factor([-10, 35]), arrhenius.law.log10_shift_factor([-10, 35]), rtol=1e-9)


@pytest.mark.parametrize(("C2", "reference"), [(60.0, -30.0), (100.0, 40.0), (187.1, 80.0), (1e6, 40.0)])
def test_an_assumed_constant_is_in_the_error_of_the_origin(C2: float, reference: float) -> None:
    """Two temperatures, and a reference far from both: whatever C2 the material has, the origin is within two standard errors."""
    truth = WLF(0.0, 0.07 * C2, C2)
    temperature = np.array([0.0, 20.0])
    values = truth.log10_shift_factor(temperature)
    with pytest.warns(DielastWarning, match=rf"log10 a at {reference:g} degC is known to .* only, for want of C2"):
        fit = fit_shift_law("wlf", temperature, values, np.diag([0.0, 1e-6]), 0, reference)
    miss = fit.origin - float(truth.log10_shift_factor(reference))
    assert abs(miss) < 2 * np.sqrt(fit.origin_excess)


@pytest.mark.parametrize(("bend", "said"), [(0.0, r"are a straight line .* above 7.\d+e\+03 K"), (5e-4, "bend the other way")])
def test_shift_factors_as_straight_as_a_line_or_bent_the_wrong_way_have_the_closest_law(bend: float, said: str) -> None:
    """Which of all C2 is an infinite one: the straight line through the reference temperature with the smallest squares."""
    values = -0.05 * (TEMPERATURE - 20) - bend * (TEMPERATURE - 20) ** 2
    covariance = pinned(INDEPENDENT, 6)
    with pytest.warns(DielastWarning, match=f"{said}.* holds between these temperatures only"):
        fit = fit_shift_law("wlf", TEMPERATURE, values, covariance, 6, 20.0)
    others = np.arange(TEMPERATURE.size) != 6
    weight = np.linalg.inv(covariance[np.ix_(others, others)])
    distance = TEMPERATURE[others] - 20
    slope = (distance @ weight @ values[others]) / (distance @ weight @ distance)
    np.testing.assert_allclose(fit.law.log10_shift_factor(TEMPERATURE), slope * (TEMPERATURE - 20), atol=1e-3)
    assert np.isinf(fit.stderr["C2"])
    assert "is a straight line over temperature" in fit.law.warning()


def test_rising_activation_is_said() -> None:
    with pytest.warns(DielastWarning, match="slower with temperature"):
        fit_shift_law("arrhenius", TEMPERATURE, 0.05 * (TEMPERATURE - 20), pinned(INDEPENDENT, 6), 6, 20.0)


@pytest.mark.parametrize("anchor", [0, 6])
def test_vogel_fulcher_tammann_is_fitted_as_wlf_is(anchor: int) -> None:
    noisy = WLF(20.0, 13.7, 187.1).log10_shift_factor(TEMPERATURE) + 0.01 * np.random.default_rng(3).standard_normal(
        TEMPERATURE.size
    )
    wlf, vft = (
        fit_shift_law(law, TEMPERATURE, relative(noisy, anchor), pinned(INDEPENDENT, anchor), anchor, 35.0)
        for law in ("wlf", "vft")
    )
    c1, c2 = wlf.values
    np.testing.assert_allclose(vft.values, [np.log(10) * c1 * c2, 35 - c2], rtol=1e-9)
    slopes = np.array([[np.log(10) * c2, np.log(10) * c1], [0, -1]])
    np.testing.assert_allclose(vft.covariance, slopes @ wlf.covariance @ slopes.T, rtol=1e-6)
    at = np.linspace(-30, 60, 7)
    np.testing.assert_allclose(vft.law.log10_shift_factor(at), wlf.law.log10_shift_factor(at), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("reference", [0.0, 3.0, 12.0, 29.0, 44.0, 58.0, 60.0])
@pytest.mark.parametrize(
    "temperature", [[0.0, 60.0], [0.0, 25.0, 60.0], [0.0, 10.0, 40.0, 60.0], [0.0, 10.0, 20.0, 35.0, 50.0, 60.0]]
)
def test_a_table_is_a_polynomial_through_four_neighbours(temperature: list[float], reference: float) -> None:
    """Exact for a polynomial of one degree less than there are neighbours."""
    degree = min(len(temperature), 4) - 1
    shape = np.polynomial.Polynomial([0.3, -0.07, 4e-4, -2e-6][: degree + 1])
    at, anchor = np.array(temperature), 1
    fit = fit_shift_law("table", at, shape(at) - shape(at[anchor]), np.zeros((len(at), len(at))), anchor, reference)
    assert fit.law.log10_shift_factor(at) == pytest.approx(shape(at) - shape(reference), abs=1e-12)
    assert fit.origin == pytest.approx(shape(reference) - shape(at[anchor]), abs=1e-12)
    assert fit.origin_weight @ (shape(at) - shape(at[anchor])) == pytest.approx(fit.origin, abs=1e-12)


@pytest.mark.parametrize("reference", [-0.1, 60.1])
def test_a_table_knows_nothing_beyond_its_ends(reference: float) -> None:
    at = np.array([0.0, 30.0, 60.0])
    with pytest.raises(InputError, match="where the shift table ends"):
        fit_shift_law("table", at, -0.1 * at, np.zeros((3, 3)), 0, reference)


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


def test_misfit_widens_the_errors() -> None:
    """Of a misfit without correlation by its square root, and by more if the law may miss smoothly."""
    curved = Arrhenius(20.0, 9e4).log10_shift_factor(TEMPERATURE) + 0.1 * np.cos(TEMPERATURE)
    fit = fit_shift_law("arrhenius", TEMPERATURE, relative(curved, 6), pinned(INDEPENDENT, 6), 6, 20.0)
    exact = relative(Arrhenius(20.0, 9e4).log10_shift_factor(TEMPERATURE), 6)
    narrow = fit_shift_law("arrhenius", TEMPERATURE, exact, pinned(INDEPENDENT, 6), 6, 20.0)
    assert fit.misfit > 10
    widened = fit.stderr["activation_energy"] / narrow.stderr["activation_energy"]
    assert 0.9 < widened / fit.misfit**0.5 < 1.6  # as far as errors may be stated too large


@pytest.mark.parametrize("error", [0.001, 0.002])
def test_a_law_without_misfit_is_as_certain_as_by_least_squares(error: float) -> None:
    """Though a misfit keeps a probability: it widens the tails of the distribution, not nine tenths of it."""
    temperature = np.linspace(-40.0, 60.0, 14)
    exact = relative(WLF(20.0, 13.7, 187.1).log10_shift_factor(temperature), 7)
    covariance = pinned(np.eye(14) * error**2, 7)
    fit = fit_shift_law("wlf", temperature, exact, covariance, 7, 20.0)
    assert fit.doubt is not None
    least_squares = fit.covariance - fit.doubt * np.outer(fit.values, fit.values)
    assert np.all(np.diag(fit.covariance) < 1.03**2 * np.diag(least_squares))


@pytest.mark.parametrize("anchor", [0, 1, 2])
def test_three_temperatures_are_just_enough_for_both_constants(anchor: int) -> None:
    law, at = WLF(20.0, 12.0, 90.0), np.array([-10.0, 20.0, 60.0])
    exact = law.log10_shift_factor(at)
    covariance = np.diag([1e-6 * (k != anchor) for k in range(3)])
    fit = fit_shift_law("wlf", at, exact - exact[anchor], covariance, anchor, 20.0)
    assert fit.values == pytest.approx([12.0, 90.0], rel=1e-6)
    assert np.isfinite(fit.covariance).all()
    assert fit.misfit == 0.0


def test_what_a_c2_that_is_only_assumed_may_do_to_the_origin() -> None:
    """Through both shift factors, with any k = 1/C2 about the anchor: log10 a = -g d/(1 + k d)."""
    at, step, move = np.array([0.0, 20.0]), 1.6, -10.0
    with pytest.warns(DielastWarning, match="do not determine the WLF constants"):
        fit = fit_shift_law("wlf", at, np.array([step, 0.0]), np.diag([1e-8, 0.0]), 1, 20.0 + move)

    def origin(k: np.ndarray) -> np.ndarray:
        return -step * (1 - 20 * k) / 20 * move / (1 + k * move)

    assumed = origin(np.array(1 / 293.15))
    assert fit.origin == pytest.approx(assumed, rel=1e-9)
    others = origin(np.linspace(0.0, 1 / (SMALLEST_C2 + 20.0), 2001))
    assert fit.origin_excess == pytest.approx(np.mean((others - assumed) ** 2), rel=0.1)


@pytest.mark.parametrize("ramp", [1e-15, 1e-12, 1e-6])
def test_a_ramp_far_shorter_than_the_times_is_a_step_at_its_middle(ramp: float) -> None:
    time = np.geomspace(1.0, 1e6, 7)
    assert mean_age(time, ramp) == pytest.approx(time - ramp / 2, rel=1e-12)
    assert time_of_age(mean_age(time, ramp), ramp) == pytest.approx(time, rel=1e-12)
