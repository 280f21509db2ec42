"""Intervals of the coordinates of failure models by their profile likelihoods, and verdicts on them."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.special import ndtri

from dielast.calibration.failures.estimate import Estimate, maximise
from dielast.calibration.profiles import DECISIVE, VERDICTS, Verdict
from dielast.numerics.arrays import Cases, Flags, Floats

WIDTHS = np.array([0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0])
"""Distances from the maximum, in standard errors, at which the end of an interval is looked for."""
CLOSE = 1e-7  # of the end of an interval, over the standard error


@dataclass(frozen=True, slots=True)
class ProfileInterval:
    """The ends of an interval of a coordinate, NaN where it has none, and the verdict on it."""

    lower: float
    upper: float
    verdict: Verdict


def profile_intervals(fit: Estimate, level: float = 0.9, *, corrected: bool = True) -> list[ProfileInterval]:
    """The interval of every free coordinate by its profile likelihood, for few specimens if `corrected`, and its verdict: an end is
    open where the profile does not reach the decisive level within the bounds of the coordinate.
    """
    free, bounds = fit.free, fit.model.bounds
    error = fit.standard_error[free]
    span = bounds[1][free] - bounds[0][free]
    error = np.where(np.isfinite(error) & (error > 0), np.minimum(error, 0.2 * span), 0.02 * span)
    sides = np.array([(j, side) for j in range(free.size) for side in (-1.0, 1.0)])
    column, side = sides[:, 0].astype(int), sides[:, 1]
    limit = np.where(side < 0, bounds[0][free][column], bounds[1][free][column])
    profile = _Profile(fit, free[column], side, corrected)
    sought, decisive = ndtri(0.5 * (1 + level)), ndtri(0.5 * (1 + max(level, DECISIVE)))
    ends, closed = np.full(column.size, np.nan), np.zeros(column.size, dtype=bool)
    inner, outer = np.zeros(column.size), np.full(column.size, np.nan)
    inner_root, outer_root = np.zeros(column.size), np.full(column.size, np.nan)
    waiting = np.ones(column.size, dtype=bool)
    room = np.abs(limit - fit.at[free][column]) / error[column]
    for width in WIDTHS:
        run = np.flatnonzero(waiting)
        if not run.size:
            break
        reach = np.minimum(width, room[run])
        root, cornered = profile.roots(run, fit.at[free][column[run]] + side[run] * reach * error[column[run]])
        past = (root >= sought) & np.isnan(outer[run])
        outer[run[past]], outer_root[run[past]] = reach[past], root[past]
        before = (root < sought) & np.isnan(outer[run])
        inner[run[before]], inner_root[run[before]] = reach[before], root[before]
        closed[run] |= (root >= decisive) & ~cornered
        waiting[run] = ~((root >= decisive) | (reach >= room[run]))
    run = np.flatnonzero(np.isfinite(outer))
    for _ in range(60):
        if not run.size:
            break
        a, b, fa, fb = inner[run], outer[run], inner_root[run] - sought, outer_root[run] - sought
        middle = np.where(fb > fa, b - fb * (b - a) / np.where(fb > fa, fb - fa, 1.0), 0.5 * (a + b))
        middle = np.clip(middle, a + 0.02 * (b - a), b - 0.02 * (b - a))
        root = profile.roots(run, fit.at[free][column[run]] + side[run] * middle * error[column[run]])[0]
        high = root >= sought
        outer[run], outer_root[run] = np.where(high, middle, b), np.where(high, root, outer_root[run])
        inner[run], inner_root[run] = np.where(high, a, middle), np.where(high, inner_root[run], root)
        near = (outer[run] - inner[run] < CLOSE) | (np.abs(root - sought) < 1e-10)
        ends[run[near]] = middle[near]
        run = run[~near]
    ends[run] = outer[run]
    places = fit.at[free][column] + side * ends * error[column]
    result = []
    for j in range(free.size):
        below, above = (2 * j, 2 * j + 1)
        either = closed[below] or closed[above]
        lower = float(places[below]) if closed[below] or not either else np.nan
        upper = float(places[above]) if closed[above] or not either else np.nan
        result.append(ProfileInterval(lower, upper, VERDICTS[bool(closed[below]), bool(closed[above])]))
    return result


@dataclass(slots=True, eq=False)
class _Profile:
    """Profiles of the coordinates `column` (k,) to their `side` (k,), followed from the last points computed."""

    fit: Estimate
    column: Cases
    side: Floats
    corrected: bool
    last: Floats = field(init=False)
    ridge: Floats = field(init=False)
    """How all coordinates move with that of the profile (k, p), if the likelihood is Gaussian."""

    def __post_init__(self) -> None:
        fit = self.fit
        self.last = np.tile(fit.at, (self.column.size, 1))
        self.ridge = np.zeros_like(self.last)
        for row, column in enumerate(self.column.tolist()):
            others = fit.free[fit.free != column]
            inner = fit.hessian[np.ix_(others, others)]
            self.ridge[row, others] = -np.linalg.lstsq(inner, fit.hessian[others, column], rcond=1e-12)[0]
            self.ridge[row, column] = 1.0

    def roots(self, run: Cases, place: Floats) -> tuple[Floats, Flags]:
        """The roots of the likelihood ratios (m,) at places (m,) of the profiles `run` (m,), positive away from the fit, and
        whether another coordinate is at the end of its range there, so that the ratio is due to this range.
        """
        fit, column, rows = self.fit, self.column[run], np.arange(run.size)
        fixed = np.tile(fit.fixed, (run.size, 1))
        fixed[rows, column] = True
        low, high = fit.model.bounds
        moved = place - self.last[run, column]
        plain = self.last[run].copy()
        plain[rows, column] = place
        straight = self.last[run] + moved[:, None] * self.ridge[run]
        along = np.clip(straight, low, high)
        totals = [fit.model.total(start) for start in (plain, along)]
        start = np.where((np.nan_to_num(totals[1], nan=-np.inf) > np.nan_to_num(totals[0], nan=-np.inf))[:, None], along, plain)

        def function(at: Floats, fits: Cases) -> tuple[Floats, Floats, Floats]:
            return fit.model.function(at)

        found = maximise(function, start, fit.model.bounds, fixed)
        lost = np.flatnonzero(~found.settled)
        if lost.size:  # they may have begun so far off that the way is too long
            other = maximise(function, self._corners(start[lost], fixed[lost]), fit.model.bounds, fixed[lost])
            better = other.value > found.value[lost]
            for of_lost, of_other in ((found.at, other.at), (found.value, other.value), (found.settled, other.settled)):
                of_lost[lost[better]] = of_other[better]
        self.last[run] = np.where(np.isfinite(found.value)[:, None], found.at, self.last[run])
        root = np.sqrt(np.maximum(2 * (fit.value - found.value), 0.0))
        # a coordinate of the location is at the end of its range also where the straight way leads beyond it; a lower end of 0 is
        # set by physics, and no end of what is looked at
        reached, places = found.at.copy(), len(fit.model.location.names)
        reached[:, :places] = np.where(straight == along, reached, straight)[:, :places]
        cornered = np.any(~fixed & (((reached <= low) & (low != 0)) | (reached >= high)), axis=1)
        return np.asarray(root * np.sqrt(fit.share_known) if self.corrected else root), np.asarray(cornered)

    def _corners(self, start: Floats, fixed: Flags) -> Floats:
        """The likeliest of starts (m, p) with slopes and scatter, where not `fixed` (m, p), at ends of their ranges."""
        low, high = self.fit.model.bounds
        moved = slice(len(self.fit.model.location.names), None)
        ends = np.array(list(product(*zip(low[moved], high[moved], strict=True))))
        tried = np.repeat(start[:, None], len(ends), axis=1)
        tried[:, :, moved] = np.where(fixed[:, None, moved], tried[:, :, moved], ends)
        totals = self.fit.model.total(tried.reshape(-1, low.size)).reshape(len(start), -1)
        return np.asarray(tried[np.arange(len(start)), np.argmax(np.nan_to_num(totals, nan=-np.inf), axis=1)])
