"""Designs: the voltage that takes a film to a goal, against closed forms, sweeps of voltages, and other simulations."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from films import SOFT
from flat import actuate, design, failure_map

from dielast.base.errors import InputError
from dielast.material.intervals import DrawIntervals
from dielast.material.material import Breakdown, Material
from dielast.material.scatter import FilmScatter, NormalScatter, WeibullScatter, draw_sample
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent, NeoHookean, Yeoh
from dielast.mechanics.load import VoltageStep
from dielast.plots.design import plot_design
from dielast.simulate.design import FAILS_FIRST, OUT_OF_REACH, YES, Design, designed, plan_design, under_way
from dielast.simulate.design_plan import MET, Goal, Targets, solve_draws, solve_films
from dielast.simulate.film_setup import Film

EMPTY = Spectrum(np.zeros(0), np.zeros(0))
ELASTIC = Material("elastic", 26e3, EMPTY, NoShift(20.0), Gent(110.0), Gent(55.0), 4e-11, Breakdown((1.0,), (1e9,)))
FILM = replace(SOFT, breakdown=Breakdown((1.7, 1.9), (40e6, 48e6)))
UNIT = np.sqrt(26e3 / 4e-11) * 5e-4  # V, of sqrt(eps/mu) E~
GOAL: dict[str, Any] = {"thickness": 5e-4, "relax": 600.0, "at": 600.0, "horizon": 86400.0}


def rows(result: Design) -> dict[str, np.ndarray]:
    """What is known of each film, in order of prestretch."""
    order = np.lexsort((result.target, result.prestretch[:, 0]))
    names = ("voltage", "time_to_failure", "failure_mode", "reached", "largest")
    return {name: getattr(result, name)[order] for name in names}


def test_the_elastic_disc_in_a_frame_takes_the_voltages_of_shooting() -> None:
    """Gent, J = 110, prestretch 3, electrode a third of the frame: sqrt(eps/mu) E~ by shooting."""
    goals = [1.02, 1.2, 1.5]
    film = {"prestretch": 3.0, "boundary": "frame", "electrode_share": 1 / 3, "thickness": 5e-4}
    result = design(ELASTIC, relative_stretch=goals, at=1.0, horizon=10.0, mesh_rtol=1e-7, **film)
    assert result.voltage / UNIT == pytest.approx([0.080869, 0.205489, 0.247665], rel=1e-5)
    assert set(result.reached) == {YES}
    assert result.largest == pytest.approx(goals, rel=1e-6)


@pytest.mark.parametrize("law", [NeoHookean(), Gent(110.0), Yeoh(0.5, -0.005, 1e-4)])
def test_an_elastic_film_without_prestress(law: Any) -> None:
    """eps E~^2 = sigma / l^4, sigma the law's true stress; a neo-Hookean film pulls in at the cube root of two."""
    material = replace(ELASTIC, equilibrium_law=law)
    stretch = np.array([1.02, 1.05, 1.1])
    stress = 26e3 * law.stress(np.square([stretch, stretch])[:, None])[0, 0]
    film = {"prestretch": 1.0, "at": 1.0, "horizon": 1e4, "thickness": 5e-4}
    result = rows(design(material, relative_stretch=stretch, **film))
    assert result["voltage"] == pytest.approx(5e-4 * np.sqrt(stress / 4e-11) / stretch**2, rel=1e-6)
    if isinstance(law, NeoHookean):
        beyond = design(material, relative_stretch=1.3, **film)
        assert (beyond.reached[0], beyond.failure_mode[0], beyond.because[0]) == (FAILS_FIRST, "pull-in", "pull-in")
        assert beyond.largest[0] == pytest.approx(2 ** (1 / 3), rel=1e-5)  # though the stretch has a vertical tangent there
        assert np.isnan(beyond.voltage[0])


