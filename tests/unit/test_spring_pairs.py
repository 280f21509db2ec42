"""Laws of springs side by side: what is tried, how laws are weighed, and which test would tell them apart."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast import DielastWarning, Free, Gent, InputError, Material, MeasuredTest, MooneyRivlin, NoShift, Spectrum, VoltageTest
from dielast.calibration.fit import Fit, fit_material
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.laws import (
    Candidate,
    CrossValidation,
    cross_validation,
    drawn_beside,
    in_order,
    law_weights,
    pieces_of,
    usual_prediction,
    weighed,
    weights_by_one_test,
)
from dielast.calibration.parameters import parameter_space, with_conditions
from dielast.calibration.profiles import Profile, Verdict, possible_values
from dielast.calibration.proposals import film_voltages, predicted_film, proposals
from dielast.calibration.spring_pairs import pairs_of, trial
from dielast.commands.calibrate.checks import warn_of_few_points
from dielast.material.springs import SPRINGS
from dielast.simulate.film_setup import Film

FILM = Material("film", 2e4, Spectrum([100.0, 3.0], [2e4, 4e4]), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=4e-11)
MODULI = {"equilibrium.shear_modulus": Free(), "nonequilibrium.shear_modulus": Free()}


def pull(material: Material, top: float, rate: float = 0.1) -> MeasuredTest:
    up = (top - 1) / rate
    at = np.linspace(0, 1.5 * up, 31)[1:]
    blank = MeasuredTest("blank", at, np.interp(at, [0, up, 2 * up], [1, top, 1]), np.ones(30), 20.0)
    stress = Laboratory([blank]).answers([material])[0][0]
    return replace(blank, name=f"to {top:g}", specimen="one", stress=stress)


def test_all_pairs_and_pairs_of_a_list_are_tried() -> None:
    names = SPRINGS.names
    assert len(pairs_of("all")) == len(names) ** 2
    assert pairs_of(["gent", ["yeoh", "gent"]]) == [("gent", "gent"), ("yeoh", "gent")]
    with pytest.raises(InputError, match="gent"):
        pairs_of(["gend"])


@pytest.mark.parametrize("name", SPRINGS.names)
def test_every_law_starts_where_it_can_follow_the_tests(name: str) -> None:
    tests = [pull(FILM, 4.0)]
    material, free = trial(FILM, (name, name), MODULI, tests[0].largest_invariant - 3)
    space = parameter_space(material, free)
    assert np.isfinite(Laboratory(tests).answers(space.materials(space.start[None]))[0]).all()
    assert np.all(space.bounds[0] <= space.start)
    assert np.all(space.start <= space.bounds[1])


def test_laws_that_predict_alike_share_the_weight_and_one_that_misses_has_none() -> None:
    even = np.full(6, 4e-4)
    found = [CrossValidation(0.02, even), CrossValidation(0.02, 1.02 * even), CrossValidation(0.1, 25 * even)]
    weights = law_weights(found, np.full(6, 3.0))
    assert weights.sum() == pytest.approx(1.0)
    assert weights[0] == pytest.approx(weights[1], rel=0.25)
    assert weights[2] < 1e-6
    # a law that cannot follow a test has no weight, and a test that no law can follow does not count
    lost, missed = 1.02 * even, np.where(np.arange(6) == 2, np.nan, 1.0)
    lost[:2] = np.nan, np.nan
    found = [
        CrossValidation(0.02, even * missed),
        CrossValidation(0.02, 1.02 * even * missed),
        CrossValidation(0.02, lost * missed),
    ]
    fewer = [CrossValidation(0.02, each.square[[0, 1, 3, 4, 5]]) for each in found[:2]]
    alone = law_weights(fewer, np.full(5, 3.0))
    assert law_weights(found, np.full(6, 3.0)) == pytest.approx([*alone, 0.0], abs=1e-12)
    # of tests that contradict each other, few do not decide
    split = [CrossValidation(0.02, np.array([1e-4, 9e-4, 4e-4])), CrossValidation(0.02, np.array([9e-4, 1e-4, 4e-4]))]
    assert law_weights(split, np.full(3, 3.0)) == pytest.approx([0.5, 0.5], abs=0.03)


def fitted(points: float, constants: int, square: float) -> Any:
    """A fit to a single test with so many independent points."""
    curves = SimpleNamespace(
        places=[np.array([0.0, 0.6 * points])], differences=np.sqrt(square) * np.ones(9), levels=lambda: [np.ones(9)]
    )
    problem = SimpleNamespace(space=np.zeros(constants), laboratory=SimpleNamespace(tests=[None]))
    return Fit(problem, np.zeros(constants), *[curves] * 3, np.zeros(1))  # type: ignore[arg-type]


def test_laws_of_a_single_test_are_weighed_by_as_much_as_it_tells() -> None:
    """With 40 independent points by Akaike's criterion, corrected; with 3, of 5 constants, no law that it does not contradict."""
    many = [fitted(40, 3, 1e-4), fitted(40, 5, 1e-4), fitted(40, 5, 4e-4)]
    value = 40 * np.log(1e-4) + 2 * 4 + 2 * 4 * 5 / 35  # the size of the error is a constant as well
    assert many[0].aicc == pytest.approx(value)
    gain = np.exp(-0.5 * np.array([0.0, 2 * 2 + 2 * 6 * 7 / 33 - 2 * 4 * 5 / 35]))
    assert weights_by_one_test(many) == pytest.approx([*(gain / gain.sum()), 0.0], abs=1e-9)
    few = [fitted(3, 5, 1e-4), fitted(3, 2, 4e-4), fitted(3, 3, 4e-4), fitted(3, 2, 4e-2)]
    assert few[0].aicc == np.inf
    assert weights_by_one_test(few) == pytest.approx([1 / 3, 1 / 3, 1 / 3, 0.0])
    ranked = in_order([Candidate(f"{k}", fit, None, ()) for k, fit in enumerate(few)])
    assert [each.name for each in ranked] == ["1", "2", "0", "3"]
    with pytest.warns(DielastWarning, match=r"about 3 independent points cannot weigh laws of up to 5 constants"):
        warn_of_few_points(few)


