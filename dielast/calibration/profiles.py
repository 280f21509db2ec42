"""Profile likelihoods: the uncertainty of each parameter with all others refitted, and a verdict (Raue et al. 2009, DOI
10.1093/bioinformatics/btp358).

All profiles are followed at once, outwards from the fit, each point from where the last ones lead to. Where the others have several
minima, a point may be above the least one: an interval is that of the course that leads on from the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from dielast.calibration.levenberg import minimise
from dielast.calibration.likelihood import Likelihood, prior_alone
from dielast.numerics.arrays import Floats

DECISIVE = 0.99  # level at which an end of the range is ruled out: wrongly in one case of a hundred
NEAR, BEYOND = 0.5, 1.07  # points of a profile, as shares of the half widths of the stated and of the decisive interval
FAR = np.array((0.2, 0.45, 0.7, 1.0))  # further points, as shares of the distance to a bound
END = 0.02  # accuracy of the end of an interval, as a share of its half width, in the root of the rise
MOST_ROUNDS = 20  # of refining the end of an interval; each round shortens its bracket by a tenth at least
PRECISE = 1e-4  # relative change of a sum of squares at which a point of a profile has converged

Points = dict[float, tuple[float, Floats]]
"""Points of a profile by the coordinate of their parameter: the least sum of squares, and all coordinates (p,) there."""


class Verdict(StrEnum):
    """Whether tests determine a parameter."""

    DETERMINED = "determined"
    LOWER = "lower bound"
    UPPER = "upper bound"
    UNDETERMINED = "undetermined"


VERDICTS = {
    (True, True): Verdict.DETERMINED,
    (True, False): Verdict.LOWER,
    (False, True): Verdict.UPPER,
    (False, False): Verdict.UNDETERMINED,
}
"""By whether the lower and the upper end of the range are ruled out."""


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """The profile of one parameter: `coordinate` (k,) ascending, the `rise` (k,) of the least sum of squares above that of the fit,
    and all coordinates (k, p) of this least. `lower` and `upper` are the ends of the interval. An end is NaN where the rise does
    not reach the decisive one before the bound of the parameter on that side, although it may exceed that of the `level`.
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
    threshold, decisive = likelihood.thresholds(level), likelihood.thresholds(max(level, DECISIVE))
    inner, outer = BEYOND * np.sqrt(threshold), BEYOND * np.sqrt(decisive)
    near = np.stack((NEAR / BEYOND * inner, inner, np.sqrt(inner * outer), outer), axis=1)
    error = likelihood.standard_error
    profiles: list[Points] = [{x: (0.0, at)} for x in at.tolist()]
    sides = [(j, -1.0, float(at[j] - lower[j])) for j in range(at.size)] + [
        (j, 1.0, float(upper[j] - at[j])) for j in range(at.size)
    ]
    steps = {
        (j, side): near[j] * error[j] if np.isfinite(error[j]) and near[j, -1] * error[j] < room else FAR * room
        for j, side, room in sides
        if room > 0
    }
    _solve_outwards(likelihood, steps, profiles)
    steps = {}
    for j, side, room in sides:
        rises = {abs(x - at[j]): rise for x, (rise, _) in profiles[j].items() if side * (x - at[j]) > 0}
        if rises and max(rises.values()) < decisive[j] and max(rises) < room * (1 - 1e-9):
            steps[j, side] = max(rises) + FAR * (room - max(rises))
    _solve_outwards(likelihood, steps, profiles)
    for _ in range(MOST_ROUNDS):
        ends = [(j, _end(profiles[j], float(at[j]), side, float(threshold[j]), END)) for j, side, _ in sides]
        if not (further := [(j, x) for j, x in ends if np.isfinite(x)]):
            break
        _solve(likelihood, further, profiles)
    unseen = prior_alone(fit.problem, likelihood.information)
    return [_profile(profiles[j], float(at[j]), float(threshold[j]), float(decisive[j]), bool(unseen[j])) for j in range(at.size)]


def _solve_outwards(likelihood: Likelihood, steps: dict[tuple[int, float], Floats], profiles: Sequence[Points]) -> None:
    """Add points at the distances `steps` (k,) from the fit, by parameter and side, all nearest ones first."""
    at = likelihood.fit.coordinates
    for ring in range(FAR.size):
        _solve(likelihood, [(j, float(at[j] + side * distances[ring])) for (j, side), distances in steps.items()], profiles)