@pytest.mark.parametrize(
    "film",
    [
        {"prestretch": [1.0, 1.2], "goals": [1.1, 1.15, 1.2, 1.22, 1.3, 2.0]},
        {"prestretch": [1.2], "boundary": ("dead-load", "clamped"), "goals": [1.2, 1.28, 2.0]},
    ],
)
def test_an_elastic_film_fails_at_once_or_not_at_all(film: dict[str, Any]) -> None:
    """Neo-Hookean, without any branch: eps E^2 = tau(l) - P l, and E at the goal is below the breakdown field or the film fails."""
    material = replace(ELASTIC, equilibrium_modulus=2e5, permittivity=2.48e-11, equilibrium_law=NeoHookean())
    goals, axis_2 = np.array(film["goals"]), "boundary" in film
    result = design(
        material,
        relative_stretch=goals,
        at=1.0,
        horizon=10.0,
        thickness=5e-5,
        breakdown_field=8e7,
        **{name: value for name, value in film.items() if name != "goals"},
    )
    for row, pre in enumerate(result.prestretch[:, 0].tolist()):
        stretch = np.linspace(pre, pre * result.target[row], 2001)
        across = np.full_like(stretch, pre) if axis_2 else stretch
        stress = 2e5 * (stretch**2 - (stretch * across) ** -2)
        field = np.sqrt(np.maximum(stress - 2e5 * (pre - pre**-5) * stretch, 0) / 2.48e-11)
        voltage = 5e-5 * field / (stretch * across)
        assert result.reached[row] == (YES if field[-1] < 8e7 else FAILS_FIRST)
        if result.reached[row] == YES:
            assert result.voltage[row] == pytest.approx(voltage[-1], rel=1e-6)
            continue
        assert result.because[row] == "breakdown"
        first = np.argmax(field > 8e7)
        broken = np.interp(8e7, field[first - 1 : first + 1], stretch[first - 1 : first + 1])
        assert result.largest[row] == pytest.approx(broken / pre, rel=1e-5)


@pytest.mark.parametrize("film", [{"prestretch": 1.8}, {"prestretch": 1.9, "boundary": "frame", "electrode_share": 0.3}])
@pytest.mark.parametrize("material", [FILM, pytest.param(replace(FILM, breakdown=None), marks=pytest.mark.trust)])
def test_how_far_a_film_comes_does_not_depend_on_where_it_was_to_come(film: dict[str, Any], material: Any) -> None:
    result = design(material, relative_stretch=[2.4, 2.7, 3.0], **GOAL, **film)
    assert set(result.reached) == {FAILS_FIRST}
    assert result.largest == pytest.approx(np.full(3, result.largest[0]), rel=1e-6)


@pytest.mark.trust
def test_a_goal_in_a_range_of_stretches_that_hardly_differ_in_voltage_is_reached() -> None:
    """Without breakdown a film goes from 1.7 to 2.4 times its stretch within 2 % of the voltage, and lives on."""
    goals = [1.7, 1.8, 1.9, 2.0, 2.1, 2.2, 2.3, 2.4]
    result = design(replace(FILM, breakdown=None), relative_stretch=goals, prestretch=1.9, **GOAL)
    assert set(result.reached) == {YES}
    order = np.argsort(result.target)
    assert np.all(np.diff(result.voltage[order]) > 0)
    assert result.largest[order] == pytest.approx(goals, rel=MET)


