"""The stepper, its method and its bookkeeping, on problems small enough to know the answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dielast.numerics import integrate as module
from dielast.numerics.integrate import Status, Stepper
from dielast.numerics.rosenbrock import RODAS5P
from dielast.numerics.stride import TriedStep


def butcher() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """b, alpha and beta = alpha + Gamma of the method in its textbook form."""
    method = RODAS5P
    gamma = np.linalg.inv(np.eye(method.stages) / method.gamma - method.c)
    weights = method.a[-1] + np.eye(method.stages)[-1]
    return weights @ gamma, method.a @ gamma, method.a @ gamma + gamma


def test_coefficients_meet_the_order_conditions() -> None:
    b, alpha, beta = butcher()
    a, t = alpha.sum(axis=1), beta.sum(axis=1)
    one = np.ones_like(b)
    # Hairer and Wanner, Solving ODEs II, table IV.7.1, trees up to order 4, and the quadrature and tall tree of order 5
    for value, wanted in (
        (b @ one, 1.0),
        (b @ t, 1 / 2),
        (b @ a**2, 1 / 3),
        (b @ beta @ t, 1 / 6),
        (b @ a**3, 1 / 4),
        (b @ (a * (alpha @ t)), 1 / 8),
        (b @ beta @ a**2, 1 / 12),
        (b @ beta @ beta @ t, 1 / 24),
        (b @ a**4, 1 / 5),
        (b @ beta @ beta @ beta @ t, 1 / 120),
    ):
        assert value == pytest.approx(wanted, abs=1e-12)
    assert a == pytest.approx(RODAS5P.alpha, abs=1e-12)
    assert (beta - alpha).sum(axis=1) == pytest.approx(RODAS5P.gamma_i, abs=1e-12)


def test_the_method_is_stiffly_accurate_and_damps_completely() -> None:
    b, _, beta = butcher()
    assert b == pytest.approx(beta[-1], abs=1e-12)
    assert np.array_equal(RODAS5P.adds_last, [False] * 6 + [True] * 2)
    z = -1e8
    amplification = 1 + z * b @ np.linalg.solve(np.eye(b.size) - z * beta, np.ones(b.size))
    assert abs(amplification) < 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Oscillating:
    """y' = -k (y - z) + cos t and 0 = z^3 + z - sin(t)^3 - sin(t): y = z = sin t, of index 1, stiff for large k."""

    stiffness: np.ndarray

    def take(self, cases: np.ndarray) -> Oscillating:
        return Oscillating(self.stiffness[cases])

    def error(self, time: np.ndarray, state: np.ndarray, increment: np.ndarray) -> np.ndarray:
        return np.max(np.abs(increment), axis=0)

    def linearise(self, times: np.ndarray, state: np.ndarray, step: np.ndarray, gamma: float) -> Linear:
        return Linear(self, times, state, step, gamma)


class Linear:
    def __init__(self, system: Oscillating, times: np.ndarray, state: np.ndarray, step: np.ndarray, gamma: float) -> None:
        self.k, self.times, self.step, self.gamma = system.stiffness, times, step, gamma
        self.slope, time = 3 * state[1] ** 2 + 1, times[0]
        self.rates = -np.sin(time), -(3 * np.sin(time) ** 2 + 1) * np.cos(time)

    def increment(self, stage: int, state: np.ndarray, history: np.ndarray | None, gamma_i: float, out: np.ndarray) -> np.ndarray:
        (y, z), time = state, self.times[stage]
        algebraic = z**3 + z - np.sin(time) ** 3 - np.sin(time) + self.step * gamma_i * self.rates[1]
        u_z = -algebraic / self.slope
        right = self.step * (-self.k * (y - z) + np.cos(time)) + self.step**2 * gamma_i * self.rates[0]
        right = right if history is None else right + history[0]
        out[:] = (right + self.step * self.k * u_z) / (1 / self.gamma + self.step * self.k), u_z
        return out


