"""Levenberg and Marquardt's method for many fits at once, which evaluates the models of all fits in one batch.

The fits may be starts of one problem, points of a profile or resampled data. Bounds hold by projection: a parameter that is at a
bound and would leave the range is fixed for a step (Bertsekas 1982, DOI 10.1137/0320018; Nocedal and Wright, Ch. 10).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Cases, Flags, Floats

DIFFERENCE = 1e-3  # of a coordinate, for derivatives: far above the tolerance of the solver, and small for a logarithm
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-9, 1e9
FALL, RISE = 0.2, 5.0  # factors on the damping, after an accepted and a refused step
SETTLED = 1e-5  # relative change of the sum of squares at which a fit ends
LONGEST = 1.5  # step of a coordinate, a factor of 4.5 for a positive number
MOST_ITERATIONS = 120

Residuals = Callable[[Floats, Cases], Floats]
"""Residuals (k, n) at coordinates (k, p) of the fits with these numbers (k,); not finite if the model cannot be evaluated."""
Watcher = Callable[[int, Floats, Floats], None]
"""Called after every iteration with its number, the sums of squares (fits,) and the coordinates (fits, p)."""


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """Solutions of the fits: `coordinates` (fits, p), `cost` (fits,) = sum of squares, `residuals` (fits, n), `jacobian` (fits, n,
    p), and which have `settled` (fits,). The cost is infinite if the model cannot be evaluated at the start.
    """

    coordinates: Floats
    cost: Floats
    residuals: Floats
    jacobian: Floats
    settled: Flags

    @property
    def best(self) -> int:
        """The fit with the least sum of squares."""
        return int(np.argmin(self.cost))


def with_slopes(residuals: Residuals, at: Floats, fits: Cases, upper: Floats, moves: Flags) -> tuple[Floats, Floats]:
    """Residuals (k, n) and their derivatives (k, n, p) at coordinates (k, p), by forward differences, in one batch.

    Only parameters with `moves` (k, p) True are varied; the derivatives by the others are 0. If the model cannot be evaluated on
    one side, the difference is taken on the other side.
    """
    count, size = at.shape
    row, column = np.nonzero(moves)
    step = np.where(at + DIFFERENCE > upper, -DIFFERENCE, DIFFERENCE)[row, column]
    varied = at[row].copy()
    varied[np.arange(row.size), column] += step
    answers = residuals(np.concatenate((at, varied)), np.concatenate((fits, fits[row])))
    base, shifted = answers[:count], answers[count:]
    missing = np.flatnonzero(~np.all(np.isfinite(shifted), axis=1) & np.all(np.isfinite(base[row]), axis=1))
    if missing.size:
        again = at[row[missing]].copy()
        again[np.arange(missing.size), column[missing]] -= step[missing]
        step[missing] *= -1
        shifted[missing] = residuals(again, fits[row[missing]])
    jacobian = np.zeros((count, base.shape[1], size))
    slopes = (shifted - base[row]) / step[:, None]
    jacobian[row, :, column] = np.where(np.isfinite(slopes), slopes, 0.0)
    return base, jacobian


@dataclass(slots=True, eq=False)
class Descents:
    """Fits under way: `at` (fits, p), `there` (fits, n) the residuals at these coordinates, `jacobian` (fits, n, p), `cost` (fits,)
    and `damping` (fits,).

    `varied` (fits, p) are the parameters by which the residuals are differentiated, `free` (fits, p) those that a step may change.
    """

    residuals: Residuals
    lower: Floats
    upper: Floats
    free: Flags
    varied: Flags
    at: Floats
    there: Floats
    jacobian: Floats
    cost: Floats
    damping: Floats

    @classmethod
    def begin(
        cls, residuals: Residuals, start: Floats, lower: Floats, upper: Floats, free: Flags, varied: Flags | None = None
    ) -> Descents:
        """Fits at their `start` (fits, p); the cost is infinite if the model cannot be evaluated there."""
        at = np.clip(start, lower, upper)
        varied = free if varied is None else varied
        there, jacobian = with_slopes(residuals, at, np.arange(at.shape[0]), upper, varied)
        damping = np.full(at.shape[0], FIRST_DAMPING)
        return cls(residuals, lower, upper, free, varied, at, there, jacobian, _costs(there), damping)

    def trials(self, fits: Cases) -> Floats:
        """The coordinates (k, p) to which the damped steps of the `fits` (k,) lead."""
        there = self.there[fits], self.jacobian[fits], self.at[fits]
        step = _steps(*there, self.lower, self.upper, self.free[fits], self.damping[fits])
        return np.clip(self.at[fits] + step, self.lower, self.upper)

    def visit(self, fits: Cases, trial: Floats, settled: float, anew: Flags | None = None) -> Flags:
        """Move those of the `fits` (k,) whose cost is less at the `trial` (k, p), and those that begin `anew` (k,) in any case.

        Returns which fits have converged (k,): those that gain less than the share `settled` of their cost.
        """
        there, jacobian = with_slopes(self.residuals, trial, fits, self.upper, self.varied[fits])
        cost, anew = _costs(there), np.zeros(fits.size, dtype=bool) if anew is None else anew
        with np.errstate(invalid="ignore"):
            gain = self.cost[fits] - cost
        moved = np.max(np.abs(trial - self.at[fits]), axis=1)
        better = (gain > 0) & ~anew
        small = np.where(better, gain <= settled * self.cost[fits], (moved < 1e-7) | (self.damping[fits] >= MOST_DAMPING))
        taken = fits[better | anew]
        self.at[taken], self.there[taken], self.jacobian[taken] = (part[better | anew] for part in (trial, there, jacobian))
        self.cost[taken] = cost[better | anew]
        factor = np.where(anew, 1.0, np.where(better, FALL, RISE))
        self.damping[fits] = np.clip(self.damping[fits] * factor, LEAST_DAMPING, MOST_DAMPING)
        # a small gain under strong damping does not mean convergence
        return small & ~anew & (~better | (self.damping[fits] <= 1.0) | (moved < 1e-7))


def minimise(
    residuals: Residuals,
    start: Floats,
    lower: Floats,
    upper: Floats,
    *,
    fixed: Flags | None = None,
    iterations: int = MOST_ITERATIONS,
    settled: float = SETTLED,
    watch: Watcher | None = None,
) -> Solutions:
    """Least sums of squares from `start` (fits, p) within bounds (p,); parameters that are `fixed` (fits, p) keep their value.

    A fit stays at its start, with an infinite cost, if the model cannot be evaluated there.
    """
    free = np.ones(start.shape, dtype=bool) if fixed is None else ~fixed
    fits = Descents.begin(residuals, start, lower, upper, free)
    done, reached = ~np.isfinite(fits.cost), np.zeros(start.shape[0], dtype=bool)
    for iteration in range(iterations):
        running = np.flatnonzero(~done)
        if not running.size:
            break
        end = running[fits.visit(running, fits.trials(running), settled)]
        done[end] = reached[end] = True
        if watch is not None:
            watch(iteration, fits.cost, fits.at)
    return Solutions(fits.at, fits.cost, fits.there, fits.jacobian, reached)


def _costs(residuals: Floats) -> Floats:
    """Sums of squares (k,), infinite where a residual is not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        cost = np.einsum("kn,kn->k", residuals, residuals)
    return np.where(np.isfinite(cost), cost, np.inf)


def _steps(here: Floats, jacobian: Floats, at: Floats, lower: Floats, upper: Floats, free: Flags, damping: Floats) -> Floats:
    """The damped Gauss-Newton steps (k, p) in Marquardt's scaling, at most `LONGEST`."""
    slope = np.einsum("knp,kn->kp", jacobian, here)
    normal = np.einsum("knp,knq->kpq", jacobian, jacobian)
    moving = free & ~((at <= lower) & (slope > 0)) & ~((at >= upper) & (slope < 0))
    diagonal = np.einsum("kpp->kp", normal).copy()
    moving &= diagonal > 0
    both = moving[:, :, None] & moving[:, None, :]
    matrix = np.where(both, normal, 0.0)
    index = np.arange(at.shape[1])
    least = 1e-12 * np.max(diagonal, axis=1, keepdims=True)
    matrix[:, index, index] = np.where(moving, diagonal + damping[:, None] * np.maximum(diagonal, least), 1.0)
    step = -np.linalg.solve(matrix, np.where(moving, slope, 0.0)[:, :, None])[:, :, 0]
    return np.asarray(np.clip(step, -LONGEST, LONGEST))
