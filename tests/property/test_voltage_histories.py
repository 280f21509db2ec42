"""Films under any voltage: the solver ends, says what happened, and no case depends on its company, the grid or the chunks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from flat import actuate, failure_map, plan_failure_map
from hypothesis import example, given, settings, strategies as st

from dielast.material.material import Breakdown, Material
from dielast.material.shift import WLF
from dielast.material.spectrum import Spectrum
from dielast.material.springs import Gent
from dielast.mechanics.load import VoltageStep, Waveform
from dielast.mechanics.stability import TimeScale
from dielast.simulate.actuation_history import ActuationHistory
from dielast.simulate.failure_map import assembled
from dielast.simulate.map_plan import solve_cells

THICKNESS, PERMITTIVITY = 0.5e-3, 3.98e-11
FIELD = Breakdown((1.0, 3.0), (30e6, 60e6))


def solid(branches: int = 12, fastest: float = 1e-6) -> Material:
    """Branches whose moduli fall with the relaxation time like those of a rubber."""
    tau = np.geomspace(1.6e5, fastest, branches)
    return Material(
        "rubber", 26e3, Spectrum(tau, 4e4 * tau**-0.25), WLF(20.0, 13.7, 187.1), Gent(110.0), Gent(55.0), PERMITTIVITY, FIELD
    )


def same(one: ActuationHistory, case: int, other: ActuationHistory, column: int) -> bool:
    names = ("stretch_1", "stretch_2", "nominal_stress_1", "nominal_stress_2", "true_field", "stability", "time")
    return (
        all(np.array_equal(getattr(one, name)[case], getattr(other, name)[column], equal_nan=True) for name in names)
        and one.events[case] == other.events[column]
        and one.outcome[case] == other.outcome[column]
    )


VOLTAGE = np.array([3.4e3, 3.8e3, 4.5e3, 3.8e3, 2e3])
FIRST, SECOND = np.array([1.9, 1.7, 1.9, 2.2, 1.5]), np.array([1.9, 1.7, 1.9, 1.3, 1.5])
TEMPERATURE = np.array([20.0, 20.0, 0.0, 40.0, 60.0])


@pytest.mark.parametrize("timescale", [TimeScale.fraction(0.01), pytest.param(TimeScale.fixed(0.0), marks=pytest.mark.trust)])
def test_a_case_does_not_depend_on_its_company(timescale: TimeScale) -> None:
    def run(some: slice) -> ActuationHistory:
        return actuate(
            solid(4, 10.0),
            [VoltageStep(VOLTAGE[some], duration=[3.0]), VoltageStep.hold(3000.0)],
            thickness=THICKNESS,
            prestretch=(FIRST[some], SECOND[some]),
            relax=600.0,
            temperature=TEMPERATURE[some],
            pull_in_timescale=timescale,
            stop_at="end",
            times=np.geomspace(0.1, 3003.0, 50),
        )

    together = run(slice(None))
    for case in range(VOLTAGE.size):
        assert same(together, case, run(slice(case, case + 1)), 0)


def test_events_do_not_depend_on_the_output_grid() -> None:
    steps = [VoltageStep(5e3), VoltageStep.hold(1e5)]
    common: dict[str, Any] = {"thickness": THICKNESS, "prestretch": 1.9, "relax": 600.0, "stop_at": "end"}
    coarse, fine = (actuate(solid(), steps, points_per_decade=points, **common) for points in (2, 50))
    given_times = actuate(solid(), steps, times=[5.0, 7.0], **common)
    assert coarse.events == fine.events == given_times.events
    assert len(coarse.events[0]) == 2


def test_a_map_does_not_depend_on_its_chunks() -> None:
    common: dict[str, Any] = {
        "voltage": np.linspace(2.4e3, 4.4e3, 4),
        "prestretch": [(1.7, 1.7), (2.2, 1.4), (1.9, 1.9)],
        "temperature": [20.0, 50.0],
        "thickness": THICKNESS,
        "relax": 600.0,
        "horizon": 3600.0,
        "rtol": 1e-5,
    }
    film = solid(5, 1e-2)
    whole = failure_map(film, **common)
    plan = plan_failure_map(film, **common)
    pieces = [solve_cells(plan, first, end) for first, end in plan.chunks(5)]
    (cut,) = assembled(plan, pieces)
    for name in ("time_to_breakdown", "time_to_pull_in", "time_to_failure"):
        assert np.array_equal(getattr(whole, name), getattr(cut, name), equal_nan=True)
    assert np.array_equal(whole.failure_mode, cut.failure_mode)
    assert {"breakdown", "none"} <= set(whole.failure_mode.ravel().tolist())
    for j, pair in enumerate(common["prestretch"]):
        history = actuate(
            film,
            [VoltageStep(common["voltage"][3]), VoltageStep.hold(3600.0)],
            thickness=THICKNESS,
            prestretch=pair,
            relax=600.0,
            temperature=50.0,
            stop_at="end",
            rtol=1e-5,
        )
        times = {event.name: event.time for event in history.events[0]}
        assert whole.time_to_breakdown[1, j, 3] == times["breakdown"]
        assert whole.time_to_pull_in[1, j, 3] == times.get("pull-in", pytest.approx(np.nan, nan_ok=True))


def test_without_voltage_the_film_stays() -> None:
    history = actuate(solid(), [VoltageStep.hold(1e4)], thickness=THICKNESS, prestretch=1.9, relax=1e9, stop_at="end", rtol=1e-8)
    assert history.relative_stretch_1 == pytest.approx(np.ones_like(history.time), rel=1e-7)
    assert not history.events[0]


def test_a_film_clamped_all_round_stays() -> None:
    history = actuate(
        solid(),
        [VoltageStep(4e3), VoltageStep.hold(1e4)],
        thickness=THICKNESS,
        prestretch=(2.0, 1.5),
        relax=600.0,
        boundary="clamped",
        stop_at="end",
    )
    assert np.all(np.abs(history.relative_stretch_1 - 1) < 1e-14)
    assert np.all(np.abs(history.relative_stretch_2 - 1) < 1e-14)
    assert np.all(history.stability == 1)
    assert all(event.name == "loss-of-tension" for event in history.events[0])


def test_watched_for_ever_only_the_equilibrium_spring_holds() -> None:
    steps = [VoltageStep(3e3), VoltageStep.hold(1e3)]
    history = actuate(
        solid(), steps, thickness=THICKNESS, prestretch=1.9, relax=600.0, stop_at="end", pull_in_timescale=TimeScale.fixed(1e30)
    )
    x, load = history.stretch_1[0], history.nominal_stress_1[0, 0]
    front, back = x**2, x**-4
    margin = 1 - (2 * front + back - 3) / 110
    stress = (front - back) / margin
    own = 26e3 * (2 * (front + back) / margin + 2 * stress**2 / 110)
    both = 26e3 * (2 * back / margin + 2 * stress**2 / 110)
    squeeze = 2 * PERMITTIVITY * history.true_field[0] ** 2
    determinant = ((own - squeeze - load * x) ** 2 - (both - squeeze) ** 2) / x**4
    assert history.stability[0] / history.stability[0, 0] == pytest.approx(determinant / determinant[0], rel=1e-8)


@given(
    st.lists(st.tuples(st.floats(-5e3, 5e3), st.floats(-3, 4)), min_size=1, max_size=4),
    st.floats(1.0, 3.0),
    st.floats(1.0, 3.0),
    st.sampled_from(["dead-load", "clamped", ("dead-load", "clamped")]),
    st.sampled_from([TimeScale.fraction(0.01), TimeScale.fixed(0.0), TimeScale.fixed(1.0)]),
    st.sampled_from([1e-6, 10.0]),
)
@example([(7.0, 0.0), (-12.0, 1.5)], 1.0, 1.0, "dead-load", TimeScale.fraction(0.01), 1e-6)  # the sum of both spans is not 10^1.5
@settings(max_examples=12)
def test_any_programme_ends_with_numbers(
    programme: list[tuple[float, float]], first: float, second: float, boundary: str, timescale: TimeScale, fastest: float
) -> None:
    steps = []
    for voltage, log_time in programme:
        steps += [VoltageStep(voltage, duration=0.0 if log_time > 3 else 10**log_time), VoltageStep.hold(10**log_time)]
    history = actuate(
        solid(5, fastest),
        steps,
        thickness=THICKNESS,
        prestretch=(first, second),
        relax=60.0,
        boundary=boundary,
        pull_in_timescale=timescale,
        stop_at="end",
        points_per_decade=3,
        rtol=1e-5,
    )
    assert history.completed, history.outcome
    for values in (
        history.stretch_1,
        history.stretch_2,
        history.nominal_stress_1,
        history.true_field,
        history.stability,
        history.voltage,
    ):
        assert np.all(np.isfinite(values))
    times = [event.time for event in history.events[0]]
    assert times == sorted(times)


def test_cycles() -> None:
    steps = [VoltageStep(1e3), VoltageStep(Waveform(-1e3, 3e3, 4.0, 3, "triangle"))]
    history = actuate(solid(), steps, thickness=THICKNESS, prestretch=1.9, relax=60.0, stop_at="end", times=np.linspace(0, 12, 49))
    phase = history.time[0] % 4.0
    wanted = np.interp(phase, [0, 2, 4], [-1e3, 3e3, -1e3])
    assert history.time[0, 0] == 0
    assert history.voltage[0] == pytest.approx(wanted, abs=1e-6)
    smooth = [VoltageStep(Waveform(-2e3, 2e3, 4.0, 2))]
    history = actuate(solid(), smooth, thickness=THICKNESS, prestretch=1.9, relax=60.0, stop_at="end", times=np.linspace(0, 8, 77))
    assert history.voltage[0] == pytest.approx(-2e3 * np.cos(np.pi / 2 * history.time[0]), abs=1e-9)