def solve_with_fixed_steps(count: int, stiffness: float) -> tuple[float, float]:
    """Largest errors at the ends of equal steps over 2 s, and within them."""
    system = Oscillating(np.full(1, stiffness))
    step, state = np.full(1, 2.0 / count), np.zeros((2, 1))
    ends, within = 0.0, 0.0
    for number in range(count):
        time = number * step
        linear, increments = system.linearise(time + RODAS5P.alpha[:, None] * step, state, step, RODAS5P.gamma), []
        for i in range(RODAS5P.stages):
            stage = state + sum((a * u for a, u in zip(RODAS5P.a[i], increments, strict=False)), np.zeros((2, 1)))
            history = sum((c * u for c, u in zip(RODAS5P.c[i], increments, strict=False)), np.zeros((2, 1))) if i else None
            increments.append(linear.increment(i, stage, history, RODAS5P.gamma_i[i], np.empty((2, 1))))
        after = stage + increments[-1]
        one = np.zeros(1, int)
        made = time, step, time + step, state, after, np.array(increments), one, 0 * time, 0 * time + 1, time + step
        stride = TriedStep(system, RODAS5P, one, np.ones(1, bool), *made)
        fractions = np.linspace(0.1, 0.9, 9)
        dense = stride.dense(slice(None), np.zeros(9, int), fractions)
        within = max(within, float(np.max(np.abs(dense - np.sin(time + fractions * step)))))
        state = after
        ends = max(ends, float(np.max(np.abs(state - np.sin(time + step)))))
    return ends, within


