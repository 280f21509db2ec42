"""A load applied at once: algebraic equilibrium of the springs with all viscous stretches frozen."""

import numpy as np

from dielast.mechanics.electric import ELECTRIC
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Control, stretch_prescribed
from dielast.numerics import newton
from dielast.numerics.arrays import Flags, Floats


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
    stresses, whose tangent is positive definite where the energy of the springs is convex. With `nearby`, the search ends without
    an equilibrium as soon as Lambda has changed by more than `nearby`, or converges slowly.
    """
    driven = stretch_prescribed(controls)

    def equations(log_squared: Floats) -> tuple[Floats, Floats, Floats]:
        """True mechanical stress and imbalance (2, cases), and the tangent (2, 2, cases), the identity in rows of driven axes."""
        stress, spring_tangent = points.law.tangent(points.springs(internal, log_squared))
        maxwell, by_stretch, _ = points.maxwell_tangent(log_squared, target[ELECTRIC])
        carried = np.einsum("nm,cnm->cm", points.modulus, stress) - maxwell
        tangent = points.film_tangent(spring_tangent, by_stretch, carried, log_squared)
        needed = applied if points.edges is None else applied - points.edges.borne(log_squared)
        imbalance = np.where(driven, 0.0, carried - needed * np.exp(0.5 * log_squared))
        for axis in range(2):
            if driven[axis, 0]:
                tangent[axis, :] = tangent[:, axis] = 0.0
                tangent[axis, axis] = 1.0
        return carried, imbalance, tangent

    def step(log_squared: Floats, here: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats]:
        _, imbalance, matrix = here
        determinant = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
        first = matrix[1, 1] * -imbalance[0] + matrix[0, 1] * imbalance[1]
        second = matrix[0, 0] * -imbalance[1] + matrix[1, 0] * imbalance[0]
        change = np.array((first, second)) / determinant
        return change, np.max(np.abs(change), axis=0)

    def merit(log_squared: Floats, here: tuple[Floats, Floats, Floats]) -> Floats:
        return np.asarray(np.sum(np.square(here[1] * np.exp(-0.5 * log_squared)), axis=0))

    with np.errstate(all="ignore"):
        begin = np.where(driven, 2 * np.log(np.where(driven, target[:2], 1.0)), log_squared_stretch)
        applied = np.where(driven, 0.0, target[:2])
        found = newton.solve(begin, equations, step, merit, lambda present: np.max(np.abs(present - begin), axis=0), nearby)
        log_squared, (carried, _, tangent), settled = found
        determinant = tangent[0, 0] * tangent[1, 1] - tangent[0, 1] * tangent[1, 0]
        stable = settled & (determinant > 0) & (tangent[0, 0] > 0) & np.all(np.isfinite(carried), axis=0)
        free = target[:2] if points.edges is None else target[:2] - points.edges.borne(log_squared)
        nominal = np.where(driven, carried * np.exp(-0.5 * log_squared), free)
    return log_squared, nominal, stable
