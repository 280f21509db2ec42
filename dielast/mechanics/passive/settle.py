"""A voltage applied at once to films in frames: equilibrium with every viscous stretch frozen."""

import numpy as np

from dielast.mechanics.passive.framed import Surroundings
from dielast.mechanics.passive.structure import rim_stiffness, solved
from dielast.mechanics.point_material import SYMMETRIC
from dielast.numerics import newton
from dielast.numerics.arrays import Flags, Floats


def settle(at: Surroundings, internal: Floats, field: Floats, nearby: float | None = None) -> tuple[Surroundings, Flags]:
    """The equilibrium at a nominal field (k,) with viscous stretches (2, n, P, k), and whether (k,) it was found and is stable.

    The search starts from the present state, by Newton's method on the forces F of the structure. With `nearby`, it ends without an
    equilibrium as soon as 2 ln l of a stretch l has changed by more than `nearby`, or converges slowly.
    """
    assembly, structure = at.assembly, at.assembly.structure

    def equations(unknown: Floats) -> tuple[Floats, Floats, Floats]:
        stretch = structure.stretch(unknown)
        stress, half = assembly.all_points.law.tangent(assembly.springs(internal, stretch))
        maxwell, by_stretch, _ = assembly.maxwell_tangent(stretch, field)
        carried = assembly.carried(stress, maxwell)
        spring_tangent = np.einsum("nm,cnm->cm", assembly.all_points.modulus, half)[SYMMETRIC]
        nominal = carried / stretch
        slope = assembly.slope(spring_tangent, stretch, carried, by_stretch)
        return nominal, structure.force(nominal), structure.tangent(slope)

    def step(unknown: Floats, here: tuple[Floats, Floats, Floats]) -> tuple[Floats, Floats]:
        change = solved(here[2], -here[1][:, None])[:, 0]
        return change, 2 * np.max(np.abs(structure.moved(change) / structure.stretch(unknown)), axis=(0, 1))

    def merit(unknown: Floats, here: tuple[Floats, Floats, Floats]) -> Floats:
        return np.asarray(np.sum(np.square(here[1]), axis=0))

    def moved(unknown: Floats) -> Floats:
        return np.asarray(2 * np.max(np.abs(np.log(structure.stretch(unknown) / begin)), axis=(0, 1)))

    with np.errstate(all="ignore"):
        begin = structure.stretch(at.border[:-2])
        unknown, (nominal, _, tangent), settled = newton.solve(at.border[:-2].copy(), equations, step, merit, moved, nearby)
        stable = settled & (rim_stiffness(tangent) > 0) & np.all(np.isfinite(nominal), axis=(0, 1))
    return Surroundings(assembly, np.concatenate((unknown, structure.border(nominal)))), stable
