"""The first fall of the stability margin against a dense evaluation of the run's own stability; the clock of its time scale."""

from __future__ import annotations

import numpy as np
import pytest
from flat import actuate, failure_map
from hypothesis import Phase, given, settings, strategies as st

from dielast import Gent, Material, NoShift, Spectrum, TimeScale, VoltageStep, Waveform
from dielast.simulate.actuation_history import ActuationHistory

EPS, THICKNESS = 3.98e-11, 0.5e-3
ABOUT = 1 + np.array([-1e-4, -1e-6, 1e-8, 1e-7, 1e-6, 1e-5])


def two_branches(ratio: float, share: float, tau: tuple[float, float] = (1.0, 40.0), limit: float = np.inf) -> Material:
    soft = 20e3
    return Material("gapped", soft, Spectrum(tau, [ratio * soft, share * soft]), NoShift(20.0), Gent(limit), Gent(limit), EPS)


def pull_in(history: ActuationHistory, case: int = 0) -> float:
    return next((event.time for event in history.events[case] if event.name == "pull-in"), np.nan)


@pytest.mark.parametrize(("hold", "rtol"), [(1500.0, 1e-3), (2500.0, 1e-6), (5000.0, 1e-3)])
def test_a_margin_that_falls_while_the_film_hardly_moves(hold: float, rtol: float) -> None:
    """One branch of 100 MPa: the margin falls from 0.99 to below 0 while the film moves by a thousandth."""
    solid = Material("stiff", 20e3, Spectrum([1.0], [1e8]), NoShift(20.0), permittivity=EPS)
    history = actuate(solid, [VoltageStep(12e3), VoltageStep.hold(hold)], thickness=THICKNESS, stop_at="end", rtol=rtol)
    assert pull_in(history) == pytest.approx(1295.886, rel=1e-4)
    film = {"prestretch": [1.0], "thickness": THICKNESS, "breakdown_field": 1e12, "rtol": rtol}
    times = failure_map(solid, voltage=[12e3, 16e3], horizon=hold, **film).time_to_pull_in[0, 0]
    assert times == pytest.approx([1295.886, 868.932], rel=1e-4)


@settings(max_examples=4, phases=(Phase.explicit, Phase.generate))
@given(
    ratio=st.floats(0.0, 10.0).map(lambda x: 10.0 ** (1 + 0.9 * x)),
    share=st.floats(-2.0, 1.0).map(lambda x: 10.0**x),
    gap=st.floats(0.0, 3.0).map(lambda x: 10.0**x),
    hold=st.floats(1.0, 4.0).map(lambda x: 10.0**x),
    rtol=st.sampled_from([1e-3, 1e-4, 1e-6, 1e-9]),
    volts=st.floats(0.6, 1.6),
    prestretch=st.sampled_from([1.0, 1.5, 2.5]),
    limit=st.sampled_from([np.inf, 60.0]),
)
def test_the_first_fall_is_that_of_the_stability_column(
    ratio: float, share: float, gap: float, hold: float, rtol: float, volts: float, prestretch: float, limit: float
) -> None:
    solid = two_branches(ratio, share, (1.0, gap), limit)
    # about the voltage at which the equilibrium spring alone would pull in
    voltage = volts * 0.687 * np.sqrt(20e3 / EPS) * THICKNESS
    film = {"thickness": THICKNESS, "prestretch": prestretch, "relax": 1e5}
    history = actuate(
        solid, [VoltageStep(voltage), VoltageStep.hold(hold)], stop_at="end", points_per_decade=300, rtol=rtol, **film
    )
    reached = np.isfinite(history.stability[0])
    found, stability, time = pull_in(history), history.stability[0][reached], history.time[0][reached]
    below = np.flatnonzero(stability <= 0)
    if below.size:
        row = int(below[0])
        # the column's own first fall lies between two of its rows
        assert found <= time[row] * (1 + 1e-9)
        if row and stability[row - 1] > 1e-3:
            assert found >= time[row - 1] * (1 - 1e-9)
    elif found == 0:  # on the way to the voltage, beyond which the film finds another rest
        assert abs(history.events[0][0].voltage) < voltage
    elif found < time[-1]:  # a dip between two rows: a fold, or a fall that a run of a small tolerance shows, too
        steps, tight = [VoltageStep(voltage), VoltageStep.hold(hold)], min(rtol, 1e-9)
        exact = pull_in(actuate(solid, steps, stop_at="end", rtol=tight, **film))
        assert found == pytest.approx(exact, rel=rtol)
        around = actuate(solid, steps, stop_at="end", rtol=tight, times=exact * ABOUT, **film).stability[0]
        assert np.all(around[ABOUT < 1] > 0)
        assert around[ABOUT > 1].min() < 1e-6
    film |= {"prestretch": [prestretch], "breakdown_field": 1e12}
    mapped = failure_map(solid, voltage=[voltage], horizon=hold, rtol=rtol, **film)
    assert mapped.time_to_pull_in[0, 0, 0] == pytest.approx(found, rel=1e-9, nan_ok=True)


