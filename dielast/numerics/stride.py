"""One step of many cases, and the states within it (dense output)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dielast.numerics.columns import Cases, Flags, Floats, paired
from dielast.numerics.rosenbrock import Rosenbrock
from dielast.numerics.system import System


def advance(system: System, method: Rosenbrock, time: Floats, state: Floats, step: Floats, increments: Floats) -> Floats:
    """States (rows, pool) a `step` (pool,) after a `state`; writes the `increments` (stages, rows, pool) that lead there."""
    equations = system.linearise(time, state, step, method.gamma)
    times = time + method.alpha[:, None] * step
    equations.increment(time, state, None, method.gamma_i[0], increments[0])
    stage = state
    for i in range(1, method.stages):
        if method.adds_last[i]:
            stage = stage + increments[i - 1]
            history = np.einsum("s,srm->rm", method.c[i, :i], increments[:i])
        else:
            stage, history = np.einsum("bs,srm->brm", method.ac[i][:, :i], increments[:i])
            stage += state
        equations.increment(times[i], stage, history, method.gamma_i[i], increments[i])
    return np.asarray(stage + increments[-1])


@dataclass(frozen=True, slots=True, eq=False)
class Stride:
    """One step of a pool of cases: `cases` (pool,) names them, `accepted` (pool,) says which of the steps count.

    `time` and `step` (pool,) in s count since the `span` began, which was `begin` s after the integration began and takes
    `duration` s. The step ends at `until` in the span, exactly its duration in the last step, and `elapsed` s after the integration
    began, exactly the whole duration at the very end. `before` and `after` are states (rows, pool), `increments` (stages, rows,
    pool). A case may stand in two columns, alike in both.
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


class Observer(Protocol):
    """Sees every step."""

    def __call__(self, stride: Stride) -> Flags | None:
        """Columns (pool,) whose case ends at `stride.after`, or None for none."""


@dataclass(frozen=True, slots=True, eq=False)
class DenseSteps:
    """Dense output of columns (k,) of strides, kept: polynomials in the fraction of the step, `coefficients` (5, rows, k)."""

    method: Rosenbrock
    cases: Cases
    time: Floats
    step: Floats
    coefficients: Floats

    @classmethod
    def of(cls, stride: Stride, rows: slice, columns: Cases) -> DenseSteps:
        """These rows and columns (k,) of a stride."""
        inner = np.einsum("is,srk->irk", stride.method.dense, stride.increments[:, rows, paired(columns)])[:, :, : columns.size]
        ends = np.stack((stride.before[rows, columns], stride.after[rows, columns]))
        coefficients = np.concatenate((ends, inner))
        return cls(stride.method, stride.cases[columns], stride.time[columns], stride.step[columns], coefficients)

    @classmethod
    def joined(cls, parts: list[DenseSteps]) -> DenseSteps:
        """The columns of all parts, one part after another."""
        arrays = ((part.cases, part.time, part.step, part.coefficients) for part in parts)
        return cls(parts[0].method, *(np.concatenate(one, axis=-1) for one in zip(*arrays, strict=True)))

    def take(self, columns: Cases, rows: slice = slice(None)) -> DenseSteps:
        """Some of the columns, and of the rows."""
        coefficients = self.coefficients[:, rows][:, :, columns]
        return DenseSteps(self.method, self.cases[columns], self.time[columns], self.step[columns], coefficients)

    def state(self, fraction: Floats) -> Floats:
        """States (rows, k) at fractions (k,) of the steps."""
        before, after, k1, k2, k3 = self.coefficients
        rest = 1 - fraction
        return np.asarray(rest * before + fraction * (after + rest * (k1 + fraction * (k2 + fraction * k3))))

    def anew(self, system: System, fraction: Floats) -> Floats:
        """The same states, as exact as steps are, by steps that end there; all rows are needed."""
        before = np.ascontiguousarray(self.coefficients[0])
        increments = np.empty((self.method.stages, *before.shape))
        return advance(system, self.method, self.time, before, fraction * self.step, increments)

    def rate(self, fraction: Floats) -> Floats:
        """Rates of the states (rows, k) in 1/s at fractions (k,) of the steps."""
        before, after, k1, k2, k3 = self.coefficients
        bulge = (1 - 2 * fraction) * (k1 + fraction * (k2 + fraction * k3)) + fraction * (1 - fraction) * (k2 + 2 * fraction * k3)
        return np.asarray((after - before + bulge) / self.step)
