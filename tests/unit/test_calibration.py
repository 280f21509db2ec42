"""Calibration: the fit finds what made the tests, the likelihood is that of least squares, and what no test sees has no number."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from flat import relax
from scipy.optimize import least_squares
from scipy.special import stdtr
from scipy.stats import norm

from dielast import (
    WLF,
    ArrudaBoyce,
    Free,
    Gent,
    Intervals,
    Material,
    MeasuredTest,
    MooneyRivlin,
    NeoHookean,
    NoShift,
    Ogden,
    PowerBreakdown,
    ShiftTable,
    Spectrum,
    Yeoh,
    calibrate,
)
from dielast.base.errors import DielastWarning, InputError, NumericsError
from dielast.calibration.comparison import Comparison, hull, stable_stress
from dielast.calibration.fit import Fit, fit_material
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.laws import cross_validation, stabilities
from dielast.calibration.levenberg import minimise
from dielast.calibration.likelihood import Likelihood, likelihood_of
from dielast.calibration.parameters import Parameter, parameter_space
from dielast.calibration.problem import Weighting
from dielast.calibration.scatter import Curves, Scatter, Scatters, covariance_of
from dielast.commands.calibrate.checks import warn_of_contradictions
from dielast.handover.material_draws import draw_columns, parse_draws
from dielast.handover.material_file import parse_material, write_material
from dielast.io.table import to_csv
from dielast.material.material import material_of, numbers_of
from dielast.material.springs import SpringLaw
from dielast.material.use_checks import warn_of_range
from dielast.mechanics.load import Step

TRUTH = Material("truth", 20e3, Spectrum([100.0, 3.0], [18e3, 40e3]), NoShift(20.0), Gent(110.0), Gent(55.0))
START = replace(TRUTH, equilibrium_modulus=30e3, spectrum=Spectrum([150.0, 5.0], [1e4, 2e4]))
MODULI = {"equilibrium.shear_modulus": Free(), "nonequilibrium.shear_modulus": Free()}
LAWS: list[SpringLaw] = [
    *(Gent(110.0), NeoHookean(), Yeoh(13e3, -100.0, 2.0), ArrudaBoyce(5.0), MooneyRivlin(1e4, 1e3)),
    Ogden((18e3, -2e3), (1.6, -2.5)),
]


def cycle(top: float, rate: float, specimen: str = "", factor: float = 1.0, lasting: float = 1.8) -> MeasuredTest:
    """A test to a stretch and back as TRUTH answers it, slack in the end unless it ends while the specimen is taut."""
    up = (top - 1) / rate
    time = np.linspace(0.0, lasting * up, 25)[1:]
    stretch = np.interp(time, [0.0, up, 2 * up], [1.0, top, 1.0])
    blank = MeasuredTest("blank", time, stretch, np.ones(24), 20.0)
    stress = factor * Laboratory([blank]).answers([TRUTH])[0][0]
    return MeasuredTest(f"{top:g} at {rate:g} /s {specimen}", time, stretch, stress, 20.0, specimen=specimen)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_numbers_of_a_material_make_it_again(law: SpringLaw) -> None:
    material = replace(
        TRUTH,
        equilibrium_modulus=law.initial_modulus() or 26e3,
        equilibrium_law=law,
        nonequilibrium_law=law,
        permittivity=4e-11,
        breakdown=PowerBreakdown(3e7, 1.1),
    )
    numbers = numbers_of(material)
    again = material_of(material, numbers)
    stretched = np.square([[1.5, 2.0], [1.0, 1.2]])
    assert np.allclose(again.equilibrium_law.stress(stretched), law.stress(stretched), rtol=1e-8)
    numbers["dielectric"]["permittivity"] = 5e-11
    key = list(numbers["equilibrium"])[-1]
    numbers["equilibrium"][key] = np.multiply(numbers["equilibrium"][key], 1.1).tolist()
    numbers["nonequilibrium"]["scale"] = 2.0
    other = material_of(material, numbers)
    assert other.spectrum.shear_modulus.tolist() == [36e3, 80e3]
    # draws hold every constant that differs
    back = parse_draws(to_csv(draw_columns(np.arange(2), [material, other])), "draws.csv", material)[1]
    assert back.dielectric == other.dielectric
    assert back.equilibrium_modulus == pytest.approx(other.equilibrium_modulus)
    assert np.allclose(back.equilibrium_law.stress(stretched), other.equilibrium_law.stress(stretched), rtol=1e-7)


def test_answers_are_those_of_the_library() -> None:
    tests = [cycle(3.0, 0.1), cycle(2.0, 0.02), replace_at_once()]
    stiffer = replace(TRUTH, equilibrium_modulus=25e3)
    short = replace(TRUTH, equilibrium_law=Gent(2.0))
    answers = Laboratory(tests).answers([TRUTH, None, stiffer, short])
    for test, answer in zip(tests, answers, strict=True):
        steps = [Step(stretch=float(test.corner_stretch[0]))] if (test.corner_stretch[0] != 1) else []
        corner = zip(test.corner_stretch[1:].tolist(), np.diff(test.corner_time).tolist(), strict=True)
        steps += [Step(stretch=stretch, duration=lasting) for stretch, lasting in corner]
        own = relax(stiffer, steps, times=test.time, rtol=1e-8).nominal_stress_1[0]
        assert np.allclose(answer[2], own, rtol=1e-4, atol=1e-4 * np.max(own))
        assert np.all(np.isnan(answer[1]))
    # what cannot follow one test still answers the others
    assert np.all(np.isnan(answers[0][3]))
    assert np.all(np.isfinite(answers[1][3]))
    # all tests are outside the table of the shift law
    elsewhere = replace(TRUTH, shift=ShiftTable(20.0, (-20.0, 20.0, 30.0), (1.0, 0.0, -0.5)))
    hot = replace(replace_at_once(), temperature=40.0)
    assert np.all(np.isnan(Laboratory([hot]).answers([elsewhere])[0]))
    with pytest.raises(InputError, match=r"^tests: at once: 40 degC is outside the shift table's -20 to 30 degC$"):
        calibrate([hot], elsewhere, {"equilibrium.shear_modulus": Free()})
    # a free constant of the shift law may bring the temperature within its range
    cold = replace(replace_at_once(), temperature=-10.0)
    narrow = replace(TRUTH, shift=WLF(20.0, 10.0, 25.0))
    with pytest.raises(InputError, match="-10 degC"):
        fit_material(narrow, [cold], {"equilibrium.shear_modulus": Free()})
    fitted = fit_material(narrow, [cold], {"shift.C2": Free(min=10.0, max=500.0)})
    assert fitted.material.shift.values()["C2"] > 30


def replace_at_once() -> MeasuredTest:
    time = np.concatenate(([0.0], np.geomspace(0.1, 100.0, 15)))
    return MeasuredTest("at once", time, np.full(16, 1.5), np.ones(16), 20.0)


def test_fits_side_by_side_are_those_of_scipy_one_by_one() -> None:
    place = np.linspace(0.0, 3.0, 20)
    data = np.stack([2.0 * np.exp(-1.3 * place), 0.7 * np.exp(-0.4 * place) + 0.02 * np.cos(9 * place)])

    def residuals(at: np.ndarray, fits: np.ndarray) -> np.ndarray:
        return at[:, :1] * np.exp(-at[:, 1:] * place) - data[fits]

    bounds = np.array([0.0, 0.5]), np.array([10.0, 5.0])
    found = minimise(residuals, np.array([[1.0, 1.0], [1.0, 3.0]]), bounds, settled=1e-12)
    for k in range(2):
        alone = least_squares(lambda x, k=k: residuals(x[None], np.array([k]))[0], [1.0, 1.0], bounds=bounds, xtol=1e-12)
        assert np.allclose(found.coordinates[k], alone.x, rtol=1e-4)
    assert found.coordinates[1, 1] == 0.5  # rests on its bound
    fixed = minimise(residuals, found.coordinates + 0.1, bounds, fixed=np.array([[True, False]] * 2))
    assert np.array_equal(fixed.coordinates[:, 0], found.coordinates[:, 0] + 0.1)


def test_the_weighting_is_the_root_of_the_inverse_covariance() -> None:
    place = np.linspace(0.0, 2.0, 12)
    model = 1e5 * (1 + place)
    curves = Curves((model,) * 3, (model, 2 * model, model), (place,) * 3, np.array([0, 0, 1]))
    weighting = Weighting.of(curves, Scatter(np.full(3, 0.01), 0.03, 0.3, 0.05))
    for chosen in (np.ones(36), np.repeat([1.0, 0.0, 1.0], 12)):
        kept = chosen > 0
        root = weighting(np.eye(36), np.tile(chosen, (36, 1))).T[np.ix_(kept, kept)]
        values, specimen = np.concatenate(curves.model)[kept], np.repeat([0, 0, 1], 12)[kept]
        shared = np.where(specimen[:, None] == specimen, 0.05**2 * np.outer(values, values), 0.0)
        covariance = np.diag(weighting.weight[kept] ** -2) + shared
        assert np.allclose(root @ covariance @ root.T, np.eye(int(kept.sum())), atol=1e-9)
    # a test that is left out may have no modelled values
    lost = np.where(np.arange(36) // 12 == 1, np.nan, 1e4)
    assert np.all(np.isfinite(weighting(lost[None], np.repeat([[1.0, 0.0, 1.0]], 12, axis=1))))


@pytest.mark.trust
def test_a_stiff_specimen_does_not_bend_rates_and_branches() -> None:
    """At the fast test's rate, a second specimen with 1.5 times the stress, as measured on another machine."""
    fast, slow = cycle(3.0, 0.1, "A"), cycle(3.0, 0.01, "B")
    stiff = cycle(3.0, 0.1, "C", factor=1.5)
    free = MODULI | {"nonequilibrium.relaxation_time": Free()}
    calibration = calibrate((fast, slow, stiff), START, free, starts=4, intervals=Intervals(draws=0))
    table = calibration.to_frame()
    times = table[table["parameter"].str.contains("relaxation_time")]
    # the specimens, of which one differs by eight usual scatters, leave the times open by a quarter; without factors in the fit,
    # they would be 47 and 0.6 s
    assert np.allclose(times["value"], [100.0, 3.0], rtol=0.3)