def test_measured_order_of_steps_and_of_dense_output() -> None:
    errors = np.array([solve_with_fixed_steps(count, 1.0) for count in (8, 16, 32)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(orders[:, 0] > 4.7)  # order 5
    assert np.all(orders[:, 1] > 3.8)  # order 4


def test_order_on_a_stiff_problem() -> None:
    errors = np.array([solve_with_fixed_steps(count, 1e5) for count in (8, 16, 32)])
    assert np.all(np.log2(errors[:-1] / errors[1:]) > 3.5)


def test_tolerance_and_status_of_many_cases() -> None:
    stiffness = np.geomspace(1e-2, 1e6, 50)
    duration = np.linspace(0.0, 5.0, 50)
    result = Stepper(Oscillating(stiffness), np.zeros((2, 50)), duration, rtol=1e-8, pool=7).run()
    assert np.all(result.status == Status.COMPLETED)
    assert np.array_equal(result.time, duration)
    assert result.state == pytest.approx(np.stack((np.sin(duration),) * 2), abs=3e-8)


def test_an_observer_may_stop_a_case() -> None:
    def stop(stride: TriedStep) -> np.ndarray:
        return stride.after[0] > 0.5

    result = Stepper(Oscillating(np.ones(3)), np.zeros((2, 3)), np.array([0.1, 2.0, 3.0]), rtol=1e-6).run(stop)
    assert result.status.tolist() == [Status.COMPLETED, Status.STOPPED, Status.STOPPED]
    assert np.all(result.state[0, 1:] > 0.5)
    assert np.all(result.time[1:] < 2.0)


def test_a_solution_that_ceases_to_exist_is_reported_where_it_does() -> None:
    class Explosion(Oscillating):
        def linearise(self, times: np.ndarray, state: np.ndarray, step: np.ndarray, gamma: float) -> Blow:
            return Blow(state, step, gamma)

        def take(self, cases: np.ndarray) -> Explosion:
            return Explosion(self.stiffness[cases])

        def error(self, time: np.ndarray, state: np.ndarray, increment: np.ndarray) -> np.ndarray:
            return np.max(np.abs(increment / state), axis=0)

    class Blow:
        """y' = y^2, which is infinite at 1/y(0)."""

        def __init__(self, state: np.ndarray, step: np.ndarray, gamma: float) -> None:
            self.matrix, self.step = 1 / gamma - step * 2 * state, step

        def increment(
            self, stage: int, state: np.ndarray, history: np.ndarray | None, gamma_i: float, out: np.ndarray
        ) -> np.ndarray:
            return np.divide(self.step * state**2 + (0.0 if history is None else history), self.matrix, out=out)

    result = Stepper(Explosion(np.ones(2)), np.array([[1.0, 0.1]]), np.array([5.0, 5.0]), rtol=1e-8).run()
    assert result.status.tolist() == [Status.STEP_VANISHED, Status.COMPLETED]
    assert result.time[0] == pytest.approx(1.0, rel=1e-6)
    assert result.state[0, 1] == pytest.approx(0.2, rel=1e-6)


def test_what_gets_nowhere_is_given_up_early(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "STALL_STEPS", 50)
    # a tenth of a second a step, and 1e15 s to go
    result = Stepper(Oscillating(np.ones(2)), np.zeros((2, 2)), np.array([1e15, 2.0]), rtol=1e-6).run()
    assert result.status.tolist() == [Status.STALLED, Status.COMPLETED]
    assert result.steps[0] + result.rejected[0] == 500
    assert result.state[0, 1] == pytest.approx(np.sin(2.0), abs=1e-5)


def test_a_first_step_is_shortened_where_the_rates_have_a_transient() -> None:
    stiff, start = Oscillating(np.full(2, 1e6)), np.array([[0.0, 1e-3], [0.0, 0.0]])
    first: list[float] = []

    def look(stride: TriedStep) -> None:
        if not first:
            first.extend(stride.step.tolist())

    result = Stepper(stiff, start, np.full(2, 1.0), rtol=1e-6, first_step=np.full(2, 0.1)).run(look)
    assert np.all(result.status == Status.COMPLETED)
    assert first[0] > 1e-3  # nothing decays
    assert first[1] < 1e-5  # 1e-3 decays within microseconds
    assert np.all(result.next_step > 0)


NOTHING: Any = None  # dense output asks no system


@pytest.mark.parametrize("theta", [0.1, 0.35, 0.5, 0.8, 1.0])
def test_dense_output_meets_the_conditions_of_order_four(theta: float) -> None:
    """Hairer and Wanner, Solving ODEs II, table IV.7.1, each with the power of theta that the exact solution has there."""
    method, size = RODAS5P, RODAS5P.stages
    gamma = np.linalg.inv(np.eye(size) / method.gamma - method.c)
    alpha, beta = method.a @ gamma, method.a @ gamma + gamma
    # the increments of one stage alone, so that the state at theta is that stage's weight
    columns, none = np.arange(size), np.zeros(size)
    weights = method.a[-1] + np.eye(size)[-1]
    stride = TriedStep(
        NOTHING,
        method,
        columns,
        np.ones(size, dtype=bool),
        none,
        none + 1,
        none + 1,
        np.zeros((1, size)),
        weights[None],
        np.eye(size)[:, None],
        columns,
        none,
        none + 1,
        none + 1,
    )
    b = stride.dense(slice(None), columns, np.full(size, theta))[0] @ gamma
    a, t = alpha.sum(axis=1), beta.sum(axis=1)
    for value, wanted in (
        (b.sum(), theta),
        (b @ t, theta**2 / 2),
        (b @ a**2, theta**3 / 3),
        (b @ beta @ t, theta**3 / 6),
        (b @ a**3, theta**4 / 4),
        (b @ (a * (alpha @ t)), theta**4 / 8),
        (b @ beta @ a**2, theta**4 / 12),
        (b @ beta @ beta @ t, theta**4 / 24),
    ):
        assert value == pytest.approx(wanted, abs=1e-12)


def test_dense_output_ends_where_the_step_does() -> None:
    random = np.random.default_rng(0)
    before, after, increments = random.normal(size=(3, 2)), random.normal(size=(3, 2)), random.normal(size=(8, 3, 2))
    one = np.ones(2)
    stride = TriedStep(
        NOTHING, RODAS5P, np.arange(2), one > 0, one, one, one, before, after, increments, np.arange(2), one, one, one
    )
    assert np.array_equal(stride.dense(slice(None), np.arange(2), np.zeros(2)), before)
    assert np.array_equal(stride.dense(slice(None), np.arange(2), one), after)
    assert np.array_equal(stride.dense(slice(1, None), np.array([1]), one[:1]), after[1:, 1:])
    assert stride.halfway() == pytest.approx(stride.dense(slice(None), np.arange(2), 0.5 * one), rel=1e-14)
    # with what fades in it: a (1 - exp(-k t))/k in two of the rows
    from dielast.numerics.response import Response

    decay, rate = random.uniform(0.5, 3.0, (2, 2, 2))
    known = [np.vstack((-rate * np.expm1(-decay * time) / decay, np.zeros(2))) for time in (1.0, 0.5)]
    fading = replace(stride, response=Response(decay, rate, 1, *known, (0, 1)))
    assert fading.dense(slice(None), np.arange(2), one) == pytest.approx(after, rel=1e-14)
    assert fading.halfway() == pytest.approx(fading.dense(slice(None), np.arange(2), 0.5 * one), rel=1e-14)


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

    def linearise(self, times: Array, state: Array, step: Array, gamma: float) -> ChasingLinear:
        return ChasingLinear(self, times, step, gamma)

    def exact(self, start: Array, time: Array) -> Array:
        return np.sin(self.w * time) + start * np.exp(-self.k * time)


class ChasingLinear:
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
    result = Stepper(SYSTEM, np.zeros((1, CASES)), DURATION, rtol=1e-7, first_step=np.geomspace(1e-4, 10.0, CASES), pool=4).run(
        notes
    )
    for case in range(CASES):
        second = next(step for begin, step, _ in notes.tries[case] if begin > 0)
        assert result.next_step[case] == second


def test_a_start_from_the_rates_alone_is_told_the_step_that_was_reached() -> None:
    notes = Notes(CASES)
    result = Stepper(SYSTEM, np.ones((1, CASES)), DURATION, rtol=1e-7, pool=3).run(notes)
    for case in range(CASES):
        steps = [step for _, step, _ in notes.steps[case]]
        assert 0.3 * max(steps[-4:]) < result.next_step[case] < 8 * max(steps[-4:])
        assert result.next_step[case] > 3 * steps[0]


@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
@pytest.mark.parametrize("first", [None, 1e-6, 1.0, 100.0])
def test_steps_join_without_gaps_and_are_counted(rtol: float, first: float | None) -> None:
    notes, start = Notes(CASES), np.linspace(0.0, 1.0, CASES)[None]
    first_step = None if first is None else np.full(CASES, first)
    result = Stepper(SYSTEM, start, DURATION, rtol=rtol, first_step=first_step).run(notes)
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
    counts = [Stepper(SYSTEM, np.zeros((1, CASES)), 2 * DURATION, rtol=rtol).run().steps.sum() for rtol in (1e-5, 1e-9)]
    assert 10**0.5 < counts[1] / counts[0] < 10**1.1


def test_whatever_advances_together_gives_the_same_bytes() -> None:
    start = np.linspace(0.0, 1.0, CASES)[None]
    whole = Stepper(SYSTEM, start, DURATION, rtol=1e-6).run()
    for pool in (1, 2, 3, 100):
        part = Stepper(SYSTEM, start, DURATION, rtol=1e-6, pool=pool).run()
        for name in ("state", "time", "next_step", "status", "steps", "rejected"):
            assert np.array_equal(getattr(part, name), getattr(whole, name)), name


def test_too_many_steps_end_a_case_where_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_STEPS", 50)
    system, duration = Chasing(np.ones(2), np.array([200.0, 0.1])), np.array([10.0, 1.0])
    result = Stepper(system, np.zeros((1, 2)), duration, rtol=1e-8).run()
    assert result.status.tolist() == [Status.TOO_MANY_STEPS, Status.COMPLETED]
    assert result.steps[0] + result.rejected[0] == 50
    assert 0 < result.time[0] < 10.0
    assert result.state[0] == pytest.approx(system.exact(np.zeros(2), result.time), abs=1e-6)


def test_what_gets_on_slowly_is_not_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "STALL_STEPS", 20)
    system = Chasing(np.ones(2), np.array([20.0, 0.1]))
    result = Stepper(system, np.zeros((1, 2)), np.full(2, 10.0), rtol=1e-8).run()
    assert np.all(result.status == Status.COMPLETED)
    assert result.steps[0] > 100


def test_cases_that_last_no_time_stay_where_they_are() -> None:
    start, notes = np.array([[0.3, 0.4]]), Notes(2)
    result = Stepper(Chasing(np.ones(2), np.ones(2)), start, np.array([0.0, 1.0]), rtol=1e-6, method=RODAS5P).run(notes)
    assert result.state[0, 0] == 0.3
    assert (result.time[0], result.steps[0], result.next_step[0], notes.steps[0]) == (0.0, 0, 0.0, [])
    assert result.status.tolist() == [Status.COMPLETED] * 2
