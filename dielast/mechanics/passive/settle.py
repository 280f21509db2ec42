"""A voltage applied at once to films in frames: equilibrium with every viscous stretch frozen."""

from __future__ import annotations

import numpy as np

from dielast.mechanics.passive.framed import Surroundings
from dielast.mechanics.passive.structure import Factors
from dielast.mechanics.point_material import SYMMETRIC
from dielast.numerics.columns import Flags, Floats

ITERATIONS, HALVINGS = 60, 16
SETTLED, BALANCED = 5e-13, 1e-8  # of the stretches: a step that ends the search, and one that leads on
LARGEST = 0.5  # relative change of a stretch in one step


def settle(at: Surroundings, internal: Floats, field: Floats) -> tuple[Surroundings, Flags]:
    """The equilibrium at a nominal field (k,) with viscous stretches (2, n, P, k), from where the films are, and whether (k,) it
    was found and is stable.

    Newton's method on the forces F of the structure, with steps halved until they fall.
    """
    assembly, structure = at.assembly, at.assembly.structure

    def equations(unknown: Floats) -> tuple[Floats, Floats, Floats]:
        stretch = structure.stretch(unknown)
        stress, half = assembly.all_points.law.tangent(assembly.springs(internal, stretch))
        carried = assembly.carried(stress, stretch, field)
        own = np.einsum("nm,cnm->cm", assembly.all_points.modulus, half)[SYMMETRIC]
        nominal = carried / stretch
        return nominal, structure.force(nominal), assembly.slope(own, carried, stretch, field)

    with np.errstate(all="ignore"):
        unknown = at.border[:-2].copy()
        nominal, force, slope = equations(unknown)
        settled = np.zeros(field.size, dtype=bool)
        for _ in range(ITERATIONS):
            step = Factors.of(structure.tangent(slope)).solve(-force)
            size = np.max(np.abs(structure.moved(step) / structure.stretch(unknown)), axis=(0, 1))
            step *= np.minimum(1.0, LARGEST / size)
            settled |= size <= SETTLED
            if np.all(settled | ~np.isfinite(size)):
                break
            merit, share = _merit(force), np.where(settled, 0.0, 1.0)
            for _halving in range(HALVINGS):
                trial = unknown + share * step
                state = equations(trial)
                worse = ~(_merit(state[1]) < merit) & (share > 0)
                if not worse.any():
                    break
                share = np.where(worse, 0.5 * share, share)
            settled |= (share * size <= SETTLED) | worse  # what no share improves is as good as it can be
            unknown, (nominal, force, slope) = trial, state
        factors = Factors.of(structure.tangent(slope))
        left = np.max(np.abs(factors.solve(-force)), axis=0)
        stable = settled & (left <= BALANCED) & (factors.rim_stiffness() > 0) & np.all(np.isfinite(nominal), axis=(0, 1))
    return Surroundings(assembly, np.concatenate((unknown, assembly.seen(nominal)))), stable


def _merit(force: Floats) -> Floats:
    """Square of the forces (k,)."""
    return np.asarray(np.sum(np.square(force), axis=0))
