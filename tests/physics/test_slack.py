"""Specimens that bear no pressure: slack where a prescribed stretch would press them together, taut again once recovered."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from peers.kept import answer
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from dielast import (
    InputError,
    Material,
    MeasuredTest,
    NoShift,
    Output,
    Solver,
    Spectrum,
    Step,
    Track,
    Waveform,
    Yeoh,
    read_material,
    relax,
)
from dielast.calibration.laboratory import Laboratory
from dielast.mechanics.slack import Contact

MU, BRANCH, TAU = 26e3, 60e3, 5.0
SOLID = Material("one branch", MU, Spectrum(np.array([TAU]), np.array([BRANCH])), NoShift(20.0))
CORNERS = np.array([0.0, 1.0, 3.0, 4.0, 24.0, 25.0, 25.9, 60.0])
STRETCH = np.array([1.0, 2.0, 2.0, 1.0, 1.0, 2.0, 1.1, 1.1])
POWER = {"uniaxial": -0.5, "pure-shear": 0.0}


def steps(time: np.ndarray = CORNERS, stretch: np.ndarray = STRETCH) -> list[Step]:
    return [Step(stretch=end, duration=later - t) for (t, later), end in zip(pairwise(time), stretch[1:], strict=True)]


def independent(mode: str, times: np.ndarray) -> tuple[list[tuple[bool, float]], np.ndarray]:
    """Events (slack, time), and nominal stress and stretch (2, k) at times, by Radau on the viscous stretches of one branch."""

    def axes(stretch: float) -> np.ndarray:
        return np.array((stretch, stretch ** POWER[mode]))

    def true_stress(squared: np.ndarray) -> np.ndarray:
        return squared - 1 / squared.prod()

    def nominal(stretch: float, log_viscous: np.ndarray) -> float:
        pulled = axes(stretch)
        return float((MU * true_stress(pulled**2) + BRANCH * true_stress((pulled * np.exp(-log_viscous)) ** 2))[0] / stretch)

    def grips(t: float) -> float:
        return float(np.interp(t, CORNERS, STRETCH))

    def free(log_viscous: np.ndarray) -> float:
        return float(brentq(lambda stretch: nominal(stretch, log_viscous), 0.5, 3.0, xtol=1e-15, rtol=1e-14))

    def length(t: float, log_viscous: np.ndarray, slack: bool) -> float:
        return free(log_viscous) if slack else grips(t)

    def rate(t: float, log_viscous: np.ndarray, slack: bool) -> np.ndarray:
        p, q = true_stress((axes(length(t, log_viscous, slack)) * np.exp(-log_viscous)) ** 2)
        return np.array((2 * p - q, 2 * q - p)) / (6 * TAU)

    def signal(t: float, log_viscous: np.ndarray, slack: bool) -> float:
        return free(log_viscous) / grips(t) - 1 if slack else nominal(grips(t), log_viscous) / MU

    signal.terminal, signal.direction = True, -1  # type: ignore[attr-defined]
    now, state, slack = 0.0, np.zeros(2), False
    events, found = [], np.zeros((2, times.size))
    while now < CORNERS[-1]:
        end = float(np.min(CORNERS[now < CORNERS]))
        done = solve_ivp(rate, (now, end), state, "Radau", args=(slack,), rtol=1e-9, atol=1e-11, events=signal, dense_output=True)
        for k in np.flatnonzero((times > now) & (times <= done.t[-1])):
            there = done.sol(times[k])
            stretch = length(times[k], there, slack)
            found[:, k] = 0.0 if slack else nominal(stretch, there), stretch
        now, state = float(done.t[-1]), done.y[:, -1]
        if done.t_events[0].size and now > 0:
            slack = not slack
            events.append((slack, now))
    return events, found


@pytest.mark.parametrize("mode", POWER)
def test_slack_and_taut_as_an_independent_solution(mode: str) -> None:
    times = np.sort(np.concatenate((np.linspace(0.3, 59.0, 40), [3.9, 4.0, 25.8])))
    expected, (stress, stretch) = answer([independent, mode, times], lambda: independent(mode, times))
    history = relax(SOLID, steps(), mode=mode, output=Output(times=times), solver=Solver(rtol=1e-9))
    events = history.slack_events[0]
    assert [event.event for event in events] == ["slack", "taut"] * 2 == ["slack" if slack else "taut" for slack, _ in expected]
    assert [event.time for event in events] == pytest.approx([time for _, time in expected], rel=1e-7)
    assert [event.stretch for event in events] == pytest.approx(
        np.interp([time for _, time in expected], CORNERS, STRETCH), rel=1e-7
    )
    assert history.nominal_stress_1[0] == pytest.approx(stress, rel=1e-7, abs=1e-7 * stress.max())
    assert history.stretch_1[0] == pytest.approx(stretch, rel=1e-7)
    # the same at everyday tolerance
    usual = relax(SOLID, steps(), mode=mode, output=Output(times=times))
    assert [event.time for event in usual.slack_events[0]] == pytest.approx([time for _, time in expected], rel=1e-6)


def test_slack_at_small_strain_in_closed_form() -> None:
    """e = a t, then a (2 T - t), of springs E and B and a dashpot B tau: the strain of the dashpot is v = a (t - tau + tau f) at
    first, with f = exp(-t/tau), then recovers at zero stress, e = B v/(E + B), with the time (E + B) tau/E, to e = h.
    """
    top, a, held = 1e-4, 2e-5, 1e-6
    loading, unloading = top / a, (top - held) / a
    stretch = np.array([1.0, 1 + top, 1 + held, 1 + held])
    history = relax(SOLID, steps(np.array([0.0, loading, loading + unloading, 200.0]), stretch), solver=Solver(rtol=1e-11))

    def dashpot(t: float) -> float:
        first = a * (loading - TAU + TAU * np.exp(-loading / TAU))
        particular = top - a * t + a * TAU
        return float(particular + (first - top - a * TAU) * np.exp(-t / TAU))

    slack = brentq(lambda t: MU * (top - a * t) + BRANCH * (top - a * t - dashpot(t)), 0.0, unloading, xtol=1e-14)
    recovery = (MU + BRANCH) * TAU / MU
    taut = slack + recovery * np.log(BRANCH * dashpot(slack) / (MU + BRANCH) / held)
    found = [event.time for event in history.slack_events[0]]
    assert found == pytest.approx([loading + slack, loading + taut], rel=3e-4)


def test_every_cycle_has_its_slack_phase_and_cases_do_not_disturb_each_other() -> None:
    wave = [Step(stretch=Waveform(1.0, 2.0, 4.0, 3, "triangle"))]
    history = relax(SOLID, wave)
    assert [event.event for event in history.slack_events[0]] == (["slack", "taut"] * 3)[:5]  # the last cycle ends slack
    slack, taut = (np.array([event.time for event in history.slack_events[0][k::2]]) for k in (0, 1))
    assert np.all((slack % 4 > 2) & (slack // 4 == np.arange(3)))
    assert np.all((taut % 4 < 2) & (taut // 4 == np.arange(1, 3)))
    assert np.all(np.diff(slack % 4) < 0)  # each cycle leaves a longer specimen
    assert history.steps[0] < 140  # 161 where landings were tried again and steps began anew at the rounding of an event
    assert history.nominal_stress_1.min() == 0.0
    cycles = history.cycles
    assert cycles is not None
    swings = relax(SOLID, [Step(stretch=Waveform(1.0, 2.0, 4.0, 3))]).cycles
    assert swings is not None
    assert np.all(np.concatenate((cycles.lowest, swings.lowest)) == 0.0)  # not some uPa below it
    # work over a cycle: the integral of the stress over the prescribed stretch
    time = np.linspace(0.0, 4.0, 4001)
    fine = relax(SOLID, [Step(stretch=Waveform(1.0, 2.0, 4.0, 1, "triangle"))], output=Output(times=time))
    work = np.trapezoid(fine.nominal_stress_1[0], 1 + 0.5 * np.abs(((time + 2) % 4) - 2))
    assert cycles.work[0, 0] == pytest.approx(work, rel=1e-5)
    both = relax(SOLID, [Step(stretch=Waveform(1.0, np.array([2.0, 1.5]), 4.0, 3, "triangle"))])
    assert both.slack_events[0] == history.slack_events[0]


@pytest.mark.trust  # test_long_histories.py has waveforms beside their points, taut
def test_a_wave_goes_slack_where_its_points_do() -> None:
    other = relax(SOLID, [Step(stretch=Waveform(1.2, 2.0, 4.0, 2))], solver=Solver(rtol=1e-7))
    exact = relax(SOLID, [Step(stretch=Track(*sine()))], solver=Solver(rtol=1e-7)).slack_events[0]
    assert len(exact) == 2
    assert [event.time for event in other.slack_events[0][:2]] == pytest.approx([event.time for event in exact], abs=2e-5)


def test_a_stiff_material_turns_once_and_has_rows_there() -> None:
    """With branches a hundred times as stiff as the equilibrium spring, taut again is not slack once more a moment later."""
    history = relax(read_material("example:vhb4905"), [Step(stretch=Waveform(1.0, np.array([1.5, 2.0]), 4.0, 2, "triangle"))])
    for case, events in enumerate(history.slack_events):
        assert [event.event for event in events] == ["slack", "taut", "slack"]
        rows = history.case(case)
        for event in events:
            row = np.flatnonzero(np.abs(rows["time [s]"] - event.time) <= 1e-8 * event.time)
            assert row.size
            assert rows["nominal_stress_1 [Pa]"][row] == pytest.approx(0.0, abs=1e-6 * rows["nominal_stress_1 [Pa]"].max())
            assert rows["stretch_1 [1]"][row] == pytest.approx(event.stretch, rel=1e-6)
        assert np.all(np.diff(rows["time [s]"]) > 0)
        assert rows["nominal_stress_1 [Pa]"].min() == 0
    elastic = replace(SOLID, spectrum=Spectrum([1.0], [0.0]))  # rows of two kinds lie within rounding of each other
    alone = relax(elastic, [Step(stretch=2.0, duration=0.0), Step(stretch=0.5, duration=1.0)])
    assert np.isfinite(alone.time).all()
    assert np.isfinite(alone.nominal_stress_1).all()
    inside = relax(SOLID, steps(), output=Output(internal=True))
    assert inside.viscous_stretch is not None
    assert inside.viscous_stretch.shape[2:] == inside.time.shape
    energy = inside.stored_energy()[0]
    assert np.isfinite(energy[np.isfinite(inside.time[0])]).all()


def test_a_specimen_that_is_pressed_from_the_start_rests_until_it_is_taut() -> None:
    squeezed = [Step(stretch=0.9, duration=1.0), Step(stretch=1.6, duration=1.0), Step(stretch=1.0, duration=0.5), Step.hold(30.0)]
    times = np.linspace(0.05, 32.5, 60)
    history = relax(SOLID, squeezed, output=Output(times=times), solver=Solver(rtol=1e-8))
    events = history.slack_events[0]
    assert [event.event for event in events] == ["slack", "taut", "slack"]
    assert events[1].stretch == pytest.approx(1.0, abs=1e-6)  # it has rested: taut at its own length
    rested = relax(
        SOLID,
        [Step.hold(events[1].time), Step(stretch=1.6, rate=0.7), Step(stretch=1.0, duration=0.5), Step.hold(30.0)],
        output=Output(times=times),
        solver=Solver(rtol=1e-8),
    )
    assert history.nominal_stress_1[0] == pytest.approx(rested.nominal_stress_1[0], rel=1e-6, abs=1e-3)
    assert history.stretch_1[0] == pytest.approx(rested.stretch_1[0], rel=1e-6)


def sine() -> tuple[np.ndarray, np.ndarray]:
    time = np.concatenate((np.linspace(0.0, 3.76, 236), np.linspace(3.76, 4.2, 221)[1:]))  # closer about the events
    return time, 1.6 - 0.4 * np.cos(2 * np.pi * time / 4)


def test_a_jump_leaves_a_specimen_slack_and_pulls_it_taut() -> None:
    jumps = [Step(stretch=2.0), Step.hold(20.0), Step(stretch=1.1), Step.hold(5.0), Step(stretch=2.0), Step.hold(1.0)]
    history = relax(SOLID, jumps, solver=Solver(rtol=1e-9))
    assert [(event.event, event.time) for event in history.slack_events[0]] == [("slack", 20.0), ("taut", 25.0)]
    resting = (history.time[0] > 20) & (history.time[0] < 25)
    assert np.all(history.nominal_stress_1[0, resting] == 0)
    assert np.all(np.diff(history.stretch_1[0, resting]) < 0)
    assert history.stretch_1[0, resting][-1] > 1.1
    # a ramp that follows begins at the grips, not at the specimen's own length
    history = relax(SOLID, [*jumps[:4], Step(stretch=2.0, rate=0.1)])
    assert history.outcome[0].time == pytest.approx(34.0)


def test_a_specimen_may_push_and_creep_at_no_load_is_not_slack() -> None:
    pushes = relax(SOLID, steps(), slack="pushes")
    assert pushes.slack_events == ((),)
    assert pushes.nominal_stress_1.min() < -1e4
    assert relax(SOLID, steps(), mode="equibiaxial").nominal_stress_1.min() < -1e4
    squeezed = relax(SOLID, [Step(stretch=0.8, rate=-0.1), Step.hold(5.0)])
    assert [(event.event, event.time) for event in squeezed.slack_events[0]] == [("slack", pytest.approx(0.0, abs=1e-6))]
    assert np.all(squeezed.nominal_stress_1 == 0)
    assert squeezed.stretch_1 == pytest.approx(1.0, abs=1e-9)
    wrong: Any = "gives"
    with pytest.raises(InputError, match=r'slack: "gives": in uniaxial mode .*bears nothing'):
        relax(SOLID, steps(), slack=wrong)
    with pytest.raises(InputError, match=r"in equibiaxial mode .*pushes"):
        relax(SOLID, steps(), mode="equibiaxial", slack="bears nothing")
    with pytest.raises(InputError, match=r"where a step states both axes .*pushes"):
        relax(SOLID, [Step(stretch=(2.0, None), stress=(None, 0.0))], slack="bears nothing")


def _cyclic(name: str, top: float, lasts: float, slack: str | None = None) -> MeasuredTest:
    """Two triangles to a stretch and back, and then rest, measured at 81 points."""
    time = np.linspace(0.0, 5 * lasts, 81)
    stretch = np.interp(time, lasts * np.arange(5), [1.0, top, 1.0, top, 1.0])
    return MeasuredTest(name, time, stretch, np.where(time > 0, 1e5, 0.0), 20.0, slack=slack)


def test_calibrate_follows_slack_tests_of_different_histories_at_once() -> None:
    tests = [_cyclic("slow", 1.8, 40.0), _cyclic("fast", 2.5, 4.0), _cyclic("pushed", 2.0, 8.0, "pushes")]
    materials = [SOLID, replace(SOLID, equilibrium_modulus=40e3)]
    answers = Laboratory(tests, rtol=1e-8).answers(materials)
    for test, ours in zip(tests, answers, strict=True):
        steps = [Step(stretch=Track(test.corner_time, test.corner_stretch))]
        history = relax(materials, steps, output=Output(times=test.time), solver=Solver(rtol=1e-8), slack=test.slack)
        assert ours == pytest.approx(history.nominal_stress_1, rel=1e-6, abs=1e-6 * ours.max())
    assert min(ours.min() for ours in answers[:2]) == 0.0 > answers[2].min()


def test_a_free_specimen_whose_springs_lose_their_stiffness_has_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """It has no equilibrium where it goes slack, and must not turn from slack to taut and back without end."""
    turns: list[int] = []
    turn = Contact.turn

    def counted(contact: Contact, *place: Any) -> Any:
        turns.append(1)
        return turn(contact, *place)

    monkeypatch.setattr(Contact, "turn", counted)
    springs = Yeoh(7.7e3, -189.0, 6.77), Yeoh(0.5, -0.0108, -0.00575)  # the branches' stiffness falls as they are stretched
    material = Material("m", 15.4e3, Spectrum([1580.0, 26.9, 2.34], [694e3, 17e3, 42e3]), NoShift(20.0), *springs)
    up = 2 / 0.03
    time = up * np.append(np.linspace(0, 1, 13)[1:], 1 + np.linspace(0, 0.5, 13)[1:])
    test = MeasuredTest("pull", time, np.interp(time, [0, up, 2 * up], [1, 3, 1]), np.ones(24), 20.0)
    assert np.isnan(Laboratory([test]).answers([material])[0]).all()
    assert len(turns) < 20


def test_sensitivities_go_through_slack() -> None:
    """The stress is continuous in the parameters, so that forward differences at a fit's tolerance agree with central fine ones."""

    def materials(shift: float) -> list[Material]:
        spectrum = SOLID.spectrum
        return [
            replace(SOLID, equilibrium_modulus=MU * (1 + shift)),
            replace(SOLID, spectrum=Spectrum(spectrum.relaxation_time, spectrum.shear_modulus * (1 + shift))),
            replace(SOLID, spectrum=Spectrum(spectrum.relaxation_time * (1 + shift), spectrum.shear_modulus)),
        ]

    tests = [_cyclic("fast", 2.5, 4.0)]
    fit = Laboratory(tests).answers([SOLID, *materials(1e-3)])[0]
    fine = Laboratory(tests, rtol=1e-9).answers([*materials(1e-4), *materials(-1e-4)])[0]
    central = (fine[:3] - fine[3:]) / 2e-4
    for one, other in zip((fit[1:] - fit[0]) / 1e-3, central, strict=True):
        assert one == pytest.approx(other, abs=0.01 * np.max(np.abs(other)))
