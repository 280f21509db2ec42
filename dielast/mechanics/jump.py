"""Load applied at once: an algebraic jump of the springs with every viscous stretch frozen."""

from __future__ import annotations

import numpy as np

from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.point_material import SYMMETRIC, Points
from dielast.mechanics.span import Control, stretched
from dielast.numerics.columns import Flags, Floats

ITERATIONS, HALVINGS = 200, 60
FEW, SELDOM = 12, 3  # of them, where the equilibrium is to be nearby: Newton's method then takes about 5, without any halving
SETTLED = 1e-12  # in Lambda; what is left is then squared away by the last Newton step
BALANCED = 1e-8  # in Lambda; a Newton step larger than this leads on


def jump(
    points: Points,
    controls: tuple[Control, Control],
    target: Floats,
    internal: Floats,
    log_squared_stretch: Floats,
    nearby: float | None = None,
) -> tuple[Floats, Floats, Flags]:
    """Lambda and nominal stress (2, cases) under the `target` (3, cases), and whether a stable equilibrium was found (cases,).

    `internal` is x (2, n, cases), `log_squared_stretch` the Lambda (2, cases) to start from. Newton's method on the nominal
    stresses, whose tangent is positive wherever the springs' energy is convex, with steps halved until the imbalance falls. An
    equilibrium `nearby`, no further away in Lambda, is given up as soon as the search leaves that range, or takes long.
    """
    iterations, halvings = (ITERATIONS, HALVINGS) if nearby is None else (FEW, SELDOM)
    driven = stretched(controls)
    with np.errstate(all="ignore"):
        log_squared = np.where(driven, 2 * np.log(np.where(driven, target[:2], 1.0)), log_squared_stretch)
        pull = np.where(driven, 0.0, target[:2])
        carried, imbalance, tangent = _equations(points, driven, pull, target[ELECTRIC], internal, log_squared)
        settled, lost = np.zeros((2, log_squared.shape[1]), dtype=bool)
        begin = log_squared
        for _ in range(iterations):
            step = _solve(tangent, -imbalance)
            step *= 1 / np.maximum(1.0, np.max(np.abs(step), axis=0))
            settled |= np.all(np.abs(step) <= SETTLED, axis=0)
            if np.all(settled | lost | ~np.all(np.isfinite(step), axis=0)):
                break
            merit = _merit(imbalance, log_squared)
            share = np.where(settled | lost, 0.0, 1.0)
            for _halving in range(halvings):
                trial = log_squared + share * step
                found = _equations(points, driven, pull, target[ELECTRIC], internal, trial)
                worse = ~(_merit(found[1], trial) < merit) & (share > 0)
                if not worse.any():
                    break
                share = np.where(worse, 0.5 * share, share)
            settled |= share * np.max(np.abs(step), axis=0) <= SETTLED
            log_squared, (carried, imbalance, tangent) = trial, found
            if nearby is not None:
                size = np.max(np.abs(step), axis=0)
                settled |= worse & (size <= BALANCED)  # no share of it improves what is as good as it can be
                lost |= (worse & (size > BALANCED)) | (np.max(np.abs(log_squared - begin), axis=0) > nearby)
        determinant = tangent[0, 0] * tangent[1, 1] - tangent[0, 1] * tangent[1, 0]
        settled &= np.all(
            np.abs(_solve(tangent, -imbalance)) <= BALANCED, axis=0
        )  # or else the search got stuck where there is no root
        stable = settled & ~lost & (determinant > 0) & (tangent[0, 0] > 0) & np.all(np.isfinite(carried), axis=0)
        nominal = np.where(driven, carried * np.exp(-0.5 * log_squared), target[:2])
    return log_squared, nominal, stable


def _equations(
    points: Points, driven: Flags, pull: Floats, electrical: Floats, internal: Floats, log_squared: Floats
) -> tuple[Floats, Floats, Floats]:
    """Mechanical true stress (2, cases), imbalance (2, cases), and the tangent (2, 2, cases) with driven axes taken out."""
    stress, half = points.law.tangent(points.springs(internal, log_squared))
    maxwell, by_stretch, _ = points.maxwell_tangent(log_squared, electrical)
    carried = np.einsum("nm,cnm->cm", points.modulus, stress) - maxwell
    tangent = np.einsum("nm,cnm->cm", points.modulus, half)[SYMMETRIC] - by_stretch
    tangent[(0, 1), (0, 1)] -= 0.5 * carried
    imbalance = np.where(driven, 0.0, carried - pull * np.exp(0.5 * log_squared))
    for axis in range(2):
        if driven[axis, 0]:
            tangent[axis, :] = tangent[:, axis] = 0.0
            tangent[axis, axis] = 1.0
    return carried, imbalance, tangent


def _merit(imbalance: Floats, log_squared: Floats) -> Floats:
    """Square of the imbalance of nominal stresses (cases,), for which a Newton step always leads downhill."""
    return np.asarray(np.sum(np.square(imbalance * np.exp(-0.5 * log_squared)), axis=0))


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Solutions of 2x2 systems, (2, 2, cases) and (2, cases)."""
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    first = matrix[1, 1] * right[0] - matrix[0, 1] * right[1]
    second = matrix[0, 0] * right[1] - matrix[1, 0] * right[0]
    return np.asarray(np.array((first, second)) / determinant)