@pytest.fixture(scope="module")
def taut() -> tuple[MeasuredTest, ...]:
    return cycle(3.0, 0.1, "A", lasting=1.5), cycle(3.0, 0.01, "A", lasting=1.5), cycle(2.0, 0.02, "B", lasting=1.5)


def test_the_fit_finds_what_made_the_tests(taut: tuple[MeasuredTest, ...]) -> None:
    exact = cycle(3.0, 0.1, "A"), cycle(3.0, 0.01, "A"), cycle(2.0, 0.02, "B")
    calibration = calibrate(
        taut[:2], START, MODULI, validate=taut[2:], starts=1, specimen_scatter=0.05, intervals=Intervals(draws=0)
    )
    # the times of the start stay as they are, so that the moduli cannot be those of the truth: the fit is the best there is
    assert calibration.total(True)[0] < 0.05
    free = MODULI | {"nonequilibrium.relaxation_time": Free()}
    fit = fit_material(START, exact, free, starts=4, specimen_scatter=0.05)
    # one start, with all moduli ten times too large, ends in a worse minimum with a branch at the least time
    assert fit.same_share == 0.75
    assert np.allclose(fit.space.values(fit.coordinates), [20e3, 18e3, 40e3, 100.0, 3.0], rtol=3e-3)
    assert set(calibration.verdicts.values()) == {"determined"}
    table = calibration.to_frame()
    assert np.all((table["lower"] < table["value"]) & (table["value"] < table["upper"]))
    assert calibration.test_columns()[1].values == ["fitted", "fitted", "validated"]
    # another specimen than the material: its level is less well known than the scatter of specimens
    likelihood = likelihood_of(fit)
    assert 0.02 < likelihood.standard_error[0] < 0.08
    # to the level, specimens whose scatter is stated contribute most, to the times the model's error alone
    assert np.all(likelihood.freedom[:, 0] > 3 * likelihood.freedom[:, 3])
    assert likelihood.thresholds(0.9)[0] == pytest.approx(1.645**2, rel=0.1)


