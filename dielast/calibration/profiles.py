"""Profile likelihoods: the uncertainty of each parameter with all others refitted, and a verdict (Raue et al. 2009, DOI
10.1093/bioinformatics/btp358).

All profiles are followed at once, outwards from the fit, each point from where the last ones lead to (`courses`). Where the others
have several minima, a point is computed anew from the lower ones found beside it; a minimum that no point of the profile meets
stays unknown.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from dielast.calibration.courses import ProfileCourse, follow_profiles, opening
from dielast.calibration.likelihood import Likelihood, prior_alone
from dielast.calibration.parameters import Parameter
from dielast.numerics.arrays import Floats

DECISIVE = 0.99  # level at which an end of the range is ruled out: wrongly in one case of a hundred
HALF = 0.5  # first level of the root of the rise, as a share of that at the end of the interval


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
    not reach the decisive one before the bound of the parameter on that side, although it may exceed that of the `level`. If it
    reaches the decisive one on neither side, the interval of the `level` is all that is known: ends beyond which its rise holds.
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
    sought, decisive = np.sqrt(likelihood.thresholds(level)), np.sqrt(likelihood.thresholds(max(level, DECISIVE)))
    levels = np.stack((HALF * sought, sought, np.sqrt(sought * decisive), decisive), axis=1)
    rooms = {-1.0: at - lower, 1.0: upper - at}
    courses = {
        (j, side): ProfileCourse(j, side, float(room[j]), tuple(levels[j].tolist()), float(sought[j]), [opening(likelihood, j)])
        for side, room in rooms.items()
        for j in np.flatnonzero(room > 0).tolist()
    }
    follow_profiles(likelihood, list(courses.values()))
    unseen = prior_alone(fit.problem, likelihood.information)
    return [_profile(courses.get((j, -1.0)), courses.get((j, 1.0)), bool(unseen[j])) for j in range(at.size)]


def possible_values(profile: Profile, parameter: Parameter) -> Profile:
    """The profile of a parameter whose interval does not reach to values that no material has: there, it has no end."""
    least = parameter.possible
    if least is None or not float(parameter.value(profile.lower)) < least:
        return profile
    above = profile.verdict in (Verdict.DETERMINED, Verdict.UPPER) and float(parameter.value(profile.upper)) > least
    return replace(profile, lower=np.nan, verdict=Verdict.UPPER if above else Verdict.UNDETERMINED)


def _profile(below: ProfileCourse | None, above: ProfileCourse | None, unseen: bool) -> Profile:
    """The profile of a parameter along its courses below and above the fit, None if the fit is at that bound."""
    sides = [side for side in (below, above) if side is not None]
    beyond = [point for side in sides for point in side.points[1:]]
    points = sorted([sides[0].points[0], *beyond], key=lambda point: point.place)
    closed_below, closed_above = (side is not None and side.closed and not unseen for side in (below, above))
    either = closed_below or closed_above
    lower = below.end if below is not None and (closed_below or not either) else np.nan
    upper = above.end if above is not None and (closed_above or not either) else np.nan
    return Profile(
        np.array([point.place for point in points]),
        np.square([point.root for point in points]),
        np.array([point.at for point in points]),
        lower,
        upper,
        VERDICTS[closed_below, closed_above],
    )
