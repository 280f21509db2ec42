"""Adaptive integration of many independent cases at once, each with its own time and its own step.

What drives a system may be smooth in spans only, such as a table of load: a case then goes from one span to the next where it
stands, and its time counts anew. The stepper knows neither the equations nor the method's insides: a `System` linearises itself, a
`Rosenbrock` table says how the stages combine, and an `Observer` sees every accepted step with its dense output, to record it or
to stop cases at an event.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from dielast.numerics.rosenbrock import RODAS5P, Rosenbrock

Floats = NDArray[np.float64]
Cases = NDArray[np.intp]

POOL = 32_000  # numbers in the state of the cases that advance together: enough to hide the interpreter, few enough for the cache
SAFETY, SHRINK, GROW = 0.9, 0.1, 8.0  # of the step size controller
FIRST_MOVE = 5.0  # tolerances that the first step may cover
PROBED = 10.0 ** -np.arange(10)  # shares of the step to go on with, at which transients are looked for
LEAST_STEP = 1e-24  # of the time since the span began; a step this short means that the solution has ceased to exist
NO_STEP = 1e-290  # s, the same at the very beginning
MOST_STEPS = 100_000  # in a span
STALL_STEPS, STALL_REACH = 10_000, 1e-8  # tries that get a case no further than this share of the span: it gets nowhere


class Status(IntEnum):
    """How the integration of one case ended."""

    COMPLETED = 0
    STOPPED = 1
    STEP_VANISHED = 2
    TOO_MANY_STEPS = 3
    STALLED = 4
    NO_START = 5  # of a state to start from that does not exist


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


class Spans(Protocol):
    """Smooth spans that systems go through one after another; some may last for no time."""

    @property
    def spans(self) -> int:
        """How many."""

    def enter(self, system: Any, columns: Cases, cases: Cases, index: Cases) -> tuple[Any, Floats]:
        """A system with these columns (k,), which are of these cases, in spans of this index (k,); and how long these last (k,)."""

    def smooth(self, index: Cases) -> NDArray[np.bool_]:
        """Whether spans (k,) go on smoothly from the span before."""


@dataclass(frozen=True, slots=True, eq=False)
class Stride:
    """One step of a pool of cases: `cases` says which, `accepted` which of them count; `time` and `step` are of shape (pool,).

    Time counts since the `span` began, which was `begin` after the whole began and takes a `duration`. The step ends at `until`,
    in the last step exactly the duration. `before` and `after` are states (rows, pool), `increments` (stages, rows, pool). A case
    may stand in two columns, alike in both.
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
    span: Cases
    begin: Floats
    duration: Floats

    def dense(self, rows: slice, columns: Cases, fraction: Floats) -> Floats:
        """States (rows, k) of the columns (k,) at these fractions (k,) of their steps, from the method's dense output."""
        k1, k2, k3 = np.einsum("is,srk->irk", self.method.dense, self.increments[:, rows, columns])
        rest = 1 - fraction
        inner = self.after[rows, columns] + rest * (k1 + fraction * (k2 + fraction * k3))
        return np.asarray(rest * self.before[rows, columns] + fraction * inner)

    def halfway(self) -> Floats:
        """States (rows, pool) in the middle of the steps."""
        weight = np.array((0.25, 0.125, 0.0625)) @ self.method.dense
        state = np.einsum("s,srk->rk", weight, self.increments)
        state += 0.5 * self.before
        state += 0.5 * self.after
        return np.asarray(state)


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Dense output of some columns of a step: polynomials in the fraction of the step, `coefficients` (5, rows, k)."""

    cases: Cases
    time: Floats
    step: Floats
    coefficients: Floats

    @classmethod
    def of(cls, stride: Stride, rows: slice, columns: Cases) -> Segment:
        """Rows of the columns of a stride."""
        pair = np.resize(columns, max(2, columns.size))  # numbers in a lone column round differently
        inner = np.einsum("is,srk->irk", stride.method.dense, stride.increments[:, rows, pair])[:, :, : columns.size]
        ends = np.stack((stride.before[rows, columns], stride.after[rows, columns]))
        return cls(stride.cases[columns], stride.time[columns], stride.step[columns], np.concatenate((ends, inner)))

    @classmethod
    def joined(cls, segments: list[Segment]) -> Segment:
        """All of them as one."""
        fields = ((s.cases, s.time, s.step, s.coefficients) for s in segments)
        return cls(*(np.concatenate(parts, axis=-1) for parts in zip(*fields, strict=True)))

    def take(self, columns: Cases) -> Segment:
        """The same for some of the columns."""
        return Segment(self.cases[columns], self.time[columns], self.step[columns], self.coefficients[:, :, columns])

    def state(self, fraction: Floats) -> Floats:
        """States (rows, k) at fractions (k,)."""
        before, after, k1, k2, k3 = self.coefficients
        rest = 1 - fraction
        return np.asarray(rest * before + fraction * (after + rest * (k1 + fraction * (k2 + fraction * k3))))


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
    spans: Spans | None = None,
) -> Integration:
    """Integrate from a consistent `state` (rows, cases) at time 0 over a `duration` (cases,), local errors kept below `rtol`.

    The duration may be made up of `spans`, the first of which the system is in.

    `first_step` (cases,) is tried first, such as the `next_step` of an integration that this one continues, or less where the
    rates have a transient at the start; where it is 0 the rates alone say what to try. A case whose duration is 0 stays where it
    is. No case ever raises: `status` tells the ones that did not get through. At most `pool` cases advance together, which no
    result depends on.
    """
    result = Integration(state.copy(), *np.zeros((2, duration.size)), *np.zeros((3, duration.size), dtype=np.intp))
    waiting = np.flatnonzero(duration > 0)
    with np.errstate(all="ignore"):  # what is not finite rejects its step
        first_step = np.zeros_like(duration) if first_step is None else first_step
        whole = _Pool(system, duration, first_step, rtol, observe, method, spans, result)
        whole.run(waiting, pool or max(16, POOL // state.shape[0]))
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
        spans: Spans | None,
        result: Integration,
    ) -> None:
        self.whole, self.durations, self.first_steps = system, duration, first_step
        self.rtol, self.observe, self.method, self.spans, self.result = rtol, observe, method, spans, result
        self.exponent = 1 / method.order
        self.milestone = np.zeros_like(duration)  # time in the span after the last so many tries
        self.tries = np.zeros(duration.size, dtype=np.intp)  # in the span
        self.cases = np.zeros(0, dtype=np.intp)
        self.active = np.zeros(0, dtype=bool)
        self.state = result.state[:, :0]
        self.scalars = np.zeros((5, 0))  # time in the span, its rounding error, step to try, last step, last error
        self.span = np.zeros(0, dtype=np.intp)
        self.begin, self.duration = np.zeros((2, 0))

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
        keep, count = np.flatnonzero(self.active), fresh.size
        span, begin = np.append(self.span[keep], np.zeros(count, dtype=np.intp)), np.append(self.begin[keep], np.zeros(count))
        cases = np.concatenate((self.cases[keep], fresh))
        state = np.concatenate((self.state[:, keep], self.result.state[:, fresh]), axis=1)
        scalars = np.concatenate((self.scalars[:, keep], np.zeros((5, count))), axis=1)
        duration = np.append(self.duration[keep], self.durations[fresh])
        system = self.whole.take(cases)
        if self.spans is not None and cases.size:
            system, duration = self._entered(system, np.arange(cases.size), cases, span)
        if count:
            new = np.arange(keep.size, cases.size)
            scalars[2, new] = self._opening(system, state, duration, new, self.first_steps[fresh])
        if cases.size == 1:  # sums over a lone column round differently: a case must not depend on its company
            both = np.zeros(2, dtype=np.intp)
            cases, span, begin, duration = cases[both], span[both], begin[both], duration[both]
            state, scalars, system = state[:, both], scalars[:, both], system.take(both)
        self.cases, self.span, self.begin, self.duration = cases, span, begin, duration
        self.state, self.scalars, self.system = np.ascontiguousarray(state), scalars, system
        self.active = np.ones(cases.size, dtype=bool)
        self.increments = np.empty((self.method.stages, *state.shape))

    def _entered(self, system: System, columns: Cases, cases: Cases, span: Cases) -> tuple[System, Floats]:
        """The system with columns of these cases in these spans, or in the next that last: `span` is changed to say so."""
        assert self.spans is not None
        system, duration = self.spans.enter(system, columns, cases, span)
        while (over := np.flatnonzero((duration <= 0) & (span < self.spans.spans - 1))).size:
            span[over] += 1
            system, duration[over] = self.spans.enter(system, columns[over], cases[over], span[over])
        return system, duration

    def _onward(self, finished: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Let columns that have finished a span go on to the next one; those that could."""
        on = np.zeros_like(finished)
        if self.spans is None or not (finished & (self.span < self.spans.spans - 1)).any():
            return on
        columns = np.flatnonzero(finished & (self.span < self.spans.spans - 1))
        span = self.span[columns] + 1
        self.system, lasts = self._entered(self.system, columns, self.cases[columns], span)
        going = lasts > 0
        columns, span, lasts = columns[going], span[going], lasts[going]
        self.begin[columns] += self.duration[columns]
        self.span[columns], self.duration[columns] = span, lasts
        self.scalars[:2, columns] = 0.0
        kinks = columns[~self.spans.smooth(span)]
        if kinks.size:
            alone, both = self.cases.size == 2 and self.cases[0] == self.cases[1], kinks
            kinks = kinks[:1] if alone else kinks
            tried = np.where(self.result.next_step > 0, self.result.next_step, self.durations)[self.cases[kinks]]
            first = self._opening(self.system, self.state, self.duration, kinks, tried)
            self.scalars[2, both], self.scalars[3:, both] = first, 0.0
        self.tries[self.cases[columns]], self.milestone[self.cases[columns]] = 0, 0.0
        on[columns] = True
        return on

    def _opening(self, system: System, state: Floats, duration: Floats, columns: Cases, tried: Floats) -> Floats:
        """The first step of columns (k,) after a kink or a start; `tried` (k,) is to be tried first, 0 where nothing is known."""
        step = np.zeros(columns.size)
        known = np.flatnonzero(tried > 0)
        if known.size:
            own = columns[known]
            step[known] = self._continued_step(system, state, own, np.minimum(tried[known], duration[own]))
        unknown = np.flatnonzero(step <= 0)
        if unknown.size:
            pair = np.resize(columns[unknown], max(2, unknown.size))  # as in a pool, for a lone column
            first = self._first_step(system.take(pair), np.take(state, pair, axis=1), duration[pair])
            step[unknown] = first[: unknown.size]
        return step

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

    def _continued_step(self, system: System, state: Floats, columns: Cases, wanted: Floats) -> Floats:
        """The first step that is `wanted`, or as much of it as no transient would decay in unseen; 0 where that is too little.

        The implicit slope over a step tells what is left of the rates after that time: where it differs from that over ten times
        the step by more than the tolerance, something happens in between.
        """
        many = np.repeat(columns, PROBED.size + 1)
        system, state, zero = system.take(many), np.take(state, many, axis=1), np.zeros(many.size)
        steps = (wanted[:, None] * np.append(PROBED, 1e-18)).ravel()
        moved = system.linearise(zero, state, steps, self.method.gamma).increment(zero, state, None, self.method.gamma)
        moved = moved.reshape(state.shape[0], columns.size, -1)
        moved = moved - moved[..., -1:]  # what the state lacks to consistency
        moved[..., 1:] -= 0.1 * moved[..., :-1]
        error = system.error(state, moved.reshape(state.shape) / self.method.gamma).reshape(columns.size, -1)
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
            made = self.cases, accepted, time, step, until, self.state, after, self.increments, self.span, self.begin, self.duration
            stop = self.observe(Stride(self.system, self.method, *made))
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
        following = step * np.maximum(factor, SHRINK)
        if self.spans is not None:  # a step that a span's end cut short says little of the next one
            following = np.where(finished, np.maximum(following, wanted), following)
        moved = np.array((total, low, following, step, np.maximum(error, 1e-2)))
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
        """Book the step, lead columns on to their next span, and retire those that have ended."""
        result, cases = self.result, self.cases
        result.steps[cases[accepted]] += 1
        result.rejected[cases[self.active & ~accepted]] += 1
        self.tries[cases[self.active]] += 1
        stopped = accepted & stop if stop is not None else np.zeros_like(accepted)
        if self.spans is not None and (finished & ~stopped).any():
            finished = finished & ~self._onward(finished & ~stopped)
        time, wanted = self.scalars[0], self.scalars[2]
        vanished = self.active & ~finished & ((wanted < LEAST_STEP * time) | (wanted < NO_STEP))
        tries = self.tries[cases]
        endless = self.active & (tries >= MOST_STEPS)
        stalled = self.active & (tries > 0) & (tries % STALL_STEPS == 0)
        if stalled.any():
            due, reached = cases[stalled], time[stalled]
            stalled[stalled] = reached - self.milestone[due] < STALL_REACH * self.duration[stalled]
            self.milestone[due] = reached
        ended = finished | vanished | endless | stalled | stopped
        if not ended.any():
            return
        for condition, status in (
            (endless, Status.TOO_MANY_STEPS),
            (stalled, Status.STALLED),
            (vanished, Status.STEP_VANISHED),
            (finished, Status.COMPLETED),
            (stopped, Status.STOPPED),
        ):
            result.status[cases[condition]] = status
        result.state[:, cases[ended]] = self.state[:, ended]
        whole = finished & ~stopped if self.spans is not None else finished
        result.time[cases[ended]] = np.where(whole, self.durations[cases], self.begin + time)[ended]
        unguided = ended & (self.first_steps[cases] <= 0)
        result.next_step[cases[unguided]] = wanted[unguided]
        self.active = self.active & ~ended
        self.scalars[:2, ended] = 0.0  # a parked column steps on from here to nowhere, unseen
