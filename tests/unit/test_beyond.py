"""What may follow a curve that ends before its plateau, and draws that scatter as repeated measurements do."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from dielast.base.errors import DielastWarning, InputError
from dielast.commands.mastercurve.run import draws_headline
from dielast.handover.material_file import parse_material, write_material
from dielast.material.intervals import interval
from dielast.material.material import CalibratedRange, Material, Window
from dielast.material.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.material.use_checks import warn_of_lasting
from dielast.relaxation.beyond import continuations, end_of
from dielast.relaxation.fit import fit_spectrum
from dielast.relaxation.result import SpectrumFit
from dielast.relaxation.spectrum_draws import CurveDraws, draw_spectra
from dielast.relaxation.superposition.bootstrap import MasterCurveDraws, bootstrap_master_curve
from dielast.relaxation.superposition.mastercurve import build_master_curve
from dielast.relaxation.superposition.result import MasterCurve
from reconstruction import EQUILIBRIUM_MODULUS, spectrum

LEVEL = 1e5
TAU = np.logspace(4, -8, 97)
TRUTH = Spectrum(TAU, 2e4 * TAU**-0.25 * np.exp(-TAU / 1e3))  # a power law that ends after 1e3 s
OPEN = Material("open", LEVEL, TRUTH, WLF(20.0, 13.7, 187.1), window=Window((1e-6, 1e2), False), equilibrium_range=(0.0, 1.2e5))


def fitted(last: float) -> tuple[np.ndarray, np.ndarray, SpectrumFit]:
    """A curve with 0.5 % of noise that ends at the `last` time in s, and its spectrum."""
    time = np.geomspace(1e-6, last, 200)
    noise = 1 + 0.005 * np.random.default_rng(3).standard_normal(time.size)
    modulus = 3 * TRUTH.relaxation_modulus(time, LEVEL) * noise
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        return time, modulus, fit_spectrum(time, modulus)


def test_a_curve_that_ends_before_its_plateau_states_a_range_that_holds_the_truth() -> None:
    _, _, fit = fitted(30.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        end = end_of(fit)
    assert fit.equilibrium_shear_modulus > 1.1 * LEVEL
    assert not end.reached
    assert end.range is not None
    assert end.range[0] < LEVEL < end.range[1]


@pytest.mark.filterwarnings("ignore:the curve has not levelled off")
@pytest.mark.trust
def test_a_spectrum_that_ends_with_its_curve_is_within_the_range() -> None:
    """At the border of what a curve allows: it still falls, and there is nothing slower.

    Of the paths, a fifth end so, a quarter of which an interval of 90 % leaves above it, if there are no others above.
    """
    time, held, faster = np.geomspace(1e-6, 1e2, 200), [], TAU <= 1e2
    modulus = 3 * Spectrum(TAU[faster], TRUTH.shear_modulus[faster]).relaxation_modulus(time, LEVEL)
    for seed in range(16):
        noisy = modulus * (1 + 0.005 * np.random.default_rng(seed).standard_normal(time.size))
        after = continuations(fit_spectrum(time, noisy), np.ones((1, time.size)), 400)
        low, high = interval(after.equilibrium_modulus, 0.9)
        held.append(low < LEVEL < high)
    assert np.mean(held) > 0.6


@pytest.mark.parametrize("last", [1e2, 1e4, 1e6])
def test_all_draws_follow_their_curve(last: float) -> None:
    """Also those of which the likeliest size would need an equilibrium modulus below 0."""
    fit = fitted(last)[2]
    at = last * np.array([0.1, 0.3, 1.0])
    drawn = continuations(fit, np.ones((1, fit.reduced_time.size)), 400).modulus(at)
    np.testing.assert_allclose(drawn / TRUTH.relaxation_modulus(at, LEVEL), 1, atol=0.02)


def test_a_plateau_that_is_reached_leaves_nothing_open() -> None:
    _, _, fit = fitted(1e6)
    end = end_of(fit)
    assert end.reached
    assert end.range is None
    assert end.carried_on() is fit


def test_draws_of_an_open_end_agree_within_the_curve_and_fall_beyond_it() -> None:
    time, modulus, fit = fitted(30.0)
    factors = 1 + 0.005 * np.random.default_rng(1).standard_normal((20, 1, 1))
    curves = CurveDraws(time, modulus * factors)
    drawn = draw_spectra(time, modulus[None], curves, fit, lambda t, y: fit, open_end=True)
    at = np.array([0.1, 1.0, 10.0, 1e8])
    members = drawn.equilibrium_modulus[:, None] + drawn.shear_modulus @ np.exp(-at / drawn.relaxation_time[:, None])
    np.testing.assert_allclose(members[:, :3] / TRUTH.relaxation_modulus(at[:3], LEVEL), 1, atol=0.02)
    assert members[:, 3].min() < LEVEL < members[:, 3].max()
    assert drawn.equilibrium_modulus.std() > 0.1 * LEVEL


def test_a_steep_end_is_open_and_its_paths_follow_the_curve() -> None:
    time = np.geomspace(1e-6, 30.0, 200)
    steep = Spectrum(TAU, 1e6 * TAU**0.1 * np.exp(-np.sqrt(TAU / 10)))  # falls by a sixth per tenth of a decade at the end
    modulus = steep.relaxation_modulus(time, 1e3)
    noise = 1 + 0.005 * np.random.default_rng(3).standard_normal(time.size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        fit = fit_spectrum(time, 3 * modulus * noise)
        assert not end_of(fit).reached
    after = continuations(fit, np.ones((1, time.size)), 100).modulus(time[time > 10.0])
    np.testing.assert_allclose(np.mean(after, axis=0) / modulus[time > 10.0], 1, atol=0.01)


def test_window_and_range_are_in_the_material_file() -> None:
    text = write_material(OPEN)
    assert b'shear_modulus_range = [\n    "0 Pa",\n    "120000 Pa",\n]' in text
    assert b"plateau_reached = false" in text
    again = parse_material(text, "m.toml")
    assert (again.window, again.equilibrium_range) == (OPEN.window, OPEN.equilibrium_range)
    with pytest.raises(InputError, match="the lower bound must come first"):
        parse_material(text.replace(b'"0 Pa",\n    "120000 Pa"', b'"120000 Pa",\n    "0 Pa"'), "m.toml")


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (OPEN, r"1e\+06 s at 20 degC are longer than the measured relaxation, .* 100 s .*not reached.* between 0 and 1.2e\+05 Pa"),
        (replace(OPEN, window=Window((1e-6, 1e2), True), equilibrium_range=None), "taken to stay on its plateau"),
        (
            replace(OPEN, calibrated=CalibratedRange(("uniaxial",), 4.0, (1.0, 1e3), (20.0, 20.0))),
            "longer than the tests that the material was calibrated by, which are equivalent to 1e\\+03 s",
        ),
    ],
)
def test_a_simulation_beyond_the_window_is_warned_of_once(material: Material, message: str) -> None:
    with pytest.warns(DielastWarning, match=message) as caught:
        warn_of_lasting(material, [20.0, 20.0], [1e6, np.nan])
    assert len(caught) == 1


def test_the_same_time_at_a_higher_temperature_is_a_longer_one() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", DielastWarning)
        warn_of_lasting(OPEN, [20.0], [150.0])
    with pytest.warns(DielastWarning, match="at 40 degC are longer than the measured relaxation"):
        warn_of_lasting(OPEN, [40.0], [150.0])


@pytest.mark.parametrize(("off", "place"), [(1e-30, 0), (0.1, 40), (0.4, -3), (3.0, -1)])
def test_a_stray_point_changes_neither_the_fit_nor_the_range_and_is_named(off: float, place: int) -> None:
    time = np.logspace(-6, 3, 120)
    modulus = 1e6 * (0.2 + np.exp(-((time / 10) ** 0.3))) * (1 + 0.01 * np.random.default_rng(3).standard_normal(time.size))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        kept = np.arange(time.size) != place % time.size
        without = end_of(fit_spectrum(time[kept], modulus[kept]))
    modulus[place] *= off
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DielastWarning)
        found = end_of(fit_spectrum(time, modulus))
    said = str(caught[0].message)
    assert said.startswith(f"a point is at {time[place]:.4g} s ")
    assert said.endswith("times its neighbours: it is left out of the fit")
    assert found.fit.equilibrium_shear_modulus == without.fit.equilibrium_shear_modulus
    assert found.range == without.range


def test_a_modulus_that_no_arithmetic_holds_beside_the_others_is_one_line() -> None:
    time = np.logspace(-6, 3, 20)  # too few to tell a stray point
    modulus = 1e6 * (0.2 + np.exp(-((time / 10) ** 0.3)))
    modulus[-2] = 1e-100
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DielastWarning)
        fit = fit_spectrum(time, modulus, method="nnls", branches=12)
        with pytest.raises(InputError, match=r"near its end the curve is at 1e-100 and .* Pa, the former at 336 s: leave it out"):
            end_of(fit)


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
