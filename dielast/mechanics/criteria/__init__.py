"""The registry of criteria, in the order in which simultaneous events are listed."""

from collections.abc import Sequence

from dielast.base.errors import InputError, nearest, shown
from dielast.base.registry import opened
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


opened("dielast.criteria", Criterion, lambda added: CRITERIA.append(added() if isinstance(added, type) else added))

END = "end"  # the value of `stop.at` for a run that no event stops


def names() -> list[str]:
    """The names of all criteria, without repetition."""
    return list(dict.fromkeys(criterion.name for criterion in CRITERIA))


def failures_of(materials: Sequence[Material]) -> tuple[str, ...]:
    """The names of the criteria that are failures of films of these materials, without repetition."""
    return tuple(dict.fromkeys(criterion.name for criterion in CRITERIA if criterion.is_failure and criterion.concerns(materials)))


def named(name: str) -> Criterion:
    """The first criterion of this name; raises `InputError` if there is none."""
    for criterion in CRITERIA:
        if criterion.name == name:
            return criterion
    raise InputError(f"{shown(name)}: criterion: {nearest(name, names())}")
