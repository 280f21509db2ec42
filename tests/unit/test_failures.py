"""Statistics of failures: against an independent package, closed forms, derivatives, exposures along histories, bounds."""

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from dielast import InputError, read_material
from dielast.calibration.failures.ageing import Ageing
from dielast.calibration.failures.bounds import most_expected, plan_test
from dielast.calibration.failures.estimate import estimate, without_each
from dielast.calibration.failures.exposures import Aged, Envelope, Plain
from dielast.calibration.failures.fits import fit_law
from dielast.calibration.failures.histories import Histories
from dielast.calibration.failures.law_models import law_model
from dielast.calibration.failures.laws import LawModel, LawOptions
from dielast.calibration.failures.likelihood import Anchored, FailureModel, Mixed, Observations, Seen
from dielast.calibration.failures.possible import draw, profile_intervals
from dielast.calibration.failures.scatter_laws import SCATTER_LAWS, WEIBULL
from dielast.calibration.failures.specimens import POINTS_PER_DECADE, Simulated, Specimens, simulate_specimens
from dielast.calibration.profiles import Verdict
from dielast.commands.lifetime.ranking import accepted, simulated_and_ranked
from dielast.commands.lifetime.table import read_specimens
from dielast.commands.registry import read_cases
from dielast.io.files import Inputs
from dielast.material.scatter import WeibullScatter, draw_sample, of_area
from dielast.mechanics.load import VoltageStep, Waveform
from dielast.simulate.film_setup import Film

REFERENCES = json.loads((Path(__file__).parents[1] / "references" / "failures.json").read_text())


def times_of(reference: dict[str, list[float]], law: str) -> FailureModel:
    """Times with one covariate: exact, after a time, between two times, or before one."""
    low = np.array(reference["low"])
    high = np.array([np.inf if value is None else value for value in reference["high"]])
    seen = np.where(low == high, Seen.FAILED, np.where(np.isinf(high), Seen.SUSPENDED, np.where(low == 0, Seen.DEAD, Seen.BETWEEN)))
    first = np.log(np.where(seen == Seen.DEAD, high, np.where(low > 0, low, 1.0)))
    between = np.flatnonzero(seen == Seen.BETWEEN)
    later = np.arange(seen.size)
    later[between] = seen.size + np.arange(between.size)
    y = np.concatenate((first, np.log(high[between])))
    location = Mixed(np.ones((seen.size, 1)), np.array(reference["x"])[:, None], ("intercept",), ("x",))
    return FailureModel(Observations.of(seen, None, later), Plain(y, -y), location, SCATTER_LAWS[law])


@pytest.mark.parametrize("name", sorted(REFERENCES))
def test_censored_fits_agree_with_an_independent_package(name: str) -> None:
    reference, law = REFERENCES[name], name.split()[0]
    fit = estimate(times_of(reference, law))
    values = dict(zip(reference["index"], reference["value"], strict=True))
    places = {entry: k for k, entry in enumerate(reference["index"])}
    sign = -1 if law == "weibull" else 1
    start = "lambda" if law == "weibull" else "mu"
    order = [f"{start}_ Intercept", f"{start}_ x", "rho_ Intercept" if law == "weibull" else "sigma_ Intercept"]
    expected = [values[order[0]], values[order[1]], sign * values[order[2]]]
    assert fit.at == pytest.approx(expected, abs=1e-6)
    assert fit.value == pytest.approx(reference["log_likelihood"], abs=1e-8)
    reach = 1.6448536269514722 * fit.standard_error  # of 90 % of a normal distribution
    lower, upper = fit.at - reach, fit.at + reach
    for k, key in enumerate(order):
        ends = sorted(sign ** (k == 2) * reference[end][places[key]] for end in ("lower", "upper"))
        assert (lower[k], upper[k]) == pytest.approx(ends, abs=1e-5)


