"""Profile likelihoods: how well each parameter is known if all others follow, and the verdict (Raue et al. 2009, DOI
10.1093/bioinformatics/btp358).

All profiles are followed at once, outwards from the fit, each point from where the last ones lead to.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from dielast.calibration.levenberg import minimise
from dielast.calibration.likelihood import Likelihood, prior_alone
from dielast.numerics.columns import Floats

DECISIVE = 0.999  # level at which an end of the range is ruled out: by chance in one of a thousand
NEAR, BEYOND = 0.5, 1.07  # of the half widths of the interval asked for and of the decisive one, at which a profile is looked at
FAR = np.array((0.2, 0.45, 0.7, 1.0))  # shares of the way to a bound, where that is not enough
APART = 2.5  # factor by which roots of the rise may lie on either side of an interval's end, between which it is interpolated
MOST_ROUNDS = 20  # of closing in on the end of an interval; each at least a tenth nearer
PRECISE = 1e-4  # relative change of a sum of squares with which a point of a profile is done


class Verdict(StrEnum):
    """What tests say of a parameter."""

    DETERMINED = "determined"
    LOWER = "lower bound"
    UPPER = "upper bound"
    UNDETERMINED = "undetermined"


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """The profile of one parameter: `coordinate` (k,) ascending, the `rise` (k,) of the least sum of squares over that of the fit,
    and all coordinates (k, p) where it was found; `lower` and `upper` end the interval, NaN where they are not known.
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
    found: list[dict[float, tuple[float, Floats]]] = [{float(at[j]): (0.0, at)} for j in range(size)]
    for j in range(size):
        for side, room in ((-1.0, at[j] - lower[j]), (1.0, upper[j] - at[j])):
            if room > 0:
                steps = near[j] * error[j] if np.isfinite(error[j]) and near[j, -1] * error[j] < room else FAR * room
                for ring, step in zip(rings, steps.tolist(), strict=True):
                    ring[j].append(float(at[j] + side * step))
    for ring in rings:
        _solve(likelihood, ring, found)
    rings = [[[] for _ in range(size)] for _ in FAR]
    for j in range(size):
        for side, room in ((-1.0, at[j] - lower[j]), (1.0, upper[j] - at[j])):
            own = [x for x in found[j] if side * (x - at[j]) > 0]
            reached = max((abs(x - at[j]) for x in own), default=0.0)
            rise = max((found[j][x][0] for x in own), default=0.0)
            if own and rise < decisive[j] and reached < room * (1 - 1e-9):
                for ring, share in zip(rings, FAR.tolist(), strict=True):
                    ring[j].append(float(at[j] + side * (reached + share * (room - reached))))
    for ring in rings:
        _solve(likelihood, ring, found)
    for _ in range(MOST_ROUNDS):
        nearer = [_nearer(found[j], float(at[j]), float(threshold[j])) for j in range(size)]
        if not any(nearer):
            break
        _solve(likelihood, nearer, found)
    unseen = prior_alone(fit.problem, likelihood.information)
    return [_profile(found[j], float(at[j]), float(threshold[j]), float(decisive[j]), bool(unseen[j])) for j in range(size)]


def _nearer(found: dict[float, tuple[float, Floats]], at: float, threshold: float) -> list[float]:
    """Where else a profile is to be looked at, as the points on either side of the threshold are far from it."""
    places, end = [], np.sqrt(threshold)
    for side in (-1.0, 1.0):
        outwards = sorted((x for x in found if side * (x - at) >= 0), key=lambda x: abs(x - at))
        roots = [float(np.sqrt(min(max(found[x][0], 0.0), 1e12))) for x in outwards]
        first = next((k for k, root in enumerate(roots) if root > end), 0)
        if first and (roots[first] > APART * end or roots[first - 1] < end / APART):
            share = (end - roots[first - 1]) / (roots[first] - roots[first - 1])
            places.append(outwards[first - 1] + float(np.clip(share, 0.1, 0.9)) * (outwards[first] - outwards[first - 1]))
    return places


def _solve(likelihood: Likelihood, places: list[list[float]], found: list[dict[float, tuple[float, Floats]]]) -> None:
    """Fit all others with each parameter at each of its `places`, and add what is `found`."""
    fit = likelihood.fit
    lower, upper = fit.space.bounds
    owner = np.array([j for j, own in enumerate(places) for _ in own], dtype=np.intp)
    if not owner.size:
        return
    value = np.array([x for own in places for x in own])
    start = np.repeat(fit.coordinates[None], owner.size, axis=0)
    covariance = np.where(np.isfinite(likelihood.covariance), likelihood.covariance, 0.0)
    variance = np.diag(covariance)[owner]
    # where the others go if all is linear
    follow = covariance[owner] / np.where(variance > 0, variance, 1.0)[:, None]
    move = np.clip(follow * (value - fit.coordinates[owner])[:, None], -1.0, 1.0)
    start = start + np.where(variance[:, None] > 0, move, 0.0)
    for row, (j, x) in enumerate(zip(owner.tolist(), value.tolist(), strict=True)):
        outwards = (y for y in found[j] if (y - x) * (fit.coordinates[j] - x) >= 0)
        before = [y for _, y in sorted((abs(x - y), y) for y in outwards)[:2]]
        if len(before) == 2:  # where the others went so far leads on
            (near, at), (far, from_) = ((y, found[j][y][1]) for y in before)
            start[row] = at + np.clip((x - near) / (near - far) * (at - from_), -1.0, 1.0)
    start = np.clip(start, lower, upper)
    start[np.arange(owner.size), owner] = value
    fixed = np.zeros(start.shape, dtype=bool)
    fixed[np.arange(owner.size), owner] = True
    ends = minimise(likelihood.residuals, start, lower, upper, fixed=fixed, settled=PRECISE)
    cost, points = ends.cost.copy(), ends.coordinates.copy()
    if (lost := np.flatnonzero(~np.isfinite(cost))).size:  # there the others may not follow, but stay
        start[lost] = fit.coordinates
        start[lost, owner[lost]] = value[lost]
        again = minimise(likelihood.residuals, start[lost], lower, upper, fixed=fixed[lost], settled=PRECISE)
        cost[lost], points[lost] = again.cost, again.coordinates
    for j, x, own, point in zip(owner.tolist(), value.tolist(), cost.tolist(), points, strict=True):
        found[j][x] = (own, point)


def _profile(found: dict[float, tuple[float, Floats]], at: float, threshold: float, decisive: float, unseen: bool) -> Profile:
    """The profile through what was found, with `at` the coordinate of the fit; its rise ends the interval at the `threshold`, and
    rules out an end of the range where it is `decisive`.
    """
    place = np.array(sorted(found))
    cost = np.array([found[x][0] for x in place.tolist()])
    points = np.array([found[x][1] for x in place.tolist()])
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
    """Where a profile, walked through in the order of `place`, first exceeds the threshold beyond the best; NaN where it does not.

    The root of the rise is interpolated, which is straight where the profile is a parabola.
    """
    ahead = np.flatnonzero((place >= best) if place[-1] > place[0] else (place <= best))
    root = np.sqrt(np.minimum(np.maximum(rise[ahead], 0.0), 1e12))
    over = np.flatnonzero(root > np.sqrt(threshold))
    if not over.size or over[0] == 0:
        return np.nan
    first = int(over[0])
    x, y = place[ahead][first - 1 : first + 1], root[first - 1 : first + 1]
    return float(x[0] + (np.sqrt(threshold) - y[0]) / (y[1] - y[0]) * (x[1] - x[0]))
