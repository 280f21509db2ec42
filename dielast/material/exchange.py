"""Sources of scatter between draws of films, and their exchange between two draws, to find their shares in the variance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np

from dielast.errors import InputError
from dielast.io.result import Result
from dielast.material.scatter import Sample
from dielast.numerics.arrays import Index
from dielast.numerics.random_streams import stream

PARTS: dict[str, tuple[str, ...]] = {
    "spectrum": ("spectrum",),
    "shift": ("shift",),
    "equilibrium spring": ("equilibrium_modulus", "equilibrium_law", "equilibrium_scaling"),
    "nonequilibrium springs": ("nonequilibrium_law", "nonequilibrium_scaling"),
    "permittivity": ("permittivity",),
    "breakdown law": ("breakdown",),
    "damage law": ("damage",),
}
"""The parts of a material that may differ between draws, with their fields."""
FACTORS = {"breakdown field": "breakdown_factor", "thickness": "thickness_factor", "damage": "damage_factor"}
"""The quantities that scatter from film to film, by the field of a sample."""
WHOLE = "material"


@dataclass(frozen=True, slots=True)
class Source(Result):
    """A source of scatter: its `name`, and the fields of a `Material`, or the field of a `Sample`, that hold it.

    `part_of` is the source of which it is a part; all parts of a source are drawn together. It is empty for an independent source.
    """

    name: str
    material_fields: tuple[str, ...] = ()
    factor: str = ""
    part_of: str = ""


def sources_of(sample: Sample) -> tuple[Source, ...]:
    """All sources of scatter between the draws: the material, its parts if more than one part differs, and the quantities that
    scatter from film to film.
    """
    distinct = list({id(member): member for member in sample.materials}.values())
    parts = {
        name: held
        for name, held in PARTS.items()
        if not all(_same(getattr(distinct[0], field), getattr(other, field)) for other in distinct[1:] for field in held)
    }
    found = [Source(name, held, part_of=WHOLE if len(parts) > 1 else "") for name, held in parts.items()]
    if len(parts) > 1:
        found.insert(0, Source(WHOLE, tuple(field for held in parts.values() for field in held)))
    for name, factor in FACTORS.items():
        values = getattr(sample, factor)
        if values is not None and np.any(values != values[0]):
            found.append(Source(name, factor=factor))
    return tuple(found)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Exchange(Result):
    """Pairs of draws between which each source is exchanged.

    `sample` holds the `draws` given ones, followed, for each of the `sources`, by the draws `first` (pairs,) with the source of
    `second` (pairs,), and the draws `second` with that of `first`.
    """

    sample: Sample
    draws: int
    sources: tuple[Source, ...]
    first: Index
    second: Index

    @classmethod
    def of(cls, sample: Sample, seed: int = 1) -> Exchange:
        """Random pairs (by `seed`) of the draws of a sample; each draw is in one pair, except one draw if their number is odd.

        Raises `InputError` for fewer than four draws, and if the draws do not differ.
        """
        if len(sample) < 4:
            raise InputError(f"{len(sample)} draws: shares of their spread take at least 4", argument="sample")
        sources = sources_of(sample)
        if not sources:
            raise InputError("all draws are the same: nothing has a share of their spread", argument="sample")
        order = stream(seed, "sensitivity").permutation(len(sample))
        first, second = np.array_split(order[: 2 * (len(sample) // 2)], 2)
        parts = [sample, *(_exchanged(sample, source, *pair) for source in sources for pair in ((first, second), (second, first)))]
        return cls(_joined(parts), len(sample), sources, first, second)


def _exchanged(sample: Sample, source: Source, keep: Index, take: Index) -> Sample:
    """The draws `keep` (k,) of a sample, with the source of the draws `take` (k,)."""
    materials = [sample.materials[k] for k in keep]
    if source.material_fields:
        others = [sample.materials[k] for k in take]
        materials = [
            replace(one, **{field: getattr(other, field) for field in source.material_fields})
            for one, other in zip(materials, others, strict=True)
        ]
    columns: dict[str, Any] = {
        name: None if (values := getattr(sample, name)) is None else values[take if name == source.factor else keep]
        for name in FACTORS.values()
    }
    return Sample(tuple(materials), **columns)


def _joined(samples: Sequence[Sample]) -> Sample:
    """The draws of all samples, one sample after another."""
    columns: dict[str, Any] = {
        name: None if getattr(samples[0], name) is None else np.concatenate([getattr(each, name) for each in samples])
        for name in FACTORS.values()
    }
    return Sample(tuple(member for each in samples for member in each.materials), **columns)


def _same(one: Any, other: Any) -> bool:
    """Whether two parts of a material have the same numbers."""
    if one is other:
        return True
    if is_dataclass(one) and not isinstance(one, type) and type(one) is type(other):
        return all(_same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    return type(one) is type(other) and bool(np.array_equal(one, other))
