"""Adaptive integration of many independent cases at once, each with its own time and its own step.

The stepper knows neither the equations nor the method's insides: a `System` linearises itself, a `Rosenbrock` table says how the
stages combine, and an `Observer` sees every accepted step with its dense output, to record it or to stop cases at an event.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from dielast.rosenbrock import RODAS5P, Rosenbrock

Floats = NDArray[np.float64]
Cases = NDArray[np.intp]

POOL = 32_000  # numbers in the state of the cases that advance together: enough to hide the interpreter, few enough for the cache
SAFETY, SHRINK, GROW = 0.9, 0.1, 8.0  # of the step size controller
FIRST_MOVE = 5.0  # tolerances that the first step may cover
PROBED = 10.0 ** -np.arange(10)  # shares of the step to go on with, at which transients are looked for
LEAST_STEP = 1e-24  # of the duration; a step this short means that the solution has ceased to exist
MOST_STEPS = 100_000
STALL_STEPS, STALL_REACH = 10_000, 1e-8  # tries that get a case no further than this share of the duration: it gets nowhere


class Status(IntEnum):
    """How the integration of one case ended."""

    COMPLETED = 0
    STOPPED = 1
    STEP_VANISHED = 2
    TOO_MANY_STEPS = 3
    STALLED = 4


class Linearised(Protocol):
    """The linear system of one step."""

    def increment(self, time: Floats, state: Floats, history: Floats | None, gamma_i: float) -> Floats:
        """u_i (rows, cases) of the stage at `time` and `state`; `history` is sum c_ij u_j, None in the first stage."""


class System(Protocol):
    """Differential-algebraic equations of index 1 for states of shape (rows, cases); cases never mix."""

    def take(self, cases: Cases) -> Self:
        """The same for some of the cases."""

    def linearise(self, time: Floats, state: Floats, step: Floats, gamma: float) -> Linearised:
        """The linear system at the start of a step (cases,)."""

    def error(self, state: Floats, increment: Floats) -> Floats:
        """The relative error (cases,) that an `increment` to a `state` amounts to."""


@dataclass(frozen=True, slots=True, eq=False)
class Stride:
    """One step of a pool of cases: `cases` says which, `accepted` which of them count; `time` and `step` are of shape (pool,).

    The step ends at `until`, in the last step exactly the duration. `before` and `after` are states (rows, pool), `increments`
    (stages, rows, pool). A case may stand in two columns, alike in both.
    """

    system: System
    method: Rosenbrock
    cases: Cases
    accepted: NDArray[np.bool_]
    time: Floats
    step: Floats
    until: Floats
    before: Floats
    after: Floats
    increments: Floats

    def dense(self, rows: slice, columns: Cases, fraction: Floats) -> Floats:
        """States (rows, k) of the columns (k,) at these fractions (k,) of their steps, from the method's dense output."""
        k1, k2, k3 = np.einsum("is,srk->irk", self.method.dense, self.increments[:, rows, columns])
        rest = 1 - fraction
        inner = self.after[rows, columns] + rest * (k1 + fraction * (k2 + fraction * k3))
        return np.asarray(rest * self.before[rows, columns] + fraction * inner)


class Observer(Protocol):
    """Sees every step."""

    def __call__(self, stride: Stride) -> NDArray[np.bool_] | None:
        """Columns (pool,) whose case ends at `stride.after`, or None for none."""


@dataclass(frozen=True, slots=True, eq=False)
class Integration:
    """How far each case came: `state` (rows, cases), `time`, `status`, the numbers of `steps` and `rejected` ones, and the
    `next_step` to try first if the integration is continued, all (cases,).

    After a start from the rates alone that is the step reached at the end. Otherwise it is what followed the first step here, as
    pieces of load that follow each other meet in kinks of a kind.
    """

    state: Floats
    time: Floats
    next_step: Floats
    status: NDArray[np.intp]
    steps: NDArray[np.intp]
    rejected: NDArray[np.intp]