@pytest.mark.parametrize(
    "film",
    [
        {"prestretch": [1.6, 1.8, 2.0]},
        pytest.param({"prestretch": 1.9, "boundary": "frame", "electrode_share": 0.3}, marks=pytest.mark.trust),
        pytest.param(
            {"prestretch": [[1.7, 1.9], [2.5, 1.2]], "boundary": "strip", "electrode_share": 0.5}, marks=pytest.mark.trust
        ),
        pytest.param({"prestretch": [[1.7, 1.9], [2.5, 1.2]], "boundary": ("dead-load", "clamped")}, marks=pytest.mark.trust),
    ],
)
def test_answers_agree_with_a_sweep_of_voltages(film: dict[str, Any]) -> None:
    """Which films reach the goal, by which voltage, and how long they live under it; mixed goals, some of which no film reaches."""
    goals = [1.05, 1.15, 1.4]
    result = design(FILM, relative_stretch=goals, **GOAL, **film)
    volts = np.linspace(0.0, 1.2e4, 100)
    sweep = failure_map(
        FILM, voltage=volts, horizon=600.0, **(film | {"thickness": 5e-4, "relax": 600.0}), stretch_at={"then": 600.0}
    )
    seen: set[str] = set()
    for row, target in enumerate(result.target):
        (pair,) = np.flatnonzero(np.all(sweep.prestretch == result.prestretch[row], axis=1))
        stretch = sweep.relative_stretch["then"][0, 0, pair]
        slack = None if sweep.time_to_loss_of_tension is None else sweep.time_to_loss_of_tension[0, pair]
        lives = np.isfinite(stretch) & (True if slack is None else ~(slack < 600.0))
        reached = lives & (stretch >= target)
        seen.add(result.reached[row])
        if not reached.any():
            assert result.reached[row] != YES
            assert result.largest[row] == pytest.approx(stretch[lives].max(), abs=0.05)
            continue
        first = int(np.argmax(reached))
        if first == 0:
            assert result.because[row] == "creeps to the goal without a voltage"
            continue
        assert result.reached[row] == YES
        assert volts[first - 1] <= result.voltage[row] <= volts[first]
        assert result.largest[row] == pytest.approx(target, rel=1e-6)
    if "boundary" not in film:
        assert seen == {YES, FAILS_FIRST, OUT_OF_REACH}
    best = int(np.flatnonzero(result.reached == YES)[0])
    one = {"prestretch": [result.prestretch[best]], "boundary": film.get("boundary", "dead-load")}
    one |= {"electrode_share": film["electrode_share"]} if "electrode_share" in film else {}
    life = failure_map(FILM, voltage=result.voltage[best], horizon=86400.0, thickness=5e-4, relax=600.0, **one)
    assert life.time_to_failure.item() == pytest.approx(result.time_to_failure[best], rel=1e-6, nan_ok=True)


def test_goals_that_no_voltage_is_for() -> None:
    """Under dead load a film that was not relaxed creeps by itself; and no stretch is beyond the limit of the springs."""
    creeps = design(FILM, prestretch=1.7, relative_stretch=1.001, **(GOAL | {"relax": 0.0}))
    assert (creeps.reached[0], creeps.because[0]) == (OUT_OF_REACH, "creeps to the goal without a voltage")
    limited = design(FILM, prestretch=1.7, relative_stretch=8.0, **GOAL)
    assert (limited.reached[0], limited.because[0]) == (OUT_OF_REACH, "beyond the limit of its springs")


def test_a_slack_film_around_the_electrode_fails_first() -> None:
    """Barely prestretched in a frame: the voltage pushes the film around the electrode together."""
    film = {"prestretch": 1.05, "boundary": "frame", "electrode_share": 0.3, "breakdown_field": 1e9}
    result = design(FILM, relative_stretch=1.15, **GOAL, **film)
    assert (result.reached[0], result.failure_mode[0]) == (FAILS_FIRST, "loss-of-tension")


def test_the_best_film_is_first() -> None:
    result = design(FILM, prestretch=[1.5, 1.7, 1.9], area_strain=[0.2, 0.5, 3.0], **GOAL)
    for goal in (0.2, 0.5, 3.0):
        own = result.target == goal
        life = np.minimum(np.where(np.isnan(result.life[own]), -1.0, result.life[own]), 1e9)
        assert np.all(np.diff(life) <= 0)
        assert np.all(np.diff(result.voltage[own][life == 1e9]) > 0)
    assert np.all(np.diff(result.target) >= 0)
    names = [column.name for column in result.columns()]
    assert names == [
        "temperature",
        "prestretch_1",
        "prestretch_2",
        "area_strain",
        "voltage",
        "time_to_failure",
        "failure_mode",
        "reached",
    ]
    assert len(result.to_frame()) == 9


