"""The stepper's bookkeeping: what a continuation is told, how many steps it counts, and where cases end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.numerics import integrate as module
from dielast.numerics.integrate import Status, integrate
from dielast.numerics.rosenbrock import RODAS5P
from dielast.numerics.stride import TriedStep

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Chasing:
    """y' = -k (y - sin(w t)) + w cos(w t): y = sin(w t) + y(0) exp(-k t)."""

    k: Array
    w: Array

    def take(self, cases: NDArray[np.intp]) -> Chasing:
        return Chasing(self.k[cases], self.w[cases])

    def error(self, time: Array, state: Array, increment: Array) -> Array:
        return np.max(np.abs(increment), axis=0)

    def linearise(self, times: Array, state: Array, step: Array, gamma: float) -> Linear:
        return Linear(self, times, step, gamma)

    def exact(self, start: Array, time: Array) -> Array:
        return np.sin(self.w * time) + start * np.exp(-self.k * time)


class Linear:
    def __init__(self, system: Chasing, times: Array, step: Array, gamma: float) -> None:
        self.system, self.times, self.step, self.gamma = system, times, step, gamma
        time = times[0]
        self.in_time = system.w * (system.k * np.cos(system.w * time) - system.w * np.sin(system.w * time))

    def increment(self, stage: int, state: Array, history: Array | None, gamma_i: float, out: Array) -> Array:
        k, w, h, time = self.system.k, self.system.w, self.step, self.times[stage]
        right = h * (-k * (state - np.sin(w * time)) + w * np.cos(w * time)) + h**2 * gamma_i * self.in_time
        return np.divide(right + (0.0 if history is None else history), 1 / self.gamma + h * k, out=out)


class Notes:
    """Tries of each case, and those of them that count: begin, length and end."""

    def __init__(self, cases: int) -> None:
        self.steps: list[list[tuple[float, float, float]]] = [[] for _ in range(cases)]
        self.tries: list[list[tuple[float, float, float]]] = [[] for _ in range(cases)]

    def __call__(self, stride: TriedStep) -> None:
        for column, case in enumerate(stride.cases.tolist()):
            entry = (float(stride.time[column]), float(stride.step[column]), float(stride.until[column]))
            self.tries[case].append(entry)
            if stride.accepted[column] and entry not in self.steps[case][-1:]:
                self.steps[case].append(entry)


CASES = 6
SYSTEM = Chasing(np.geomspace(0.1, 100.0, CASES), np.linspace(0.5, 3.0, CASES))
DURATION = np.linspace(5.0, 10.0, CASES)


def test_a_continuation_is_told_what_followed_the_first_step() -> None:
    notes = Notes(CASES)
    result = integrate(
        SYSTEM, np.zeros((1, CASES)), DURATION, rtol=1e-7, observe=notes, first_step=np.geomspace(1e-4, 10.0, CASES), pool=4
    )
    for case in range(CASES):
        second = next(step for begin, step, _ in notes.tries[case] if begin > 0)
        assert result.next_step[case] == second


def test_a_start_from_the_rates_alone_is_told_the_step_that_was_reached() -> None:
    notes = Notes(CASES)
    result = integrate(SYSTEM, np.ones((1, CASES)), DURATION, rtol=1e-7, observe=notes, pool=3)
    for case in range(CASES):
        steps = [step for _, step, _ in notes.steps[case]]
        assert 0.3 * max(steps[-4:]) < result.next_step[case] < 8 * max(steps[-4:])
        assert result.next_step[case] > 3 * steps[0]


@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@pytest.mark.parametrize("first", [None, 1e-6, 1.0, 100.0])
def test_steps_join_without_gaps_and_are_counted(rtol: float, first: float | None) -> None:
    notes, start = Notes(CASES), np.linspace(0.0, 1.0, CASES)[None]
    first_step = None if first is None else np.full(CASES, first)
    result = integrate(SYSTEM, start, DURATION, rtol=rtol, observe=notes, first_step=first_step)
    assert np.all(result.status == Status.COMPLETED)
    assert np.array_equal(result.time, DURATION)
    assert result.state == pytest.approx(SYSTEM.exact(start, DURATION), abs=30 * rtol)
    for case, steps in enumerate(notes.steps):
        assert len(steps) == result.steps[case]
        begin, step, until = np.array(steps).T
        assert begin[0] == 0.0
        assert until[-1] == DURATION[case]
        assert np.array_equal(begin[1:], until[:-1])
        assert begin + step == pytest.approx(until, rel=1e-14)
        assert np.all(step[1:] <= 8 * step[:-1] * (1 + 1e-12))  # no step grows without bounds
    assert np.all(result.rejected <= 0.2 * result.steps + 5)


def test_effort_follows_the_order_of_the_method() -> None:
    """Ten thousand times the accuracy costs 10^(4/5) times the steps, with a controller of order 5."""
    counts = [integrate(SYSTEM, np.zeros((1, CASES)), 2 * DURATION, rtol=rtol).steps.sum() for rtol in (1e-5, 1e-9)]
    assert 10**0.5 < counts[1] / counts[0] < 10**1.1


def test_whatever_advances_together_gives_the_same_bytes() -> None:
    start = np.linspace(0.0, 1.0, CASES)[None]
    whole = integrate(SYSTEM, start, DURATION, rtol=1e-6)
    for pool in (1, 2, 3, 100):
        part = integrate(SYSTEM, start, DURATION, rtol=1e-6, pool=pool)
        for name in ("state", "time", "next_step", "status", "steps", "rejected"):
            assert np.array_equal(getattr(part, name), getattr(whole, name)), name


def test_too_many_steps_end_a_case_where_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_STEPS", 50)
    system, duration = Chasing(np.ones(2), np.array([200.0, 0.1])), np.array([10.0, 1.0])
    result = integrate(system, np.zeros((1, 2)), duration, rtol=1e-8)
    assert result.status.tolist() == [Status.TOO_MANY_STEPS, Status.COMPLETED]
    assert result.steps[0] + result.rejected[0] == 50
    assert 0 < result.time[0] < 10.0
    assert result.state[0] == pytest.approx(system.exact(np.zeros(2), result.time), abs=1e-6)


def test_what_gets_on_slowly_is_not_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "STALL_STEPS", 20)
    system = Chasing(np.ones(2), np.array([20.0, 0.1]))
    result = integrate(system, np.zeros((1, 2)), np.full(2, 10.0), rtol=1e-8)
    assert np.all(result.status == Status.COMPLETED)
    assert result.steps[0] > 100


def test_cases_that_last_no_time_stay_where_they_are() -> None:
    start, notes = np.array([[0.3, 0.4]]), Notes(2)
    result = integrate(Chasing(np.ones(2), np.ones(2)), start, np.array([0.0, 1.0]), rtol=1e-6, observe=notes, method=RODAS5P)
    assert result.state[0, 0] == 0.3
    assert (result.time[0], result.steps[0], result.next_step[0], notes.steps[0]) == (0.0, 0, 0.0, [])
    assert result.status.tolist() == [Status.COMPLETED] * 2