def integrate(
    system: System,
    state: Floats,
    duration: Floats,
    *,
    rtol: float,
    observe: Observer | None = None,
    method: Rosenbrock = RODAS5P,
    pool: int | None = None,
    first_step: Floats | None = None,
) -> Integration:
    """Integrate from a consistent `state` (rows, cases) at time 0 over a `duration` (cases,), local errors kept below `rtol`.

    `first_step` (cases,) is tried first, such as the `next_step` of an integration that this one continues, or less where the
    rates have a transient at the start; where it is 0 the rates alone say what to try. A case whose duration is 0 stays where it
    is. No case ever raises: `status` tells the ones that did not get through. At most `pool` cases advance together, which no
    result depends on.
    """
    result = Integration(state.copy(), *np.zeros((2, duration.size)), *np.zeros((3, duration.size), dtype=np.intp))
    waiting = np.flatnonzero(duration > 0)
    with np.errstate(all="ignore"):  # what is not finite rejects its step
        first_step = np.zeros_like(duration) if first_step is None else first_step
        _Pool(system, duration, first_step, rtol, observe, method, result).run(waiting, pool or max(16, POOL // state.shape[0]))
    return result


class _Pool:
    """The cases that advance together. Columns that have finished are replaced by waiting cases, or dropped."""

    def __init__(
        self,
        system: System,
        duration: Floats,
        first_step: Floats,
        rtol: float,
        observe: Observer | None,
        method: Rosenbrock,
        result: Integration,
    ) -> None:
        self.whole, self.durations, self.first_steps = system, duration, first_step
        self.rtol, self.observe, self.method, self.result = rtol, observe, method, result
        self.exponent = 1 / method.order
        self.milestone = np.zeros_like(duration)  # time after the last so many tries
        self.cases = np.zeros(0, dtype=np.intp)
        self.active = np.zeros(0, dtype=bool)
        self.state = result.state[:, :0]
        self.scalars = np.zeros((5, 0))  # time, its rounding error, step to try, last step, last error

    def run(self, waiting: Cases, size: int) -> None:
        """Advance until all cases have ended."""
        while waiting.size or self.active.any():
            running = int(np.count_nonzero(self.active))
            room = size - running
            if (waiting.size and room >= size // 8) or (not waiting.size and running <= 0.75 * self.active.size > 2):
                self._refill(waiting[:room])
                waiting = waiting[room:]
            self._advance()

    def _refill(self, fresh: Cases) -> None:
        """Drop what has ended and take in `fresh` cases."""
        keep = np.flatnonzero(self.active)
        start = np.take(self.result.state, fresh, axis=1)
        entering = np.zeros((5, fresh.size))
        known = np.flatnonzero(self.first_steps[fresh] > 0)
        if known.size:
            entering[2, known] = self._continued_step(fresh[known])
        unknown = np.flatnonzero(entering[2] <= 0)
        if unknown.size:
            pair = np.resize(fresh[unknown], max(2, unknown.size))  # as below, for a lone column
            first = self._first_step(self.whole.take(pair), np.take(self.result.state, pair, axis=1), self.durations[pair])
            entering[2, unknown] = first[: unknown.size]
        self.cases = np.concatenate((self.cases[keep], fresh))
        self.state = np.concatenate((np.take(self.state, keep, axis=1), start), axis=1)
        self.scalars = np.concatenate((self.scalars[:, keep], entering), axis=1)
        if self.cases.size == 1:  # sums over a lone column round differently: a case must not depend on its company
            self.cases = np.repeat(self.cases, 2)
            self.state, self.scalars = np.repeat(self.state, 2, axis=1), np.repeat(self.scalars, 2, axis=1)
        self.active = np.ones(self.cases.size, dtype=bool)
        self.system = self.whole.take(self.cases)
        self.duration = self.durations[self.cases]
        self.increments = np.empty((self.method.stages, *self.state.shape))

    def _first_step(self, system: System, state: Floats, duration: Floats) -> Floats:
        """A step in which the present rates move nothing by much more than the tolerance.

        Whatever transient decays within the first step is unseen by its error estimate and its dense output, however stiff.
        """
        probe = 1e-18 * duration
        gamma = self.method.gamma
        moved = system.linearise(np.zeros_like(duration), state, probe, gamma).increment(
            np.zeros_like(duration), state, None, gamma
        )
        rate = system.error(state, moved) / (gamma * probe)
        step = FIRST_MOVE * self.rtol / rate
        return np.where(step > 0, np.minimum(step, duration), 1e-6 * duration)

    def _continued_step(self, cases: Cases) -> Floats:
        """The first step that was asked for, or as much of it as no transient would decay in unseen; 0 where that is too little.

        The implicit slope over a step tells what is left of the rates after that time: where it differs from that over ten times
        the step by more than the tolerance, something happens in between.
        """
        wanted = np.minimum(self.first_steps[cases], self.durations[cases])
        columns = np.repeat(cases, PROBED.size + 1)
        system, state, zero = self.whole.take(columns), np.take(self.result.state, columns, axis=1), np.zeros(columns.size)
        steps = (wanted[:, None] * np.append(PROBED, 1e-18)).ravel()
        moved = system.linearise(zero, state, steps, self.method.gamma).increment(zero, state, None, self.method.gamma)
        moved = moved.reshape(state.shape[0], cases.size, -1)
        moved = moved - moved[..., -1:]  # what the state lacks to consistency
        moved[..., 1:] -= 0.1 * moved[..., :-1]
        error = system.error(state, moved.reshape(state.shape) / self.method.gamma).reshape(cases.size, -1)
        busy = ~(error[:, 1:-1] <= FIRST_MOVE * self.rtol)
        finest = np.where(busy.any(axis=1), PROBED.size - 1 - np.argmax(busy[:, ::-1], axis=1), 0)
        return np.where(finest < PROBED.size - 1, wanted * PROBED[np.maximum(finest - 1, 0)], 0.0)

    def _advance(self) -> None:
        """Try one step in every column and keep those that are accurate enough."""
        time, low, wanted, last_step, last_error = self.scalars
        left = (self.duration - time) - low
        step = np.where(wanted >= 0.99 * left, left, np.minimum(wanted, 0.5 * left))
        after = self._stages(time, step)
        error = self.system.error(after, self.increments[-1]) / self.rtol
        error = np.where(np.isfinite(error), np.maximum(error, 1e-6), np.inf)
        accepted = (error <= 1) & self.active
        total = time + step
        until = np.where(step >= left, self.duration, total)
        stop = None
        if self.observe is not None and accepted.any():
            stop = self.observe(
                Stride(self.system, self.method, self.cases, accepted, time, step, until, self.state, after, self.increments)
            )
        factor = SAFETY * error**-self.exponent
        # Gustafsson's predictive controller: where errors grow or shrink steadily, expect them to go on so
        trend = factor * (step / last_step) * (last_error / error) ** self.exponent
        factor = np.where(
            accepted, np.minimum(np.where(last_step > 0, np.minimum(factor, trend), factor), GROW), np.minimum(factor, SAFETY)
        )
        finished = accepted & (step >= left)
        shift = total - time
        low = low + (time - (total - shift)) + (step - shift)
        self.state = np.where(accepted, after, self.state)
        moved = np.array((total, low, step * np.maximum(factor, SHRINK), step, np.maximum(error, 1e-2)))
        opening = accepted & (time == 0)
        self.result.next_step[self.cases[opening]] = moved[2, opening]
        kept = self.scalars.copy()
        kept[2] = moved[2]
        self.scalars = np.where(accepted, moved, kept)
        self._settle(accepted, finished, stop)

    def _stages(self, time: Floats, step: Floats) -> Floats:
        """All increments of a step; returns the new state."""
        method, increments, state = self.method, self.increments, self.state
        system = self.system.linearise(time, state, step, method.gamma)
        increments[0] = system.increment(time, state, None, method.gamma_i[0])
        stage = state
        for i in range(1, method.stages):
            if method.adds_last[i]:
                stage = stage + increments[i - 1]
                history = np.einsum("s,srm->rm", method.c[i, :i], increments[:i])
            else:
                stage, history = np.einsum("bs,srm->brm", method.ac[i][:, :i], increments[:i])
                stage += state
            increments[i] = system.increment(time + method.alpha[i] * step, stage, history, method.gamma_i[i])
        return np.asarray(stage + increments[-1])

    def _settle(self, accepted: NDArray[np.bool_], finished: NDArray[np.bool_], stop: NDArray[np.bool_] | None) -> None:
        """Book the step, and retire the columns that have ended."""
        result, cases = self.result, self.cases
        result.steps[cases[accepted]] += 1
        result.rejected[cases[self.active & ~accepted]] += 1
        vanished = self.active & ~finished & (self.scalars[2] < LEAST_STEP * self.duration)
        tries = result.steps[cases] + result.rejected[cases]
        endless = self.active & (tries >= MOST_STEPS)
        stalled = self.active & (tries % STALL_STEPS == 0)
        if stalled.any():
            due, time = cases[stalled], self.scalars[0, stalled]
            stalled[stalled] = time - self.milestone[due] < STALL_REACH * self.durations[due]
            self.milestone[due] = time
        ended = finished | vanished | endless | stalled
        if stop is not None:
            ended |= stop & accepted
        if not ended.any():
            return
        for condition, status in (
            (endless, Status.TOO_MANY_STEPS),
            (stalled, Status.STALLED),
            (vanished, Status.STEP_VANISHED),
            (finished, Status.COMPLETED),
        ):
            result.status[cases[condition]] = status
        if stop is not None:
            result.status[cases[stop & accepted]] = Status.STOPPED
        result.state[:, cases[ended]] = self.state[:, ended]
        result.time[cases[ended]] = np.where(finished, self.duration, self.scalars[0])[ended]
        unguided = ended & (self.first_steps[cases] <= 0)
        result.next_step[cases[unguided]] = self.scalars[2, unguided]
        self.active = self.active & ~ended
        self.scalars[:2, ended] = 0.0  # a parked column steps on from here to nowhere, unseen