def _end(points: Points, at: float, side: float, threshold: float, accuracy: float = 0.0) -> float:
    """Where a profile first exceeds the threshold on a side of the fit `at`, by a secant; NaN if it does not, or if a computed
    point is as near to the end as `accuracy`.

    The secant is that of the root of the rise, which is linear where the profile is a parabola.
    """
    outwards = sorted((x for x in points if side * (x - at) >= 0), key=lambda x: abs(x - at))
    roots = np.sqrt(np.clip([points[x][0] for x in outwards], 0.0, 1e12))
    end, over = np.sqrt(threshold), np.flatnonzero(roots > np.sqrt(threshold))
    if not over.size or over[0] == 0:
        return np.nan
    (x, beyond), (y, z) = outwards[over[0] - 1 : over[0] + 1], roots[over[0] - 1 : over[0] + 1]
    if accuracy and min(z - end, end - y) <= accuracy * end:
        return np.nan
    share = (end - y) / (z - y)
    return float(x + (np.clip(share, 0.1, 0.9) if accuracy else share) * (beyond - x))


def _solve(likelihood: Likelihood, places: Sequence[tuple[int, float]], profiles: Sequence[Points]) -> None:
    """Fit all other parameters with each parameter at its place, and add the points to the `profiles`."""
    if not places:
        return
    fit = likelihood.fit
    lower, upper = fit.space.bounds
    owner, value = np.array([j for j, _ in places]), np.array([x for _, x in places])
    row = np.arange(owner.size)
    covariance = np.where(np.isfinite(likelihood.covariance), likelihood.covariance, 0.0)
    variance = np.diag(covariance)[owner]
    # the other parameters in the linearised problem
    follow = covariance[owner] / np.where(variance > 0, variance, 1.0)[:, None]
    start = fit.coordinates + np.clip(follow * (value - fit.coordinates[owner])[:, None], -1.0, 1.0)
    for k, (j, x) in enumerate(places):
        outwards = (y for y in profiles[j] if (y - x) * (fit.coordinates[j] - x) >= 0)
        before = sorted(outwards, key=lambda y: abs(x - y))[:2]
        if len(before) == 2:  # extrapolate the course of the other parameters
            (near, (_, at)), (far, (_, from_)) = ((y, profiles[j][y]) for y in before)
            start[k] = at + np.clip((x - near) / (near - far) * (at - from_), -1.0, 1.0)
    start = np.clip(start, lower, upper)
    start[row, owner] = value
    fixed = np.zeros(start.shape, dtype=bool)
    fixed[row, owner] = True
    ends = minimise(likelihood.residuals, start, lower, upper, fixed=fixed, settled=PRECISE)
    cost, points = ends.cost.copy(), ends.coordinates.copy()
    if (lost := np.flatnonzero(~np.isfinite(cost))).size:  # try again from the parameters of the fit
        start[lost] = fit.coordinates
        start[lost, owner[lost]] = value[lost]
        again = minimise(likelihood.residuals, start[lost], lower, upper, fixed=fixed[lost], settled=PRECISE)
        cost[lost], points[lost] = again.cost, again.coordinates
    for (j, x), rise, point in zip(places, cost.tolist(), points, strict=True):
        profiles[j][x] = (rise, point)


def _profile(points: Points, at: float, threshold: float, decisive: float, unseen: bool) -> Profile:
    """The profile through the computed points, with `at` the coordinate of the fit. The interval ends where the rise reaches the
    `threshold`; a rise of `decisive` rules out an end of the range.
    """
    place = np.array(sorted(points))
    rise = np.array([points[x][0] for x in place.tolist()])
    lower, upper = _end(points, at, -1.0, threshold), _end(points, at, 1.0, threshold)
    closed_below = not unseen and bool(np.any(rise[place < at] >= decisive))
    closed_above = not unseen and bool(np.any(rise[place > at] >= decisive))
    verdict = VERDICTS[closed_below, closed_above]
    if not unseen:
        lower, upper = lower if closed_below else np.nan, upper if closed_above else np.nan
    return Profile(place, rise, np.array([points[x][1] for x in place.tolist()]), lower, upper, verdict)