def scattered(count: int, every: int = 1) -> list[MeasuredTest]:
    """Curves of one specimen, `every` so many points: model error 3 %, smooth over a length of 0.3, and noise 0.1 %."""
    random, scatter = np.random.default_rng(5), Scatter(np.full(1, 1e-3), 0.03, 0.3, 0.0, steady=0.2, smooth=1)
    made = []
    for number in range(count):
        test = cycle(3.0, 0.1 * 10 ** -(number % 3), "A")
        curve = Curves((test.stress,), (test.stress,), (test.place,), np.zeros(1, dtype=np.intp))
        error = np.linalg.cholesky(covariance_of(curve, scatter)) @ random.standard_normal(test.stress.size)
        parts = (each[::every] for each in (test.time, test.stretch, test.stress + error))
        made.append(MeasuredTest(f"{number}", *parts, 20.0, specimen="A"))
    return made


@pytest.mark.trust
def test_intervals_hold_whatever_the_correlation_of_the_error_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    material = replace(START, spectrum=TRUTH.spectrum)

    def under(fit: Fit, members: tuple[Scatter, ...], probability: list[float]) -> Likelihood:
        with monkeypatch.context() as only:
            only.setattr("dielast.calibration.likelihood.likely", lambda *_: Scatters(members, np.array(probability)))
            return likelihood_of(fit)

    def half_widths(likelihood: Likelihood, level: float) -> np.ndarray:
        return likelihood.standard_error * np.sqrt(likelihood.thresholds(level))

    few = fit_material(material, scattered(2, 3), MODULI, starts=1, specimen_scatter=0.02)
    # of a mixture the covariance is the mean of the members', and so is the probability of lying beyond an interval
    members = replace(few.scatter, length=0.1), replace(few.scatter, length=1.0, model_error=0.05)
    alone = [under(few, (each,), [1.0]) for each in members]
    both = under(few, members, [0.7, 0.3])
    assert np.allclose(both.covariance, 0.7 * alone[0].covariance + 0.3 * alone[1].covariance, rtol=1e-6)
    freedom = np.concatenate([each.freedom for each in alone])
    widths = half_widths(both, 0.9) / np.stack([each.standard_error for each in alone])
    assert np.allclose(np.array([0.7, 0.3]) @ (2 * stdtr(freedom, -widths)), 0.1, rtol=1e-6)
    # 16 points leave open whether the error is correlated over more than the likeliest length, 0.3; 576 points do not
    many = fit_material(material, scattered(24), MODULI, starts=1, specimen_scatter=0.02)
    for fit, known in ((few, False), (many, True)):
        every, plugged = likelihood_of(fit), under(fit, (fit.scatter,), [1.0])
        assert float(np.sum(every.scatters.probability)) == pytest.approx(1.0)
        assert fit.scatter.length == 0.3
        wider = half_widths(every, 0.999) / half_widths(plugged, 0.999)
        if known:
            assert np.max(every.scatters.probability) > 0.999
            assert np.allclose(wider, 1.0, atol=1e-3)
        else:
            assert np.max(every.scatters.probability) < 0.2
            assert np.all(wider > 1.2)


