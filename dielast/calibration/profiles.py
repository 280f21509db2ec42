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

from dielast.calibration.courses import Course, follow
from dielast.calibration.likelihood import Likelihood, prior_alone
from dielast.numerics.arrays import Floats

DECISIVE = 0.999  # level at which an end of the range is ruled out: wrongly in one case of a thousand
NEAR = 0.5  # points of a profile, as shares of the half widths of the stated and of the decisive interval
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
    threshold, decisive = likelihood.thresholds(level), likelihood.thresholds(DECISIVE)
    inner, outer = np.sqrt(threshold), np.sqrt(decisive)
    rooms = {-1.0: at - lower, 1.0: upper - at}
    courses = [
        Course(
            j, side, float(room[j]), (NEAR * inner[j], inner[j], np.sqrt(inner[j] * outer[j]), outer[j]), float(inner[j]), END
        )
        for side, room in rooms.items()
        for j in range(at.size)
        if room[j] > 0
    ]
    follow(likelihood, courses)
    unseen = prior_alone(fit.problem, likelihood.information)
    profiles = []
    for j in range(at.size):
        below, above = (next((c for c in courses if c.own == j and c.side == side), None) for side in (-1.0, 1.0))
        profiles.append(_profile(below, above, at, bool(unseen[j])))
    return profiles


def _profile(below: Course | None, above: Course | None, at: Floats, unseen: bool) -> Profile:
    """The profile of both courses of a parameter."""
    points = [*reversed(below.points[1:] if below else []), (below or above).points[0], *(above.points[1:] if above else [])]
    closed = [course is not None and course.closed and not unseen for course in (below, above)]
    ends = [course.end() if course is not None and (ok or unseen) else np.nan for course, ok in zip((below, above), closed)]
    return Profile(
        np.array([p.place for p in points]),
        np.square([p.root for p in points]),
        np.array([p.at for p in points]),
        *ends,
        VERDICTS[closed[0], closed[1]],
    )
