"""Profile likelihoods: the uncertainty of each parameter with all others refitted, and a verdict (Raue et al. 2009, DOI
10.1093/bioinformatics/btp358).

All profiles are followed at once, outwards from the fit, each point from where the last ones lead to.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from dielast.calibration.levenberg import minimise
from dielast.calibration.likelihood import Likelihood, prior_alone
from dielast.numerics.arrays import Floats

DECISIVE = 0.999  # level at which an end of the range is ruled out: wrongly in one case of a thousand
NEAR, BEYOND = 0.5, 1.07  # points of a profile, as shares of the half widths of the stated and of the decisive interval
FAR = np.array((0.2, 0.45, 0.7, 1.0))  # further points, as shares of the distance to a bound
END = 0.02  # accuracy of the end of an interval, as a share of its half width, in the root of the rise
MOST_ROUNDS = 20  # of refining the end of an interval; each round shortens its bracket by a tenth at least
PRECISE = 1e-4  # relative change of a sum of squares at which a point of a profile has converged


class Verdict(StrEnum):
    """Whether tests determine a parameter."""

    DETERMINED = "determined"
    LOWER = "lower bound"
    UPPER = "upper bound"
    UNDETERMINED = "undetermined"


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """The profile of one parameter: `coordinate` (k,) ascending, the `rise` (k,) of the least sum of squares above that of the fit,
    and all coordinates (k, p) of this least; `lower` and `upper` are the ends of the interval, NaN if unknown.
    """

    coordinate: Floats
    rise: Floats
    points: Floats
    lower: float
    upper: float
    verdict: Verdict


def profiles_of(likelihood: Likelihood, level: float = 0.9) -> list[Profile]:
    """The profile of each parameter, with its interval of this `level` and its verdict."""
    fit = likelihood.fit
    at, (lower, upper) = fit.coordinates, fit.space.bounds
    threshold, decisive = likelihood.thresholds(level), likelihood.thresholds(DECISIVE)
    inner, outer = BEYOND * np.sqrt(threshold), BEYOND * np.sqrt(decisive)
    near = np.stack((NEAR / BEYOND * inner, inner, np.sqrt(inner * outer), outer), axis=1)
    error, size = likelihood.standard_error, fit.coordinates.size
    rings: list[list[list[float]]] = [[[] for _ in range(size)] for _ in FAR]
    profile: list[dict[float, tuple[float, Floats]]] = [{float(at[j]): (0.0, at)} for j in range(size)]
    for j in range(size):
        for side, room in ((-1.0, at[j] - lower[j]), (1.0, upper[j] - at[j])):
            if room > 0:
                steps = near[j] * error[j] if np.isfinite(error[j]) and near[j, -1] * error[j] < room else FAR * room
                for ring, step in zip(rings, steps.tolist(), strict=True):
                    ring[j].append(float(at[j] + side * step))
    for ring in rings:
        _solve(likelihood, ring, profile)
    rings = [[[] for _ in range(size)] for _ in FAR]
    for j in range(size):
        for side, room in ((-1.0, at[j] - lower[j]), (1.0, upper[j] - at[j])):
            beyond = [x for x in profile[j] if side * (x - at[j]) > 0]
            reached = max((abs(x - at[j]) for x in beyond), default=0.0)
            rise = max((profile[j][x][0] for x in beyond), default=0.0)
            if beyond and rise < decisive[j] and reached < room * (1 - 1e-9):
                for ring, share in zip(rings, FAR.tolist(), strict=True):
                    ring[j].append(float(at[j] + side * (reached + share * (room - reached))))
    for ring in rings:
        _solve(likelihood, ring, profile)
    for _ in range(MOST_ROUNDS):
        further = [_towards_ends(profile[j], float(at[j]), float(threshold[j])) for j in range(size)]
        if not any(further):
            break
        _solve(likelihood, further, profile)
    unseen = prior_alone(fit.problem, likelihood.information)
    return [_profile(profile[j], float(at[j]), float(threshold[j]), float(decisive[j]), bool(unseen[j])) for j in range(size)]


def _towards_ends(profile: dict[float, tuple[float, Floats]], at: float, threshold: float) -> list[float]:
    """The expected ends of an interval, by secants of the root of the rise, where no point of the profile is near them yet."""
    places, end = [], np.sqrt(threshold)
    for side in (-1.0, 1.0):
        outwards = sorted((x for x in profile if side * (x - at) >= 0), key=lambda x: abs(x - at))
        roots = [float(np.sqrt(min(max(profile[x][0], 0.0), 1e12))) for x in outwards]
        first = next((k for k, root in enumerate(roots) if root > end), 0)
        if first and min(roots[first] - end, end - roots[first - 1]) > END * end:
            share = (end - roots[first - 1]) / (roots[first] - roots[first - 1])
            places.append(outwards[first - 1] + float(np.clip(share, 0.1, 0.9)) * (outwards[first] - outwards[first - 1]))
    return places


def _solve(likelihood: Likelihood, places: list[list[float]], profile: list[dict[float, tuple[float, Floats]]]) -> None:
    """Fit all other parameters with each parameter at each of its `places`, and add the points to its `profile`."""
    fit = likelihood.fit
    lower, upper = fit.space.bounds
    owner = np.array([j for j, own in enumerate(places) for _ in own], dtype=np.intp)
    if not owner.size:
        return
    value = np.array([x for own in places for x in own])
    start = np.repeat(fit.coordinates[None], owner.size, axis=0)
    covariance = np.where(np.isfinite(likelihood.covariance), likelihood.covariance, 0.0)
    variance = np.diag(covariance)[owner]
    # the other parameters in the linearised problem
    follow = covariance[owner] / np.where(variance > 0, variance, 1.0)[:, None]
    move = np.clip(follow * (value - fit.coordinates[owner])[:, None], -1.0, 1.0)
    start = start + np.where(variance[:, None] > 0, move, 0.0)
    for row, (j, x) in enumerate(zip(owner.tolist(), value.tolist(), strict=True)):
        outwards = (y for y in profile[j] if (y - x) * (fit.coordinates[j] - x) >= 0)
        before = [y for _, y in sorted((abs(x - y), y) for y in outwards)[:2]]
        if len(before) == 2:  # extrapolate the course of the other parameters
            (near, at), (far, from_) = ((y, profile[j][y][1]) for y in before)
            start[row] = at + np.clip((x - near) / (near - far) * (at - from_), -1.0, 1.0)
    start = np.clip(start, lower, upper)
    start[np.arange(owner.size), owner] = value
    fixed = np.zeros(start.shape, dtype=bool)
    fixed[np.arange(owner.size), owner] = True
    ends = minimise(likelihood.residuals, start, lower, upper, fixed=fixed, settled=PRECISE)
    cost, points = ends.cost.copy(), ends.coordinates.copy()
    if (lost := np.flatnonzero(~np.isfinite(cost))).size:  # try again from the parameters of the fit
        start[lost] = fit.coordinates
        start[lost, owner[lost]] = value[lost]
        again = minimise(likelihood.residuals, start[lost], lower, upper, fixed=fixed[lost], settled=PRECISE)
        cost[lost], points[lost] = again.cost, again.coordinates
    for j, x, own, point in zip(owner.tolist(), value.tolist(), cost.tolist(), points, strict=True):
        profile[j][x] = (own, point)


def _profile(profile: dict[float, tuple[float, Floats]], at: float, threshold: float, decisive: float, unseen: bool) -> Profile:
    """The profile through the computed points, with `at` the coordinate of the fit. The interval ends where the rise reaches the
    `threshold`; a rise of `decisive` rules out an end of the range.
    """
    place = np.array(sorted(profile))
    cost = np.array([profile[x][0] for x in place.tolist()])
    points = np.array([profile[x][1] for x in place.tolist()])
    rise = cost
    best = at
    lower, upper = _crossing(place[::-1], rise[::-1], best, threshold), _crossing(place, rise, best, threshold)
    below, above = rise[place < best], rise[place > best]
    closed_below = bool(np.any(below >= decisive)) and np.isfinite(lower)
    closed_above = bool(np.any(above >= decisive)) and np.isfinite(upper)
    if unseen:
        verdict = Verdict.UNDETERMINED
    elif closed_below and closed_above:
        verdict = Verdict.DETERMINED
    elif closed_below:
        verdict, upper = Verdict.LOWER, np.nan
    elif closed_above:
        verdict, lower = Verdict.UPPER, np.nan
    else:
        verdict = Verdict.UNDETERMINED
    if verdict is Verdict.UNDETERMINED and not unseen:
        lower = upper = np.nan
    return Profile(place, rise, points, lower, upper, verdict)


def _crossing(place: Floats, rise: Floats, best: float, threshold: float) -> float:
    """Where a profile, in the order of `place`, first exceeds the threshold beyond the best point; NaN if it does not.

    The root of the rise is interpolated, because it is linear where the profile is a parabola.
    """
    ahead = np.flatnonzero((place >= best) if place[-1] > place[0] else (place <= best))
    root = np.sqrt(np.minimum(np.maximum(rise[ahead], 0.0), 1e12))
    over = np.flatnonzero(root > np.sqrt(threshold))
    if not over.size or over[0] == 0:
        return np.nan
    first = int(over[0])
    x, y = place[ahead][first - 1 : first + 1], root[first - 1 : first + 1]
    return float(x[0] + (np.sqrt(threshold) - y[0]) / (y[1] - y[0]) * (x[1] - x[0]))
