"""Samples of films for the sensitivity of a result: sources of scatter exchanged between pairs of draws, for their shares of the
variance, and numbers changed one at a time, for derivatives.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import chain
from typing import Any, Self

import numpy as np

from dielast.base.errors import InputError
from dielast.io.result import Result
from dielast.material.material import Material, material_of, numbers_of
from dielast.material.scatter import Sample
from dielast.numerics.arrays import Floats, Index
from dielast.numerics.random_streams import stream

PARTS: dict[str, tuple[str, ...]] = {
    "spectrum": ("spectrum",),
    "shift": ("shift",),
    "equilibrium spring": ("equilibrium_modulus", "equilibrium_law", "equilibrium_scaling"),
    "nonequilibrium springs": ("nonequilibrium_law", "nonequilibrium_scaling"),
    "flow law": ("flow",),
    "permittivity": ("permittivity",),
    "breakdown law": ("breakdown",),
    "damage law": ("damage",),
}
"""The parts of a material that may differ between draws, with their fields."""
FACTORS = {
    "breakdown field": "breakdown_factor",
    "thickness": "thickness_factor",
    "damage": "damage_factor",
    "specimen": "specimen_factor",
}
"""Sources that scatter from film to film -> the field of a sample."""
WHOLE = "material"

STEP = 0.01
"""Changes of the logarithm of a number."""
STEPS = STEP * np.array([-2.0, -1.0, 1.0, 2.0])
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12 * STEP)
"""Weights of the results at `STEPS` in the central difference of fourth order."""
CLOSE = np.array([0.0, -1.0, 1.0, 0.0]) / (2 * STEP)
"""Weights of the results at `STEPS` in the central difference of second order."""
FIELD, THICKNESS = "breakdown field", "thickness"
ELSEWHERE = (("nonequilibrium", "shear_modulus"), ("breakdown", "field"))  # varied by SCALE and FIELD instead
# keys of the abscissae of tables, and of the scatter from film to film, which are not varied
ABSCISSAE = ("prestretch", "temperature", "temperature_degC", "shape", "relative", "reference_area")


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
    def of(cls, sample: Sample, seed: int = 1) -> Self:
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
        every = np.arange(len(sample))
        blocks = [(Source(""), every, every)]
        for source in sources:
            blocks += [(source, first, second), (source, second, first)]
        factors: dict[str, Any] = {
            name: np.concatenate([values[take if name == source.factor else keep] for source, keep, take in blocks])
            for name in FACTORS.values()
            if (values := getattr(sample, name)) is not None
        }
        materials = chain.from_iterable(_exchanged(sample, *block) for block in blocks)
        return cls(replace(sample, materials=tuple(materials), **factors), len(sample), sources, first, second)


def _exchanged(sample: Sample, source: Source, keep: Index, take: Index) -> tuple[Material, ...]:
    """The materials of the draws `keep` (k,) of a sample, with the source of the draws `take` (k,)."""
    fields_of_source = source.material_fields
    if not fields_of_source:
        return tuple(sample.materials[k] for k in keep)
    pairs = [(sample.materials[k], sample.materials[other]) for k, other in zip(keep, take, strict=True)]
    return tuple(replace(kept, **{field: getattr(other, field) for field in fields_of_source}) for kept, other in pairs)


def _same(one: Any, other: Any) -> bool:
    """Whether two parts of a material have equal numbers."""
    if one is other:
        return True
    if is_dataclass(one) and not isinstance(one, type) and type(one) is type(other):
        return all(_same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    return type(one) is type(other) and bool(np.array_equal(one, other))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Perturbed(Result):
    """The `names` of the varied numbers, and the `sample` of films: four for each number, which is multiplied by exp(STEPS)."""

    names: tuple[str, ...]
    sample: Sample

    @classmethod
    def of(cls, material: Material, *, has_breakdown: bool = True) -> Self:
        """Every number of a material, by its path in a material file, followed by breakdown field, if there is one, and thickness
        of the film.

        The numbers of a list change together. Numbers that are 0 are not varied.
        """
        changed = list(_changed(material))
        films = [member for _, members in changed for member in members]
        steady, moved = np.ones(len(films)), np.exp(STEPS)
        ones = np.ones(STEPS.size)
        of_film = (FIELD, THICKNESS) if has_breakdown else (THICKNESS,)
        field, thickness = (
            np.concatenate((steady, *(moved if name == varied else ones for name in of_film))) for varied in (FIELD, THICKNESS)
        )
        plain = [material] * (len(of_film) * STEPS.size)
        # with a separate scatter of the damage, the factor on the breakdown field does not change the field of the damage law
        damage = np.ones(field.size) if material.damage is not None else None
        return cls((*(name for name, _ in changed), *of_film), Sample((*films, *plain), field, thickness, damage))

    def slopes(self, results: Floats) -> tuple[Floats, Floats]:
        """The derivatives (names, ...) of results (films, ...) with respect to ln number, and their errors.

        An error is the difference between fourth and second order, an upper bound for a smooth result.
        """
        by_name = results.reshape(len(self.names), STEPS.size, *results.shape[1:])
        slope, plain = (np.einsum("s,ns...->n...", weights, by_name) for weights in (WEIGHTS, CLOSE))
        return slope, np.abs(slope - plain)


def _changed(material: Material) -> Iterator[tuple[str, list[Material]]]:
    """Each number of a material that may be varied, by name, and the materials with this number changed."""
    numbers = numbers_of(material)
    for section, values in numbers.items():
        for key, value in values.items():
            idle = section == "nonequilibrium" and not len(material.spectrum)
            if idle or (section, key) in ELSEWHERE or key in ABSCISSAE or not (np.all(np.isfinite(value)) and np.any(value)):
                continue
            factors = np.exp(STEPS).tolist()
            changed = [[k * entry for entry in value] if isinstance(value, list | tuple) else k * value for k in factors]
            yield f"{section}.{key}", [material_of(material, numbers | {section: values | {key: other}}) for other in changed]