def test_laws_that_an_interrupt_left_without_a_cross_validation_come_last() -> None:
    problem = SimpleNamespace(laboratory=SimpleNamespace(tests=[None] * 2))
    pairs: list[Any] = [(0.01, None), (0.02, 0.03), (0.005, None), (0.03, 0.02)]  # errors of the fit and of the prediction
    laws = []
    for name, (misfit, error) in enumerate(pairs):
        fit: Any = SimpleNamespace(problem=problem, misfit=misfit)
        laws.append(Candidate(f"{name}", fit, CrossValidation(error, np.ones(2)) if error else None, ()))
    assert [each.name for each in in_order(laws)] == ["3", "1", "2", "0"]


def test_cross_validation_of_a_single_test_leaves_nothing() -> None:
    fits = [fit_material(FILM, [pull(FILM, 3.0)], MODULI, starts=1)]
    assert cross_validation(fits[0]) is None
    ranked = [Candidate("a", fits[0], None, ()), Candidate("b", fits[0], None, ())]
    assert [each.weight for each in weighed(ranked, usual_prediction(fits[0]))] == pytest.approx([0.5, 0.5])


def test_laws_that_fit_alike_with_other_branches_are_named_and_not_drawn_from() -> None:
    def candidate(name: str, material: Material, weight: float) -> Candidate:
        fit: Any = SimpleNamespace(material=material)
        return Candidate(name, fit, None, (), weight=weight)

    single = replace(FILM, spectrum=Spectrum([30.0], [5e4]))
    ranked = [candidate("a", FILM, 0.5), candidate("b", single, 0.3), candidate("c", FILM, 0.18), candidate("d", single, 0.02)]
    with pytest.warns(DielastWarning, match=r"cannot tell b \(30 %\) from a: draws leave them out") as caught:
        assert drawn_beside(ranked) == [ranked[2]]
    assert len(caught) == 1
    even = [candidate(f"{k}", FILM, 1 / 30) for k in range(30)]  # of many laws alike, none has a large weight
    volts = {9: 3e3, 20: 5e3}  # those whose films differ most are drawn
    even = [replace(each, film_voltage=volts.get(k, 4e3)) for k, each in enumerate(even)]
    with pytest.warns(DielastWarning, match=r"5 laws at most, and leave out 3, 4, 5, 6, 7 \(and 20 more\), which"):
        assert drawn_beside(even) == [even[k] for k in (1, 2, 9, 20)]


