"""Failure maps: what comes out of a grid, and what bad input gets."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flat import actuate, design, failure_map, plan_failure_map

from dielast.base.errors import InputError
from dielast.material.material import NEO_HOOKEAN, Breakdown, Material
from dielast.material.shift import NoShift
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.load import Track, VoltageStep
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
