"""What may happen to a film, in the order in which things that happen at one moment are listed."""

from __future__ import annotations

from collections.abc import Sequence

from dielast.errors import InputError, nearest, shown
from dielast.material.material import Material
from dielast.mechanics.criteria.breakdown import ElectricalBreakdown
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.criteria.damage import Damage
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.criteria.pull_in import PullIn

CRITERIA: list[Criterion] = [
    ElectricalBreakdown(),
    PullIn(),
    Damage(),
    *(LossOfTension(axis) for axis in (0, 1)),
]


END = "end"  # where a run stops that stops at nothing that happens


def names() -> list[str]:
    """The names of all criteria, each once."""
    return list(dict.fromkeys(known.name for known in CRITERIA))


def failures_of(materials: Sequence[Material]) -> tuple[str, ...]:
    """The names of the criteria by which films of these materials may be lost, each once."""
    return tuple(dict.fromkeys(known.name for known in CRITERIA if known.is_failure and known.concerns(materials)))


def named(name: str) -> Criterion:
    """The first criterion of this name; raises `InputError` if there is none."""
    for known in CRITERIA:
        if known.name == name:
            return known
    raise InputError(f"{shown(name)}: criterion: {nearest(name, names())}")