def test_cross_validation_knows_the_error_of_each_test() -> None:
    tests = [replace(pull(FILM, top), specimen=f"{top:g}") for top in (2.0, 3.0, 4.0)]
    tests[1] = replace(tests[1], stress=1.3 * tests[1].stress)
    fit = fit_material(FILM, tests, MODULI, starts=1)
    found = cross_validation(fit)
    assert found is not None
    assert int(np.argmax(found.square)) == 1
    assert np.all(pieces_of(fit) >= 1)


def test_a_constant_whose_interval_holds_impossible_values_is_not_determined() -> None:
    start = replace(FILM, equilibrium_law=MooneyRivlin(8e3, 2e3), equilibrium_modulus=2e4)
    stated = parameter_space(start, {"equilibrium.C10": Free(min=-1e4), "equilibrium.C01": Free()}).parameters
    assert stated[1].lower == 0.0
    assert stated[0].lower == -1e4
    scale = stated[0].scale or 1.0
    wide = Profile(np.zeros(1), np.zeros(1), np.zeros((1, 2)), -1936 / scale, 8247 / scale, Verdict.DETERMINED)
    found = possible_values(wide, stated[0])
    assert found.verdict is Verdict.UPPER
    assert np.isnan(found.lower)
    assert found.upper == wide.upper
    narrow = replace(wide, lower=3000 / scale)
    assert possible_values(narrow, stated[0]) is narrow


def test_a_test_in_the_predicted_mode_is_proposed_first() -> None:
    random = np.random.default_rng(1)
    shares = random.uniform(0.0, 0.4, 24)
    draws = [replace(FILM, equilibrium_law=MooneyRivlin(1e4 * (1 - s), 1e4 * s), equilibrium_modulus=2e4) for s in shares]
    asked = predicted_film(16.0, 20.0)
    found = proposals(draws, asked, 16.0, 0.03, 0.03)
    tests, removed = list(found), list(found.values())
    assert np.ptp(np.log(film_voltages(draws, asked))) > 0.2
    assert tests[0].startswith(("film", "equibiaxial"))
    assert removed[0] > 0.8 > removed[-1]
    assert tests[-1].startswith("pure-shear")  # where both invariants are equal


def test_draws_that_cannot_follow_the_predicted_film_are_counted() -> None:
    asked = predicted_film(32.0, 20.0)
    follow = [replace(FILM, equilibrium_modulus=modulus) for modulus in np.linspace(1e4, 3e4, 12).tolist()]
    limited = [replace(FILM, equilibrium_law=Gent(10.0))] * 6
    with pytest.warns(DielastWarning, match=r"^prediction: 6 of 18 draws cannot follow this film, next_tests.csv leaves them out$"):
        assert proposals([*follow, *limited], asked, 9.0, 0.03, 0.03)
    assert proposals([*follow[:9], *limited], asked, 9.0, 0.03, 0.03) == {}


def test_an_unknown_rate_is_a_parameter_within_its_bounds() -> None:
    film = Film(1e-3, 3.0, relax=600.0)
    stretch = np.array([1.01, 1.02, 1.05, 1.1, 1.15, 1.2])
    test = VoltageTest("film", np.full(6, 1e4), stretch, film, 300.0, 20.0, measure="relative_stretch")
    voltage = Laboratory([test]).answers([FILM])[0][0]
    free = {"dielectric.permittivity": Free(min=3.9e-11, max=4.1e-11)}
    unknown = replace(test, voltage=voltage, ramp=np.array([10.0, 1e4]))
    space = with_conditions(parameter_space(FILM, free), [unknown])
    assert space.names == ("dielectric.permittivity", "film: ramp")
    fit = fit_material(FILM, [unknown], free, starts=2)
    rate = fit.space.values(fit.coordinates)[1]
    assert 10.0 <= rate <= 1e4
    assert rate == pytest.approx(300.0, rel=0.3)
    slow, fast = (Laboratory([replace(unknown, ramp=each)]).answers([FILM])[0][0] for each in (10.0, 1e4))
    assert np.all(slow < voltage)
    assert np.all(voltage < fast)