@pytest.mark.parametrize("law", sorted(SCATTER_LAWS))
def test_derivatives_are_those_of_the_likelihood(law: str) -> None:
    n = 8
    y = np.concatenate((np.linspace(-0.3, 0.4, n), [0.5, 0.6]))
    seen = np.array([0, 1, 2, 3, 3, 0, 1, 2])
    later = np.arange(n)
    later[[3, 4]] = [8, 9]
    location = Mixed(np.array([[1.0, 0.0], [0.3, 0.7]] * 4), np.arange(n)[:, None] / 10, ("a", "b"), ("c",))
    model = FailureModel(Observations(seen, np.linspace(-1, 1, n), later), Plain(y, -y), location, SCATTER_LAWS[law])
    at = np.array([[0.1, -0.2, 0.3, -1.0]])
    _, gradient, hessian = model.function(at)
    for k in range(4):
        step = np.zeros((1, 4))
        step[0, k] = 1e-5
        assert (model.total(at + step) - model.total(at - step))[0] / 2e-5 == pytest.approx(gradient[0, k], rel=1e-6, abs=1e-6)
        change = (model.function(at + step)[1] - model.function(at - step)[1])[0] / 2e-5
        assert change == pytest.approx(hessian[0, k], rel=1e-6, abs=1e-6)


def constant_and_ramp() -> Histories:
    time = np.tile(np.concatenate(([0.0], np.geomspace(1e-3, 1e4, 400))), (2, 1))
    field = np.stack((np.full(401, 50e6), 1e4 * time[1]))
    return Histories(time, field, np.ones_like(time))


def test_exposures_to_constant_fields_and_ramps_are_exact() -> None:
    histories, end = constant_and_ramp(), np.array([1234.5, 5678.9])
    aged = Aged.along(histories, Ageing("power", 50e6), np.array([0, 1]), end)
    for n in (0.7, 3.0, 18.5, 120.0):
        y = aged.at(np.array([[n]]))
        ramp = n * np.log(1e4 * end[1] / 50e6) + np.log(end[1] / (n + 1))
        assert y.y[0] == pytest.approx([np.log(end[0]), ramp], abs=1e-6)
        assert y.y1[0, 1, 0] == pytest.approx(np.log(1e4 * end[1] / 50e6) - 1 / (n + 1), abs=1e-5)
        assert y.rate[0] == pytest.approx([-np.log(end[0]), np.log((n + 1) / end[1])], abs=1e-6)


def test_the_field_over_a_power_of_the_stretch_counts_at_its_largest() -> None:
    time = np.array([[0.0, 1.0, 2.0, 3.0]])
    histories = Histories(time, np.array([[1.0, 4.0, 4.4, 4.8]]) * 1e6, np.array([[1.0, 1.0, 1.5, 1.8]]))
    field, stretch = histories.largest(np.array([0]), np.array([3.0]))
    for power in (-2.0, 0.0, 0.2, 1.0, 3.0):
        expected = np.max(np.log(histories.field[0]) - power * np.log(histories.stretch[0]))
        assert np.max(np.log(field) - power * np.log(stretch)) == pytest.approx(expected, abs=2e-7)


def exponential_tests(seen: np.ndarray, time: np.ndarray, area: np.ndarray | None = None) -> FailureModel:
    y = np.log(time)
    location = Mixed(np.ones((y.size, 1)), np.zeros((y.size, 0)), ("scale",))
    return FailureModel(Observations.of(seen, None if area is None else np.log(area)), Plain(y, -y), location, WEIBULL)


def test_closed_forms_of_a_known_shape() -> None:
    random = np.random.default_rng(2)
    time, shape = random.weibull(2.3, 20) * 100, 2.3
    seen = np.where(np.arange(20) % 3 == 0, Seen.SUSPENDED, Seen.FAILED)
    fit = estimate(exponential_tests(seen, time), known={"log_scatter": -np.log(shape)})
    failures = int(np.count_nonzero(seen == Seen.FAILED))
    assert np.exp(fit.at[0]) == pytest.approx((np.sum(time**shape) / failures) ** (1 / shape), rel=1e-10)
    assert most_expected(0, 0.9) == pytest.approx(-np.log(0.1), rel=1e-12)  # no failure: exp(-sum (t/eta)^b) = 1 - C
    # r failures or fewer have the probability 1 - C at the bound (a Poisson distribution)
    expected = most_expected(3, 0.9)
    assert np.exp(-expected) * (1 + expected + expected**2 / 2 + expected**3 / 6) == pytest.approx(0.1, rel=1e-10)


