"""Events on dense output: roots, dips, first falls, the last row of a run, and criteria from outside."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from films import SOFT
from flat import actuate
from hypothesis import given, strategies as st
from matplotlib.axes import Axes
from numpy.typing import NDArray

from dielast import Ogden
from dielast.base.errors import InputError
from dielast.cli.app import application
from dielast.material.laws_of_cases import FailureLaws
from dielast.material.material import Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.criteria import CRITERIA, named, names
from dielast.mechanics.criteria.breakdown import ElectricalBreakdown
from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal, WatchedFilms
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.criteria.pull_in import PullIn
from dielast.mechanics.load import VoltageStep, Waveform
from dielast.mechanics.point import LoadedPoints
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, Load
from dielast.mechanics.stability import ONE_PERCENT, damped
from dielast.mechanics.watch import EventArrays, Watch
from dielast.numerics.arrays import Floats
from dielast.numerics.roots import fall, samples
from dielast.numerics.rosenbrock import RODAS5P
from dielast.numerics.stride import TriedStep
from dielast.simulate import actuation_history as module
from dielast.simulate.actuation_history import ActuationHistory
from dielast.simulate.events import events_of, first_of
from dielast.simulate.record import Record, ending

Array = NDArray[np.float64]


@given(st.lists(st.floats(1e-6, 1 - 1e-6), min_size=1, max_size=5), st.sampled_from([1.0, 3.0, 5.0]))
def test_falls_are_found_to_rounding(roots: list[float], power: float) -> None:
    wanted = np.array(roots)

    def signal(fraction: Array) -> Array:
        return np.sign(wanted - fraction) * np.abs(wanted - fraction) ** power + 0.1 * (wanted - fraction)

    assert fall(signal, np.zeros_like(wanted), np.ones_like(wanted)) == pytest.approx(wanted, abs=2e-13)


def test_a_column_does_not_depend_on_its_company() -> None:
    wanted = np.linspace(0.01, 0.99, 37)

    def signal(part: Array) -> Callable[[Array], Array]:
        return lambda fraction: np.cos(np.pi / 2 * fraction / part)

    together = fall(signal(wanted), np.zeros(37), np.ones(37) * np.minimum(2 * wanted, 1))
    apart = np.concatenate([fall(signal(w), np.zeros(1), np.minimum(2 * w, 1)) for w in wanted[:, None]])
    assert np.array_equal(together, apart)


def watched(
    monkeypatch: pytest.MonkeyPatch, margin: Callable[[Array], Array], stop_at: str = "pull-in", rtol: float = 1e-4
) -> ActuationHistory:
    """A film whose margin is a given function of time."""
    from dielast.simulate import actuation_history as module

    class Prescribed(PullIn):
        def signal(self, films: WatchedFilms) -> Signal:
            return lambda moment: np.asarray(margin(moment.age))  # the voltage rises at 0 s

    monkeypatch.setattr(module, "CRITERIA", [Prescribed()])
    return actuate(
        SOFT, [VoltageStep(2e3), VoltageStep.hold(1e4)], thickness=5e-4, prestretch=1.5, relax=10.0, stop_at=stop_at, rtol=rtol
    )


@pytest.mark.parametrize("width", [1e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("at", [47.1, 300.0, 1234.5])
def test_a_pair_of_crossings_within_a_step_is_not_stepped_over(monkeypatch: pytest.MonkeyPatch, at: float, width: float) -> None:
    history = watched(monkeypatch, lambda time: 0.1 * np.minimum((time / at - 1) ** 2 - width**2, 1.0))
    assert history.events[0][0].time == pytest.approx(at * (1 - width), rel=1e-9)


def test_the_first_of_three_crossings_counts() -> None:
    def signal(fraction: Array) -> Array:
        return np.asarray(-(fraction - 0.3) * (fraction - 0.6) * (fraction - 0.9))

    values, fractions = samples(signal, signal(np.zeros(1)), signal(np.ones(1)))
    first = int(np.argmax(values[:, 0] <= 0))
    assert fall(signal, fractions[first - 1], fractions[first])[0] == pytest.approx(0.3, abs=1e-12)


def test_a_dip_that_stays_above_zero_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    history = watched(monkeypatch, lambda time: np.minimum((time / 47 - 1) ** 2 + 1e-6, 1.0))
    assert not history.events[0]
    assert history.outcome[0].completed


def test_what_has_fallen_when_it_begins_happens_then(monkeypatch: pytest.MonkeyPatch) -> None:
    history = watched(monkeypatch, lambda time: -np.ones_like(time))
    assert history.events[0][0].time == 0.0
    assert history.outcome[0].reason == "pull-in"


def test_a_dip_from_far_above_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    # a pair of crossings far below the margin at the ends of its step, as steps at 1e-2 are long enough to hold
    def margin(time: Array) -> Array:
        return np.asarray(np.minimum(2.0 * ((time / 300.0 - 1) ** 2 - 0.01), 0.9))

    assert [event.name for event in watched(monkeypatch, margin, rtol=1e-2).events[0]] == ["pull-in"]


def test_of_events_at_one_time_the_first_is_at_the_lowest_voltage() -> None:
    def at(time: float, field: float) -> EventArrays:
        return EventArrays(
            np.array([time]), np.array([field]), *np.zeros((2, 2, 1)), np.zeros(1), np.zeros((0, 1)), *np.zeros((2, 1))
        )

    happened = {ElectricalBreakdown(): at(2.0, -8e6), LossOfTension(0): at(2.0, -7e6), LossOfTension(1): at(2.0, -6e6)}
    names = ["breakdown", "loss-of-tension"]
    assert first_of(happened, names).field.tolist() == [-6e6]
    assert first_of(happened, ["breakdown"]).field.tolist() == [-8e6]
    assert first_of({**happened, PullIn(): at(1.0, -9e6)}, [*names, "pull-in"]).time.tolist() == [1.0]
    found = events_of(happened, 0, 1e-3, 2.0)
    assert [(event.name, event.voltage) for event in found] == [("loss-of-tension", -6e3), ("breakdown", -8e3)]


AT, WIDTH = 300.0, 1e-3


def dips(fraction: Array) -> Array:
    """Five signals: a dip below zero, a dip above it, a plain fall, nothing at all, and a dip whose bottom is at a sample."""
    f = np.broadcast_to(fraction, (5,))
    return np.stack(
        (((f[0] - 0.37) / 0.3) ** 2 - 1e-4, ((f[1] - 0.6) / 0.5) ** 2 + 0.01, 0.7 - f[2], 1 + 0 * f[3], (f[4] - 0.5) ** 2 - 1e-6)
    )


def test_samples_follow_each_dip_to_its_bottom_and_leave_the_rest_alone() -> None:
    values, fractions = samples(dips, dips(np.zeros(5)), dips(np.ones(5)))
    assert fractions[[0, -1]].tolist() == [[0.0] * 5, [1.0] * 5]
    assert np.array_equal(values, np.stack([dips(row) for row in fractions]))
    assert np.all(np.diff(fractions, axis=0) > 0)
    assert values[:, 0].min() == pytest.approx(-1e-4, abs=1e-7)
    assert fractions[values[:, 0].argmin(), 0] == pytest.approx(0.37, abs=1e-3)
    assert values[:, 1].min() == pytest.approx(0.01, abs=1e-7)
    assert fractions[values[:, 1].argmin(), 1] == pytest.approx(0.6, abs=1e-3)
    for column in (2, 3):
        assert fractions[:, column].tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert values[2, 4] == -1e-6
    for column in range(5):
        one = samples(lambda f, c=column: dips(f)[c : c + 1], dips(np.zeros(5))[[column]], dips(np.ones(5))[[column]])
        assert np.array_equal(one[0][:, 0], values[:, column])
        assert np.array_equal(one[1][:, 0], fractions[:, column])


def test_a_root_at_the_edge_or_found_by_chance_is_exact() -> None:
    def signal(fraction: Array) -> Array:
        return np.array([0.5, 1.0, 0.75]) - fraction

    assert fall(signal, np.zeros(3), np.ones(3)) == pytest.approx([0.5, 1.0, 0.75], abs=1e-15)


class SixPrescribed(PullIn):
    """Six films whose margin is a given function of time: at AT it dips below zero, or only near it, or falls to it, or keeps near
    zero or far from it, or falls from far above to just below.
    """

    def signal(self, films: WatchedFilms) -> Signal:
        def margin(moment: FilmSnapshot) -> Array:
            x = moment.age / AT - 1  # the voltage rises at 0 s
            dip = 0.1 * np.minimum(x**2, 1.0)
            falling, sudden = 0.1 * np.clip(-x, -1, 1), np.clip(-1e6 * x, -0.01, 1.0)
            signals = dip - 0.1 * WIDTH**2, dip + 1e-6, falling, np.full_like(x, 0.1), 1 + 0 * x, sudden
            return np.choose(moment.cases, signals)

        return margin


@pytest.mark.parametrize("voltage", [2e3, 2.2e3])
def test_one_case_dips_while_others_do_not(monkeypatch: pytest.MonkeyPatch, voltage: float) -> None:
    monkeypatch.setattr(module, "CRITERIA", [SixPrescribed()])
    programme = [VoltageStep(voltage), VoltageStep.hold(1e3)]
    history = actuate(
        SOFT, programme, thickness=np.full(6, 5e-4), prestretch=1.5, relax=10.0, stop_at="pull-in", rtol=1e-4, points_per_decade=5
    )
    assert [len(events) for events in history.events] == [1, 0, 1, 0, 0, 1]
    assert history.events[0][0].time == pytest.approx(AT * (1 - WIDTH), rel=1e-9)
    assert history.events[2][0].time == pytest.approx(AT, rel=1e-9)
    assert history.events[5][0].time == pytest.approx(AT, rel=1e-9)
    assert [outcome.time for outcome in history.outcome] == pytest.approx([AT * (1 - WIDTH), 1e3, AT, 1e3, 1e3, AT])


@dataclass(frozen=True, eq=False)
class Parabolas(PullIn):
    """Margins over a step from 0 to 1 s, one a case: parabolas that dip to `-depth` at `bottom`; both `ends` together are given."""

    bottom: Array
    depth: float
    ends: float

    @property
    def curvature(self) -> Array:
        return np.asarray(self.ends / (self.bottom**2 + (1 - self.bottom) ** 2))

    def signal(self, films: WatchedFilms) -> Signal:
        return lambda moment: self.curvature[moment.cases] * (moment.age - self.bottom[moment.cases]) ** 2 - self.depth


@pytest.mark.parametrize("depth", [1e-5, -1e-5])
@pytest.mark.parametrize("ends", [0.29, 3.0])
@pytest.mark.parametrize("bottom", [np.linspace(0.03, 0.97, 48), np.array([0.2, 0.3]), np.array([0.7, 0.8])])
def test_a_parabola_that_dips_below_zero_is_found_wherever_it_does(bottom: Array, depth: float, ends: float) -> None:
    parabolas = Parabolas(bottom, depth, ends)
    count = bottom.size
    solid = Material("soft", 26e3, Spectrum([1.0], [1e5]), NoShift(20.0), Gent(110.0), Gent(55.0), permittivity=4e-11)
    controls, zero, one, every = (Control.STRESS, Control.STRESS), np.zeros(count), np.ones(count), np.arange(count)
    points = damped(PointMaterial.of(solid, np.full(count, 20.0), 1e-4))
    system = LoadedPoints(points, Load.between(controls, np.zeros((3, count)), np.zeros((3, count)), one))
    state = np.zeros((2 * len(points.modulus) + 2, count))
    films = WatchedFilms(controls, FailureLaws(np.full(count, np.inf)), ONE_PERCENT, np.zeros((2, count)), points.stress_floor)
    watch = Watch(films, [parabolas], ["pull-in"])
    watch.begin(system, state, zero, every >= 0)
    increments = np.zeros((RODAS5P.stages, *state.shape))
    steps = zero, one, one, state, state, increments, 0 * every, zero, one, one
    over = watch(TriedStep(system, RODAS5P, every, every >= 0, *steps))
    watch.finish(lambda cases, load: LoadedPoints(points.take(cases), load))
    time = watch.happened[parabolas].time
    if depth > 0:
        assert time == pytest.approx(bottom - np.sqrt(depth / parabolas.curvature), abs=1e-12)
        assert over is not None
        assert over.all()
    else:
        assert np.isnan(time).all()
        assert over is None


COLUMNS = ("voltage", "stretch_1", "stretch_2", "relative_stretch_1", "nominal_stress_1", "nominal_stress_2", "true_field")
LATER = [VoltageStep(2e3, duration=10.0), VoltageStep.hold(100.0), VoltageStep(3.6e3), VoltageStep.hold(5e3)]
run = partial(actuate, SOFT, steps=LATER, thickness=5e-4, prestretch=1.9, relax=600.0, breakdown_field=4.8e7)


def last(history: ActuationHistory, case: int = 0) -> dict[str, float]:
    row = int(np.flatnonzero(np.isfinite(history.stretch_1[case]))[-1])
    return {name: float(getattr(history, name)[case, row]) for name in (*COLUMNS, "time", "stability")}


@pytest.mark.parametrize(
    ("stop_at", "boundary", "voltage"),
    [
        ("breakdown", "dead-load", 3.6e3),
        pytest.param("breakdown", ("dead-load", "clamped"), 5e3, marks=pytest.mark.trust),
        ("pull-in", "dead-load", 5.5e3),
    ],
)
def test_the_last_row_is_the_state_at_the_stop(stop_at: str, boundary: str | tuple[str, str], voltage: float) -> None:
    steps = [*LATER[:2], VoltageStep(voltage), LATER[3]]
    stopped = partial(run, steps=steps, stop_at=stop_at, boundary=boundary)
    fine = stopped(points_per_decade=7)
    (event,) = [event for event in fine.events[0] if event.name == stop_at]
    given = run(steps=steps, stop_at="end", boundary=boundary, times=[event.time])
    for points_per_decade in (1, 50):
        history = stopped(points_per_decade=points_per_decade)
        assert history.events == fine.events
        row = last(history)
        assert row["time"] == event.time == history.outcome[0].time
        for name in ("voltage", "stretch_1", "stretch_2", "true_field"):
            assert row[name] == pytest.approx(getattr(event, name), rel=1e-12), name
        assert event.time > 110
        # after it there is nothing, before it the rows that were there anyway
        reached = np.isfinite(history.stretch_1[0])
        assert np.all(np.diff(history.time[0][reached])[-2:] > 0)
        assert np.all(np.diff(history.time[0]) >= 0)
        for name, value in last(fine).items():
            assert row[name] == pytest.approx(value, rel=1e-9, abs=1e-300), name
        # and all its numbers are those of the dense output there
        for name in COLUMNS:
            assert row[name] == pytest.approx(float(getattr(given, name)[0, 0]), rel=2e-5), name
        if stop_at == "pull-in":
            assert row["stability"] == 0
        else:
            assert row["stability"] == pytest.approx(float(given.stability[0, 0]), rel=1e-5)


@pytest.mark.trust
def test_a_case_has_the_same_end_alone_and_among_others() -> None:
    fields = np.array([4.0e7, 4.8e7, 9e9])
    together = run(breakdown_field=fields)
    assert [outcome.reason for outcome in together.outcome] == ["breakdown", "breakdown", ""]
    for case, field in enumerate(fields):
        assert last(run(breakdown_field=field)) == last(together, case)


def test_listed_times_stay_as_they_are_unless_the_end_is_wanted() -> None:
    whole = run()
    end = whole.outcome[0].time
    times = [1.0, 50.0, 200.0, 4000.0]
    assert 200 < end < 4000
    listed = run(times=times)
    np.testing.assert_array_equal(listed.time[0], times)
    assert np.isfinite(listed.stretch_1[0]).tolist() == [True, True, True, False]
    ended = run(times=times, with_end=True)
    assert ended.time[0].tolist() == [1.0, 50.0, 200.0, end]
    assert last(ended) == last(whole)
    bare = run(with_end=False)
    assert last(bare)["time"] < end


def test_a_film_that_fails_at_once_has_one_row() -> None:
    history = run(steps=[VoltageStep(1.5e4), VoltageStep.hold(10.0)])
    assert history.outcome[0].time == 0
    assert np.count_nonzero(np.isfinite(history.stretch_1[0])) == 1
    event = history.events[0][0]
    row = last(history)
    assert row["voltage"] == event.voltage < 1.5e4
    assert row["true_field"] == pytest.approx(4.8e7, rel=1e-6)
    assert row["stretch_1"] == event.stretch_1 > 1.9
    # the dead load is held on the way
    assert row["nominal_stress_1"] == pytest.approx(last(run())["nominal_stress_1"], rel=1e-12)


def test_a_jump_later_on_keeps_the_row_before_it() -> None:
    steps = [VoltageStep(2e3), VoltageStep.hold(10.0), VoltageStep(1.5e4), VoltageStep.hold(10.0)]
    history = run(steps=steps)
    assert history.outcome[0].time == 10
    reached = np.isfinite(history.stretch_1[0])
    assert history.time[0][reached][-2:].tolist() == [10.0, 10.0]
    before, after = history.voltage[0][reached][-2:]
    assert before == pytest.approx(2e3)
    assert 2e3 < after < 1.5e4


def test_rows_of_one_time_are_not_doubled() -> None:
    time, values = np.array([[1.0, 2.0, 3.0, 4.0]] * 4), np.arange(16.0).reshape(1, 4, 4)
    values[0, 1, 2:] = values[0, 2, :] = values[0, 3, 3] = np.nan
    reached = np.array([4.0, 2.0, 0.5, 3.5])
    at_end = np.array([[np.nan, 50.0, 60.0, 70.0]])
    ended = ending(Record(time, values), reached, at_end)
    assert ended.time.tolist() == [[1, 2, 3, 4], [1, 2, 3, 4], [0.5, 2, 3, 4], [1, 2, 3, 3.5]]
    np.testing.assert_array_equal(
        ended.values[0], [[0, 1, 2, 3], [4, 50, np.nan, np.nan], [60, np.nan, np.nan, np.nan], [12, 13, 14, 70]]
    )
    assert time[3, 3] == 4  # what came in is left alone


@pytest.mark.parametrize("field", [(1e7, 9e9), (9e9, 1e7), (1e7, 1e7)])
def test_films_that_fail_before_a_waveform_have_no_cycles(field: tuple[float, float]) -> None:
    """Films with equal and with different axes are solved apart; none, one or both of them come to the waveform."""
    steps = [VoltageStep(2.9e3, duration=1.0), VoltageStep(Waveform(0.0, 3e3, 10.0, 2))]
    lateral = np.array([1.9, 1.5])
    together = run(steps=steps, prestretch=(np.full(2, 1.9), lateral), breakdown_field=np.array(field))
    assert together.cycles is not None
    for case in range(2):
        alone = run(steps=steps, prestretch=(1.9, float(lateral[case])), breakdown_field=field[case])
        assert np.isfinite(together.cycles.mean[case]).tolist() == [field[case] > 1e8] * 2
        for header, values in alone.case(0).items():
            np.testing.assert_array_equal(together.case(case)[header], values, err_msg=header)
        assert together.outcome[case] == alone.outcome[0]


LARGEST = 1.6

MATERIAL = """
name = "soft"
reference_temperature = "20 degC"
[equilibrium]
shear_modulus = "26 kPa"
J_lim = 110.0
[nonequilibrium]
J_lim = 55.0
relaxation_time_s = [1e4, 1.0]
shear_modulus_Pa = [1e4, 9e4]
[shift]
law = "none"
[dielectric]
permittivity = "4e-11 F/m"
[breakdown]
prestretch = [1.5]
field = ["500 MV/m"]
"""

FILM = 'material = "soft.toml"\n[film]\nthickness = "0.5 mm"\nprestretch = 1.5\nrelax = "10 min"\n'
ACTUATE = f'kind = "actuate"\n{FILM}[[step]]\nvoltage = "4 kV"\nduration = "1 s"\n[[step]]\nhold = "1 h"\n'
GRID = FILM.replace("= 1.5", "= [1.5, 1.51, 1.52, 1.53, 1.54]")
MAP = f'kind = "failure-map"\nhorizon = "1 h"\n{GRID}[voltage]\nfrom = "1 kV"\nto = "4 kV"\npoints = 5\n'


class Overstretched(Criterion):
    """The film is stretched further than a stiff electrode follows."""

    name: ClassVar[str] = "overstretched"
    marker: ClassVar[str] = "D"

    def signal(self, films: WatchedFilms) -> Signal:
        def left(moment: FilmSnapshot) -> Floats:
            return LARGEST - np.exp(0.5 * np.max(moment.log_squared_stretch, axis=0))

        return left


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "soft.toml").write_text(MATERIAL)
    CRITERIA.append(Overstretched())
    yield tmp_path
    CRITERIA.pop()


def run_recipe(folder: Path, kind: str, recipe: str) -> list[dict[str, str]]:
    """Run a recipe; the rows of its table of events, or of its map."""
    (folder / "recipe.toml").write_text(recipe)
    assert not application(kind)([kind, "recipe.toml", "-o", "out", "-q"], standalone_mode=False)
    with (folder / "out" / ("events.csv" if kind == "actuate" else "failure-map.csv")).open() as file:
        return list(csv.DictReader(file))


def test_a_criterion_from_outside_has_its_event_and_its_mark(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    markers: list[str] = []
    plot = Axes.plot
    monkeypatch.setattr(
        Axes, "plot", lambda self, *at, **look: (markers.append(str(look.get("marker"))), plot(self, *at, **look))[1]
    )
    events = run_recipe(folder, "actuate", ACTUATE + '[stop]\nat = "overstretched"\n')
    assert [event["event"] for event in events] == ["overstretched"]
    assert float(events[0]["stretch_1 [1]"]) == pytest.approx(LARGEST, rel=1e-8)
    assert "D" in markers
    assert "\n[overstretched]\ncases = " in (folder / "out" / "summary.toml").read_text()


def test_a_criterion_from_outside_is_a_failure_mode_of_maps(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named: list[str] = []
    legend = Axes.legend
    monkeypatch.setattr(
        Axes,
        "legend",
        lambda self, *at, **look: (named.extend(one.get_label() for one in look.get("handles", ())), legend(self, *at, **look))[1],
    )
    survives, *_, fails = run_recipe(folder, "failure-map", MAP)
    assert (survives["failure_mode"], fails["failure_mode"]) == ("none", "overstretched")
    assert survives["time_to_overstretched [s]"] == ""
    assert float(fails["time_to_overstretched [s]"]) == float(fails["time_to_failure [s]"])
    assert float(fails["time_to_failure [s]"]) < 3600.0
    assert "overstretched first" in named


def test_a_run_stops_at_the_event_of_any_name() -> None:
    film = {"thickness": 5e-4, "prestretch": (2.0, 1.5), "relax": 600.0, "boundary": "clamped", "breakdown_field": 1e12}
    programme = [VoltageStep(2e4, duration=1.0), VoltageStep.hold(10.0)]
    history = actuate(SOFT, programme, stop_at="loss-of-tension", **film)
    (event,) = history.events[0]
    assert (event.name, history.outcome[0].reason) == ("loss-of-tension", "loss-of-tension")
    assert history.outcome[0].time == event.time == history.time[0, np.isfinite(history.stretch_1[0])][-1]
    # by default, and up to breakdown, too: beyond it the film would wrinkle, whether a passive part or held edges lose tension
    for stop in (None, "breakdown"):
        assert actuate(SOFT, programme, stop_at=stop, **film).outcome == history.outcome
    assert actuate(SOFT, programme, stop_at="end", **film).outcome[0].time == 11.0
    with pytest.raises(InputError, match=f"it must be one of {', '.join(names())}, end"):
        actuate(SOFT, programme, stop_at="wrinkling", **film)


def test_a_tension_that_a_voltage_applied_at_once_takes_away_is_lost_at_once() -> None:
    film = {"thickness": 5e-4, "prestretch": (2.0, 1.5), "relax": 600.0, "boundary": "clamped", "breakdown_field": 1e12}
    history = actuate(SOFT, [VoltageStep(2e4), VoltageStep.hold(10.0)], stop_at="end", **film)
    assert [(event.name, event.time) for event in history.events[0]] == [("loss-of-tension", 0.0)]


def test_a_criterion_that_there_is_not_is_refused() -> None:
    assert named("pull-in").name == "pull-in"
    with pytest.raises(InputError, match='"pullin": criterion: did you mean "pull-in"'):
        named("pullin")


def test_the_stability_of_a_film_that_starts_unstable_is_negative() -> None:
    """Under equal dead loads, W = 8 sum l^(1/2) is unstable to unequal stretches beyond 2^(2/3): W11 - W12 = 4/l^3 - 2/l^1.5."""
    law = Ogden((4.0,), (0.5,))
    weak = replace(SOFT, equilibrium_law=law, spectrum=Spectrum(np.array([1.0]), np.array([1.0])))
    film = {"thickness": 5e-4, "prestretch": 2.0, "relax": 600.0, "boundary": "dead-load", "stop_at": "end"}
    history = actuate(weak, [VoltageStep(1.0, duration=1.0)], **film)
    assert history.stability[0, 0] == pytest.approx(-1.0)
