"""Adaptive integration of many independent cases at once, each with its own time and its own step.

What drives a system may be smooth in spans only, such as a table of load: a case then goes from one span to the next where it
stands, and its time counts anew. The stepper knows neither the equations nor the method's insides: a `System` linearises itself, a
`Rosenbrock` table says how the stages combine, and an `Observer` sees every accepted step with its dense output, to record it or
to stop cases at an event.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from dielast.numerics.columns import Cases, Flags, Floats, paired
from dielast.numerics.rosenbrock import RODAS5P, Rosenbrock
from dielast.numerics.stride import Observer, Stride, advance
from dielast.numerics.system import Spans, System
from dielast.numerics.whereabouts import Whereabouts

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
    status: Cases
    steps: Cases
    rejected: Cases


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
    longest_step: Floats | None = None,
    spans: Spans | None = None,
) -> Integration:
    """Integrate from a consistent `state` (rows, cases) at time 0 over a `duration` (cases,), local errors kept below `rtol`.

    The duration may be made up of `spans`, the first of which the system is in.

    `first_step` (cases,) is tried first, such as the `next_step` of an integration that this one continues, or less where the
    rates have a transient at the start; where it is 0 the rates alone say what to try. Steps are at most 1 % longer than the
    `longest_step` (cases,), because the error estimate does not see a load that swings and comes back within one step. A case
    whose duration is 0 stays where it is. No case ever raises: `status` tells the ones that did not get through. At most `pool`
    cases advance together, which no result depends on.
    """
    result = Integration(state.copy(), *np.zeros((2, duration.size)), *np.zeros((3, duration.size), dtype=np.intp))
    waiting = np.flatnonzero(duration > 0)
    with np.errstate(all="ignore"):  # what is not finite rejects its step
        first_step = np.zeros_like(duration) if first_step is None else first_step
        longest_step = np.full_like(duration, np.inf) if longest_step is None else longest_step
        whole = _Pool(system, duration, first_step, longest_step, rtol, observe, method, spans, result)
        whole.run(waiting, pool or max(16, POOL // state.shape[0]))
    return result


class _Pool:
    """The cases that advance together. Columns that have finished are replaced by waiting cases, or dropped."""

    def __init__(
        self,
        system: System,
        duration: Floats,
        first_step: Floats,
        longest_step: Floats,
        rtol: float,
        observe: Observer | None,
        method: Rosenbrock,
        spans: Spans | None,
        result: Integration,
    ) -> None:
        self.whole, self.durations, self.first_steps, self.longest_steps = system, duration, first_step, longest_step
        self.rtol, self.observe, self.method, self.spans, self.result = rtol, observe, method, spans, result
        self.exponent = 1 / method.order
        self.milestone = np.zeros_like(duration)  # time in the span after the last so many tries
        self.tries = np.zeros(duration.size, dtype=np.intp)  # in the span
        self.last_span = self._last_spans()
        self.at = Whereabouts.fresh(np.zeros(0, dtype=np.intp), np.zeros(0))
        self.active = np.zeros(0, dtype=bool)
        self.state = result.state[:, :0]

    def run(self, waiting: Cases, size: int) -> None:
        """Advance until all cases have ended."""
        while waiting.size or self.active.any():
            running = int(np.count_nonzero(self.active))
            room = size - running
            if (waiting.size and room >= size // 8) or (not waiting.size and running <= 0.75 * self.active.size > 2):
                self._refill(waiting[:room])
                waiting = waiting[room:]
            self._advance()

    def _last_spans(self) -> Cases:
        """The last span (cases,) of each case that lasts for some time."""
        cases = np.arange(self.durations.size)
        last = np.zeros_like(cases)
        if self.spans is not None:
            last += self.spans.spans - 1
            while (over := np.flatnonzero((last > 0) & ~(self.spans.lasts(cases, last) > 0))).size:
                last[over] -= 1
        return last

    def _refill(self, fresh: Cases) -> None:
        """Drop what has ended and take in `fresh` cases."""
        keep, count = np.flatnonzero(self.active), fresh.size
        at = self.at.take(keep).joined(Whereabouts.fresh(fresh, self.durations[fresh]))
        state = np.concatenate((self.state[:, keep], self.result.state[:, fresh]), axis=1)
        system = self.whole.take(at.cases)
        if self.spans is not None and at.cases.size:
            system, at.duration = self._entered(system, np.arange(at.cases.size), at.cases, at.span)
        if count:
            new = np.arange(keep.size, at.cases.size)
            at.next_step[new] = self._opening(system, state, at.duration, new, self.first_steps[fresh])
        if at.cases.size == 1:
            both = paired(np.zeros(1, dtype=np.intp))
            at, state, system = at.take(both), state[:, both], system.take(both)
        self.at, self.state, self.system = at, np.ascontiguousarray(state), system
        self.active = np.ones(at.cases.size, dtype=bool)
        self.increments = np.empty((self.method.stages, *state.shape))

    def _entered(self, system: System, columns: Cases, cases: Cases, span: Cases) -> tuple[System, Floats]:
        """The system with columns of these cases in these spans, or in the next that last: `span` is changed to say so."""
        assert self.spans is not None
        system, duration = self.spans.enter(system, columns, cases, span)
        while (over := np.flatnonzero((duration <= 0) & (span < self.last_span[cases]))).size:
            span[over] += 1
            system, duration[over] = self.spans.enter(system, columns[over], cases[over], span[over])
        return system, duration

    def _onward(self, ready: Flags) -> None:
        """Let columns that are `ready` (pool,) go on to the next span."""
        assert self.spans is not None
        at, columns = self.at, np.flatnonzero(ready)
        span = at.span[columns] + 1
        self.system, lasts = self._entered(self.system, columns, at.cases[columns], span)
        at.begin[columns] += at.duration[columns]
        at.span[columns], at.duration[columns] = span, lasts
        at.time[columns] = at.rounding[columns] = 0.0
        kinks = columns[~self.spans.smooth(span)]
        if kinks.size:
            alone, both = at.cases.size == 2 and at.cases[0] == at.cases[1], kinks
            kinks = kinks[:1] if alone else kinks
            tried = np.where(self.result.next_step > 0, self.result.next_step, self.durations)[at.cases[kinks]]
            at.next_step[both] = self._opening(self.system, self.state, at.duration, kinks, tried)
            at.last_step[both] = at.last_error[both] = 0.0
        self.tries[at.cases[columns]], self.milestone[at.cases[columns]] = 0, 0.0

    def _opening(self, system: System, state: Floats, duration: Floats, columns: Cases, tried: Floats) -> Floats:
        """The first step of columns (k,) after a kink or a start; `tried` (k,) is to be tried first, 0 where nothing is known."""
        step = np.zeros(columns.size)
        known = np.flatnonzero(tried > 0)
        if known.size:
            guided = columns[known]
            step[known] = self._continued_step(system, state, guided, np.minimum(tried[known], duration[guided]))
        unknown = np.flatnonzero(step <= 0)
        if unknown.size:
            pair = paired(columns[unknown])
            first = self._first_step(system.take(pair), np.take(state, pair, axis=1), duration[pair])
            step[unknown] = first[: unknown.size]
        return step

    def _first_step(self, system: System, state: Floats, duration: Floats) -> Floats:
        """A step in which the present rates move nothing by much more than the tolerance.

        Whatever transient decays within the first step is unseen by its error estimate and its dense output, however stiff.
        """
        probe = 1e-18 * duration
        gamma = self.method.gamma
        zero = np.zeros_like(duration)
        moved = system.linearise(zero, state, probe, gamma).increment(zero, state, None, gamma, np.empty(state.shape))
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
        gamma = self.method.gamma
        moved = system.linearise(zero, state, steps, gamma).increment(zero, state, None, gamma, np.empty(state.shape))
        moved = moved.reshape(state.shape[0], columns.size, -1)
        moved = moved - moved[..., -1:]  # what the state lacks to consistency
        moved[..., 1:] -= 0.1 * moved[..., :-1]
        error = system.error(state, moved.reshape(state.shape) / gamma).reshape(columns.size, -1)
        busy = ~(error[:, 1:-1] <= FIRST_MOVE * self.rtol)
        finest = np.where(busy.any(axis=1), PROBED.size - 1 - np.argmax(busy[:, ::-1], axis=1), 0)
        return np.where(finest < PROBED.size - 1, wanted * PROBED[np.maximum(finest - 1, 0)], 0.0)

    def _advance(self) -> None:
        """Try one step in every column and keep those that are accurate enough."""
        at = self.at
        left = (at.duration - at.time) - at.rounding
        step = np.minimum(at.next_step, self.longest_steps[at.cases])
        step = np.where(step >= 0.99 * left, left, np.minimum(step, 0.5 * left))
        after = advance(self.system, self.method, at.time, self.state, step, self.increments)
        error = self.system.error(after, self.increments[-1]) / self.rtol
        error = np.where(np.isfinite(error), np.maximum(error, 1e-6), np.inf)
        accepted = (error <= 1) & self.active
        finished = accepted & (step >= left)
        last = finished & (at.span == self.last_span[at.cases])
        total = at.time + step
        stop = None
        if self.observe is not None and accepted.any():
            until = np.where(step >= left, at.duration, total)
            elapsed = np.where(last, self.durations[at.cases], at.begin + until)
            made = at.cases, accepted, at.time, step, until, self.state, after, self.increments
            stop = self.observe(Stride(self.system, self.method, *made, at.span, at.begin, at.duration, elapsed))
        factor = SAFETY * error**-self.exponent
        # Gustafsson's predictive controller: where errors grow or shrink steadily, expect them to go on so
        trend = factor * (step / at.last_step) * (at.last_error / error) ** self.exponent
        factor = np.where(
            accepted, np.minimum(np.where(at.last_step > 0, np.minimum(factor, trend), factor), GROW), np.minimum(factor, SAFETY)
        )
        following = step * np.maximum(factor, SHRINK)
        if self.spans is not None:  # a step that a span's end cut short says little of the next one
            following = np.where(finished, np.maximum(following, at.next_step), following)
        opening = accepted & (at.time == 0)
        self.result.next_step[at.cases[opening]] = following[opening]
        self.state = np.where(accepted, after, self.state)
        shift = total - at.time
        rounding = at.rounding + (at.time - (total - shift)) + (step - shift)
        at.time, at.rounding = np.where(accepted, total, at.time), np.where(accepted, rounding, at.rounding)
        at.last_step = np.where(accepted, step, at.last_step)
        at.last_error = np.where(accepted, np.maximum(error, 1e-2), at.last_error)
        at.next_step = following
        self._settle(accepted, finished, last, stop)

    def _settle(self, accepted: Flags, finished: Flags, last: Flags, stop: Flags | None) -> None:
        """Book the step, lead columns that have `finished` a span that is not the `last` on, and retire those that have ended."""
        result, at = self.result, self.at
        cases = at.cases
        result.steps[cases[accepted]] += 1
        result.rejected[cases[self.active & ~accepted]] += 1
        self.tries[cases[self.active]] += 1
        stopped = accepted & stop if stop is not None else np.zeros_like(accepted)
        if (ready := finished & ~stopped & ~last).any():
            self._onward(ready)
            finished = finished & ~ready
        vanished = self.active & ~finished & ((at.next_step < LEAST_STEP * at.time) | (at.next_step < NO_STEP))
        tries = self.tries[cases]
        endless = self.active & (tries >= MOST_STEPS)
        stalled = self.active & (tries > 0) & (tries % STALL_STEPS == 0)
        if stalled.any():
            due, reached = cases[stalled], at.time[stalled]
            stalled[stalled] = reached - self.milestone[due] < STALL_REACH * at.duration[stalled]
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
        result.time[cases[ended]] = np.where(whole, self.durations[cases], at.begin + at.time)[ended]
        unguided = ended & (self.first_steps[cases] <= 0)
        result.next_step[cases[unguided]] = at.next_step[unguided]
        self.active = self.active & ~ended
        at.time[ended] = at.rounding[ended] = 0.0  # a parked column steps on from here to nowhere, unseen