def test_an_interrupt_keeps_the_best_so_far(taut: tuple[MeasuredTest, ...]) -> None:
    seen: list[float] = []

    def watch(what: str, done: int, total: int, misfit: float) -> None:
        assert (what, total) == ("starts", 2)  # counts what was asked for
        seen.append(misfit)
        if len(seen) == 4:
            raise KeyboardInterrupt

    found = calibrate(taut[:1], START, MODULI, starts=2, intervals=Intervals(draws=20), watch=watch)
    assert not found.fit.finished
    assert found.fit.start_misfit[0] == 1  # the sums of squares are those of the starts so far
    assert found.fit.start_misfit.size == 2
    assert seen[3] <= seen[0]
    assert found.profiles == ()
    assert found.draws.size == 0
    assert np.isfinite(found.total(True)[0])
    assert set(found.to_frame()["verdict"]) == {""}


def test_a_material_knows_its_tests(taut: tuple[MeasuredTest, ...]) -> None:
    found = calibrate(
        taut,
        replace(START, spectrum=TRUTH.spectrum),
        {"equilibrium.shear_modulus": Free()},
        starts=1,
        intervals=Intervals(draws=0),
    )
    known = found.material.calibrated
    assert known is not None
    assert known.modes == ("uniaxial",)
    top = float(np.max(taut[0].stretch))
    assert known.largest_invariant == pytest.approx(top**2 + 2 / top)
    again = parse_material(write_material(found.material), "m.toml").calibrated
    assert again is not None
    assert (again.modes, again.temperature) == (known.modes, known.temperature)
    assert again.largest_invariant == pytest.approx(known.largest_invariant, rel=1e-8)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_range(found.material, np.array([[1.0, 2.9], [1.0, 2.9**-0.5]]), "uniaxial")
        warn_of_range(TRUTH, np.array([[9.0], [9.0]]), None)
        # all modes lie between uniaxial and equibiaxial ones
        both = replace(found.material, calibrated=replace(known, modes=("equibiaxial", "uniaxial")))
        warn_of_range(both, np.array([[2.5], [1.0]]), "pure-shear")
    with pytest.warns(DielastWarning, match="calibrated by uniaxial tests up to I1 = 9.667 only: .* at I1 = 18.01 its law"):
        warn_of_range(found.material, np.array([[3.0], [3.0]]), "equibiaxial")
    with pytest.warns(DielastWarning, match="only: in equibiaxial loading its law is extrapolated"):
        warn_of_range(found.material, np.array([[1.7], [1.7]]), "equibiaxial")


