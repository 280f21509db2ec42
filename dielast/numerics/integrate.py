"""Adaptive integration of many independent cases at once, each case with its own time and step size.

A load may be smooth only in spans, such as the intervals of a table. A case then enters the next span in place, without leaving the
pool, and its time starts again from 0. The stepper knows neither the equations nor the coefficients of the method: a `System`
linearises itself, a `Rosenbrock` table says how the stages combine, and an `Observer` sees every accepted step with its dense
output, to record it or to stop cases at an event.
"""

from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any, Protocol

import numpy as np

from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.beginning import Beginning
from dielast.numerics.response import Fading, Response
from dielast.numerics.rosenbrock import RODAS5P, Rosenbrock
from dielast.numerics.stride import Observer, PoolColumns, Spans, System, TriedStep, Turns, advance

# numbers in the state of the cases that advance together: large enough to amortise Python calls, small enough to cache
POOL = 32_000
FEW = 2_000  # numbers in the state of so few cases that the columns of those that have ended cost less than to drop them
SAFETY, SHRINK, GROW = 0.9, 0.1, 8.0  # safety factor and bounds of the step size controller
LEAST_STEP = 1e-24  # shortest step over the time since the span began; a shorter one means that the solution ceases to exist
NO_STEP = 1e-290  # s, shortest step at the beginning of a span
MOST_STEPS = 100_000  # in a span
# a case stalls if so many tried steps lengthen the time in a span by less than this fraction, or, after ten times as many, cover
# less than a tenth of this fraction of the span
STALL_STEPS, STALL_REACH = 1_000, 1e-8


class Status(IntEnum):
    """How the integration of one case ended."""

    COMPLETED = 0
    STOPPED = 1
    STEP_VANISHED = 2
    TOO_MANY_STEPS = 3
    STALLED = 4
    NO_START = 5  # there is no consistent initial state


@dataclass(frozen=True, slots=True, eq=False)
class Integration:
    """The end of each case: `state` (rows, cases) and, of shape (cases,), the `time` in s, the `status`, the numbers of accepted
    `steps` and `rejected` steps, and the `next_step` in s with which to continue the integration.

    `next_step` is the last step size of a case whose first step was chosen from its rates. If the first step was given, it is the
    step size after that first step: similar pieces of load follow each other, and begin with similar kinks.
    """

    state: Floats
    time: Floats
    next_step: Floats
    status: Cases
    steps: Cases
    rejected: Cases


class Keeper(Protocol):
    """Keeps the states of long simulations, so that interrupted ones go on from there."""

    def resumed(self) -> Any:
        """The state that was kept of the simulation that now begins, None if none was."""

    def keep(self, state: Any) -> None:
        """Keep a state, which can be pickled, if it is time to."""


KEEPER: ContextVar[Keeper | None] = ContextVar("KEEPER", default=None)
"""Where simulations keep their states; None: nowhere."""


