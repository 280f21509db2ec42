"""Maps of draws, and output on the grid of its own: both against the same asked for otherwise."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flat import actuate, creep, failure_map, plan_failure_map, relax

from dielast.material.material import Breakdown, Material
from dielast.material.scatter import Sample
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.load import Step, VoltageStep
from dielast.simulate.failure_map import solve_map

SOLID = Material(
    "soft",
    26e3,
    Spectrum(np.array([1e3, 30.0, 1.0]), np.array([1e4, 2e4, 9e4])),
    WLF(20.0, 13.7, 187.1),
    Gent(110.0),
    Gent(55.0),
    4e-11,
    Breakdown((1.5, 2.0), (40e6, 52e6)),
)
STIFF = replace(SOLID, equilibrium_modulus=40e3)
MAP: dict[str, Any] = {
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
    sample = Sample((STIFF, SOLID), np.array([0.9, 1.1]), np.array([1.05, 0.8]))
    main, *drawn = solve_map(plan_failure_map(SOLID, thickness=5e-4, breakdown_field=field, rtol=1e-6, sample=sample, **MAP))
    known = SOLID.breakdown
    assert known is not None
    assert np.isfinite(main.time_to_failure).any()
    assert not np.isfinite(main.time_to_failure).all()
    for index, result in enumerate(drawn):
        factor = float(sample.breakdown_factor[index])
        scaled = Breakdown(known.prestretch, tuple(factor * value for value in known.field))
        own = scaled if field is None else factor * np.asarray(field)
        thick = 5e-4 * float(sample.thickness_factor[index])
        alone = failure_map(sample.materials[index], thickness=thick, breakdown_field=own, rtol=1e-6, **MAP)
        assert np.array_equal(result.failure_mode, alone.failure_mode)
        for name in ("time_to_breakdown", "time_to_pull_in", "time_to_failure"):
            # draws are computed more loosely
            np.testing.assert_allclose(getattr(result, name), getattr(alone, name), rtol=2e-3, err_msg=name)


def test_a_cell_of_a_map_is_a_film_under_that_voltage() -> None:
    result = failure_map(SOLID, thickness=5e-4, **MAP)
    assert result.breakdown_field == pytest.approx(
        [np.interp(1.6, (1.5, 2.0), (40e6, 52e6)), np.interp(np.sqrt(1.9 * 1.7), (1.5, 2.0), (40e6, 52e6))]
    )
    for i, temperature in enumerate(MAP["temperature"]):
        for j, prestretch in enumerate(MAP["prestretch"]):
            if i != j:
                continue
            history = actuate(
                SOLID,
                [VoltageStep(np.array(MAP["voltage"]), duration=5.0), VoltageStep.hold(3595.0)],
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
    history = actuate(SOLID, [VoltageStep(8e3, rate=100.0)], thickness=5e-4, prestretch=(1.9, 1.7), relax=10.0, stop_at="breakdown")
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
        history = actuate(SOLID, [VoltageStep(voltage)], **arguments)
        (event,) = [event for event in history.events[0] if event.name == "breakdown"]
        assert event.time == 0.0
        assert event.voltage < voltage
        assert event.true_field == pytest.approx(48e6, rel=1e-5)  # a load is divided no further than by 1e-7


def test_a_map_may_begin_at_no_voltage() -> None:
    result = failure_map(SOLID, voltage=[0.0, 0.5], prestretch=[1.6], thickness=5e-4, horizon=10.0)
    assert result.failure_mode.tolist() == [[["none", "none"]]]


@pytest.mark.parametrize("internal", [True, False])
def test_output_on_its_own_grid_is_output_at_these_times(internal: bool) -> None:
    steps = [Step(stretch=1.8, rate=0.2), Step.hold(20.0), Step(stretch=1.2, rate=-0.5)]
    own = relax(SOLID, steps, temperature=[15.0, 25.0], points_per_decade=4, internal=internal)
    asked = relax(SOLID, steps, temperature=[15.0, 25.0], times=own.time, internal=internal)
    assert np.array_equal(asked.time, own.time)
    apart = {name: np.abs(getattr(asked, name) - getattr(own, name)) for name in ("stretch_1", "stretch_2", "nominal_stress_1")}
    for name in ("stretch_1", "stretch_2"):
        assert np.all(apart[name] <= 1e-9), name
    # where slack begins, at a stress of 0, stresses differ as stretches do: at most by Young's modulus of the first moment
    tangent = 3 * (SOLID.equilibrium_modulus + SOLID.spectrum.shear_modulus.sum())
    assert np.all(apart["nominal_stress_1"] <= 1e-9 * own.nominal_stress_1 + tangent * apart["stretch_1"])
    assert not np.any(own.nominal_stress_2)
    assert not np.any(asked.nominal_stress_2)
    assert (own.viscous_stretch is not None) == internal
    if own.viscous_stretch is not None and asked.viscous_stretch is not None:
        assert own.viscous_stretch.shape == (2, 3, 2, own.time.shape[1])
        np.testing.assert_allclose(asked.viscous_stretch, own.viscous_stretch, rtol=1e-9)


def test_at_the_moment_of_a_load_applied_at_once_given_times_show_what_was_before() -> None:
    steps = [Step(stress=1e4), Step.hold(2.0), Step(stress=3e4), Step.hold(2.0)]
    history = creep(SOLID, steps, times=[0.0, 1.0, 2.0, 2.0 + 1e-9, 4.0])
    assert history.nominal_stress_1[0] == pytest.approx([1e4, 1e4, 1e4, 3e4, 3e4])
    assert history.stretch_1[0, 0] > 1.0
    assert history.stretch_1[0, 3] > history.stretch_1[0, 2] + 0.01
    grid = creep(SOLID, steps, points_per_decade=2)
    assert np.all(np.diff(grid.time[0]) >= 0)
    moment = np.flatnonzero(grid.time[0] == 2.0)
    assert grid.nominal_stress_1[0, moment].tolist() == pytest.approx([1e4] * (len(moment) - 1) + [3e4])


def test_the_last_output_time_may_be_the_end_but_for_rounding() -> None:
    late = 0.1 + 0.2
    assert late > 0.3
    creeping = creep(SOLID, [Step(stress=1e4, duration=0.1), Step.hold(0.3 - 0.1)], times=[0.1, late])
    assert np.isfinite(creeping.stretch_1).all()


def test_the_last_time_is_told_though_it_lies_beyond_the_end_by_rounding() -> None:
    steps = [VoltageStep(1e3, duration=0.3)]
    result = actuate(SOLID, steps, thickness=5e-4, prestretch=1.6, relax=10.0, times=[0.1, 0.1 + 0.2], stop_at="end")
    assert 0.1 + 0.2 > 0.3
    assert np.all(np.isfinite(result.stretch_1))