def test_what_no_test_sees_has_a_verdict_and_no_number(taut: tuple[MeasuredTest, ...]) -> None:
    material = replace(START, spectrum=TRUTH.spectrum, permittivity=4e-11)
    free = {"equilibrium.shear_modulus": Free(), "dielectric.permittivity": Free(min=1e-11, max=1e-10)}
    calibration = calibrate(taut[:1], material, free, starts=1, intervals=Intervals(draws=0))
    assert calibration.verdicts == {"equilibrium.shear_modulus": "determined", "dielectric.permittivity": "undetermined"}
    row = calibration.to_frame().iloc[1]
    assert np.all(np.isnan(row[["value", "standard_error", "lower", "upper"]].to_numpy(dtype=float)))
    # with a prior, the interval is that of the prior: 1.645 standard deviations on either side
    free["dielectric.permittivity"] = Free(prior=4e-11, relative=0.05)
    known = calibrate(taut[:1], material, free, starts=1, intervals=Intervals(draws=0))
    assert known.verdicts["dielectric.permittivity"] == "undetermined"
    ends = known.to_frame().iloc[1][["lower", "upper"]].to_numpy(dtype=float)
    assert np.log(ends / 4e-11) == pytest.approx(0.05 * norm.ppf([0.05, 0.95]), rel=1e-3)


def test_tests_that_contradict_each_other_are_warned_of(recwarn: pytest.WarningsRecorder) -> None:
    """One specimen of four times the stress, with its test that the material misses."""
    material = replace(START, spectrum=TRUTH.spectrum)
    tests = [cycle(1.5, 0.1, name, factor=4.0 if name == "c" else 1.0) for name in "abc"]
    result = calibrate(tests, material, {"equilibrium.shear_modulus": Free()}, starts=1, intervals=Intervals(draws=0))
    recwarn.clear()
    warn_of_contradictions(result)
    said = " ".join(str(each.message) for each in recwarn)
    # the two like specimens are those of the material
    factor = re.search(r"stress over that of the material, by specimen: c (.*): check unit, cross-section", said)
    assert factor is not None
    assert float(factor[1]) == pytest.approx(4.0, rel=0.03)
    assert re.search(r"the material misses fitted tests, 1.5 at 0.1 /s c by 7[45] %: they contradict each other", said)


@pytest.mark.trust
def test_small_stretches_do_not_tell_the_limit_of_the_chains() -> None:
    tests = [cycle(1.5, 0.1), cycle(1.5, 0.01)]
    material = replace(START, spectrum=TRUTH.spectrum)
    calibration = calibrate(
        tests,
        material,
        {"equilibrium.shear_modulus": Free(), "equilibrium.J_lim": Free(min=5, max=1e4)},
        intervals=Intervals(draws=0),
    )
    assert calibration.verdicts["equilibrium.J_lim"] in ("undetermined", "lower bound")