def test_a_short_pulse_after_a_long_rest_is_not_watched_for_long() -> None:
    """1 % of the 2 ms that the pulse takes, and not of the 3000 s before: the film moves by 2.5 % and returns."""
    solid = Material("damped", 20e3, Spectrum([0.1], [4e5]), NoShift(20.0), permittivity=EPS)
    film = {"thickness": THICKNESS, "stop_at": "end", "times": [2999.0, 3000.002, 3500.0]}
    rest = [VoltageStep(1e3), VoltageStep.hold(3000.0)]
    pulse = [VoltageStep(15e3), VoltageStep.hold(2e-3), VoltageStep(1e3), VoltageStep.hold(1000.0)]
    history = actuate(solid, [*rest, *pulse], **film)
    assert np.isnan(pull_in(history))
    assert 1.005 < history.stretch_1[0, 1] / history.stretch_1[0, 0] < 1.03
    assert history.stretch_1[0, 2] == pytest.approx(history.stretch_1[0, 0], rel=1e-3)
    # watched for 1 % of the whole time it would be one
    assert np.isfinite(pull_in(actuate(solid, [*rest, *pulse], pull_in_timescale=TimeScale.fixed(30.0), **film)))


def test_the_clock_starts_anew_where_the_size_of_the_voltage_begins_to_rise() -> None:
    """The stability column over each programme's last part is that of the same load on a clock of its own, theta = share t."""
    solid = two_branches(50.0, 5.0)
    film = {"thickness": THICKNESS, "prestretch": 1.5, "relax": 1e5, "stop_at": "end", "rtol": 1e-6}

    def at(steps: list[VoltageStep], time: float, theta: float) -> tuple[float, float]:
        """The column under the default time scale, and under one that is fixed to what that should come to."""
        asked = {"times": [time], **film}
        # the column is relative to the start of the programme; a relaxed film at 0 V is the same at any time, but for theta
        begin = actuate(solid, [VoltageStep.hold(100 * theta)], times=[100 * theta], **film).stability[0, 0]
        fixed = actuate(solid, steps, pull_in_timescale=TimeScale.fixed(theta), **asked)
        return actuate(solid, steps, **asked).stability[0, 0], fixed.stability[0, 0] * begin

    hold, ramp = VoltageStep.hold(100.0), VoltageStep(2e3, duration=10.0)
    for steps, time, age in (
        ([ramp, hold], 60.0, 60.0),  # a ramp and its hold are one
        ([ramp, hold, VoltageStep(2.5e3, duration=5.0), hold], 112.0, 2.0),  # a rise after a hold
        ([ramp, hold, VoltageStep(2.5e3), hold], 150.0, 40.0),  # at once
        ([ramp, VoltageStep(1e3, duration=10.0), VoltageStep(1.5e3, duration=10.0), hold], 50.0, 30.0),  # after a fall
        ([ramp, VoltageStep(1e3, duration=10.0), hold], 80.0, 80.0),  # a fall is no rise
        ([ramp, VoltageStep(-2e3, duration=40.0), hold], 40.0, 10.0),  # the other sign rises from 0 V on
        ([VoltageStep(1e3), VoltageStep(2e3, duration=10.0), hold], 60.0, 60.0),  # a jump that goes on as a ramp
        ([VoltageStep(1e3, duration=1.0), VoltageStep(2e3), hold], 60.0, 60.0),  # a ramp that ends in a jump
        ([VoltageStep(Waveform(0.0, 2e3, 10.0, 4))], 27.0, 7.0),
        ([VoltageStep(Waveform(-2e3, 2e3, 12.0, 4, "triangle"))], 2 * 12.0 + 11.0, 2.0),
    ):
        got, wanted = at(steps, time, 0.01 * age)
        assert got == pytest.approx(wanted, rel=1e-9), (steps, time)


def test_the_elastic_film_pulls_in_at_its_closed_form_if_the_voltage_comes_at_once() -> None:
    elastic = Material("elastic", 26e3, Spectrum([], []), NoShift(20.0), permittivity=EPS)
    history = actuate(elastic, [VoltageStep(2e4)], thickness=THICKNESS, stop_at="pull-in")
    (event,) = history.events[0]
    assert event.stretch_1 == pytest.approx(2 ** (1 / 3), rel=1e-9)
    assert event.voltage / THICKNESS == pytest.approx(0.687365 * np.sqrt(26e3 / EPS), rel=1e-6)


def test_tension_that_never_was_is_not_lost() -> None:
    solid = two_branches(10.0, 1.0)
    film = {"thickness": THICKNESS, "prestretch": 1.0, "boundary": "clamped", "stop_at": "end"}
    for steps in ([VoltageStep.hold(10.0)], [VoltageStep(1e3, duration=1.0), VoltageStep.hold(10.0)]):
        assert actuate(solid, steps, **film).events[0] == ()
