"""What may happen to a film, in the order in which things that happen at one moment are listed."""

from __future__ import annotations

from dielast.mechanics.criteria.breakdown import Breakdown
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.criteria.pull_in import PullIn

CRITERIA: list[Criterion] = [
    Breakdown(),
    PullIn(),
    *(LossOfTension(axis) for axis in (0, 1)),
]


END = "end"  # where a run stops that stops at nothing that happens


def names(*, failures_only: bool = False) -> list[str]:
    """The names of all criteria, each once, or of those by which a film is lost."""
    return list(dict.fromkeys(known.name for known in CRITERIA if known.is_failure or not failures_only))


def named(name: str) -> Criterion:
    """The first criterion of this name."""
    return next(known for known in CRITERIA if known.name == name)
