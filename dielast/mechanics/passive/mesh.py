"""The number of points that the annulus around a disc needs for a given tolerance.

The measure is the nominal field that holds an elastic disc, with only the equilibrium spring of the film, at a prescribed stretch.
By the theory of small strains, this stretch halves the radial stress at the rim: a relative stretch of 1.5 for a small electrode,
about the largest at which the film around it stays taut. The error with n points is the largest change of the field when one or two
points are added.

Around a disc with a very stiff spring, such as Ogden's with an exponent of 8 or more, the film goes slack far below that stretch,
and collapses next to the rim in a kink that no polynomial resolves. Where no number of points is enough, a smaller stretch is used,
which leaves the film around the disc half of its tension.
"""

from dataclasses import replace

import numpy as np

from dielast.mechanics.passive.forms import disc
from dielast.mechanics.passive.framed import Assembly
from dielast.mechanics.passive.structure import solved
from dielast.mechanics.point_material import SYMMETRIC, PointMaterial
from dielast.numerics.arrays import Cases, Floats

LEAST, MOST = 2, 20  # number of points
RESOLVED = 1e-6  # error of the field that is reached with enough points, unless there is a kink
WIDENINGS = 0.5 ** np.arange(16)  # fractions of the stretch to try in turn, until the springs can reach it
ITERATIONS, SETTLED = 30, 1e-9  # of Newton's method, and its last step relative to the prestretch
FEW_AND_MANY = (LEAST, LEAST + 4, LEAST + 9)  # numbers of points with all of which the stretch must be reached


def points_needed(points: PointMaterial, share: Floats, prestretch: Floats, tolerance: float) -> Cases:
    """The number of points (cases,) with which the field of each disc (see `forms.disc`) is accurate to a relative `tolerance`, 0
    where no number is enough.
    """
    # where the film has no equilibrium modulus, any other does: the error is relative to the field
    points = points.apart().take(np.arange(share.size))  # the equilibrium springs: the branches are relaxed
    points = replace(points, modulus=np.where(points.modulus > 0, points.modulus, 1.0))
    finest = min(tolerance, RESOLVED)
    errors = _errors(points, share, prestretch, finest, taut=False)
    kinked = np.flatnonzero(~np.any(errors <= RESOLVED, axis=0))
    if kinked.size:
        errors = np.concatenate((errors, np.full((MOST - LEAST - len(errors), share.size), np.inf)))
        taut_errors = _errors(points.take(kinked), share[kinked], prestretch[kinked], finest, taut=True)
        errors[: len(taut_errors), kinked], errors[len(taut_errors) :, kinked] = taut_errors, np.inf
    exact = errors <= tolerance
    return np.where(np.any(exact, axis=0), LEAST + np.argmax(exact, axis=0), 0)


def _errors(points: PointMaterial, share: Floats, prestretch: Floats, finest: float, taut: bool) -> Floats:
    """Errors (counts, cases) of the field with `LEAST` points, and more up to `MOST`, until all are below `finest`.

    They hold at stretches that the springs can reach, and, if `taut`, that leave the film at least half of its tension.
    """
    squared = share * share
    tension = _pull(points, share, prestretch, prestretch, LEAST)[1] if taut else np.full(share.shape, -np.inf)
    widest = prestretch * (1 + 0.5 * (1 - squared) / (1 + squared))
    reachable = np.full(share.shape, np.nan)
    for part in WIDENINGS:
        aim = prestretch + part * (widest - prestretch)
        reach, tensions = np.array([_pull(points, share, prestretch, aim, count) for count in FEW_AND_MANY]).swapaxes(0, 1)
        reached = np.all((reach > 0) & (tensions > 0.5 * tension), axis=0)
        reachable = np.where(np.isnan(reachable) & reached, aim, reachable)
        if not np.isnan(reachable).any():
            break
    known = dict(zip(FEW_AND_MANY, reach, strict=True)) if np.array_equal(reachable, aim) else {}
    errors: list[Floats] = []
    pulls: list[Floats] = []
    for count in range(LEAST - 2, MOST):
        now = known.get(count + 2)
        pulls.append(_pull(points, share, prestretch, reachable, count + 2)[0] if now is None else now)
        if count < LEAST:
            continue
        errors.append(0.5 * np.max(np.abs(np.array(pulls[-2:]) / pulls[-3] - 1), axis=0))
        if np.all(errors[-1] <= finest):
            break
    return np.array(errors)


def _pull(points: PointMaterial, share: Floats, prestretch: Floats, stretch: Floats, count: int) -> tuple[Floats, Floats]:
    """The Maxwell stress in Pa that holds relaxed discs at a `stretch`, and the smallest nominal stress in the film around them,
    all (cases,); NaN where the springs cannot reach the stretch.
    """
    structure = disc(share, prestretch, count)
    assembly = Assembly.of(points, structure)
    wide = assembly.all_points
    with np.errstate(all="ignore"):
        # initial guess: a straight line from rim to frame in z, in which small strains are linear
        unknown = structure.home + _line(count) * (stretch - prestretch)
        for _ in range(ITERATIONS):
            at = structure.stretch(unknown)
            stress, half = wide.law.tangent(np.square(at).reshape(2, 1, -1))
            carried = assembly.carried(stress, None)
            spring_tangent = (wide.modulus * half[:, 0])[SYMMETRIC]
            force = structure.force(carried / at)
            tangent = structure.tangent(assembly.slope(spring_tangent, at, carried))
            step = solved(tangent[1:, 1:], -force[1:, None])[:, 0]
            unknown[1:] += step
            size = np.max(np.abs(step), axis=0)
            if not np.any(size > SETTLED * prestretch):
                break
        # with what the last step changes, which is exact to the square of that step
        maxwell = 0.5 * (force[0] + np.sum(tangent[0, 1:] * step, axis=0)) * stretch
        settled = size <= SETTLED * prestretch
        reached = settled & np.all(at > 0, axis=(0, 1)) & np.isfinite(maxwell)
        tension = np.min((carried / at)[:, 1:], axis=(0, 1))
        return np.where(reached, maxwell, np.nan), np.where(reached, tension, np.nan)


def _line(count: int) -> Floats:
    """z (count, 1) of the nodes, from the rim to the last one before the frame."""
    return np.asarray(0.5 * (1 + np.cos(np.pi * np.arange(count) / count)))[:, None]