class Stepper:
    """An integration from a consistent `state` (rows, cases) at time 0 over a `duration` (cases,) in s, with local errors below
    `rtol`, which can be pickled between two steps.

    The duration may consist of `spans`; the system is in the first of them. Its equations may change at `turns`.

    `first_step` (cases,) in s proposes the first step, such as the `next_step` of an integration that this one continues; it is
    reduced where the rates have a transient at the start. Where it is 0, the first step follows from the rates alone. Steps exceed
    `longest_step` (cases,) by at most 1 %: the error estimate cannot see a load that swings and returns within one step. A case
    of duration 0 keeps its state. No case raises an error: `status` says how it ended.

    At most `pool` cases advance together, in columns of the pool; no result depends on this number. Columns whose cases have ended
    are replaced by waiting cases, or dropped.
    """

    def __init__(
        self,
        system: System,
        state: Floats,
        duration: Floats,
        *,
        rtol: float,
        method: Rosenbrock = RODAS5P,
        pool: int | None = None,
        first_step: Floats | None = None,
        longest_step: Floats | None = None,
        spans: Spans | None = None,
        turns: Turns | None = None,
    ) -> None:
        self.system_of_all, self.durations = system, duration
        self.first_steps = np.zeros_like(duration) if first_step is None else first_step
        self.longest_steps = np.full_like(duration, np.inf) if longest_step is None else longest_step
        self.rtol, self.method, self.spans, self.size = rtol, method, spans, pool or max(16, POOL // state.shape[0])
        self.result = Integration(state.copy(), *np.zeros((2, duration.size)), *np.zeros((3, duration.size), dtype=np.intp))
        self.waiting = np.flatnonzero(duration > 0)
        self.observe: Observer | None = None
        self.turns, self.exponent = turns, 1 / method.order
        with np.errstate(all="ignore"):
            self.last_span = self._last_spans()
        self.at = PoolColumns.start(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0))
        self.active = np.zeros(0, dtype=bool)
        self.state = self.result.state[:, :0]
        self.beginning = Beginning(method, rtol)
        self.response: Response | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "observe": None}

    def run(self, observe: Observer | None = None, keep: Callable[[], None] | None = None) -> Integration:
        """Advance until all cases have ended; `keep` is called after each step."""
        self.observe = observe
        with np.errstate(all="ignore"):  # a step whose result is not finite is rejected
            while (running := np.count_nonzero(self.active)) or self.waiting.size:
                vacant = self.size - running
                if (self.waiting.size and vacant >= self.size // 8) or (
                    not self.waiting.size and running <= 0.75 * self.active.size > 2 and self.state.size > FEW
                ):
                    starting, self.waiting = self.waiting[:vacant], self.waiting[vacant:]
                    self._refill(starting)
                self._advance()
                if keep is not None:
                    keep()
        return self.result

    def _last_spans(self) -> Cases:
        """The last span (cases,) of a duration above 0, of each case."""
        cases = np.arange(self.durations.size)
        last = np.zeros_like(cases)
        if self.spans is not None:
            last += self.spans.spans - 1
            while (empty := np.flatnonzero((last > 0) & ~(self.spans.span(cases, last)[1] > 0))).size:
                last[empty] -= 1
        return last

    def _refill(self, starting: Cases) -> None:
        """Drop the columns of cases that have ended, and add columns of the `starting` cases."""
        keep = np.flatnonzero(self.active)
        new_columns = PoolColumns.start(starting, self.durations[starting], self.longest_steps[starting])
        at = PoolColumns.joined([self.at.take(keep), new_columns])
        state = np.concatenate((self.state[:, keep], self.result.state[:, starting]), axis=1)
        if self.beginning.fading is not None:  # of the new columns, any that are kept until they open
            self.beginning.fading = self.beginning.fading.take(paired(np.concatenate((keep, np.zeros_like(starting)))))
        pair = paired(np.arange(at.cases.size))
        at, state = at.take(pair), np.take(state, pair, axis=1)
        new = np.arange(keep.size, at.cases.size) if starting.size else starting
        system: Any = self.system_of_all.take(at.cases)
        if self.turns is not None:
            system = self.turns.present(system, at.cases)
        if self.spans is not None and at.cases.size:
            system, at.duration = self._entered(system, np.arange(at.cases.size), at.cases, at.span)
        if new.size:
            self.beginning.respond(system, state, at, new)
            at.next_step[new] = self.beginning.step(system, state, at, new[: starting.size], self.first_steps[starting])
        self.at, self.state, self.system = at, state, system
        self.active = np.ones(at.cases.size, dtype=bool)
        self.increments = np.empty((self.method.stages, *state.shape))

    def _entered(self, system: Any, columns: Cases, cases: Cases, span: Cases) -> tuple[System, Floats]:
        """The system with columns (k,) of `cases` (k,) in the spans `span` (k,), and the durations (k,) of these spans.

        Spans of duration 0 are skipped: `span` is changed in place to the next one that lasts.
        """
        assert self.spans is not None
        load, duration = self.spans.span(cases, span)
        system = system.driven_by(columns, load)
        while (empty := np.flatnonzero((duration <= 0) & (span < self.last_span[cases]))).size:
            span[empty] += 1
            load, duration[empty] = self.spans.span(cases[empty], span[empty])
            system = system.driven_by(columns[empty], load)
        return system, duration

    def _onward(self, ready: Flags) -> None:
        """Let the columns that are `ready` (pool,) enter their next span."""
        assert self.spans is not None
        at, columns = self.at, np.flatnonzero(ready)
        span = at.span[columns] + 1
        self.system, lasts = self._entered(self.system, columns, at.cases[columns], span)
        at.begin[columns] += at.duration[columns]
        at.span[columns], at.duration[columns] = span, lasts
        at.time[columns] = at.rounding[columns] = at.milestone[columns] = 0.0
        at.tries[columns], at.landing[columns] = 0, False
        kinks = columns[~self.spans.smooth(span)]
        if kinks.size:
            single_case, at_kink = at.cases.size == 2 and at.cases[0] == at.cases[1], kinks
            kinks = kinks[:1] if single_case else kinks
            proposed = np.where(self.result.next_step > 0, self.result.next_step, self.durations)[at.cases[kinks]]
            self.state = np.array(self.state)
            self.beginning.respond(self.system, self.state, at, at_kink)
            at.next_step[at_kink] = self.beginning.step(self.system, self.state, at, kinks, proposed)
            at.last_step[at_kink] = at.last_error[at_kink] = 0.0

    def _advance(self) -> None:
        """Try one step in every column, and accept the steps that are accurate enough."""
        at, cases = self.at, self.at.cases
        left = (at.duration - at.time) - at.rounding
        step = np.minimum(at.next_step, at.longest_step)
        step = np.where(step >= 0.99 * left, left, np.minimum(step, 0.5 * left))
        if self.turns is not None:
            step = np.where(at.landing, np.minimum(at.next_step, left), step)
        fading = None if self.beginning.fading is None else self.beginning.fading.rate
        after, self.response = advance(self.system, self.method, at.time, self.state, step, self.increments, fading)
        total, ends = at.time + step, step >= left
        until = np.where(ends, at.duration, total)
        error = self.system.error(until, after, self.increments[-1]) / self.rtol
        error = np.maximum(error, 1e-6)  # NaN, as the comparisons and `fmax` below need it, where the step is not finite
        accepted = (error <= 1) & self.active
        if self.turns is not None:  # part of a step that was accurate enough: relative to a stress that vanishes, no error is
            accepted |= at.landing & self.active & np.isfinite(error)
        share, stride = None, None
        if self.turns is not None and np.count_nonzero(accepted):
            stride = self._stride(accepted, step, until, after, at.begin + until)
            share = np.where(accepted, self.turns.share(stride, at.landing), np.inf)
            accepted = accepted & ~(share < 1)
        finished = accepted & ends
        last, elapsed = finished, at.begin + until
        if np.count_nonzero(finished):
            last = finished & (at.span == self.last_span[cases])
            elapsed = np.where(last, self.durations[cases], elapsed)
        stop, count = None, np.count_nonzero(accepted)
        if self.observe is not None and count:
            if stride is None:
                stride = self._stride(accepted, step, until, after, elapsed)
            else:  # with what is stored of its dense output
                stride = replace(stride, accepted=accepted, elapsed=elapsed)
            stop = self.observe(stride)
        factor = SAFETY * error**-self.exponent
        # Gustafsson's predictive controller extrapolates the trend of the errors; upwards, it would make events less exact
        trend = factor * (step / at.last_step) * (at.last_error / error) ** self.exponent
        factor = np.where(
            accepted, np.minimum(np.where(at.last_step > 0, np.minimum(factor, trend), factor), GROW), np.minimum(factor, SAFETY)
        )
        following = step * np.fmax(factor, SHRINK)
        if self.spans is not None:  # a step cut short by the end of its span must not shorten the next one
            following = np.where(finished, np.maximum(following, at.next_step), following)
        opening = accepted & (at.time == 0)  # the first step of a span
        if np.count_nonzero(opening):
            self.result.next_step[cases[opening]] = following[opening]
        shift = total - at.time
        rounding = at.rounding + (at.time - (total - shift)) + (step - shift)
        # copied, as observers keep the step, and kinks change that of the pool
        now: tuple[Floats, ...] = after, total, rounding, step.copy(), np.maximum(error, 1e-2)
        if count < accepted.size:
            before = self.state, at.time, at.rounding, at.last_step, at.last_error
            now = tuple(np.where(accepted, new, old) for new, old in zip(now, before, strict=True))
        self.state, at.time, at.rounding, at.last_step, at.last_error = now
        at.next_step = following
        if self.beginning.fading is not None and self.response is not None:
            faded = self.beginning.fading.rate * np.exp(-self.response.decay * step)
            if count < accepted.size:
                faded = np.where(accepted, faded, self.beginning.fading.rate)
            self.beginning.fading = Fading(faded, self.beginning.fading.beyond)
        if share is not None and (np.isfinite(share).any() or at.landing.any()):
            self._turn(share, step)
        self._settle(accepted, finished, last, stop)

    def _stride(self, accepted: Flags, step: Floats, until: Floats, after: Floats, elapsed: Floats) -> TriedStep:
        """The step that was tried."""
        at = self.at
        tried = at.cases, accepted, at.time, step, until, self.state, after, self.increments
        place, fading = (
            (at.span, at.begin, at.duration, elapsed),
            None if self.beginning.fading is None else self.beginning.fading.rate,
        )
        return TriedStep(self.system, self.method, *tried, *place, self.response, fading)

    def _turn(self, share: Floats, step: Floats) -> None:
        """Let columns whose equations change within the step end it there, and change those at whose start or end they do.

        `share` (pool,) is the fraction of the `step` (pool,) in s at which they change, infinite where they do not.
        """
        assert self.turns is not None
        at, within = self.at, (share > 0) & (share < 1)
        at.next_step = np.where(within, share * step, at.next_step)
        at.landing = within
        columns = np.flatnonzero(np.isfinite(share) & ~within)
        if columns.size:
            place = columns, at.cases[columns], (at.begin + at.time)[columns], at.time[columns]
            self.state = np.array(self.state)
            self.system = self.turns.turn(self.system, *place, self.state)
            self.beginning.respond(self.system, self.state, at, columns)
            at.next_step[columns] = self.beginning.step(self.system, self.state, at, columns, (at.duration - at.time)[columns])
            at.last_step[columns] = at.last_error[columns] = 0.0

    def _settle(self, accepted: Flags, finished: Flags, last: Flags, stop: Flags | None) -> None:
        """Count the steps, let columns that have `finished` a span enter the next one, and store the cases that have ended.

        `finished` (pool,) marks the end of any span, `last` (pool,) that of the last span of a case.
        """
        result, at = self.result, self.at
        cases = at.cases
        at.steps, at.rejected, at.tries = at.steps + accepted, at.rejected + ~accepted, at.tries + 1
        stopped = accepted & stop if stop is not None else np.zeros(accepted.shape, dtype=bool)
        if np.count_nonzero(ready := finished & ~stopped & ~last):
            self._onward(ready)
            finished = finished & ~ready
        vanished = self.active & ~finished & (at.next_step < np.maximum(LEAST_STEP * at.time, NO_STEP))
        endless = stalled = at.tries >= min(STALL_STEPS, MOST_STEPS)
        if np.count_nonzero(stalled):
            endless = self.active & (at.tries >= MOST_STEPS)
            stalled = self.active & (at.tries % STALL_STEPS == 0)
            due = np.flatnonzero(stalled)
            whole = np.where(at.tries[due] % (10 * STALL_STEPS) == 0, 0.1 * at.duration[due], at.time[due])
            stalled[due] = at.time[due] - at.milestone[due] < STALL_REACH * whole
            at.milestone[due] = at.time[due]
        ended = finished | vanished | endless | stalled | stopped
        if not np.count_nonzero(ended):
            return
        outcomes = (  # the last one that holds counts; a call of np.select takes longer
            (endless, Status.TOO_MANY_STEPS),
            (stalled, Status.STALLED),
            (vanished, Status.STEP_VANISHED),
            (finished, Status.COMPLETED),
            (stopped, Status.STOPPED),
        )
        for condition, status in outcomes:
            result.status[cases[condition]] = status
        result.state[:, cases[ended]] = self.state[:, ended]
        result.steps[cases[ended]], result.rejected[cases[ended]] = at.steps[ended], at.rejected[ended]
        completed = finished & ~stopped if self.spans is not None else finished
        result.time[cases[ended]] = np.where(completed, self.durations[cases], at.begin + at.time)[ended]
        without_proposal = ended & (self.first_steps[cases] <= 0)
        result.next_step[cases[without_proposal]] = at.next_step[without_proposal]
        self.active = self.active & ~ended
        at.time[ended] = at.rounding[ended] = 0.0  # the column is still computed until the next refill, but its steps are discarded