def test_a_test_plan_shows_its_goal() -> None:
    plan = plan_test([500.0, 1000.0, 2000.0], [500.0**2, 1000.0**2, 2000.0**2], 1000.0**2, 0.1, 0.9)
    survive = 0.9 ** (plan.specimens * (plan.duration / 1000.0) ** 2)
    assert np.all(survive <= 0.1 * (1 + 1e-9))
    assert plan.specimens[1] == 22  # ln 0.1 / ln 0.9
    shown = plan_test([1000.0], [1000.0**2], 1000.0**2, 0.1, 0.9, shown=10 * 1000.0**2)
    assert shown.specimens[0] == 12


def test_fewer_failures_than_parameters_are_refused() -> None:
    with pytest.raises(InputError, match=r"2 parameters \(.*\) need as many failures, not 1"):
        estimate(exponential_tests(np.array([0, 1, 1]), np.array([1.0, 2.0, 3.0])))


def test_a_profile_ends_where_the_likelihood_has_fallen() -> None:
    random = np.random.default_rng(5)
    fit = estimate(exponential_tests(np.zeros(15, dtype=int), random.weibull(1.5, 15)))
    for k, found in enumerate(profile_intervals(fit, 0.9)):
        for end in (found.lower, found.upper):
            other = estimate(fit.model, known={fit.model.names[k]: end})
            assert 2 * (fit.value - other.value) * fit.share_known == pytest.approx(2.705543, abs=1e-4)
    draws = draw(fit, 1000)
    for k, found in enumerate(profile_intervals(fit, 0.9)):
        assert np.mean((draws[:, k] > found.lower) & (draws[:, k] < found.upper)) == pytest.approx(0.9, abs=0.04)


@pytest.mark.parametrize("slope", [0.3, 350.0])
def test_a_level_ridge_has_one_verdict_wherever_a_fit_ends_on_it(slope: float) -> None:
    """Lives at one field: the likelihood depends on the slope and the field of the law through their product alone."""
    life, ageing = np.array([1.0, 2.0, 0.4, 1.3, 3.0]), Ageing("power", 40e6)
    histories = Histories(np.tile([0.0, 1e7], (5, 1)), np.full((5, 2), 44e6), np.ones((5, 2)))
    model = FailureModel(
        Observations.of(np.zeros(5, dtype=int)),
        Aged.along(histories, ageing, np.arange(5), 3600 * life),
        Anchored(ageing, 3600.0, np.zeros((5, 0))),
        WEIBULL,
    )
    fit = estimate(model)
    at = np.array([np.log(44e6) + fit.at[1] / slope * (fit.at[0] - np.log(44e6)), slope, fit.at[2]])
    value, _, hessian = model.function(at[None])
    assert value[0] == pytest.approx(fit.value, abs=1e-9)
    along = replace(fit, at=at, value=float(value[0]), hessian=hessian[0])
    verdicts = [found.verdict for found in profile_intervals(along)]
    assert verdicts == [Verdict.UNDETERMINED, Verdict.UNDETERMINED, Verdict.DETERMINED]


def fewest(repeats: int, quantities: int, level: float = 0.9) -> int:
    """The fewest of `repeats` in which intervals of this level may hold the truth: with all intervals exact, one of the quantities
    is held less often with a probability of at most 1e-3 (binomial distribution, Bonferroni).
    """
    return int(binom.ppf(1e-3 / quantities, repeats, level))


def test_area_scales_strength_by_the_weakest_link() -> None:
    """Specimens of 0.1 and 10 cm^2 in one fit: the shape that scales them is that of their scatter."""
    shape, held, repeats = 8.0, [], 15
    for seed in range(repeats):
        area = np.where(np.arange(30) % 2, 0.1, 10.0)
        field = 50.0 * (np.random.default_rng(seed).exponential(size=30) / area) ** (1 / shape)
        fit = estimate(exponential_tests(np.zeros(30, dtype=int), field, area))
        scale, scatter = profile_intervals(fit, 0.9)
        held.append((scale.lower < np.log(50.0) < scale.upper, scatter.lower < -np.log(shape) < scatter.upper))
        for reference in (0.1, 10.0) if seed < 1 else ():  # from the small to the large ones, and back
            other = estimate(exponential_tests(np.zeros(30, dtype=int), field, area / reference))
            assert other.at[1] == pytest.approx(fit.at[1], abs=1e-7)
            assert other.at[0] == pytest.approx(fit.at[0] - np.exp(fit.at[1]) * np.log(reference), abs=1e-7)
    assert np.all(np.sum(held, axis=0) >= fewest(repeats, 2))