@pytest.mark.trust
def test_draws_follow_the_test_that_was_fitted_where_it_determines_little() -> None:
    """A small cycle tells one modulus, and hardly how it is shared out. All draws must follow the test as well as is plausible."""
    test = cycle(1.01, 0.001)
    calibration = calibrate([test], START, MODULI, starts=1, intervals=Intervals(draws=40))
    assert "determined" not in calibration.verdicts["equilibrium.shear_modulus"].split()
    answers = Laboratory([test]).answers(calibration.fit.space.materials(calibration.draws))[0]
    factor = answers @ test.stress / (test.stress @ test.stress)
    spread = 3 * np.sqrt(np.mean(calibration.likelihood.scatters.variance(test.stress)) / np.mean(np.square(test.stress)))
    assert np.quantile(np.abs(factor - 1), 0.95) < spread
    assert calibration.comparisons[0].coverage >= 0.9


@pytest.mark.trust
def test_a_law_that_is_wrong_predicts_worse() -> None:
    tests = [cycle(4.0, 0.1), cycle(3.0, 0.02), cycle(2.0, 0.05)]
    base = replace(START, spectrum=TRUTH.spectrum)
    right = cross_validation(fit_material(base, tests, MODULI, starts=1))
    wrong = cross_validation(fit_material(replace(base, equilibrium_law=Gent(16.0)), tests, MODULI, starts=1))
    assert right is not None
    assert wrong is not None
    assert right.relative_error < 0.3 * wrong.relative_error
    assert cross_validation(fit_material(base, tests[:1], MODULI, starts=1)) is None
    unstable = replace(TRUTH, equilibrium_law=Yeoh(1.0, -0.05))
    found = {each.mode: each for each in stabilities(unstable, 4.0)}
    assert not found["equibiaxial"].holds
    assert "measure in this mode up to this stretch" in found["equibiaxial"].in_words
    assert "the equilibrium spring by itself locks or becomes unstable" in found["equibiaxial"].in_words
    assert "slower than in the tests" in stabilities(unstable, 4.0, {"equibiaxial"})[1].in_words
    weak = stabilities(replace(TRUTH, nonequilibrium_law=Yeoh(1.0, -0.05)), 4.0, {"equibiaxial"})[1]
    assert "the branches' spring by itself" in weak.in_words
    assert "faster than in the tests" in weak.in_words
    assert all(each.holds for each in stabilities(TRUTH, 4.0))


def pulled(field: float, mode: str = "uniaxial") -> MeasuredTest:
    """A test to a stretch of 3.4 at 0.1 /s, and a little back, under a nominal field."""
    time = np.linspace(0.1, 26.0, 260)
    return MeasuredTest("pulled", time, np.interp(time, [0, 24, 48], [1, 3.4, 1]), np.ones(260), 20.0, mode, nominal_field=field)


def test_a_film_that_pulls_in_across_a_test_is_found() -> None:
    def runaway_stretch(test: MeasuredTest, film: Material) -> float | None:
        known = np.isfinite(stable_stress(test, [film])[0])
        return None if known.all() else float(test.stretch[known][-1])

    film = Material("film", 20e3, Spectrum([1.0], [1.0]), NoShift(20.0), NeoHookean(), NeoHookean(), permittivity=4e-11)
    for field in (10e6, 14e6):
        # mu (B - 1/(A B)) = eps E^2 A B without stress across, A and B the squared stretches: B = A where A^3 (1 - r A) = 1
        r = 4e-11 * field**2 / 20e3
        as_wide_as_long = np.sqrt(max(root.real for root in np.roots([-r, 1, 0, 0, -1]) if abs(root.imag) < 1e-9))
        beyond = runaway_stretch(pulled(field), film)
        assert beyond is not None
        assert beyond < as_wide_as_long < beyond + 0.0101
    assert runaway_stretch(pulled(4e6), film) is None
    assert runaway_stretch(pulled(0.0), film) is None
    assert runaway_stretch(pulled(10e6, "pure-shear"), film) is None
    # from the first point on
    gent = replace(film, equilibrium_law=Gent(110.0))
    assert runaway_stretch(pulled(18e6), gent) == pytest.approx(1.01)


