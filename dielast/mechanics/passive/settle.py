"""A voltage applied at once to films in frames: equilibrium with every viscous stretch frozen."""

from __future__ import annotations

import numpy as np

from dielast.mechanics.passive.framed import Surroundings
from dielast.mechanics.passive.structure import Factors
from dielast.mechanics.point_material import SYMMETRIC
from dielast.numerics.columns import Flags, Floats

ITERATIONS, HALVINGS = 60, 16
FEW, SELDOM = 12, 3  # of them, where the equilibrium is to be nearby: as in `jump`
SETTLED, BALANCED = 5e-13, 1e-8  # of the stretches: a step that ends the search, and one that leads on
LARGEST = 0.5  # relative change of a stretch in one step


def settle(at: Surroundings, internal: Floats, field: Floats, nearby: float | None = None) -> tuple[Surroundings, Flags]:
    """The equilibrium at a nominal field (k,) with viscous stretches (2, n, P, k), from where the films are, and whether (k,) it
    was found and is stable.

    Newton's method on the forces F of the structure, with steps halved until they fall. An equilibrium `nearby`, at stretches no
    further away in 2 ln l, is given up as soon as the search leaves that range, or takes long.
    """
    iterations, halvings = (ITERATIONS, HALVINGS) if nearby is None else (FEW, SELDOM)
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
                found = equations(trial)
                worse = ~(_merit(found[1]) < merit) & (share > 0)
                if not worse.any():
                    break
                share = np.where(worse, 0.5 * share, share)
            settled |= (share * size <= SETTLED) | worse  # what no share improves is as good as it can be
            unknown, (nominal, force, slope) = trial, found
            if nearby is not None:
                lost |= 2 * np.max(np.abs(np.log(structure.stretch(unknown) / begin)), axis=(0, 1)) > nearby
        factors = Factors.of(structure.tangent(slope))
        left = np.max(np.abs(factors.solve(-force)), axis=0)
        stable = settled & ~lost & (left <= BALANCED) & (factors.rim_stiffness() > 0) & np.all(np.isfinite(nominal), axis=(0, 1))
    return Surroundings(assembly, np.concatenate((unknown, assembly.seen(nominal)))), stable


def _merit(force: Floats) -> Floats:
    """Square of the forces (k,)."""
    return np.asarray(np.sum(np.square(force), axis=0))