def test_left_out_fits_are_those_without_the_specimen() -> None:
    time = np.random.default_rng(6).weibull(2.0, 9)
    fit = estimate(exponential_tests(np.zeros(9, dtype=int), time))
    found, score = without_each(fit)
    alone = estimate(exponential_tests(np.zeros(8, dtype=int), time[1:]))
    assert found.at[0] == pytest.approx(alone.at, abs=1e-6)
    assert score[0] == pytest.approx(fit.model.values(alone.at[None])[0, 0], abs=1e-5)


def test_a_film_that_withstood_more_before_cannot_break_down_now() -> None:
    ends = np.zeros(1)
    end = (np.log(np.array([4.0])), np.array([0.0]))
    envelope = Envelope(np.log(np.array([[5.0, 4.0]])), np.zeros((1, 2)), end, ends, np.ones(1), ends)
    assert envelope.at(np.zeros((1, 2))).rate[0, 0] == -np.inf


def test_the_anchored_location_is_the_exposure_of_its_field() -> None:
    ageing = Ageing("eyring", 40e6)
    location = Anchored(ageing, 100.0, np.zeros((1, 0)))
    at, slope = np.array([[np.log(45e6)]]), np.array([[6.0]])
    exact = np.log(100.0) + np.log(np.sinh(6.0 * 45 / 40))
    assert location.at(at, slope)[0][0, 0] == pytest.approx(exact, rel=1e-12)
    assert ageing.field_of(np.array(exact - np.log(100.0)), np.array(6.0)) == pytest.approx(np.log(45e6), rel=1e-12)


ENERGY, SLOPE, SHAPE = 60e3, 10.0, 2.0
FASTER = ENERGY / 8.314462618 * (1 / 333.15 - 1 / 293.15)  # ln of the ratio of lives at 60 and 20 degC


