"""What a measured curve shows besides its material, and the scatter that is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from machines import QUIET, Machine, Record, cycles, hold, record, softened

from dielast import WLF, Free, Gent, Material, MeasuredTest, NeoHookean, NoShift, Spectrum, Yeoh
from dielast.base.errors import DielastWarning
from dielast.calibration.doubts import gives_work, slack_of, softening, stress_at_rest
from dielast.calibration.estimate import PRIOR_FREEDOM, USUAL_ERROR, ResidualSpace, estimate
from dielast.calibration.fit import fit_material
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.likelihood import likelihood_of
from dielast.calibration.ringing import loaded_at_rest, ringing
from dielast.calibration.scatter import CORRELATIONS, INTEGRALS, Curves, Scatter
from dielast.material.material import CalibratedRange
from dielast.material.use_checks import warn_of_lasting, warn_of_use

SOFT = Material("soft", 20e3, Spectrum([100.0, 3.0], [18e3, 40e3]), NoShift(20.0), Gent(110.0), Gent(55.0))
FAST = Material("fast", 30e3, Spectrum([50.0, 1.0, 0.05], [20e3, 60e3, 300e3]), NoShift(20.0), Gent(60.0), Gent(15.0))
STIFF = Material(
    "stiff", 25e3, Spectrum([20.0, 0.3, 0.02], [20e3, 1e5, 1e6]), NoShift(20.0), Yeoh(12.5e3, -100.0, 3.0), NeoHookean()
)


def each_in_turn(materials: Sequence[Material], levels: Sequence[object], varied: Sequence[object]) -> pytest.MarkDecorator:
    """Every material with one of what is varied, at the last level; all with all before a release."""
    turns = zip(materials, range(len(materials)), strict=True)
    some = [pytest.param(material, levels[-1], [varied[k % len(varied)]], id=material.name) for material, k in turns]
    whole = [
        pytest.param(material, level, varied, id=f"{material.name}-{level}-all", marks=pytest.mark.trust)
        for material in materials
        for level in levels
    ]
    return pytest.mark.parametrize(("material", "noise", "varied"), [*some, *whole])


@each_in_turn([SOFT, FAST, STIFF], [0.0, 0.01, 0.03], [(2.0, 4.0), (3.0, 1.0), (1.5, 0.2)])
def test_clean_tests_and_fast_relaxation_ring_nowhere(material: Material, noise: float, varied: list[tuple[float, float]]) -> None:
    random = np.random.default_rng(17)
    machine = replace(QUIET, noise=noise)
    for top, ramp in varied:
        for made in (hold(material, machine, random, top=top, ramp=ramp), cycles(material, machine, random, top=top, ramp=ramp)):
            test = made.test()
            assert not ringing(test).any()
            assert not loaded_at_rest(test).any()


@each_in_turn([SOFT, STIFF, FAST], [None], [(10.0, 0.001, 0.01), (50.0, 0.001, 0.01), (20.0, 0.01, 0.07)])
def test_ringing_is_left_out_where_it_is(material: Material, noise: None, varied: list[tuple[float, float, float]]) -> None:
    for rate, noise, left in varied:
        machine = Machine(force=0.5 * material.equilibrium_modulus / 20e3, noise=noise)
        made = hold(material, machine, np.random.default_rng(4), rate=rate)
        found = ringing(made.test())
        off = np.abs(made.force - made.clean)[-found.size :] / np.max(made.clean)
        assert np.max(off[~found]) < left < np.max(off)
        # the ramp stays to its stop, from 2.5 s on, or from where all further points of a swing do not show: with the amplitude a
        # and the rate c, a^2/(4 c spacing) is the variance of one point
        time, damping = made.time[-found.size :], machine.damping * 2 * np.pi * machine.frequency
        level = np.sqrt(0.5 * made.clean**2 + 0.5 * np.mean(made.clean**2))[-found.size :]
        faded = machine.force * np.exp(-damping * time) / level < 2 * noise * np.sqrt(damping / rate)
        assert not found[(time > max(2.5, time[faded][0])) & (time < 3.9)].any()
        assert not found[time > 7.0].any()


def test_ringing_that_fills_most_of_a_test_is_not_taken_for_noise() -> None:
    """6 Hz that fades within seconds, every 20 ms during a ramp of 2 s and after it, and then in log time."""
    time = np.concatenate((np.arange(0.0, 4.0, 0.02), 2 + np.geomspace(2.0, 600.0, 80)))
    machine = Machine(frequency=6.0, damping=0.03, force=0.3)
    made = record(SOFT, [(0.0, 1.0), (2.0, 2.0), (602.0, 2.0)], time, machine, np.random.default_rng(3))
    found = ringing(made.test())
    assert np.all(found[made.disturbed[-found.size :]])
    assert not found[made.time[-found.size :] > 20.0].any()


def test_an_overshoot_of_half_a_second_is_left_out() -> None:
    """An extension of 80.4, 80.7 and 79.9 mm, and a force that falls and rises by a third meanwhile, after a ramp of 4 s."""
    made = hold(SOFT, QUIET, np.random.default_rng(1), ramp=4.0, rate=10.0)
    after = np.array([4.0, 4.1, 4.2, 4.3, 4.4, 4.5, 4.6])
    extension = made.extension + np.interp(made.time, after, [0, 3e-4, 1e-4, -5e-4, -2e-4, -1e-4, 0])
    share = np.interp(made.time, after, [0, 0.05, -0.24, -0.17, 0.05, 0.02, 0])
    found = ringing(replace(made, extension=extension, force=made.force * (1 + share)).test())
    time = made.time[-found.size :]
    assert found[(time > 4.05) & (time < 4.45)].all()
    assert not found[(time < 3.95) | (time > 4.75)].any()


def test_measured_loops_of_vhb_4905_ring_nowhere(shared_data: Callable[[str], Path]) -> None:
    table = pd.read_csv(shared_data("vhb4905/4-loading.csv"), sep=";", decimal=",", encoding="latin-1")
    for _, rows in list(table.groupby("id"))[::3]:
        stretch = rows.stretch.to_numpy()
        time = np.cumsum(np.abs(np.diff(stretch, prepend=1.0))) / float(rows.vel.iloc[0])
        moved = np.diff(time, prepend=0.0) > 0
        test = MeasuredTest("loop", time[moved], stretch[moved], rows.stress.to_numpy()[moved], 20.0)
        assert not ringing(test).any()
        assert not loaded_at_rest(test).any()


def _laboratory(machine: Machine, seed: int) -> list[Record]:
    random = np.random.default_rng(seed)
    scattered = np.exp(0.05 * random.standard_normal(4)).tolist()
    first = [
        hold(SOFT, machine, random, top=top, ramp=ramp, factor=factor, rate=10.0)
        for top, ramp, factor in zip((2.0, 1.5, 3.0), (4.0, 2.0, 6.0), scattered[:3], strict=True)
    ]
    return [*first, cycles(SOFT, machine, random, ramp=10.0, count=1, factor=scattered[3])]


@pytest.mark.parametrize("seeds", [(3,), pytest.param((3, 100, 101), marks=pytest.mark.trust)])
def test_constants_are_within_their_intervals_although_the_machine_rings(seeds: tuple[int, ...]) -> None:
    machine = Machine(noise=0.003, force=0.5, offset=0.004)
    free = {f"{path}.shear_modulus": Free() for path in ("equilibrium", "nonequilibrium")} | {
        "nonequilibrium.relaxation_time": Free()
    }
    errors, score = [], []
    for seed, ignore in ((3, False), *((seed, True) for seed in seeds)):
        tests = []
        for k, made in enumerate(_laboratory(machine, seed)[: None if len(seeds) > 1 else 2]):  # two tests are enough for a seed
            test = made.test(f"{k}")
            tests.append(replace(test, left_out=ringing(test)) if ignore else test)
        fit = fit_material(SOFT, tests, free, starts=1)
        likelihood = likelihood_of(fit)
        off = (fit.coordinates - fit.space.coordinates([20e3, 18e3, 40e3, 100.0, 3.0])) / likelihood.standard_error
        score += off.tolist() if ignore else []
        errors.append((fit.scatter.model_error, float(np.max(likelihood.standard_error))))
        # the measured history is followed, whatever is left out
        assert tests[0].corner_time.size > 5
    if len(seeds) > 1:  # one laboratory says little of how far errors reach
        assert np.mean(np.square(score)) < 0.85**-2  # they may be stated by the factor 0.85 too small
    assert errors[1][0] < 0.5 * errors[0][0]
    assert errors[1][1] < errors[0][1]
    assert all(test.unused.shape[1] > 5 for test in tests)


PLAIN = Material("plain", 20e3, Spectrum([300.0, 10.0], [40e3, 40e3]), NoShift(20.0), NeoHookean(), NeoHookean())
TIGHT = Material("tight", 20e3, Spectrum([300.0, 10.0], [20e3, 20e3]), NoShift(20.0), Gent(6.0), Gent(6.0))
MATERIALS = [SOFT, FAST, PLAIN, TIGHT]


@each_in_turn(MATERIALS, [0.0, 0.02], [(10.0, 2, 1.0), (1.0, 3, 1.0), (100.0, 2, 1.2)])
def test_relaxation_is_no_softening(material: Material, noise: float, varied: list[tuple[float, int, float]]) -> None:
    random = np.random.default_rng(6)
    for ramp, count, low in varied:
        made = cycles(material, replace(QUIET, noise=noise), random, ramp=ramp, count=count, low=low, points=30)
        assert softening(made.test()) == 0.0
        # without force, a film that is longer than at the beginning is slack
        assert softening(made.test(force=np.maximum(made.force, 0.0))) == 0.0
    assert softening(hold(material, replace(QUIET, noise=noise), random).test()) == 0.0


@each_in_turn(MATERIALS, [0.0, 0.01], [(1.0, 0.1), (10.0, 0.1), (10.0, 0.4), (100.0, 0.2)])
def test_a_specimen_that_softens_is_recognised(material: Material, noise: float, varied: list[tuple[float, float]]) -> None:
    for ramp, share in varied:
        made = cycles(material, replace(QUIET, noise=noise), np.random.default_rng(2), ramp=ramp, points=30, slack="pushes")
        found = softening(softened(made, share).test())
        # the mean over the loading is less than the share next to rest
        assert 0.5 * share < found < 1.1 * share
    # a slack specimen recovers further, which hides less than a fifth
    made = cycles(material, replace(QUIET, noise=noise), np.random.default_rng(2), ramp=10.0, points=30)
    assert 0.2 < softening(softened(made, 0.4).test()) < 0.44


STRETCH = np.linspace(1.0, 3.0, 101)


def pulled(slack: float = 0.0, noise: float = 0.0, offset: float = 0.0) -> MeasuredTest:
    """A neo-Hookean specimen that is taut from a stretch of 1 + slack on."""
    taut = np.maximum(STRETCH - slack, 1.0)
    random = np.random.default_rng(1)
    stress = (taut - taut**-2) * (1 + noise * random.standard_normal(taut.size)) + offset
    return MeasuredTest("pulled", STRETCH * 1.0 - 1.0, STRETCH, 3e4 * stress, 20.0)


def test_slack_is_seen_where_later_points_are_on_steeper_lines_from_rest() -> None:
    assert slack_of(pulled()) == 0
    assert slack_of(pulled(noise=0.01)) < 0.002
    assert slack_of(pulled(0.06)) == pytest.approx(0.06)
    assert slack_of(pulled(0.06, noise=0.01)) == pytest.approx(0.06, rel=0.1)
    # between two points, the bound is that of the last one without a stress
    assert 0.06 <= slack_of(pulled(0.07)) <= 0.07


def test_an_offset_and_a_force_of_the_other_sign_are_seen() -> None:
    assert stress_at_rest(pulled()) == 0
    largest = 3 - 1 / 9
    assert stress_at_rest(pulled(offset=0.2)) == pytest.approx(0.2 / (largest + 0.2))
    assert not gives_work(pulled())
    assert gives_work(replace(pulled(), stress=-pulled().stress))
    # a table of the unloading alone: an elastic curve lies above its chord
    unloaded = MeasuredTest("unloaded", STRETCH, STRETCH[::-1], pulled().stress[::-1], 20.0)
    assert not gives_work(unloaded)
    assert gives_work(replace(unloaded, stress=-unloaded.stress))
    # compressed specimens take work, too
    assert not gives_work(MeasuredTest("pressed", STRETCH - 1, 1 / STRETCH, 3e4 * (1 / STRETCH - STRETCH**2), 20.0))


def curves_of(count: int, place: np.ndarray) -> Curves:
    model = 1e4 * (1 + np.sin(0.8 * place) ** 2)
    return Curves((model,) * count, (model,) * count, (place,) * count, np.arange(count))


@pytest.mark.parametrize("kind", range(3))
def test_correlations_have_their_integrals(kind: int) -> None:
    distance = np.linspace(0.0, 40.0, 400_001)
    values = CORRELATIONS[kind](distance)
    assert values[0] == 1
    assert 2 * np.trapezoid(values, distance) == pytest.approx(INTEGRALS[kind], rel=1e-6)
    assert np.all(np.linalg.eigvalsh(Scatter(np.zeros(1), 0.1, 0.3, 0.0, smooth=kind).correlation(np.linspace(0, 2, 40))) > -1e-9)


def test_the_size_of_the_error_of_a_model_is_found_again() -> None:
    place, random = np.linspace(0.0, 3.0, 60), np.random.default_rng(5)
    curves = curves_of(6, place)
    truth = Scatter(np.full(6, 0.003), 0.08, 0.3, 0.05, steady=0.2, smooth=1)
    root = np.linalg.cholesky(truth.correlation(place) + 1e-10 * np.eye(60))
    levels = curves.levels(truth.steady)
    sizes = []
    for _ in range(12):
        miss = [level * (0.08 * root @ random.standard_normal(60) + 0.003 * random.standard_normal(60)) for level in levels]
        slopes = np.concatenate([np.ones(60) * level for level in levels])[:, None]
        values = tuple(model + away for model, away in zip(curves.model, miss, strict=True))
        found = estimate(replace(curves, values=values), slopes, np.zeros((1, 1)), Scatter(np.full(6, 0.01), 0.05, 0.3, 0.05))
        sizes.append(found.model_error)
    assert np.median(sizes) == pytest.approx(0.08, rel=0.25)
    # where the fit has taken out all that differences could tell, the error is as usual
    curves, weight = curves_of(1, place[:4]), np.ones(4)
    nothing = ResidualSpace.of(curves, Scatter(np.zeros(1), 0.1, 10.0, 0.05), weight, np.eye(4) * curves.measured)
    assert nothing.size(np.zeros(4)) == pytest.approx(USUAL_ERROR, rel=1e-3)
    assert nothing.known == pytest.approx(PRIOR_FREEDOM)


def test_many_branches_are_smooth_where_tests_do_not_tell_them_apart() -> None:
    times = np.geomspace(300.0, 0.3, 5)
    truth = Material("t", 2e4, Spectrum(times, [1e4, 1.5e4, 2e4, 2.5e4, 3e4]), NoShift(20.0), Gent(100.0), Gent(50.0))
    at = np.linspace(0.0, 20.0, 41)[1:]
    stretch = np.interp(at, [0.0, 10.0, 20.0], [1.0, 2.0, 1.1])
    blank = MeasuredTest("cycle", at, stretch, np.ones(40), 20.0, slack="pushes")
    clean = Laboratory([blank]).answers([truth])[0][0]
    ragged = clean * (1 + 0.01 * np.random.default_rng(2).standard_normal(40))
    start = replace(truth, spectrum=Spectrum(times, np.full(5, 1e4)))
    fit = fit_material(start, [replace_stress(blank, ragged)], {"nonequilibrium.shear_modulus": Free()}, starts=1)
    assert fit.problem.smoothness.shape == (5, 5)
    assert np.linalg.matrix_rank(fit.problem.smoothness) == 3  # a straight line of log moduli is as smooth as can be
    bends = np.abs(np.diff(fit.coordinates, 2))
    assert np.max(bends) < 0.5
    assert np.max(np.abs(fit.coordinates - np.log(truth.spectrum.shear_modulus))) < 0.7
    few = fit_material(
        replace(start, spectrum=Spectrum(times[:3], np.full(3, 1e4))),
        [replace_stress(blank, ragged)],
        {"nonequilibrium.shear_modulus": Free()},
        starts=1,
    )
    assert not few.problem.smoothness.any()


def replace_stress(test: MeasuredTest, stress: np.ndarray) -> MeasuredTest:
    return MeasuredTest(test.name, test.time, test.stretch, stress, test.temperature, slack=test.slack)


def test_beyond_the_tests_is_warned_of(recwarn: pytest.WarningsRecorder) -> None:
    known = CalibratedRange(("uniaxial",), 9.0, (1.0, 100.0), (20.0, 40.0))
    material = Material("m", 2e4, Spectrum([10.0], [1e4]), NoShift(20.0), calibrated=known)
    warn_of_lasting(material, [20.0], [150.0])
    warn_of_use(replace(material, shift=WLF(20.0, 13.0, 187.0)), [22.0, 42.0])
    assert not recwarn.list
    with pytest.warns(
        DielastWarning,
        match="3.6e\\+03 s at 30 degC are longer than the tests .*, which are equivalent to 100 s at this temperature",
    ):
        warn_of_lasting(material, [20.0, 30.0], [150.0, 3600.0])
    with pytest.warns(DielastWarning, match="calibrated by tests from 20 to 40 degC: at 60 degC it is extrapolated"):
        warn_of_use(material, [60.0])
