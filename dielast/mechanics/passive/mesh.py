"""How many points the annulus around a disc needs, from a tolerance.

The measure is the nominal field that holds an elastic disc, with the film's equilibrium spring alone, at a stretch that halves the
radial stretch at its rim by the theory of small strains: a relative stretch of 1.5 for a small electrode, about as far as the film
around it stays taut. The error of n points is what the field changes by with one point more.
"""

from __future__ import annotations

import numpy as np

from dielast.mechanics.passive.forms import disc
from dielast.mechanics.passive.framed import Assembly
from dielast.mechanics.passive.structure import Factors
from dielast.mechanics.point_material import SYMMETRIC, Points
from dielast.numerics.columns import Cases, Floats

LEAST, MOST = 2, 20  # points
WIDENINGS = 0.5 ** np.arange(6)  # shares of the stretch, of which the first is taken that the springs can reach
ITERATIONS = 30


def points_needed(points: Points, share: Floats, prestretch: Floats, tolerance: float) -> Cases:
    """The number of points (cases,) with which the field of each disc (see `forms.disc`) is exact to a relative `tolerance`; 0
    where no number is enough.
    """
    squared = share * share
    widest = prestretch * (1 + 0.5 * (1 - squared) / (1 + squared))
    reachable = np.full(share.shape, np.nan)
    for part in WIDENINGS:
        aim = prestretch + part * (widest - prestretch)
        pull = _pull(points, share, prestretch, aim, LEAST + 4)
        reachable = np.where(np.isnan(reachable) & (pull > 0), aim, reachable)
    needed = np.zeros(share.size, dtype=np.intp)
    before = _pull(points, share, prestretch, reachable, LEAST)
    for count in range(LEAST, MOST):
        pull = _pull(points, share, prestretch, reachable, count + 1)
        exact = 0.5 * np.abs(pull - before) <= tolerance * pull
        needed = np.where((needed == 0) & exact, count, needed)
        if needed.all():
            break
        before = pull
    return needed


def _pull(points: Points, share: Floats, prestretch: Floats, stretch: Floats, count: int) -> Floats:
    """The Maxwell stress (cases,) in Pa that holds relaxed discs at a `stretch` (cases,); NaN where the springs cannot reach it."""
    structure = disc(share, prestretch, count)
    assembly = Assembly.of(points, structure)
    wide, none = assembly.all_points, np.zeros_like(share)
    alone = wide.modulus[:1]
    with np.errstate(all="ignore"):
        # a straight line between rim and frame, in the place that a small strain is linear in
        unknown = structure.home + _line(count) * (stretch - prestretch)
        for _ in range(ITERATIONS):
            at = structure.stretch(unknown)
            viscous = np.repeat(at[:, None], len(wide.modulus), axis=1)
            viscous[:, 0] = 1.0  # branches are relaxed
            stress, half = wide.law.tangent(assembly.springs(viscous, at))
            carried = assembly.carried(stress, at, none, electric=False)
            own = (alone * half[:, 0])[SYMMETRIC]
            force = structure.force(carried / at)
            tangent = structure.tangent(assembly.slope(own, carried, at, none, electric=False))
            if count == 1:
                break
            step = Factors.of(tangent[1:, 1:]).solve(-force[1:])
            unknown[1:] += step
            if np.nanmax(np.abs(step), initial=0.0) <= 1e-15 * prestretch.max():
                break
        found = 0.5 * force[0] * stretch
        return np.where(np.all(at > 0, axis=(0, 1)) & np.isfinite(found), found, np.nan)


def _line(count: int) -> Floats:
    """z (count, 1) of the nodes from the rim to the last before the frame."""
    return np.asarray(0.5 * (1 + np.cos(np.pi * np.arange(count) / count)))[:, None]
