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
    at = np.clip(start, lower, upper)
    count, size = at.shape
    free = np.ones((count, size), dtype=bool) if fixed is None else ~fixed
    every = np.arange(count)
    here, jacobian = with_slopes(residuals, at, every, upper, free)
    cost = _costs(here)
    damping, done = np.full(count, FIRST_DAMPING), ~np.isfinite(cost)
    reached = np.zeros(count, dtype=bool)
    for iteration in range(iterations):
        running = np.flatnonzero(~done)
        if not running.size:
            break
        step = _steps(here[running], jacobian[running], at[running], lower, upper, free[running], damping[running])
        trial = np.clip(at[running] + step, lower, upper)
        trial_here, trial_jacobian = with_slopes(residuals, trial, running, upper, free[running])
        trial_cost = _costs(trial_here)
        gain = cost[running] - trial_cost
        moved = np.max(np.abs(trial - at[running]), axis=1)
        better = gain > 0
        small = np.where(better, gain <= settled * cost[running], (moved < 1e-7) | (damping[running] >= MOST_DAMPING))
        taken = running[better]
        at[taken], here[taken], jacobian[taken] = trial[better], trial_here[better], trial_jacobian[better]
        cost[taken] = trial_cost[better]
        damping[running] = np.clip(damping[running] * np.where(better, FALL, RISE), LEAST_DAMPING, MOST_DAMPING)
        # a small gain under strong damping does not mean convergence
        end = running[small & (~better | (damping[running] <= 1.0) | (moved < 1e-7))]
        done[end] = reached[end] = True
        if watch is not None:
            watch(iteration, cost, at)
    return Solutions(at, cost, here, jacobian, reached)


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
