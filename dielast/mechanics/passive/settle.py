"""A voltage applied at once to films in frames: equilibrium with every viscous stretch frozen."""

import numpy as np

from dielast.mechanics.passive.framed import Surroundings
from dielast.mechanics.passive.structure import Factors
from dielast.mechanics.point_material import SYMMETRIC
from dielast.numerics.arrays import Flags, Floats

ITERATIONS, HALVINGS = 60, 16
FEW, SELDOM = 12, 3  # the same in a search nearby, as in `jump`
# relative Newton steps in the stretches: one that ends the search, one that an equilibrium may have
SETTLED, BALANCED = 5e-13, 1e-8
LARGEST = 0.5  # relative change of a stretch in one step


def settle(at: Surroundings, internal: Floats, field: Floats, nearby: float | None = None) -> tuple[Surroundings, Flags]:
    """The equilibrium at a nominal field (k,) with viscous stretches (2, n, P, k), and whether (k,) it was found and is stable.

    The search starts from the present state. Newton's method on the forces F of the structure; a step is halved until they
    decrease. With `nearby`, the search ends without an equilibrium as soon as 2 ln l of a stretch l has changed by more than
    `nearby`, or converges slowly.
    """
    iterations, halvings = (ITERATIONS, HALVINGS) if nearby is None else (FEW, SELDOM)
    assembly, structure = at.assembly, at.assembly.structure

    def equations(unknown: Floats) -> tuple[Floats, Floats, Floats]:
        stretch = structure.stretch(unknown)
        stress, half = assembly.all_points.law.tangent(assembly.springs(internal, stretch))
        maxwell, by_stretch, _ = assembly.maxwell_tangent(stretch, field)
        carried = assembly.carried(stress, maxwell)
        spring_tangent = np.einsum("nm,cnm->cm", assembly.all_points.modulus, half)[SYMMETRIC]
        nominal = carried / stretch
        return nominal, structure.force(nominal), assembly.slope(spring_tangent, stretch, carried, by_stretch)

    with np.errstate(all="ignore"):
        unknown = at.border[:-2].copy()
        nominal, force, slope = equations(unknown)
        settled, lost = np.zeros((2, field.size), dtype=bool)
        begin = structure.stretch(unknown)
        for _ in range(iterations):
            step = Factors.of(structure.tangent(slope)).solve(-force)
            size = np.max(np.abs(structure.moved(step) / structure.stretch(unknown)), axis=(0, 1))
            step *= np.minimum(1.0, LARGEST / size)
            settled |= size <= SETTLED
            if np.all(settled | lost | ~np.isfinite(size)):
                break
            merit, share = _merit(force), np.where(settled | lost, 0.0, 1.0)
            for _halving in range(halvings):
                trial = unknown + share * step
                trial_state = equations(trial)
                worse = ~(_merit(trial_state[1]) < merit) & (share > 0)
                if not worse.any():
                    break
                share = np.where(worse, 0.5 * share, share)
            settled |= (share * size <= SETTLED) | worse  # no fraction of the step improves the equilibrium further
            unknown, (nominal, force, slope) = trial, trial_state
            if nearby is not None:
                lost |= 2 * np.max(np.abs(np.log(structure.stretch(unknown) / begin)), axis=(0, 1)) > nearby
        factors = Factors.of(structure.tangent(slope))
        newton_step = np.max(np.abs(factors.solve(-force)), axis=0)
        holds = settled & ~lost & (newton_step <= BALANCED)
        stable = holds & (factors.rim_stiffness() > 0) & np.all(np.isfinite(nominal), axis=(0, 1))
    return Surroundings(assembly, np.concatenate((unknown, structure.border(nominal)))), stable


def _merit(force: Floats) -> Floats:
    """The sum of squared forces (k,)."""
    return np.asarray(np.sum(np.square(force), axis=0))
