"""A load applied at once: algebraic equilibrium of the springs with all viscous stretches frozen."""

import numpy as np

from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.point_material import SYMMETRIC, PointMaterial
from dielast.mechanics.span import Control, stretch_prescribed
from dielast.numerics.arrays import Flags, Floats

ITERATIONS, HALVINGS = 200, 60  # at most; halvings of one Newton step
FEW, SELDOM = 12, 3  # the same in a search nearby, where Newton's method takes about 5 iterations without any halving
SETTLED = 1e-12  # change of Lambda at which the search ends; the last Newton step has then squared the error
BALANCED = 1e-8  # Newton step in Lambda that an equilibrium may still have


def jump(
    points: PointMaterial,
    controls: tuple[Control, Control],
    target: Floats,
    internal: Floats,
    log_squared_stretch: Floats,
    nearby: float | None = None,
) -> tuple[Floats, Floats, Flags]:
    """Lambda and nominal stress (2, cases) under the `target` (3, cases), and whether a stable equilibrium was found (cases,).

    `internal` is x (2, n, cases), `log_squared_stretch` the initial guess of Lambda (2, cases). Newton's method on the nominal
    stresses, whose tangent is positive definite where the energy of the springs is convex; a step is halved until the imbalance
    decreases. With `nearby`, the search ends without an equilibrium as soon as Lambda has changed by more than `nearby`, or
    converges slowly.
    """
    iterations, halvings = (ITERATIONS, HALVINGS) if nearby is None else (FEW, SELDOM)
    driven = stretch_prescribed(controls)
    with np.errstate(all="ignore"):
        log_squared = np.where(driven, 2 * np.log(np.where(driven, target[:2], 1.0)), log_squared_stretch)
        applied = np.where(driven, 0.0, target[:2])
        carried, imbalance, tangent = _equations(points, driven, applied, target[ELECTRIC], internal, log_squared)
        settled, lost = np.zeros((2, log_squared.shape[1]), dtype=bool)
        begin = log_squared
        for _ in range(iterations):
            step = _solve(tangent, -imbalance)
            step *= 1 / np.maximum(1.0, np.max(np.abs(step), axis=0))
            settled |= np.all(np.abs(step) <= SETTLED, axis=0)
            if np.all(settled | lost | ~np.all(np.isfinite(step), axis=0)):
                break
            merit = _merit(imbalance, log_squared)
            fraction = np.where(settled | lost, 0.0, 1.0)
            for _halving in range(halvings):
                trial = log_squared + fraction * step
                equations = _equations(points, driven, applied, target[ELECTRIC], internal, trial)
                worse = ~(_merit(equations[1], trial) < merit) & (fraction > 0)
                if not worse.any():
                    break
                fraction = np.where(worse, 0.5 * fraction, fraction)
            settled |= fraction * np.max(np.abs(step), axis=0) <= SETTLED
            log_squared, (carried, imbalance, tangent) = trial, equations
            if nearby is not None:
                size = np.max(np.abs(step), axis=0)
                settled |= worse & (size <= BALANCED)  # no fraction of the step improves the equilibrium further
                lost |= (worse & (size > BALANCED)) | (np.max(np.abs(log_squared - begin), axis=0) > nearby)
        determinant = tangent[0, 0] * tangent[1, 1] - tangent[0, 1] * tangent[1, 0]
        # a larger Newton step means that the search stalled where there is no root
        settled &= np.all(np.abs(_solve(tangent, -imbalance)) <= BALANCED, axis=0)
        stable = settled & ~lost & (determinant > 0) & (tangent[0, 0] > 0) & np.all(np.isfinite(carried), axis=0)
        free = target[:2] if points.edges is None else target[:2] - points.edges.borne(log_squared)
        nominal = np.where(driven, carried * np.exp(-0.5 * log_squared), free)
    return log_squared, nominal, stable


def _equations(
    points: PointMaterial, driven: Flags, applied: Floats, electrical: Floats, internal: Floats, log_squared: Floats
) -> tuple[Floats, Floats, Floats]:
    """Mechanical true stress and imbalance (2, cases), and the tangent (2, 2, cases), the identity in rows of driven axes."""
    stress, spring_tangent = points.law.tangent(points.springs(internal, log_squared))
    maxwell, by_stretch, _ = points.maxwell_tangent(log_squared, electrical)
    carried = np.einsum("nm,cnm->cm", points.modulus, stress) - maxwell
    tangent = np.einsum("nm,cnm->cm", points.modulus, spring_tangent)[SYMMETRIC] - by_stretch
    tangent[(0, 1), (0, 1)] -= 0.5 * carried
    if points.edges is not None:
        applied = applied - points.edges.borne(log_squared)
        tangent[(0, 1), (0, 1)] += points.edges.tangent(log_squared)
    imbalance = np.where(driven, 0.0, carried - applied * np.exp(0.5 * log_squared))
    for axis in range(2):
        if driven[axis, 0]:
            tangent[axis, :] = tangent[:, axis] = 0.0
            tangent[axis, axis] = 1.0
    return carried, imbalance, tangent


def _merit(imbalance: Floats, log_squared: Floats) -> Floats:
    """The squared imbalance of nominal stresses (cases,), which every Newton step decreases if it is short enough."""
    return np.asarray(np.sum(np.square(imbalance * np.exp(-0.5 * log_squared)), axis=0))


def _solve(matrix: Floats, right: Floats) -> Floats:
    """Solutions of 2x2 systems, (2, 2, cases) and (2, cases)."""
    determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    first = matrix[1, 1] * right[0] - matrix[0, 1] * right[1]
    second = matrix[0, 0] * right[1] - matrix[1, 0] * right[0]
    return np.asarray(np.array((first, second)) / determinant)