def at_two_temperatures(seed: int, n: int = 48) -> LawModel:
    """Films under constant fields that fail by the inverse power law and Arrhenius' law."""
    hot, ones, unknown, empty = np.arange(n) % 2 == 1, np.ones(n), np.full(n, np.nan), ("",) * n
    field = np.array([40e6, 44e6, 48e6])[np.arange(n) // 2 % 3]
    scatter = np.random.default_rng(seed).weibull(SHAPE, n)
    life = 3600 * (44e6 / field) ** SLOPE * np.exp(np.where(hot, FASTER, 0.0)) * scatter
    histories = Histories(np.tile([0.0, 1e7], (n, 1)), np.tile(field[:, None], (1, 2)), np.ones((n, 2)))
    specimens = Specimens(
        *(tuple(map(str, range(n))), np.zeros(n, dtype=int), life, field, ones * np.inf, np.ones((n, 2)), ones),
        *(np.where(hot, 60.0, 20.0), unknown, ones * 1e-4, unknown, empty, empty, np.full(n, -1)),
    )
    tested = Simulated(specimens, histories, np.arange(n), life, field, ones * np.inf, np.zeros(n, dtype=int))
    return law_model("inverse-power", tested, LawOptions(time=3600.0))


@pytest.mark.trust
def test_intervals_hold_the_activation_energy_of_lives() -> None:
    """As often as they say, and the estimates scatter about the truth: their mean lies within 3.9 of its standard errors, beyond
    which either of two quantities lies with a probability of about 2e-4.
    """
    truth, repeats, held, away = {"activation_energy": 6.0, "exponent": SLOPE, "log_scatter": -np.log(SHAPE)}, 16, [], []
    for seed in range(repeats):
        law = at_two_temperatures(seed)
        fit = estimate(law.model)
        found = profile_intervals(fit, 0.9)
        places = [law.model.names.index(name) for name in truth]
        held.append([found[k].lower < value < found[k].upper for k, value in zip(places, truth.values(), strict=True)])
        away.append([(fit.at[k] - value) / fit.standard_error[k] for k, value in zip(places[:2], truth.values(), strict=False)])
    assert np.all(np.sum(held, axis=0) >= fewest(repeats, 3))
    assert np.all(np.abs(np.mean(away, axis=0)) < 3.9 / np.sqrt(repeats))


def test_a_fitted_activation_energy_and_scatter_reach_samples_of_films() -> None:
    fitted = fit_law(at_two_temperatures(0), draws=20)
    found = fitted.to_frame().set_index("parameter")
    material = fitted.material(read_material("example:vhb4905.toml"))
    assert material.damage is not None
    assert material.damage.at(60.0, 20.0).rate(44e6) / material.damage.rate(44e6) == pytest.approx(
        np.exp(-found.loc["damage.activation_energy", "value"] / ENERGY * FASTER)
    )
    # scatter of the material reaches samples without further words, a share of films as one quantile
    drawn = draw_sample([material], 400)
    assert drawn.damage_factor is not None
    shape = float(material.damage.shape or 0.0)
    assert np.mean(drawn.damage_factor < 1) == pytest.approx(1 - np.exp(-1), abs=0.05)
    share = draw_sample([material], 3, share=0.1).damage_factor
    assert share == pytest.approx([WeibullScatter(shape).factors(np.array([0.1]))[0]] * 3)
    larger = of_area(material, 1e-3).damage
    assert larger is not None
    assert larger.rate(44e6) / material.damage.rate(44e6) == pytest.approx(10 ** (1 / shape))
    with pytest.raises(InputError, match="no shape with a reference_area"):
        of_area(replace(material, damage=None), 1e-3)


def test_rows_are_closer_where_a_law_needs_them() -> None:
    path = Path(str(files("dielast"))) / "commands" / "lifetime" / "starters" / "lifetime.short.toml"
    case = read_cases(path)[0]
    sharp = case.recipe.fit.model_copy(update={"exponent": 200.0, "shape": 30.0})
    recipe = case.recipe.model_copy(update={"fit": sharp})
    inputs = Inputs(path.parent)
    material = read_material(recipe.material)
    tested, ranks = simulated_and_ranked(recipe, material, read_specimens(recipe, material, inputs))
    assert tested.points_per_decade > POINTS_PER_DECADE
    assert ranks[0].error <= accepted(len(tested.specimens))


def under(steps: list[VoltageStep], end: float, **film: Any) -> Simulated:
    """One survivor of the example material under a programme of voltages."""
    unknown, one = np.full(1, np.nan), np.ones(1)
    specimen = Specimens(
        *(("a",), np.array([Seen.SUSPENDED]), end * one, unknown, np.inf * one, np.full((1, 2), 1.9), 5e-4 * one, 20.0 * one),
        *(unknown, unknown, unknown, ("",), ("",), np.zeros(1, dtype=int), (steps,)),
    )
    return simulate_specimens(read_material("example:vhb4905.toml"), specimen, film=Film(5e-4, **film))


def test_cycles_that_are_not_kept_age_a_film(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dielast.calibration.failures.specimens.KEPT_WHOLE", 10)
    tested = under([VoltageStep(voltage=Waveform(0.0, 4e3, 10.0, 30, "triangle"))], 300.0, boundary="clamped")
    largest = 4e3 * 1.9**2 / 5e-4
    films, time = np.zeros(3, dtype=int), np.array([300.0, 270.0, 165.0])
    y = tested.histories.exposure(Ageing("power", largest), np.array([5.0]), films, time)[0][0]
    assert np.exp(y) == pytest.approx(time / 6, rel=1e-4)  # of field over its largest to the power of 5: a sixth of the time
    assert tested.histories.at(films[:2], np.array([273.0, 275.0]))[0] == pytest.approx([0.6 * largest, largest], rel=1e-4)


@pytest.mark.trust
def test_cycles_of_creeping_films_may_be_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    steps = [VoltageStep(voltage=1e3, duration=7.0), VoltageStep(voltage=Waveform(1e3, 3e3, 10.0, 45)), VoltageStep.hold(400.0)]

    def exposures() -> tuple[int, Any]:
        histories = under(steps, 857.0, relax=5400.0).histories
        time = np.array([220.0, 457.0, 857.0])
        return histories.time.size, histories.exposure(Ageing("power", 3e7), np.array([12.0]), np.zeros(3, dtype=int), time)[0][0]

    rows, whole = exposures()
    monkeypatch.setattr("dielast.calibration.failures.specimens.KEPT_WHOLE", 10)
    fewer, thinned = exposures()
    assert fewer < 0.7 * rows
    assert thinned[1:] == pytest.approx(whole[1:], abs=2e-3)
    assert thinned[0] == pytest.approx(whole[0], abs=0.02)  # within a cycle
