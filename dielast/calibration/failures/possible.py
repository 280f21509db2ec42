"""What a failure model may be, by its likelihood: draws of its coordinates, those at the edge of a region of them, and intervals
by profile likelihoods, with verdicts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.special import ndtri

from dielast.base.errors import NumericsError, warn
from dielast.calibration.failures.estimate import Estimate, maximise
from dielast.calibration.profiles import DECISIVE, VERDICTS, Verdict
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.numerics.random_streams import stream

PROPOSED, ROUNDS = 4000, 4  # proposals in a round of draws
FEWEST = 100  # draws of a round that count; an interval of 90 % then leaves five of them out on each side
ENOUGH = 10  # draws that count, for each coordinate, of which the next round's covariance is estimated
RAYS = 1000  # about the fit, on which the ends of intervals are looked for
SHARES = (1e-3, 0.01, 0.1, 0.5, 0.9)  # of films that fail, to whose lives some of the rays are directed
HEAVY = 5.0  # degrees of freedom of the proposals


def draw(fit: Estimate, draws: int, seed: int = 1) -> Floats:
    """Draws (draws, p) of the posterior with Jeffreys' prior, by importance sampling from distributions with heavy tails that
    adapt in a few rounds (Cappé et al. 2004, DOI 10.1198/106186004X12803), within the bounds of the coordinates.
    """
    random, free, p = stream(seed, "failures"), fit.free, fit.free.size
    if not p or not draws:
        return np.tile(fit.at, (draws, 1))
    bounds = fit.model.bounds
    covariance = fit.covariance[np.ix_(free, free)]
    if not (np.all(np.isfinite(covariance)) and np.all(np.linalg.eigvalsh(covariance) > 0)):
        information = -fit.hessian[np.ix_(free, free)]
        scale = np.sqrt(np.maximum(np.abs(np.diag(information)), 1e-8))
        roots, axes = np.linalg.eigh(information / np.outer(scale, scale))
        covariance = (axes / np.maximum(np.abs(roots), 1e-3)) @ axes.T / np.outer(scale, scale)
    centre, spread, best = fit.at[free], 1.5 * covariance, (0.0, fit.at[None], np.ones(1))
    for turn in range(3 * ROUNDS):
        count = PROPOSED
        factor = np.linalg.cholesky(spread + 1e-14 * np.diag(np.diag(spread) + 1e-300))
        normal = random.standard_normal((count, p))
        chi = random.chisquare(HEAVY, count) / HEAVY
        away = normal / np.sqrt(chi)[:, None]
        proposed = centre + away @ factor.T
        at = np.tile(fit.at, (count, 1))
        at[:, free] = proposed
        inside = np.all((at >= bounds[0]) & (at <= bounds[1]), axis=1)
        log = np.full(count, -np.inf)
        for part in np.array_split(np.flatnonzero(inside), max(1, count // 1500)):
            log[part] = fit.share_known * fit.model.total(at[part]) + fit.model.log_prior(at[part])
        log = np.where(np.isfinite(log), log, -np.inf)
        likeliest = proposed[np.argmax(log)]
        log -= -0.5 * (HEAVY + p) * np.log1p(np.sum(away**2, axis=1) / HEAVY)
        log = np.where(np.isfinite(log), log, -np.inf)
        if not np.isfinite(log.max()):
            raise NumericsError("no draw of the parameters has a likelihood: state known values in [fit]")
        weight = np.exp(log - log.max())
        weight /= weight.sum()
        mean = weight @ proposed
        size = 1 / np.sum(weight**2)  # the number of draws that count (Kish 1965, sec. 11.7)
        if size >= FEWEST and turn >= ROUNDS - 1:
            best = (size, at, weight)
            break
        best = max(best, (size, at, weight), key=lambda each: each[0])
        if size >= ENOUGH * p:
            moved = proposed - mean
            centre, spread = mean, 1.3 * (moved * weight[:, None]).T @ moved
        elif best[0] >= FEWEST:  # the tail of one proposal has taken nearly all weight: an earlier round is better
            break
        else:  # proposals are much too wide
            centre, spread = likeliest, spread / 100
    size, at, weight = best
    if size < FEWEST:
        warn(f"fewer than {FEWEST} draws of the parameters have a likelihood that counts: intervals may be too narrow", key="fit")
    count = weight.size
    # systematic resampling, then a random order
    place = (np.arange(draws) + random.random()) / draws
    chosen = np.minimum(np.searchsorted(np.cumsum(weight), place), count - 1)
    return np.asarray(at[random.permutation(chosen)])


def edge(fit: Estimate, level: float = 0.9, seed: int = 1) -> Floats:
    """Coordinates (rays, p) on the edge of the region whose likelihood ratio is that of an interval of one quantity. The least and
    the largest value of a quantity on it are the ends of its profile-likelihood interval (Meeker and Escobar 1998, App. B.6.6),
    within the bounds of the coordinates.

    Where the likelihood is Gaussian, the edge is an ellipsoid, and a quantity of gradient q is largest along C q, with C the
    covariance. Three quarters of the rays are about those of the lives at the exposures of the specimens, others anywhere.
    """
    free, p = fit.free, fit.free.size
    if not p:
        return fit.at[None]
    random = stream(seed, "edge")
    information = -fit.hessian[np.ix_(free, free)]
    scale = np.sqrt(np.maximum(np.abs(np.diag(information)), 1e-12))
    roots, axes = np.linalg.eigh(information / np.outer(scale, scale))
    back = axes / np.sqrt(np.maximum(np.abs(roots), 1e-6))  # of rays from a space in which the ellipsoid is a sphere
    away = random.standard_normal((RAYS, p))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    toward = (_gradients(fit, random)[:, free] / scale) @ back
    toward /= np.maximum(np.linalg.norm(toward, axis=1, keepdims=True), 1e-300)
    spread = np.repeat((0.0, 0.2, 0.6), RAYS // 4)[:, None]
    away[: spread.size] = toward[: spread.size] + spread * away[: spread.size]
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    ray = np.zeros((RAYS, fit.at.size))
    ray[:, free] = away @ back.T / scale
    low, high = fit.model.bounds
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.min(np.where(ray > 0, (high - fit.at) / ray, np.where(ray < 0, (low - fit.at) / ray, np.inf)), axis=1)
    room, goal = np.minimum(room, 1e3), ndtri(0.5 * (1 + level)) / np.sqrt(fit.share_known)
    inner, outer, at = np.zeros(RAYS), room.copy(), np.minimum(goal, room)
    inside, beyond, run = np.zeros(RAYS), np.full(RAYS, np.inf), np.arange(RAYS)
    for _ in range(60):
        value = fit.model.total(fit.at + at[run, None] * ray[run])
        root = np.sqrt(2 * np.maximum(fit.value - np.where(np.isnan(value), -np.inf, value), 0.0))
        below = root <= goal
        inner[run], inside[run] = np.where(below, at[run], inner[run]), np.where(below, root, inside[run])
        outer[run], beyond[run] = np.where(below, outer[run], at[run]), np.where(below, beyond[run], root)
        ended = (below & (root >= goal * (1 - 1e-5))) | (outer[run] - inner[run] <= 1e-9 * outer[run])
        run = run[~ended]
        if not run.size:
            break
        a, b, fa, fb = inner[run], outer[run], inside[run], beyond[run]
        # the root is nearly proportional to the distance
        with np.errstate(invalid="ignore"):
            between = a + (goal * (1 - 5e-6) - fa) * (b - a) / (fb - fa)
        further = a * np.clip(goal / np.maximum(fa, 1e-300), 1.0, 2.0)
        tried = np.where(np.isfinite(fb), between, np.minimum(further, b))
        # by halves where a side hardly moves
        halved = np.isfinite(fb) & ((tried - a < 0.02 * (b - a)) | (b - tried < 0.02 * (b - a)) & (b - a > 1e-3 * b))
        at[run] = np.where(halved, 0.5 * (a + b), tried)
    return fit.at + inner[:, None] * ray


def _gradients(fit: Estimate, random: np.random.Generator) -> Floats:
    """Gradients (rays, p) of the log lives within which some share fails, at exposures of the specimens and beyond."""
    p, step = fit.at.size, 1e-4
    steps = step * np.eye(p)
    moved = fit.model.places(fit.at + np.concatenate((steps, -steps)))[0]
    moved = moved[:, np.all(np.isfinite(moved), axis=0)]
    of_place = ((moved[:p] - moved[p:]) / (2 * step)).T
    if not len(of_place):
        return np.zeros((RAYS, p))
    one, other = (of_place[random.integers(len(of_place), size=RAYS)] for _ in range(2))
    beyond = random.uniform(0, 2, RAYS) * random.integers(2, size=RAYS)
    result = one + beyond[:, None] * (one - other)
    share = random.choice(SHARES, RAYS)
    ahead, behind = (fit.model.scatter.quantile(share, fit.at[-1] + sign * step) for sign in (1, -1))
    with np.errstate(invalid="ignore"):
        change = (ahead - behind) / (2 * step)
    result[:, -1] -= np.where(np.isfinite(change), change, 0.0)
    return np.asarray(result * random.choice((-1.0, 1.0), RAYS)[:, None])


WIDTHS = np.array([0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0])
"""Distances from the maximum, in standard errors, at which the end of an interval is looked for."""
CLOSE = 1e-7  # of the end of an interval, over the standard error


@dataclass(frozen=True, slots=True)
class ProfileInterval:
    """The ends of an interval of a coordinate, NaN where it has none, and the verdict on it."""

    lower: float
    upper: float
    verdict: Verdict


def profile_intervals(fit: Estimate, level: float = 0.9) -> list[ProfileInterval]:
    """The interval of every free coordinate by its profile likelihood (see `Estimate.share_known`), and its verdict: an end is open
    where the profile does not reach the decisive level within the bounds of the coordinate.
    """
    free, bounds = fit.free, fit.model.bounds
    error = fit.standard_error[free]
    span = bounds[1][free] - bounds[0][free]
    error = np.where(np.isfinite(error) & (error > 0), np.minimum(error, 0.2 * span), 0.02 * span)
    sides = np.array([(j, side) for j in range(free.size) for side in (-1.0, 1.0)])
    column, side = sides[:, 0].astype(int), sides[:, 1]
    limit = np.where(side < 0, bounds[0][free][column], bounds[1][free][column])
    profile = _Profile(fit, free[column], side)
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
        return np.asarray(root * np.sqrt(fit.share_known)), np.asarray(cornered)

    def _corners(self, start: Floats, fixed: Flags) -> Floats:
        """The likeliest of starts (m, p) with slopes and scatter, where not `fixed` (m, p), at ends of their ranges."""
        low, high = self.fit.model.bounds
        moved = slice(len(self.fit.model.location.names), None)
        ends = np.array(list(product(*zip(low[moved], high[moved], strict=True))))
        tried = np.repeat(start[:, None], len(ends), axis=1)
        tried[:, :, moved] = np.where(fixed[:, None, moved], tried[:, :, moved], ends)
        totals = self.fit.model.total(tried.reshape(-1, low.size)).reshape(len(start), -1)
        return np.asarray(tried[np.arange(len(start)), np.argmax(np.nan_to_num(totals, nan=-np.inf), axis=1)])
