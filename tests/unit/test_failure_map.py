"""Maps of voltages and films: who fails when and of what, against single films, also of draws, and what is refused."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flat import actuate, creep, design, failure_map, plan_failure_map, relax

from dielast.base.errors import InputError
from dielast.material.material import NEO_HOOKEAN, Breakdown, Material
from dielast.material.scatter import Sample
from dielast.material.shift import WLF, NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.load import Step, Track, VoltageStep
from dielast.numerics.integrate import Status
from dielast.simulate.failure_map import assembled, solve_map
from dielast.simulate.map_plan import SolvedCells, solve_cells

SOLID = Material(
    "soft",
    26e3,
    Spectrum(np.array([1e4, 100.0, 1.0]), np.array([1e4, 2e4, 9e4])),
    NoShift(20.0),
    Gent(110.0),
    Gent(55.0),
    4e-11,
    Breakdown((1.7, 1.9), (40e6, 48e6)),
)
FILM: dict[str, Any] = {"thickness": 5e-4, "relax": 600.0}
MAP: dict[str, Any] = {"voltage": [1e3, 3.9e3, 2e4], "prestretch": [1.7, 1.9], "horizon": 3600.0, **FILM}
STEPS = [VoltageStep(3e3), VoltageStep.hold(10.0)]


def test_a_map_knows_who_survives_who_fails_and_who_was_broken_on_arrival() -> None:
    done: list[tuple[int, int]] = []
    result = solve_map(plan_failure_map(SOLID, **MAP), lambda solved, cells: done.append((solved, cells)))[0]
    assert result.time_to_failure.shape == (1, 2, 3)
    assert result.completed
    assert result.failure_mode[0, 0].tolist() == ["none", "breakdown", "breakdown"]
    assert np.isnan(result.time_to_failure[0, :, 0]).all()
    assert np.all(result.time_to_failure[0, :, 2] == 0)
    assert np.all(result.time_to_pull_in[0, :, 2] == 0)
    assert done == [(6, 6)]


def test_films_that_run_away_after_pull_in_are_not_given_up_where_nothing_else_can_happen() -> None:
    """A neo-Hookean film beyond pull-in stretches without bounds in a finite time, long before the horizon."""
    springs = replace(SOLID, equilibrium_law=NEO_HOOKEAN, nonequilibrium_law=NEO_HOOKEAN, breakdown=None)
    result = failure_map(springs, **MAP)
    assert result.completed
    assert set(result.failure_mode[0, :, 1:].ravel().tolist()) == {"pull-in"}


@pytest.mark.parametrize("field", [2e7, 4.8e7])
def test_of_failures_at_once_the_mode_is_the_one_at_the_lower_voltage(field: float) -> None:
    # an elastic film breaks down before pull-in at 20 MV/m, and pulls in first at 48 MV/m, though both happen at 0 s
    elastic, volts = replace(SOLID, spectrum=Spectrum([], [])), [1e3, 1e4, 3e4]
    film: dict[str, Any] = {"prestretch": 1.0, "thickness": 5e-4, "breakdown_field": field}
    result = failure_map(elastic, voltage=volts, horizon=10.0, **film)
    steps = [VoltageStep(volts), VoltageStep.hold(10.0)]
    events = actuate(elastic, steps, stop_at="end", **film).events
    assert [event.name for event in events[2]] == (["breakdown", "pull-in"] if field < 3e7 else ["pull-in", "breakdown"])
    assert [event.time for event in events[2]] == [0.0, 0.0]
    assert result.failure_mode[0, 0].tolist() == [of_film[0].name if of_film else "none" for of_film in events]


def test_the_unit_of_work_can_be_sent_to_another_process() -> None:
    plan = plan_failure_map(SOLID, **MAP)
    copy = pickle.loads(pickle.dumps(plan))
    for first, end in plan.chunks(4):
        one, other = solve_cells(plan, first, end), pickle.loads(pickle.dumps(solve_cells(copy, first, end)))
        assert list(one.times) == list(other.times) == ["breakdown", "pull-in"]
        for name, times in one.times.items():
            assert np.array_equal(times, other.times[name], equal_nan=True)


def test_a_cell_that_the_numerics_cannot_finish_is_no_survivor() -> None:
    plan = plan_failure_map(SOLID, **MAP)
    nothing = np.full(6, np.nan)
    status = np.array([Status.COMPLETED, Status.STEP_VANISHED, Status.TOO_MANY_STEPS] * 2)
    broken = np.array([np.nan, np.nan, 5.0, np.nan, np.nan, 7.0])
    mode = np.where(np.isnan(broken), "none", "breakdown")
    (result,) = assembled(plan, [SolvedCells({"breakdown": broken, "pull-in": nothing}, mode, status)])
    assert result.failure_mode[0, 0].tolist() == ["none", "unfinished", "breakdown"]
    assert not result.completed
    assert result.outcome[0, 0, 1] != "completed"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"horizon": 0.0}, "horizon: 0 s"),
        ({"voltage": []}, "voltage: a list of numbers, which is not empty"),
        ({"voltage": [-1.0]}, "must not be negative"),
        ({"prestretch": []}, "not empty"),
        ({"prestretch": [0.9]}, "prestretch: 0.9"),
        ({"prestretch": [6.0], "breakdown_field": 1e7}, "beyond the Gent limit"),
        ({"thickness": -1e-4}, "thickness: -0.0001 m"),
        ({"breakdown_field": [1e7, 2e7, 3e7]}, "breakdown_field: 3 fields for 2 prestretches"),
        ({"breakdown_field": 0.0}, "breakdown_field: 0 V/m"),
        ({"ramp": 1e5}, "ramp: 100000 s"),
        ({"temperature": []}, "temperature: a list of numbers"),
        ({"relax": -1.0}, "must not be negative"),
        ({"boundary": "glued"}, "dead-load or clamped"),
        ({"prestretch_rate": 0.0}, "must be positive"),
        ({"rtol": 0.5}, "rtol"),
    ],
)
def test_bad_maps(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        failure_map(SOLID, **(MAP | change))


@pytest.mark.parametrize(
    ("steps", "change", "message"),
    [
        ([], {}, "at least one step"),
        ([VoltageStep(1e3, rate=1.0, duration=2.0)], {}, "not both"),
        ([VoltageStep(np.array([1e3, 2e3]))], {"prestretch": np.array([1.7, 1.8, 1.9])}, "2 and 3 values"),
        (STEPS, {"stop_at": "never"}, "stop_at: 'never'"),
        (STEPS, {"times": [20.0]}, "after the end"),
        (STEPS, {"boundary": ("clamped",)}, "text or a pair of names is needed"),
    ],
)
def test_bad_programmes(steps: list[VoltageStep], change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        actuate(SOLID, steps, **(FILM | {"prestretch": 1.9} | change))


def test_materials_that_cannot_be_driven() -> None:
    with pytest.raises(InputError, match="no permittivity"):
        actuate(replace(SOLID, permittivity=None), STEPS, prestretch=1.9, **FILM)
    without = replace(SOLID, breakdown=None)
    for material, stop_at in ((without, "breakdown"), ([SOLID, without], None)):
        with pytest.raises(InputError, match=f"stop_at: material {SOLID.name!r} has no breakdown field".replace("'", '"')):
            actuate(material, STEPS, prestretch=1.9, stop_at=stop_at, **FILM)


@pytest.mark.trust
def test_films_without_a_breakdown_field_end_by_pull_in() -> None:
    """As films of a field that they never come to."""
    without, never = replace(SOLID, breakdown=None), replace(SOLID, breakdown=Breakdown((1.0,), (1e12,)))
    steps = [VoltageStep(8e3, rate=100.0)]
    first = actuate(without, steps, prestretch=1.9, **FILM)
    assert first.outcome == actuate(never, steps, prestretch=1.9, stop_at="pull-in", **FILM).outcome
    assert [first.outcome[0].reason, *(event.name for event in first.events[0])] == ["pull-in", "pull-in"]
    maps = [failure_map(material, **MAP) for material in (without, never)]
    assert np.isnan(maps[0].time_to_breakdown).all()
    assert np.isinf(maps[0].breakdown_field).all()
    np.testing.assert_array_equal(maps[0].time_to_pull_in, maps[1].time_to_pull_in)
    assert maps[0].failure_mode.tolist() == maps[1].failure_mode.tolist()
    goal = {"at": 60.0, "horizon": 1e6, "prestretch": 1.9, "relative_stretch": [1.05, 3.0], **FILM}
    designs = [design(material, **goal) for material in (without, never)]
    assert [each.failure_mode.tolist() for each in designs] == [["none", "pull-in"]] * 2
    np.testing.assert_array_equal(designs[0].voltage, designs[1].voltage)


@pytest.mark.parametrize(
    ("boundary", "voltage", "horizon"),
    [
        (("dead-load", "clamped"), 9e3, 60.0),
        pytest.param("clamped", 1e4, 7200.0, marks=pytest.mark.trust),
        pytest.param(("clamped", "dead-load"), 9e3, 7200.0, marks=pytest.mark.trust),
    ],
)
def test_a_held_axis_that_goes_slack_is_known_to_the_map(boundary: Any, voltage: float, horizon: float) -> None:
    film: dict[str, Any] = {**FILM, "boundary": boundary, "breakdown_field": 1e9}
    result = failure_map(SOLID, voltage=[1e3, voltage], prestretch=[1.3], horizon=horizon, **film)
    assert result.time_to_loss_of_tension is not None
    at_rest, slack = result.time_to_loss_of_tension[0, 0]
    steps = [VoltageStep(voltage), VoltageStep.hold(horizon)]
    events = actuate(SOLID, steps, prestretch=1.3, stop_at="end", **film).events[0]
    event = next(event for event in events if event.name == "loss-of-tension")
    assert np.isnan(at_rest)
    assert slack == pytest.approx(event.time, rel=1e-6)
    assert "time_to_loss_of_tension [s]" in result.to_frame().columns


def test_under_dead_loads_no_tension_is_lost() -> None:
    assert failure_map(SOLID, **MAP).time_to_loss_of_tension is None


def test_a_table_of_voltages() -> None:
    history = actuate(
        SOLID, [VoltageStep(Track([0.0, 1.0, 3.0], [500.0, 1e3, 0.0]))], prestretch=1.9, times=[0.0, 0.5, 1.0, 2.0, 3.0], **FILM
    )
    assert history.voltage[0] == pytest.approx([500.0, 750.0, 1e3, 500.0, 0.0])
    with pytest.raises(InputError, match="goes back in time"):
        Track([0.0, 2.0, 1.0], [0.0, 1.0, 2.0])


def test_an_axis_left_free_is_uniaxial_prestretch() -> None:
    history = actuate(SOLID, [VoltageStep.hold(10.0)], prestretch=(2.0, None), times=[0.0], breakdown_field=1e9, **FILM)
    assert history.stretch_2[0, 0] == pytest.approx(2**-0.5, rel=1e-5)
    assert history.nominal_stress_2[0, 0] == 0


SHIFTED = Material(
    "soft",
    26e3,
    Spectrum(np.array([1e3, 30.0, 1.0]), np.array([1e4, 2e4, 9e4])),
    WLF(20.0, 13.7, 187.1),
    Gent(110.0),
    Gent(55.0),
    4e-11,
    Breakdown((1.5, 2.0), (40e6, 52e6)),
)

STIFF = replace(SHIFTED, equilibrium_modulus=40e3)

RAMPED: dict[str, Any] = {
    "voltage": [2.5e3, 4.2e3, 6e3],
    "prestretch": [(1.6, 1.6), (1.9, 1.7)],
    "temperature": [20.0, 30.0],
    "relax": 300.0,
    "prestretch_rate": 0.1,
    "horizon": 3600.0,
    "ramp": 5.0,
}


@pytest.mark.parametrize("field", [pytest.param(None, marks=pytest.mark.trust), [44e6, 46e6]])
def test_a_draw_is_the_map_of_what_was_drawn(field: Any) -> None:
    sample = Sample((STIFF, SHIFTED), np.array([0.9, 1.1]), np.array([1.05, 0.8]))
    main, *drawn = solve_map(plan_failure_map(SHIFTED, thickness=5e-4, breakdown_field=field, rtol=1e-6, sample=sample, **RAMPED))
    known = SHIFTED.breakdown
    assert known is not None
    assert np.isfinite(main.time_to_failure).any()
    assert not np.isfinite(main.time_to_failure).all()
    for index, result in enumerate(drawn):
        factor = float(sample.breakdown_factor[index])
        scaled = Breakdown(known.prestretch, tuple(factor * value for value in known.field))
        own = scaled if field is None else factor * np.asarray(field)
        thick = 5e-4 * float(sample.thickness_factor[index])
        alone = failure_map(sample.materials[index], thickness=thick, breakdown_field=own, rtol=1e-6, **RAMPED)
        assert np.array_equal(result.failure_mode, alone.failure_mode)
        for name in ("time_to_breakdown", "time_to_pull_in", "time_to_failure"):
            # draws are computed more loosely
            np.testing.assert_allclose(getattr(result, name), getattr(alone, name), rtol=2e-3, err_msg=name)


def test_a_cell_of_a_map_is_a_film_under_that_voltage() -> None:
    result = failure_map(SHIFTED, thickness=5e-4, **RAMPED)
    assert result.breakdown_field == pytest.approx(
        [np.interp(1.6, (1.5, 2.0), (40e6, 52e6)), np.interp(np.sqrt(1.9 * 1.7), (1.5, 2.0), (40e6, 52e6))]
    )
    for i, temperature in enumerate(RAMPED["temperature"]):
        for j, prestretch in enumerate(RAMPED["prestretch"]):
            if i != j:
                continue
            history = actuate(
                SHIFTED,
                [VoltageStep(np.array(RAMPED["voltage"]), duration=5.0), VoltageStep.hold(3595.0)],
                thickness=5e-4,
                prestretch=prestretch,
                prestretch_rate=0.1,
                relax=300.0,
                temperature=temperature,
                stop_at="end",
                points_per_decade=1,
            )
            for k, events in enumerate(history.events):
                times = {event.name: event.time for event in reversed(events)}
                for name, found in (("breakdown", result.time_to_breakdown), ("pull-in", result.time_to_pull_in)):
                    assert found[i, j, k] == pytest.approx(times.get(name, np.nan), rel=1e-5, nan_ok=True), (name, i, j, k)


def test_a_map_knows_the_field_at_which_it_broke() -> None:
    """Breakdown is where V lambda_1 lambda_2 / L_3 is the breakdown field at the prestretch."""
    history = actuate(
        SHIFTED, [VoltageStep(8e3, rate=100.0)], thickness=5e-4, prestretch=(1.9, 1.7), relax=10.0, stop_at="breakdown"
    )
    (event,) = [event for event in history.events[0] if event.name == "breakdown"]
    field = np.interp(np.sqrt(1.9 * 1.7), (1.5, 2.0), (40e6, 52e6))
    assert event.true_field == pytest.approx(field, rel=1e-9)
    assert event.voltage * event.stretch_1 * event.stretch_2 / 5e-4 == pytest.approx(field, rel=1e-9)
    assert event.voltage == pytest.approx(100.0 * event.time, rel=1e-9)
    assert history.outcome[0].time == event.time


@pytest.mark.parametrize("prestretch", [1.8, (1.9, 1.7)])
def test_breakdown_on_the_way_of_a_voltage_applied_at_once_is_at_the_breakdown_field(prestretch: Any) -> None:
    arguments: dict[str, Any] = {"thickness": 5e-4, "prestretch": prestretch, "relax": 10.0, "breakdown_field": 48e6}
    for voltage in (7.5e3, 8e3, 2e4):
        history = actuate(SHIFTED, [VoltageStep(voltage)], **arguments)
        (event,) = [event for event in history.events[0] if event.name == "breakdown"]
        assert event.time == 0.0
        assert event.voltage < voltage
        assert event.true_field == pytest.approx(48e6, rel=1e-5)  # a load is divided no further than by 1e-7


def test_a_map_may_begin_at_no_voltage() -> None:
    result = failure_map(SHIFTED, voltage=[0.0, 0.5], prestretch=[1.6], thickness=5e-4, horizon=10.0)
    assert result.failure_mode.tolist() == [[["none", "none"]]]


@pytest.mark.parametrize("internal", [True, False])
def test_output_on_its_own_grid_is_output_at_these_times(internal: bool) -> None:
    steps = [Step(stretch=1.8, rate=0.2), Step.hold(20.0), Step(stretch=1.2, rate=-0.5)]
    own = relax(SHIFTED, steps, temperature=[15.0, 25.0], points_per_decade=4, internal=internal)
    asked = relax(SHIFTED, steps, temperature=[15.0, 25.0], times=own.time, internal=internal)
    assert np.array_equal(asked.time, own.time)
    apart = {name: np.abs(getattr(asked, name) - getattr(own, name)) for name in ("stretch_1", "stretch_2", "nominal_stress_1")}
    for name in ("stretch_1", "stretch_2"):
        assert np.all(apart[name] <= 1e-9), name
    # where slack begins, at a stress of 0, stresses differ as stretches do: at most by Young's modulus of the first moment
    tangent = 3 * (SHIFTED.equilibrium_modulus + SHIFTED.spectrum.shear_modulus.sum())
    assert np.all(apart["nominal_stress_1"] <= 1e-9 * own.nominal_stress_1 + tangent * apart["stretch_1"])
    assert not np.any(own.nominal_stress_2)
    assert not np.any(asked.nominal_stress_2)
    assert (own.viscous_stretch is not None) == internal
    if own.viscous_stretch is not None and asked.viscous_stretch is not None:
        assert own.viscous_stretch.shape == (2, 3, 2, own.time.shape[1])
        np.testing.assert_allclose(asked.viscous_stretch, own.viscous_stretch, rtol=1e-9)


def test_at_the_moment_of_a_load_applied_at_once_given_times_show_what_was_before() -> None:
    steps = [Step(stress=1e4), Step.hold(2.0), Step(stress=3e4), Step.hold(2.0)]
    history = creep(SHIFTED, steps, times=[0.0, 1.0, 2.0, 2.0 + 1e-9, 4.0])
    assert history.nominal_stress_1[0] == pytest.approx([1e4, 1e4, 1e4, 3e4, 3e4])
    assert history.stretch_1[0, 0] > 1.0
    assert history.stretch_1[0, 3] > history.stretch_1[0, 2] + 0.01
    grid = creep(SHIFTED, steps, points_per_decade=2)
    assert np.all(np.diff(grid.time[0]) >= 0)
    moment = np.flatnonzero(grid.time[0] == 2.0)
    assert grid.nominal_stress_1[0, moment].tolist() == pytest.approx([1e4] * (len(moment) - 1) + [3e4])


def test_the_last_output_time_may_be_the_end_but_for_rounding() -> None:
    late = 0.1 + 0.2
    assert late > 0.3
    creeping = creep(SHIFTED, [Step(stress=1e4, duration=0.1), Step.hold(0.3 - 0.1)], times=[0.1, late])
    assert np.isfinite(creeping.stretch_1).all()


def test_the_last_time_is_told_though_it_lies_beyond_the_end_by_rounding() -> None:
    steps = [VoltageStep(1e3, duration=0.3)]
    result = actuate(SHIFTED, steps, thickness=5e-4, prestretch=1.6, relax=10.0, times=[0.1, 0.1 + 0.2], stop_at="end")
    assert 0.1 + 0.2 > 0.3
    assert np.all(np.isfinite(result.stretch_1))
