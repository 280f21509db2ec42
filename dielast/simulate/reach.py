"""Properties of a history of load: the symmetry that films keep in it, and stretches beyond the limit of a spring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dielast.errors import InputError
from dielast.material.springs import EQUIBIAXIAL, UNIAXIAL, Symmetry
from dielast.mechanics.cases import of_case
from dielast.mechanics.course import Piece
from dielast.mechanics.point_material import Points
from dielast.mechanics.span import Control
from dielast.numerics.arrays import Cases, Flags, Floats
from dielast.simulate.film_setup import Stretched, pair_in_words

PER_CENT = 20  # a larger stretch may be meant in per cent


def symmetry_of(pieces: Sequence[Piece]) -> Symmetry | None:
    """The symmetry that a specimen at rest keeps throughout a history, None without one."""
    stress = Control.STRESS

    def free(target: Floats | None) -> bool:
        return target is None or not np.any(target)

    if all(
        piece.controls[1] is stress and free(piece.target[1]) and free(piece.target[2]) and not any(piece.driven[1:])
        for piece in pieces
    ):
        return UNIAXIAL
    alike = all(
        piece.controls[0] is piece.controls[1]
        and piece.driven[0] == piece.driven[1]
        and (piece.target[0] is piece.target[1] or np.array_equal(np.asarray(piece.target[0]), np.asarray(piece.target[1])))
        for piece in pieces
    )
    return EQUIBIAXIAL if alike else None


def check_reach(points: Points, pieces: Sequence[Piece]) -> None:
    """`InputError` for a stretch beyond the limit of the equilibrium spring, or of the branches if applied at once at rest."""
    never = np.zeros(points.stress_floor.size, dtype=bool)
    for index, piece in enumerate(pieces):
        held = {
            axis: target
            for axis, (control, target) in enumerate(zip(piece.controls, piece.target, strict=False))
            if control is Control.STRETCH and target is not None
        }
        check_limits(points, list(held.values()), piece.at_once if index == 0 else never, step=piece.origin)
        for extreme in piece.extremes():
            far = [extreme if piece.driven[axis] else value for axis, value in held.items()]
            check_limits(points, far, never, step=piece.origin)


def check_limits(
    points: Points, held: Sequence[Floats], at_once: Flags, prestretch: Stretched | None = None, step: int | None = None
) -> None:
    """`InputError` for stretches of the axes `held`, each (cases,), beyond the limit of a spring (see `out_of_reach`).

    They are those of the `prestretch` of both axes, or of a `step`, which the error names.
    """
    beyond, spring = out_of_reach(points, held, at_once)
    if beyond.any():
        case = int(np.argmax(beyond))
        largest = max(float(stretch[case]) for stretch in held)
        stated, argument = (f"stretch {largest:g}", None) if prestretch is None else (pair_in_words(prestretch, case), "prestretch")
        limit = points.law.of_spring(int(spring[case]), case).describe_limit()
        text = f"{stated} is beyond {limit}{_or_per_cent(largest)}"
        raise InputError(text, step=step, argument=argument, case=of_case(case, beyond.size))


def _or_per_cent(stretch: float) -> str:
    """The question to add to an error about a `stretch` so large that it may be meant in per cent; empty for others."""
    if stretch < PER_CENT:
        return ""
    share = stretch / 100
    as_stretch = f", and a stretch of {stretch:g} % is {share:g}" if share >= 1 else ""
    return f"; is it in per cent? a strain of {stretch:g} % is a stretch of {1 + share:g}{as_stretch}"


def out_of_reach(points: Points, held: Sequence[Floats], at_once: Flags) -> tuple[Flags, Cases]:
    """Whether (cases,) the stretches of the axes `held`, each (cases,), are beyond the limit of a spring, and the spring (cases,)
    with the smallest margin.

    It is the equilibrium spring, or any spring where the stretches are reached `at_once` from rest.
    """
    if not held:
        return np.zeros(at_once.shape, dtype=bool), np.zeros(at_once.shape, dtype=np.intp)
    squared = [np.square(stretch) for stretch in held]
    # a free axis is assumed to contract as under uniaxial stress
    squared_stretches = np.stack((squared[0], squared[1] if len(squared) == 2 else 1 / np.sqrt(squared[0])))
    margin = points.law.margin(np.repeat(squared_stretches[:, None], points.modulus.shape[0], axis=1))
    margin[1:, ~at_once] = np.inf
    first = np.argmin(margin, axis=0)
    return np.asarray(np.min(margin, axis=0) <= 0), first
