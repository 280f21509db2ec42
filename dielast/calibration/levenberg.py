"""Levenberg and Marquardt's method for many fits at once, which evaluates the models of all fits in one batch.

The fits may be starts of one problem, points of profiles or resampled data. Bounds hold by projection: a parameter that is at a
bound and would leave the range is fixed for a step (Bertsekas 1982, DOI 10.1137/0320018; Nocedal and Wright, Ch. 10).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.numerics.arrays import Cases, Flags, Floats

DIFFERENCE = 1e-3  # of a coordinate, for derivatives: far above the tolerance of the solver, and small for a logarithm
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-9, 1e9
FALL, RISE = 0.2, 5.0  # factors on the damping, after an accepted and a refused step
SETTLED = 1e-5  # relative change of the sum of squares at which a fit ends
LEAST_CURVATURE = 1e-6  # with the bend, over that of a parameter alone without it: below, the bend is not used
SHORTEST = 1e-6  # step that shows the bend, and least cosine between a step and the change of the slope
LONGEST = 1.5  # step of a coordinate, a factor of 4.5 for a positive number
MOST_ITERATIONS = 120

Residuals = Callable[[Floats, Cases], Floats]
"""Residuals (k, n) at coordinates (k, p) of the fits with these numbers (k,); not finite if the model cannot be evaluated."""
Bounds = tuple[Floats, Floats]
"""The least and the largest coordinates, each (p,), or (fits, p) if each fit has its own."""
Watcher = Callable[[int, Floats, Floats], None]
"""Called after every iteration with the number of settled fits, the sums of squares (fits,) and the coordinates (fits, p)."""


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


def with_slopes(residuals: Residuals, at: Floats, fits: Cases, bounds: Bounds, moves: Flags) -> tuple[Floats, Floats]:
    """Residuals (k, n) and their derivatives (k, n, p) at coordinates (k, p), by forward differences, in one batch.

    Only parameters with `moves` (k, p) True are varied; the derivatives by the others are 0. If the model cannot be evaluated on
    one side, the difference is taken on the other side.
    """
    count, size = at.shape
    row, column = np.nonzero(moves)
    step = np.where(at + DIFFERENCE > bounds[1], -DIFFERENCE, DIFFERENCE)[row, column]
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
    `bend` (fits, p, p), None for Gauss and Newton's steps, is an estimate of the sum of the residuals times their second
    derivatives, from the change of the jacobian in all steps. It is used where it is `trusted` (fits,): where the last gain is
    better predicted with it (Dennis, Gay and Welsch 1981, DOI 10.1145/355958.355965).
    """

    residuals: Residuals
    bounds: Bounds
    free: Flags
    varied: Flags
    at: Floats
    there: Floats
    jacobian: Floats
    cost: Floats
    damping: Floats
    bend: Floats | None
    trusted: Flags

    @classmethod
    def begin(
        cls,
        residuals: Residuals,
        start: Floats,
        bounds: Bounds,
        free: Flags,
        varied: Flags | None = None,
        bent: bool = False,
    ) -> Self:
        """Fits at their `start` (fits, p); the cost is infinite if the model cannot be evaluated there."""
        at = np.clip(start, *bounds)
        count, size = at.shape
        bounds = np.broadcast_to(bounds[0], at.shape), np.broadcast_to(bounds[1], at.shape)
        varied = free if varied is None else varied
        there, jacobian = with_slopes(residuals, at, np.arange(count), bounds, varied)
        bend, damping = np.zeros((count, size, size)) if bent else None, np.full(count, FIRST_DAMPING)
        trusted = np.zeros(count, dtype=bool)
        return cls(residuals, bounds, free, varied, at, there, jacobian, costs(there), damping, bend, trusted)

    def model(self, fits: Cases) -> Model:
        """The cost about the `fits` (k,) as a function of second order."""
        there, jacobian, at = self.there[fits], self.jacobian[fits], self.at[fits]
        slope = np.einsum("knp,kn->kp", jacobian, there)
        normal = np.einsum("knp,knq->kpq", jacobian, jacobian)
        diagonal = np.einsum("kpp->kp", normal).copy()
        lower, upper = self._bounds(fits)
        moving = self.free[fits] & ~((at <= lower) & (slope > 0)) & ~((at >= upper) & (slope < 0)) & (diagonal > 0)
        if self.bend is not None and (chosen := np.flatnonzero(self.trusted[fits])).size:
            whole = normal[chosen] + self.bend[fits[chosen]]
            scale = np.where(moving, np.sqrt(diagonal), np.inf)[chosen]
            scaled = whole / (scale[:, :, None] * scale[:, None, :]) + np.eye(at.shape[1]) * ~moving[chosen][:, None, :]
            convex = np.linalg.eigvalsh(scaled)[:, 0] > LEAST_CURVATURE
            normal[chosen[convex]] = whole[convex]
        return Model(slope, normal, diagonal, moving)

    def trials(self, fits: Cases) -> Floats:
        """The coordinates (k, p) to which the damped steps of the `fits` (k,) lead."""
        step = self.model(fits).step(self.damping[fits])
        return np.clip(self.at[fits] + np.clip(step, -LONGEST, LONGEST), *self._bounds(fits))

    def _bounds(self, fits: Cases) -> Bounds:
        """The bounds (k, p) of the `fits` (k,)."""
        return self.bounds[0][fits], self.bounds[1][fits]

    def visit(self, fits: Cases, trial: Floats, settled: float, anew: Flags | None = None) -> Flags:
        """Move those of the `fits` (k,) whose cost is less at the `trial` (k, p), and those that begin `anew` (k,) in any case.

        Returns which fits have converged (k,): those that gain less than the share `settled` of their cost.
        """
        there, jacobian = with_slopes(self.residuals, trial, fits, self._bounds(fits), self.varied[fits])
        cost, anew = costs(there), np.zeros(fits.size, dtype=bool) if anew is None else anew
        with np.errstate(invalid="ignore"):
            gain = self.cost[fits] - cost
        if self.bend is not None:
            self._learn(fits, trial, there, jacobian, gain, anew)
        moved = np.max(np.abs(trial - self.at[fits]), axis=1)
        better = (gain > 0) & ~anew
        small = np.where(better, gain <= settled * self.cost[fits], (moved < 1e-7) | (self.damping[fits] >= MOST_DAMPING))
        taken = fits[better | anew]
        self.at[taken], self.there[taken], self.jacobian[taken] = (part[better | anew] for part in (trial, there, jacobian))
        self.cost[taken] = cost[better | anew]
        factor = np.where(anew, 1.0, np.where(better, FALL, RISE))
        self.damping[fits] = np.clip(self.damping[fits] * factor, LEAST_DAMPING, MOST_DAMPING)
        # a small gain under strong damping does not mean convergence
        return np.asarray(small & ~anew & (~better | (self.damping[fits] <= 1.0) | (moved < 1e-7)))

    def _learn(self, fits: Cases, trial: Floats, there: Floats, jacobian: Floats, gain: Floats, anew: Flags) -> None:
        """Update the bend by steps s to the `trial` (k, p): residuals r' `there` (k, n) and `jacobian` J' (k, n, p).

        With g the slope J'r, the bend B is to turn the slope over the step as J' - J does: B s = t. The update

            B <- c B + (m y' + y m') / y's - s'm y y' / (y's)^2,
            t = (J' - J)' r',   y = g' - g,   m = t - c B s,   c = min(1, |s't| / |s'Bs|)

        is the smallest one in a norm in which the cost is round (Nocedal and Wright, Sec. 10.3).
        """
        assert self.bend is not None
        step = trial - self.at[fits]
        known = np.isfinite(gain) & (np.max(np.abs(step), axis=1) > SHORTEST)
        fits, step, there, jacobian, gain, anew = (part[known] for part in (fits, step, there, jacobian, gain, anew))
        before, bend = self.jacobian[fits], self.bend[fits]
        slope = np.einsum("knp,kn->kp", before, self.there[fits])
        bent = np.einsum("kpq,kq->kp", bend, step)
        straight = -2 * _dot(slope, step) - np.square(np.einsum("knp,kp->kn", before, step)).sum(axis=1)  # predicted gain
        better = np.abs(straight - _dot(step, bent) - gain) < np.abs(straight - gain)
        self.trusted[fits] = np.where(anew, self.trusted[fits], better)
        reached = np.einsum("knp,kn->kp", jacobian, there)
        turn, change = reached - np.einsum("knp,kn->kp", before, there), reached - slope
        work, stiff = _dot(change, step), np.abs(_dot(step, bent))
        share = np.where(stiff > 0, np.minimum(1.0, np.abs(_dot(step, turn)) / np.where(stiff > 0, stiff, 1.0)), 1.0)
        miss = turn - share[:, None] * bent
        usable = work > SHORTEST * np.sqrt(_dot(change, change) * _dot(step, step))
        work = np.where(usable, work, 1.0)[:, None, None]
        product = miss[:, :, None] * change[:, None, :]
        bend = share[:, None, None] * bend + (product + np.swapaxes(product, 1, 2)) / work
        bend -= _dot(step, miss)[:, None, None] / work**2 * change[:, :, None] * change[:, None, :]
        self.bend[fits[usable]] = bend[usable]


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """Costs as functions of second order of a step: `slope` (k, p) and `normal` (k, p, p) are the derivatives of half the cost.
    `diagonal` (k, p) is that of Gauss and Newton's normal matrix; parameters that are not `moving` (k, p) keep their value.
    """

    slope: Floats
    normal: Floats
    diagonal: Floats
    moving: Flags

    def solve(self, right: Floats, damping: Floats) -> Floats:
        """Changes (k, p, m) of the parameters that change the slope by `right` (k, p, m), with Marquardt's `damping` (k,)."""
        index = np.arange(self.slope.shape[1])
        both = self.moving[:, :, None] & self.moving[:, None, :]
        matrix = np.where(both, self.normal, 0.0)
        least = 1e-12 * np.max(self.diagonal, axis=1, keepdims=True)
        stiff = matrix[:, index, index] + damping[:, None] * np.maximum(self.diagonal, least)
        matrix[:, index, index] = np.where(self.moving, stiff, 1.0)
        return np.asarray(np.linalg.solve(matrix, np.where(self.moving[:, :, None], right, 0.0)))

    def step(self, damping: Floats) -> Floats:
        """The damped steps (k, p) to the least cost."""
        return -self.solve(self.slope[:, :, None], damping)[:, :, 0]