def test_relaxation_times_are_bounded_half_way_between_their_starts() -> None:
    def times(**free: Free) -> list[Parameter]:
        paths = {f"nonequilibrium.relaxation_time[{key[1:]}]": known for key, known in free.items()}
        return list(parameter_space(TRUTH, paths).parameters)

    first, second = times(_0=Free(), _1=Free(start=1.0))
    assert (first.start, second.start) == (100.0, 1.0)
    assert (first.lower, first.upper) == (pytest.approx(10.0), pytest.approx(1e4))
    assert (second.lower, second.upper) == (pytest.approx(0.01), pytest.approx(10.0))
    assert first.default_bounds == ("half-way to relaxation_time[1] in log time", "100 times start")
    assert second.default_bounds == ("start/100", "half-way to relaxation_time[0] in log time")
    # a prior holds for a single time, too
    (known,) = times(_1=Free(prior=4.0, relative=0.05))
    assert (known.start, known.prior, known.relative) == (4.0, 4.0, 0.05)
    (stated,) = times(_1=Free(min=0.5))
    assert (stated.lower, stated.upper) == (0.5, pytest.approx(300.0))
    assert stated.default_bounds == ("", "100 times start")
    with pytest.raises(InputError, match="in the order of size of those in the material, are needed, or min"):
        times(_0=Free(), _1=Free(start=200.0))


def test_exponents_are_bounded_half_way_between_their_starts() -> None:
    """Terms of Ogden's law, in whatever order, do not change places."""
    ogden = replace(TRUTH, equilibrium_law=Ogden((1e4, 2e3, -1e3), (1.6, 4.0, -2.0)))
    first, second, third = parameter_space(ogden, {"equilibrium.alpha": Free()}).parameters
    found = np.array([(each.lower, each.upper) for each in (first, second, third)])
    assert found == pytest.approx(np.array([(-0.2, 2.8), (2.8, 16.0), (-8.0, -0.2)]))
    assert first.default_bounds == ("half-way to alpha[2]", "half-way to alpha[1]")
    with pytest.raises(InputError, match=r"start = 4 is also that of alpha\[1\]"):
        parameter_space(ogden, {"equilibrium.alpha[0]": Free(start=4.0)})


