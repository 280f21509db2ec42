"""The law of all springs of many cases: one law if it is the same for all, else several laws in parallel."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from dielast.material.springs.law import SpringLaw, Symmetry
from dielast.numerics.arrays import Cases, Flags, Floats


@dataclass(frozen=True, slots=True, eq=False)
class SeveralLaws(SpringLaw):
    """Several laws side by side: along the `axis` -1 of all arrays (..., n, cases), each for all springs of some of the cases, or
    along the axis -2, each for some of the springs. `which` (cases,) or (n,) is the index of the law of each case or spring.

    A law has its cases or springs in the order in which they appear in `which`.
    """

    laws: tuple[SpringLaw, ...]
    which: Cases
    axis: int

    def stress(self, squared_stretch: Floats) -> Floats:
        """Stresses of each law."""
        return self._joined(lambda law, squared: (law.stress(squared),), squared_stretch)[0]

    def tangent(self, squared_stretch: Floats) -> tuple[Floats, Floats]:
        """Stresses and tangents of each law."""
        stress, half = self._joined(lambda law, squared: law.tangent(squared), squared_stretch)
        return stress, half

    def energy(self, squared_stretch: Floats) -> Floats:
        """Energies of each law."""
        return self._joined(lambda law, squared: (law.energy(squared),), squared_stretch)[0]

    def margin(self, squared_stretch: Floats) -> Floats:
        """Distances to the limit of each law."""
        return self._joined(lambda law, squared: (law.margin(squared),), squared_stretch)[0]

    def axial_stress(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> Floats:
        """p of each law."""
        return self._joined(lambda law, *both: (law.axial_stress(symmetry, *both),), front, thickness)[0]

    def axial_tangent(self, symmetry: Symmetry, front: Floats, thickness: Floats) -> tuple[Floats, Floats]:
        """p and dp/dlnA of each law."""
        stress, slope = self._joined(lambda law, *both: law.axial_tangent(symmetry, *both), front, thickness)
        return stress, slope

    def equibiaxial_tangent(self, front: Floats) -> tuple[Floats, Floats]:
        """dp/dlnA - dp/dlnB and dp/dlnB of each law."""
        direct, both = self._joined(lambda law, squared: law.equibiaxial_tangent(squared), front)
        return direct, both

    def take(self, cases: Cases) -> SpringLaw:  # type: ignore[override]
        """The laws of the selected cases (k,); a single law if it is the same for all."""
        if self.axis == -2:
            return replace(self, laws=tuple(law.take(cases) for law in self.laws))
        which = self.which[cases]
        places = np.empty(self.which.size, dtype=np.intp)
        for index in range(len(self.laws)):
            places[self.which == index] = np.arange(np.count_nonzero(self.which == index))
        left, renumbered = np.unique(which, return_inverse=True)
        laws = tuple(self.laws[index].take(places[cases][which == index]) for index in left.tolist())
        return laws[0] if len(laws) == 1 else SeveralLaws(laws, renumbered, -1)

    def apart(self, springs: int, cases: int) -> Self:
        """The laws of single springs, spring after spring."""
        parts = list(zip(self.laws, np.bincount(self.which).tolist(), strict=True))
        if self.axis == -1:
            laws, which = [law.apart(springs, count) for law, count in parts], np.tile(self.which, springs)
        else:
            laws, which = [law.apart(count, cases) for law, count in parts], np.repeat(self.which, cases)
        return replace(self, laws=tuple(laws), which=which, axis=-1)

    def of_spring(self, spring: int, case: int) -> SpringLaw:  # type: ignore[override]
        """The law of one spring in one case."""
        position = (spring, case)[self.axis]
        index = int(self.which[position])
        place = int(np.count_nonzero(self.which[:position] == index))
        return self.laws[index].of_spring(*((spring, place) if self.axis == -1 else (place, case)))

    def with_idle_spring(self) -> Self:
        """The laws with one more spring, the last, which carries no stress."""
        if self.axis == -1:
            return replace(self, laws=tuple(law.with_idle_spring() for law in self.laws))
        laws = *self.laws[:-1], self.laws[-1].with_idle_spring()
        return replace(self, laws=laws, which=np.append(self.which, len(laws) - 1))

    def _joined(self, values: Callable[..., tuple[Floats, ...]], *arrays: Floats) -> list[Floats]:
        """The `values` of each law for its part of the `arrays` (..., n, cases), joined again."""
        joined: list[Floats] = []
        for index, law in enumerate(self.laws):
            members = np.flatnonzero(self.which == index)
            if self.axis == -1:
                place: Any = (..., members)
                parts = values(law, *(np.take(array, members, axis=-1) for array in arrays))
            else:  # adjacent springs
                place = (..., slice(members[0], members[-1] + 1), slice(None))
                parts = values(law, *(array[place] for array in arrays))
            joined = joined or [np.empty((*part.shape[:-2], *arrays[0].shape[-2:])) for part in parts]
            for whole, part in zip(joined, parts, strict=True):
                whole[place] = part
        return joined


def gathered(laws: Sequence[tuple[SpringLaw, SpringLaw]], carrying: Flags) -> SpringLaw:
    """The law of n springs in all cases, from pairs of the laws of the equilibrium spring and of the branches.

    There is one pair per case, or one for all cases. `carrying` (n, cases) marks springs with a modulus above 0; the others have no
    limit of stretch.
    """
    if len(carrying) == 1:
        laws = [(first, first) for first, _ in laws]  # no case has branches
    kinds = [(_kind(first), _kind(rest)) for first, rest in laws]
    different = list(dict.fromkeys(kinds))
    if len(different) == 1:
        return _of_one_kind(laws, carrying)
    which = np.array([different.index(kind) for kind in kinds])
    members = [np.flatnonzero(which == index) for index in range(len(different))]
    return SeveralLaws(
        tuple(_of_one_kind([laws[case] for case in cases.tolist()], carrying[:, cases]) for cases in members), which, -1
    )


def _kind(law: SpringLaw) -> tuple[Any, ...]:
    """The class and the shapes of the constants of a law: laws with the same can be stored in common arrays."""
    return type(law), *(np.shape(value) for value in law.values().values())


def _of_one_kind(laws: Sequence[tuple[SpringLaw, SpringLaw]], carrying: Flags) -> SpringLaw:
    """The law of n springs if all equilibrium springs have one kind of law, and all branches one kind."""
    first, rest = [law for law, _ in laws], [law for _, law in laws]
    if all(law is first[0] for law in first) and all(law is rest[0] for law in rest):
        first, rest = first[:1], rest[:1]
    count = carrying.shape[0] - 1
    blocks = (_of_rows(first, carrying[:1], 1), _of_rows(rest, carrying[1:], count))
    if _kind(first[0]) == _kind(rest[0]):
        # one law for all springs is faster than two
        width = max((value.shape[-1] for block in blocks for value in block.values()), default=1)
        joined = {name: [np.broadcast_to(block[name], (*block[name].shape[:-1], width)) for block in blocks] for name in blocks[0]}
        return first[0].with_values({name: np.concatenate(rows, axis=-2) for name, rows in joined.items()})
    return SeveralLaws(
        (first[0].with_values(blocks[0]), rest[0].with_values(blocks[1])), np.minimum(np.arange(len(carrying)), 1), -2
    )


def _of_rows(laws: Sequence[SpringLaw], carrying: Flags, rows: int) -> dict[str, Floats]:
    """The constants (..., rows, cases) of springs in `rows` rows, from one law per case or one law for all."""
    stated, idle = ([law.values() for law in group] for group in (laws, [law.unlimited() for law in laws]))
    joined = {}
    for name in stated[0]:
        value, free = (
            np.stack([np.asarray(constants[name], dtype=float) for constants in group], axis=-1) for group in (stated, idle)
        )
        value = np.repeat(value[..., None, :], rows, axis=-2)
        joined[name] = value if carrying.all() else np.where(carrying, value, free[..., None, :])
    return joined
