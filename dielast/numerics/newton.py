"""Newton's method for many independent cases at once, in steps that are halved until they help."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from dielast.numerics.arrays import Flags, Floats

Equations = TypeVar("Equations")

ITERATIONS, HALVINGS = 200, 60  # at most; halvings of one step
FEW, SELDOM = 12, 3  # the same in a search nearby, where Newton's method takes about 5 iterations without any halving
LARGEST = 1.0  # size of a step; longer ones are shortened
SETTLED = 1e-12  # size of a step at which the search ends; the last step has then squared the error
BALANCED = 1e-8  # size of the step that a solution may still have


def solve(
    unknown: Floats,
    equations: Callable[[Floats], Equations],
    step_of: Callable[[Floats, Equations], tuple[Floats, Floats]],
    merit_of: Callable[[Floats, Equations], Floats],
    moved: Callable[[Floats], Floats],
    nearby: float | None = None,
) -> tuple[Floats, Equations, Flags]:
    """Where a search from `unknown` (rows, cases) ends, the equations there, and whether (cases,) it is a solution.

    `step_of` returns the full step (rows, cases) from an unknown with its equations, and the size (cases,) of that step. A step is
    halved until `merit_of` (cases,) decreases, as it does if the step is short enough. With `nearby`, the search ends without a
    solution as soon as an unknown has `moved` (cases,) by more than that from the beginning, or converges slowly.
    """
    iterations, halvings = (ITERATIONS, HALVINGS) if nearby is None else (FEW, SELDOM)
    here = equations(unknown)
    settled, lost = np.zeros((2, unknown.shape[1]), dtype=bool)
    for _ in range(iterations):
        step, size = step_of(unknown, here)
        settled |= size <= SETTLED
        if np.all(settled | lost | ~np.isfinite(size)):
            break
        step, size = step * np.minimum(1.0, LARGEST / size), np.minimum(size, LARGEST)
        merit, share = merit_of(unknown, here), np.where(settled | lost, 0.0, 1.0)
        for _halving in range(halvings):
            trial = unknown + share * step
            there = equations(trial)
            worse = ~(merit_of(trial, there) < merit) & (share > 0)
            if not worse.any():
                break
            share = np.where(worse, 0.5 * share, share)
        settled |= (share * size <= SETTLED) | worse  # no part of the step improves the solution further
        unknown, here = trial, there
        if nearby is not None:
            lost |= moved(unknown) > nearby
    # a larger step means that the search stalled where there is no solution
    return unknown, here, settled & ~lost & (step_of(unknown, here)[1] <= BALANCED)