@pytest.mark.parametrize(
    ("free", "message"),
    [
        ({}, "nothing is free"),
        ({"equilibrium.C20": Free()}, "equilibrium.C20: the material has no such constant; there are equilibrium.shear_modulus"),
        ({"equilibrium.J_lim": Free(min=10, max=5)}, "equilibrium.J_lim: min = 10 is not below max = 5"),
        ({"equilibrium.J_lim": Free(min=10, start=5)}, "start = 5 is not between"),
        ({"equilibrium.J_lim": Free(prior=50)}, "prior and relative go together"),
        ({"equilibrium.J_lim": Free(min=-1)}, "a number above 0 is needed"),
        ({"nonequilibrium.relaxation_time": Free(start=5.0)}, "nonequilibrium.relaxation_time: positive starts of the relaxation"),
        ({"nonequilibrium.shear_modulus[7]": Free()}, "there are 2 entries, counted from 0"),
        ({"nonequilibrium.scale": Free(), "nonequilibrium.shear_modulus": Free()}, "free one of the two"),
    ],
)
def test_what_cannot_be_free_is_said(free: dict[str, Free], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parameter_space(TRUTH, free)
    assert message in str(caught.value)


def test_the_modulus_is_free_in_place_of_a_constant_that_it_replaces() -> None:
    yeoh = replace(TRUTH, equilibrium_law=Yeoh(10e3, -100.0))
    for path, message in (
        ("equilibrium.C10", "equilibrium.C10: free equilibrium.shear_modulus instead: yeoh is stated by it or by C10"),
        ("equilibrium.C77", "there are equilibrium.shear_modulus, equilibrium.C20, equilibrium.C30"),
    ):
        with pytest.raises(InputError) as caught:
            parameter_space(yeoh, {path: Free()})
        assert message in str(caught.value)
    pair = replace(TRUTH, equilibrium_law=MooneyRivlin(9e3, 1e3))
    assert parameter_space(pair, {"equilibrium.C10": Free()}).names == ("equilibrium.C10",)


def test_draws_are_a_prior_with_their_correlations() -> None:
    random = np.random.default_rng(1)
    both = 0.2 * random.standard_normal(400)
    members = [
        replace(TRUTH, equilibrium_modulus=20e3 * np.exp(b), spectrum=Spectrum([100.0, 3.0], [18e3 * np.exp(b), 40e3 * np.exp(c)]))
        for b, c in zip(both, 0.1 * random.standard_normal(400), strict=True)
    ]
    free = {"equilibrium.shear_modulus": Free(draws=members), "nonequilibrium.shear_modulus": Free(draws=members)}
    space = parameter_space(TRUTH, {**free, "equilibrium.J_lim": Free()})
    covariance = np.linalg.inv(space.precision[:3, :3])
    assert np.allclose(np.sqrt(np.diag(covariance)), [0.2, 0.2, 0.1], rtol=0.15)
    assert covariance[0, 1] > 0.95 * np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert abs(covariance[0, 2]) < 0.2 * np.sqrt(covariance[0, 0] * covariance[2, 2])
    assert np.allclose(space.centre[:3], np.log([20e3, 18e3, 40e3]), atol=0.03)
    assert not space.precision[3].any()


def test_tests_that_cannot_be_are_said(taut: tuple[MeasuredTest, ...]) -> None:
    with pytest.raises(InputError, match="at least 3"):
        MeasuredTest("short", [0.0, 1.0], [1.0, 1.1], [0.0, 1.0], 20.0)
    with pytest.raises(InputError, match="ascend"):
        MeasuredTest("back", [0.0, 2.0, 1.0], [1.0, 1.1, 1.2], [0.0, 1.0, 2.0], 20.0)
    with pytest.raises(InputError, match="above 0"):
        MeasuredTest("strain", [0.0, 1.0, 2.0], [0.0, 0.1, 0.2], [0.0, 1.0, 2.0], 20.0)
    with pytest.raises(InputError, match="stretch is 1 throughout"):
        MeasuredTest("still", [0.0, 1.0, 2.0], [1.0, 1.0, 1.0], [0.0, 1.0, 2.0], 20.0)
    with pytest.raises(InputError, match="stress is 0 throughout"):
        MeasuredTest("slack", [0.0, 1.0, 2.0], [1.0, 1.1, 1.2], [0.0, 0.0, 0.0], 20.0)
    with pytest.raises(InputError, match="at least one test"):
        fit_material(TRUTH, [], MODULI)
    tight = replace(START, equilibrium_law=Gent(3.0))
    fit = fit_material(tight, taut, MODULI, starts=1)  # a stretch of 3 is beyond it, 2 is not
    assert fit.left_out == (taut[0].name, taut[1].name)
    with pytest.raises(NumericsError, match=r"no start can follow any of the tests; .* reaches a stretch of 3:"):
        fit_material(replace(START, equilibrium_law=Gent(0.5)), taut, MODULI, starts=1)


def test_bands_hold_those_of_all_laws_that_are_alike() -> None:
    test, other = cycle(1.5, 0.1), cycle(1.5, 0.01)
    model = test.stress

    def law(below: float, above: float, lost: float = 0.0) -> Comparison:
        lower = model - below
        lower[-1] = -np.inf if lost else lower[-1]  # more draws have run away than the interval leaves out
        return Comparison(test, False, model, lower, model + above, np.append(np.zeros(model.size - 1), lost))

    unfollowed = Comparison(test, False, np.full(model.size, np.nan), *np.full((2, model.size), np.nan))
    of_other = Comparison(other, False, other.stress, other.stress, other.stress)
    (found,) = hull([(law(3.0, 1.0),), (of_other, law(1.0, 2.0, lost=0.1)), (unfollowed,)])
    assert found.model is model
    assert found.lower[:-1] == pytest.approx(model[:-1] - 3.0)
    assert found.lower[-1] == -np.inf
    assert found.opened == test.stretch[-1]
    assert found.upper == pytest.approx(model + 2.0)
    assert np.max(found.lost) == 0.1
    assert found.coverage == 1.0  # a point above an open lower end is within the interval
    gone = replace(found, upper=np.append(found.upper[:-1], -np.inf))  # and none where nearly all draws have run away
    assert gone.coverage == pytest.approx(1 - 1 / model.size)