def minimise(
    residuals: Residuals,
    start: Floats,
    bounds: Bounds,
    *,
    fixed: Flags | None = None,
    iterations: int = MOST_ITERATIONS,
    settled: float = SETTLED,
    watch: Watcher | None = None,
) -> Solutions:
    """Least sums of squares from `start` (fits, p) within the `bounds`; parameters that are `fixed` (fits, p) keep their value.

    A fit stays at its start, with an infinite cost, if the model cannot be evaluated there.
    """
    free = np.ones(start.shape, dtype=bool) if fixed is None else ~fixed
    fits = Descents.begin(residuals, start, bounds, free)
    done, reached = ~np.isfinite(fits.cost), np.zeros(start.shape[0], dtype=bool)
    for _ in range(iterations):
        running = np.flatnonzero(~done)
        if not running.size:
            break
        end = running[fits.visit(running, fits.trials(running), settled)]
        done[end] = reached[end] = True
        if watch is not None:
            watch(int(np.count_nonzero(done)), fits.cost, fits.at)
    return Solutions(fits.at, fits.cost, fits.there, fits.jacobian, reached)


def costs(residuals: Floats) -> Floats:
    """Sums of squares (k,), infinite where a residual is not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        cost = np.einsum("kn,kn->k", residuals, residuals)
    return np.where(np.isfinite(cost), cost, np.inf)


def _dot(one: Floats, other: Floats) -> Floats:
    """Scalar products (k,) of vectors (k, p)."""
    return np.asarray(np.einsum("kp,kp->k", one, other))
