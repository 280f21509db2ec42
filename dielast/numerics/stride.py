"""One step of many cases: the interface of the stepper to the equations that it integrates and to the spans of the load, the
position of the cases in time, and the states within a step (dense output).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from dielast.numerics.arrays import ByCase, Cases, Flags, Floats, paired
from dielast.numerics.response import Response
from dielast.numerics.rosenbrock import Rosenbrock


class Linearised(Protocol):
    """The linear system of one step."""

    def increment(self, stage: int, state: Floats, history: Floats | None, gamma_i: float, out: Floats) -> Floats:
        """The increment u_i (rows, cases) of the stage of this number at `state`, but for what is known of it in closed form; it is
        written to the contiguous array `out`.

        `history` is sum_j c_ij u_j, None in the first stage.
        """


class System(Protocol):
    """Differential-algebraic equations of index 1 for states of shape (rows, cases); the cases are independent."""

    def take(self, cases: Cases) -> Self:
        """The equations of the selected cases (k,)."""

    def linearise(self, times: Floats, state: Floats, step: Floats, gamma: float) -> Linearised:
        """The linear system of a step (cases,) in s from `state`, whose stages are at `times` (stages, cases); it starts at the
        first of them.
        """

    def error(self, time: Floats, state: Floats, increment: Floats) -> Floats:
        """The relative error (cases,) of a `state` (rows, cases) at a `time` (cases,) in s that is wrong by an `increment`
        (rows, cases).
        """


class Turns(Protocol):
    """Moments at which the equations of a case change, within a smooth span of load: a step ends exactly there."""

    def share(self, stride: TriedStep, landing: Flags) -> Floats:
        """The fractions (pool,) of accepted steps at which their equations change: 0 at the start, 1 at the end, infinite where
        they do not. `landing` (pool,) marks steps that were shortened to end there.
        """

    def present(self, system: Any, cases: Cases) -> Any:
        """The system of these `cases` (k,) with the equations that they have now, rather than at the beginning."""

    def turn(self, system: Any, columns: Cases, cases: Cases, elapsed: Floats, time: Floats, state: Floats) -> Any:
        """The system with changed equations in `columns` (k,), which integrate the `cases` (k,); it is `elapsed` (k,) s after the
        integration began and `time` (k,) s after the span began. The `state` (rows, pool) is made consistent in place.
        """


class Spans(Protocol):
    """The spans of the load, one after another; the load is smooth within a span. The duration of a span may be 0."""

    @property
    def spans(self) -> int:
        """The number of spans."""

    def span(self, cases: Cases, index: Cases) -> tuple[Any, Floats]:
        """The load in the spans `index` (k,) of `cases` (k,), as `driven_by(columns, load)` of the system takes it for columns
        (k,), and the durations (k,) in s of these spans.
        """

    def smooth(self, index: Cases) -> Flags:
        """Whether the load is smooth (without a kink) at the beginning of the spans `index` (k,)."""


@dataclass(slots=True, eq=False)
class PoolColumns(ByCase):
    """The position of each column of a pool: all arrays (pool,).

    A column integrates a case of index `cases` through the span of index `span`, which lasts `duration` s and begins `begin` s
    after the start of the integration. `time` in s is the time since the span began, `rounding` in s the rounding error of `time`
    (compensated summation). `next_step` is the step size to try, at most `longest_step`; `last_step` and `last_error` (in
    tolerances) are those of the last accepted step, 0 before the first. `steps` and `rejected` count the accepted and the rejected
    steps of the case, `tries` all steps in its span; `milestone` in s is the time in the span at the last check for a stalled case.
    `landing` marks steps that end where the equations change (`Turns`).
    """

    cases: Cases
    span: Cases
    begin: Floats
    duration: Floats
    time: Floats
    rounding: Floats
    next_step: Floats
    longest_step: Floats
    last_step: Floats
    last_error: Floats
    steps: Cases
    rejected: Cases
    tries: Cases
    milestone: Floats
    landing: Flags

    @classmethod
    def start(cls, cases: Cases, duration: Floats, longest_step: Floats) -> PoolColumns:
        """Columns of `cases` (k,) at the beginning of their first span, which lasts `duration` (k,) s."""
        begin, time, rounding, next_step, last_step, last_error, milestone = np.zeros((7, cases.size))
        span, steps, rejected, tries = np.zeros((4, cases.size), dtype=np.intp)
        now = begin, duration, time, rounding, next_step, longest_step
        return cls(cases, span, *now, last_step, last_error, steps, rejected, tries, milestone, np.zeros(cases.size, dtype=bool))


def advance(
    system: Any, method: Rosenbrock, time: Floats, state: Floats, step: Floats, increments: Floats, fading: Floats | None = None
) -> tuple[Floats, Response | None]:
    """States (rows, pool) at the end of a `step` (pool,) in s from `state` (rows, pool) at `time` (pool,), and the part of the step
    that is known in closed form, if there is a rate that is `fading` (m, n, pool).

    Writes the increments u_i of all stages to `increments` (stages, rows, pool), those of the rest of the step.
    """
    times = time + method.alpha[:, None] * step
    if fading is None:
        equations, response = system.linearise(times, state, step, method.gamma), None
    else:
        equations = system.linearise(times, state, step, method.gamma, fading)
        response = equations.response
    equations.increment(0, state, None, method.gamma_i[0], increments[0])
    stage = state
    for i in range(1, method.stages):
        if method.adds_last[i]:
            stage = stage + increments[i - 1]
            history = np.einsum("s,srm->rm", method.ac[i][1], increments[:i])
        else:
            stage, history = np.einsum("bs,srm->brm", method.ac[i], increments[:i])
            stage += state
        equations.increment(i, stage, history, method.gamma_i[i], increments[i])
    after = np.asarray(stage + increments[-1])
    if response is not None:
        after += response.end
    return after, response


@dataclass(frozen=True, eq=False)
class TriedStep:
    """One step of a pool of cases; all arrays (pool,) unless stated.

    `cases` are the indices of the cases, `accepted` marks the accepted steps. A step of `step` s starts `time` s after its `span`
    began; the span began `begin` s after the integration and lasts `duration` s. The step ends `until` s after its span began
    (exactly `duration` in the last step of a span), and `elapsed` s after the integration began (exactly the total duration in the
    last step of a case). `before` and `after` (rows, pool) are states, `increments` is (stages, rows, pool), without the `response`
    that is known in closed form. A case may occupy two columns, which are then equal.
    """

    system: System
    method: Rosenbrock
    cases: Cases
    accepted: Flags
    time: Floats
    step: Floats
    until: Floats
    before: Floats
    after: Floats
    increments: Floats
    span: Cases
    begin: Floats
    duration: Floats
    elapsed: Floats
    response: Response | None = None
    fading: Floats | None = None
    """The rate (m, n, pool) that fades at the beginning of the step."""
    _stored: dict[int | None, DenseSteps] = field(default_factory=dict, repr=False)

    @cached_property
    def once(self) -> Cases:
        """The accepted columns (k,); of two columns with the same case, the first."""
        accepted = np.flatnonzero(self.accepted)
        return accepted[:1] if self.cases.size == 2 and self.cases[0] == self.cases[1] else accepted

    def stored(self, rows: slice) -> DenseSteps:
        """The dense output of the last `rows` of all columns, for all observers alike."""
        if rows.start not in self._stored:
            self._stored[rows.start] = DenseSteps.of(self, rows)
        return self._stored[rows.start]

    def dense(self, rows: slice, columns: Cases, fraction: Floats) -> Floats:
        """States (rows, k) of the columns (k,) at fractions (k,) of their steps, by the dense output of the method."""
        k1, k2, k3 = np.einsum("is,srk->irk", self.method.dense, self.increments[:, rows, columns])
        remaining = 1 - fraction
        inner = self.after[rows, columns] + remaining * (k1 + fraction * (k2 + fraction * k3))
        state = np.asarray(remaining * self.before[rows, columns] + fraction * inner)
        response = _of_rows(self.response, rows)
        if response is None:
            return state
        response = response.take(columns)
        return state + response.at(fraction * self.step[columns]) - fraction * response.end

    def halfway(self) -> Floats:
        """States (rows, pool) in the middle of the steps."""
        state = np.einsum("s,srk->rk", self.method.middle, self.increments)
        state += 0.5 * (self.before + self.after)
        if self.response is not None:
            state += self.response.middle - 0.5 * self.response.end
        return np.asarray(state)


Observer = Callable[[TriedStep], Flags | None]
"""A function that is called after every step; returns a mask (pool,) of columns whose case stops at `stride.after`, or None."""


@dataclass(frozen=True, slots=True, eq=False)
class DenseSteps(ByCase):
    """Stored dense output of columns (k,) of strides: polynomials in the fraction of the step, `coefficients` (5, rows, k), and a
    `response` known in closed form. Steps of all rows have what is `fading` at their beginning, to be repeated.
    """

    method: Rosenbrock
    cases: Cases
    time: Floats
    step: Floats
    coefficients: Floats
    response: Response | None = None
    fading: Floats | None = None

    @classmethod
    def of(cls, stride: TriedStep, rows: slice, columns: Cases | None = None) -> DenseSteps:
        """The dense output of these rows and columns (k,), by default of all columns, of a stride."""
        chosen: Any = slice(None) if columns is None else columns
        pair: Any = slice(None) if columns is None else paired(columns)
        before, after = stride.before[rows, chosen], stride.after[rows, chosen]
        response, fading = _of_rows(stride.response, rows), stride.fading if rows == slice(None) else None
        if columns is not None:
            response = None if response is None else response.take(columns)
            fading = None if fading is None else fading.take(columns, axis=-1)
        coefficients = np.empty((2 + len(stride.method.dense), *before.shape))
        coefficients[0], coefficients[1] = before, after
        inner = np.einsum("is,srk->irk", stride.method.dense, stride.increments[:, rows, pair])
        coefficients[2:] = inner[..., : before.shape[1]]
        if response is not None:
            coefficients[1] -= response.end
        place = stride.cases[chosen], stride.time[chosen], stride.step[chosen]
        return cls(stride.method, *place, coefficients, response, fading)

    def rows(self, rows: slice) -> DenseSteps:
        """The selected rows."""
        return replace(self, coefficients=self.coefficients[:, rows], response=_of_rows(self.response, rows), fading=None)

    def state(self, fraction: Floats) -> Floats:
        """States (rows, k) at fractions (k,) of the steps."""
        before, after, k1, k2, k3 = self.coefficients
        remaining = 1 - fraction
        state = np.asarray(remaining * before + fraction * (after + remaining * (k1 + fraction * (k2 + fraction * k3))))
        return state if self.response is None else state + self.response.at(fraction * self.step)

    def repeated(self, system: System, fraction: Floats) -> Floats:
        """States (rows, k) at fractions (k,) of the steps, by new steps that end there: as accurate as any step.

        All rows of the state must be stored.
        """
        before = np.ascontiguousarray(self.coefficients[0])
        increments = np.empty((self.method.stages, *before.shape))
        return advance(system, self.method, self.time, before, fraction * self.step, increments, self.fading)[0]

    def rate(self, fraction: Floats) -> Floats:
        """Rates of the states (rows, k) in 1/s at fractions (k,) of the steps."""
        before, after, k1, k2, k3 = self.coefficients
        bulge = (1 - 2 * fraction) * (k1 + fraction * (k2 + fraction * k3)) + fraction * (1 - fraction) * (k2 + 2 * fraction * k3)
        rate = np.asarray((after - before + bulge) / self.step)
        return rate if self.response is None else rate + self.response.slope(fraction * self.step)


def joined_steps(parts: Sequence[tuple[DenseSteps, Cases]]) -> DenseSteps:
    """The selected columns (k,) of strides as one, in this order."""
    first = np.cumsum([0, *(steps.cases.size for steps, _ in parts[:-1])])
    columns = [begin + part for begin, (_, part) in zip(first, parts, strict=True)]
    return DenseSteps.joined([steps for steps, _ in parts]).take(np.concatenate(columns))


def _of_rows(response: Response | None, rows: slice) -> Response | None:
    """The response of selected rows, None if there is none."""
    return None if response is None else response.rows(rows)