def test_every_combination_is_a_film_and_no_film_knows_of_another() -> None:
    axes = {"prestretch": [1.7, 1.9], "thickness": [4e-4, 5e-4], "temperature": [20.0, 30.0]}
    whole = design(FILM, relative_stretch=1.1, **(GOAL | axes))
    assert whole.voltage.size == 8
    for row in (0, 5):
        one = {"prestretch": whole.prestretch[row, 0], "thickness": whole.thickness[row], "temperature": whole.temperature[row]}
        alone = design(FILM, relative_stretch=1.1, **(GOAL | one))
        assert (alone.voltage[0], alone.failure_mode[0]) == (whole.voltage[row], whole.failure_mode[row])
    setup = Film(axes["thickness"], axes["prestretch"], relax=600.0, temperature=axes["temperature"])
    plan = plan_design(FILM, setup, Goal(600.0, 86400.0, 1.1)).relaxed()
    copy = pickle.loads(pickle.dumps(plan))
    solved = [solve_films(copy, *chunk) for chunk in reversed(plan.chunks(size=3))]
    again = designed(under_way(plan, solved), solved, [], DrawIntervals(0.9), 0.05)
    assert np.array_equal(again.voltage, whole.voltage)
    assert np.array_equal(again.time_to_failure, whole.time_to_failure, equal_nan=True)
    # a thinner film of a dead load takes the same field
    thin, thick = whole.thickness == 4e-4, whole.thickness == 5e-4
    assert np.sort(whole.voltage[thin]) / 4e-4 == pytest.approx(np.sort(whole.voltage[thick]) / 5e-4, rel=1e-6)


def test_a_number_of_numpy_holds_for_all_films() -> None:
    # such a number has a method `take` of its own
    goal = Targets.of(Goal(np.float64(600.0), 86400.0, [1.1, 1.2])).take(np.array([1]))
    assert (goal.at, goal.target.tolist()) == (600.0, [1.2])


@pytest.mark.trust
def test_what_draws_tell() -> None:
    """Voltages in proportion to thickness; lives of the draws under the voltage of the design, as a map of them has them."""
    sample = draw_sample([FILM], 40, scatter=FilmScatter(thickness=NormalScatter(0.02), breakdown_field=WeibullScatter(20)))
    film = {"prestretch": [1.7, 1.9]}
    result = design(FILM, relative_stretch=1.2, sample=sample, drawn_rtol=1e-6, **GOAL, **film)
    assert result.drawn is not None
    exact = np.sort(sample.thickness_factor)
    low, high = result.drawn.voltage
    assert low / result.voltage == pytest.approx([exact[1]] * 2, rel=1e-5)  # the second of 40 at a level of 0.9
    assert high / result.voltage == pytest.approx([exact[-2]] * 2, rel=1e-5)
    for row in range(2):
        limit = 4e7 if result.prestretch[row, 0] == 1.7 else 4.8e7
        drawn = {"thickness": 5e-4 * sample.thickness_factor, "breakdown_field": limit * sample.breakdown_factor}
        steps = [VoltageStep(result.voltage[row]), VoltageStep.hold(86400.0)]
        runs = actuate(FILM, steps, prestretch=result.prestretch[row, 0], relax=600.0, **drawn).events
        lives = np.array([min((event.time for event in events), default=np.inf) for events in runs])
        ordered = np.sort(lives)
        assert result.drawn.failure_probability[row] == np.mean(np.isfinite(lives))
        assert result.drawn.safe_life[row] == pytest.approx(ordered[1], rel=1e-5)
        assert result.drawn.time_to_failure[1][row] == pytest.approx(ordered[-2], rel=1e-5)
    setup = Film(5e-4, film["prestretch"], relax=600.0)
    plan = plan_design(FILM, setup, Goal(600.0, 86400.0, [1.2, 9.0]), sample=sample).relaxed()
    plan = under_way(plan, [solve_films(plan, *chunk) for chunk in plan.chunks()])
    parts = [solve_draws(plan, *chunk) for chunk in plan.chunks(drawn=True, size=7)]
    assert sum(part.films.size for part in parts) == 80  # none of a film that has no voltage


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"relative_stretch": 1.0}, "relative_stretch: 1: a relative stretch above 1"),
        ({"relative_stretch": None}, "either a relative_stretch or an area_strain"),
        ({"area_strain": 0.2}, "either a relative_stretch or an area_strain"),
        ({"relative_stretch": None, "area_strain": -0.1}, "area_strain: -0.1"),
        ({"at": 0.0}, "at: 0 s"),
        ({"at": 1e6}, "at: 1e[+]06 s is longer than the horizon"),
        ({"horizon": np.nan}, "horizon"),
        ({"boundary": "clamped"}, "boundary: both axes are clamped"),
        ({"boundary": ("clamped", "dead-load")}, "relative_stretch: axis 1 is clamped"),
        ({"prestretch": []}, "prestretch: a list of numbers or of pairs"),
        ({"thickness": []}, "thickness: a list of numbers, which is not empty"),
        ({"failure_probability": 0.7}, "failure_probability: 0.7"),
        ({"breakdown_field": -1.0}, "breakdown_field"),
    ],
)
def test_bad_designs(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        design(FILM, **(GOAL | {"prestretch": 1.7, "relative_stretch": 1.1} | change))
    with pytest.raises(InputError, match="permittivity"):
        design(replace(FILM, permittivity=None), prestretch=1.7, relative_stretch=1.1, **GOAL)


def test_films_without_a_time_are_in_strips_beyond_the_times() -> None:
    """Nothing in the figure looks like a time that is none."""
    result = design(FILM, prestretch=[1.7, 1.9], relative_stretch=[1.1, 1.2, 1.25, 1.6], **GOAL)
    figure = plot_design(result)
    figure.draw_without_rendering()
    right = figure.axes[1]
    drawn = [line for line in right.lines if line.get_transform() == right.transData and len(line.get_xdata()) > 2]
    times = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in drawn])
    assert set(times[np.isfinite(times)]) == set(result.life[np.isfinite(result.life)])
    assert {text.get_text() for text in right.texts} == {
        "longer than 1 d (marks side by side)",
        "\N{MULTIPLICATION SIGN} fails first (marks side by side)",
    }
    low, high = right.get_ylim()
    ticks = np.concatenate((right.get_yticks(), right.get_yticks(minor=True)))
    assert low * 2 < ticks.min() <= ticks.max() <= 86400.0 < high / 2


