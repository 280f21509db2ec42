"""Sources of scatter between draws of films, exchanged between pairs of draws to find their shares of the variance."""

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
"""Sources that scatter from film to film -> the field of a sample."""
WHOLE = "material"


@dataclass(frozen=True, slots=True)
class Source(Result):
    """A source of scatter: `name`, and the fields of a `Material`, or the field of a `Sample`, that hold it. `part_of` is the
    source that contains it, whose parts are drawn together; empty for a source that is independent of all others.
    """

    name: str
    material_fields: tuple[str, ...] = ()
    factor: str = ""
    part_of: str = ""


def sources_of(sample: Sample) -> tuple[Source, ...]:
    """The sources in which the draws differ: the material, its parts if several of them differ, and sources that scatter from film
    to film.
    """
    distinct = list({id(member): member for member in sample.materials}.values())
    parts = {
        name: fields_of_part
        for name, fields_of_part in PARTS.items()
        if not all(_same(getattr(distinct[0], field), getattr(other, field)) for other in distinct[1:] for field in fields_of_part)
    }
    sources = [Source(name, fields_of_part, part_of=WHOLE if len(parts) > 1 else "") for name, fields_of_part in parts.items()]
    if len(parts) > 1:
        sources.insert(0, Source(WHOLE, tuple(field for fields_of_part in parts.values() for field in fields_of_part)))
    for name, factor in FACTORS.items():
        values = getattr(sample, factor)
        if values is not None and np.any(values != values[0]):
            sources.append(Source(name, factor=factor))
    return tuple(sources)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Exchange(Result):
    """Pairs of draws between which each source is exchanged. `sample` holds the original `draws`, then, for each of the `sources`,
    draws `first` (pairs,) with the source from `second` (pairs,), and draws `second` with the source from `first`.
    """

    sample: Sample
    draws: int
    sources: tuple[Source, ...]
    first: Index
    second: Index

    @classmethod
    def of(cls, sample: Sample, seed: int = 1) -> Exchange:
        """Random pairs of the draws of a sample, by `seed`, each draw in one pair; of an odd number, one draw is left out.

        Raises `InputError` for fewer than four draws, and if they do not differ.
        """
        if len(sample) < 4:
            raise InputError(f"{len(sample)} draws: at least 4 are needed for shares of their variance", argument="sample")
        sources = sources_of(sample)
        if not sources:
            raise InputError("all draws are equal: there is no variance to divide into shares", argument="sample")
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
        name: None if getattr(samples[0], name) is None else np.concatenate([getattr(one_sample, name) for one_sample in samples])
        for name in FACTORS.values()
    }
    return Sample(tuple(member for one_sample in samples for member in one_sample.materials), **columns)


def _same(one: Any, other: Any) -> bool:
    """Whether two parts of a material have equal numbers."""
    if one is other:
        return True
    if is_dataclass(one) and not isinstance(one, type) and type(one) is type(other):
        return all(_same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    return type(one) is type(other) and bool(np.array_equal(one, other))
