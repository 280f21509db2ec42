"""The strata that a posterior is drawn in: boxes of the parameters that tests do not determine (`dielast.material.intervals`)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtri

from dielast.calibration.levenberg import minimise, with_slopes
from dielast.calibration.likelihood import Likelihood
from dielast.calibration.parameters import ParameterSpace
from dielast.calibration.profiles import DECISIVE, Profile, Verdict
from dielast.material.intervals import division
from dielast.numerics.arrays import Floats, Index

ITERATIONS, PRECISE = 10, 1e-2  # of the fits in the boxes, whose sums of squares are to be plausible, not the least
SEEN = 1e-3  # of the largest effect: parameters of smaller ones do not follow


@dataclass(frozen=True, slots=True, eq=False)
class Strata:
    """Boxes from `lower` to `upper` (strata, p) in the coordinates; `divided` are the numbers of the parameters of which a box has
    a part only. `centre` (strata, p) has these in the middle of their parts or, if the tests rule that out, as near to the fit as
    the box allows, and all others about where the sum of squares is least; `follows` (strata, p, divided) are the derivatives of
    all parameters, so chosen, by the divided ones.
    """

    divided: tuple[int, ...]
    lower: Floats
    upper: Floats
    centre: Floats
    follows: Floats

    def __len__(self) -> int:
        return len(self.centre)

    def spread(self, stratum: Index, random: np.random.Generator) -> Floats:
        """Distances (k, p) from the centre of each `stratum` (k,), with the divided parameters anywhere in their parts."""
        chosen = list(self.divided)
        lower, upper = (part[stratum][:, chosen] for part in (self.lower, self.upper))
        away = random.uniform(lower, upper) - self.centre[stratum][:, chosen]
        return np.asarray(np.einsum("kpd,kd->kp", self.follows[stratum], away))


def open_parameters(space: ParameterSpace, profiles: Sequence[Profile]) -> list[int]:
    """The numbers of the constants that neither tests nor a prior determine: first those of spring laws, which decide where no test
    has been, then those with not even a bound.
    """
    expected = np.diag(space.precision) > 0
    found = [
        k
        for k, (parameter, profile) in enumerate(zip(space.parameters, profiles, strict=False))
        if profile.verdict is not Verdict.DETERMINED and not parameter.of_test and not expected[k]
    ]
    return sorted(found, key=lambda k: (not space.parameters[k].of_shape, profiles[k].verdict is not Verdict.UNDETERMINED))


def stratify(likelihood: Likelihood, profiles: Sequence[Profile], draws: int) -> Strata | None:
    """The strata for so many `draws`; None if nothing is to be divided. A range is divided between the ends of its interval, as far
    as it has any, and the outer parts reach to the bounds. Boxes in which the tests rule out every point are left out.
    """
    space, at = likelihood.fit.space, likelihood.fit.coordinates
    opened = open_parameters(space, profiles)
    count, parts = division(draws, len(opened))
    divided = tuple(opened[:count])
    if parts < 2:
        return None
    bounds = space.bounds
    lower, upper = (np.tile(bound, (parts**count, 1)) for bound in bounds)
    part = np.stack(np.unravel_index(np.arange(parts**count), (parts,) * count), axis=1)
    for column, j in enumerate(divided):
        ends = (profiles[j].lower, profiles[j].upper)
        low, high = (bound[j] if np.isnan(end) else end for end, bound in zip(ends, bounds, strict=True))
        edges = np.linspace(low, high, parts + 1)
        edges[[0, -1]] = bounds[0][j], bounds[1][j]
        lower[:, j], upper[:, j] = edges[part[:, column]], edges[part[:, column] + 1]
    possible = count * float(fdtri(count, likelihood.common_freedom, DECISIVE))
    centre, cost = np.empty_like(lower), np.full(len(lower), np.inf)
    # where the middle of a box is ruled out, its point that is nearest to the fit
    for near in (0.5 * (lower + upper), np.clip(at, lower, upper)):
        left = np.flatnonzero(cost > possible)
        fixed = np.zeros((left.size, at.size), dtype=bool)
        fixed[:, divided] = True
        start = np.where(fixed, near[left], at)
        found = minimise(likelihood.residuals, start, bounds, fixed=fixed, iterations=ITERATIONS, settled=PRECISE)
        centre[left], cost[left] = found.coordinates, found.cost
    kept = cost <= possible
    if not np.any(kept):
        return None
    lower, upper, centre = lower[kept], upper[kept], centre[kept]
    every, moves = np.arange(len(centre)), np.ones(centre.shape, dtype=bool)
    _, slopes = with_slopes(likelihood.residuals, centre, every, (lower, upper), moves)
    return Strata(divided, lower, upper, centre, np.stack([_follows(each, divided) for each in slopes]))


def _follows(slopes: Floats, divided: Sequence[int]) -> Floats:
    """How all parameters (p, divided) follow the divided ones to the least sum of squares, by derivatives (n, p) of residuals."""
    moved = np.zeros((slopes.shape[1], len(divided)))
    others = np.setdiff1d(np.arange(slopes.shape[1]), divided)
    moved[list(divided)] = np.eye(len(divided))
    moved[others] = -np.linalg.lstsq(slopes[:, others], slopes[:, list(divided)], rcond=SEEN)[0]
    return moved