@pytest.mark.parametrize(
    ("scatter", "seen"), [({"thickness": NormalScatter(0.05)}, True), ({"breakdown_field": WeibullScatter(20)}, False)]
)
def test_the_legend_names_bars_and_a_frontier_where_they_are_seen(scatter: Any, seen: bool) -> None:
    """Breakdown fields alone give voltages no interval; at one goal alone the lives make no line."""
    sample = draw_sample([FILM], 20, scatter=FilmScatter(**scatter))
    result = design(FILM, prestretch=[1.7, 1.9], relative_stretch=[1.02, 1.2], sample=sample, **GOAL)
    figure = plot_design(result, interval="90 % interval")
    assert any(text.get_text() == "bars: 90 % interval, side by side" for text in figure.legends[0].get_texts()) == seen
    known = {target for target, life in zip(result.target, result.life, strict=True) if 0 < life < np.inf}
    assert len(known) == 1
    assert not any("frontier" in text.get_text() for text in figure.legends[0].get_texts())
    if seen and result.drawn is not None:
        low, high = figure.axes[0].get_ylim()
        assert low < 1e-3 * np.nanmin(result.drawn.voltage[0]) < 1e-3 * np.nanmax(result.drawn.voltage[1]) < high


def test_of_many_films_the_figure_shows_the_best() -> None:
    """One film in nine is the best at each temperature; its line is drawn, and a pair of prestretches has a label without a gap."""
    goal, temperature, prestretch, thickness = (
        axis.ravel() for axis in np.meshgrid([1.1, 1.2], [0.0, 20.0, 40.0], [1.2, 1.5, 1.8], [1e-4, 2e-4, 4e-4], indexing="ij")
    )
    best = (prestretch == 1.5) & (thickness == 2e-4)
    order = np.lexsort([~best, goal])
    count = goal.size
    result = Design(
        temperature=temperature[order],
        prestretch=np.stack([prestretch, np.where(best, 1.1, prestretch)], axis=1)[order],
        thickness=thickness[order],
        electrode_share=None,
        goal="relative_stretch",
        target=goal[order],
        at=60.0,
        horizon=86400.0,
        voltage=np.linspace(1e3, 5e3, count),
        time_to_failure=np.full(count, np.nan),
        failure_mode=np.full(count, "none"),
        reached=np.full(count, YES),
        because=np.full(count, ""),
        largest=goal[order],
        rounds=1,
    )
    labels = [text.get_text() for text in plot_design(result).legends[0].get_texts()]
    assert len(labels) == 8
    assert labels[-1] == "20 more films are not shown"
    for degrees in (0, 20, 40):
        assert f"prestretch 1.5 \N{MULTIPLICATION SIGN} 1.1, {degrees} °C, 0.2 mm" in labels
