"""A film whose numbers are changed one at a time, for the relative change of a result by that of each number."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from dielast.io.result import Result
from dielast.material.material import Material
from dielast.material.numbers import Numbers, material_of, numbers_of
from dielast.material.scatter import Sample
from dielast.numerics.arrays import Floats

STEP = 0.01
"""Change of the logarithm of a number."""
STEPS = STEP * np.array([-2.0, -1.0, 1.0, 2.0])
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12 * STEP)
"""Of the results at `STEPS`, in the central difference of fourth order."""
CLOSE = np.array([0.0, -1.0, 1.0, 0.0]) / (2 * STEP)
"""The same of second order."""
FIELD, THICKNESS = "breakdown field", "thickness"
ELSEWHERE = (("nonequilibrium", "shear_modulus"), ("breakdown", "field"))  # which SCALE and FIELD change
ABSCISSAE = ("prestretch", "temperature", "temperature_degC")  # of tables


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Perturbed(Result):
    """The `names` of what is changed, and the `sample` of films, four for each: a number times exp(STEPS)."""

    names: tuple[str, ...]
    sample: Sample

    @classmethod
    def of(cls, material: Material) -> Perturbed:
        """Every number of a material, by its path in a material file, then breakdown field and thickness of the film.

        The numbers of a list change together. Numbers that are 0 do not change.
        """
        changed = list(_changed(material))
        films = [member for _, members in changed for member in members]
        steady, moved = np.ones(len(films)), np.exp(STEPS)
        ones = np.ones(STEPS.size)
        field = np.concatenate((steady, moved, ones))
        thickness = np.concatenate((steady, ones, moved))
        plain = [material] * (2 * STEPS.size)
        # a damage of its own, or a factor on the breakdown field would be one on the field of the damage, too
        damage = np.ones(field.size) if material.damage is not None else None
        return cls((*(name for name, _ in changed), FIELD, THICKNESS), Sample((*films, *plain), field, thickness, damage))

    def slopes(self, results: Floats) -> tuple[Floats, Floats]:
        """d(result)/d(ln number) (names, ...) from the results (films, ...), and by how much the difference of fourth order changes
        that of second order, which is more than the error of a smooth result.
        """
        by_name = results.reshape(len(self.names), STEPS.size, *results.shape[1:])
        slope, plain = (np.einsum("s,ns...->n...", weights, by_name) for weights in (WEIGHTS, CLOSE))
        return slope, np.abs(slope - plain)


def _changed(material: Material) -> Iterator[tuple[str, list[Material]]]:
    """Each number of a material that may change, by name, and the material with it changed."""
    numbers = numbers_of(material)
    for section, values in numbers.items():
        for key, value in values.items():
            idle = section == "nonequilibrium" and not len(material.spectrum)
            if idle or (section, key) in ELSEWHERE or key in ABSCISSAE or not (np.all(np.isfinite(value)) and np.any(value)):
                continue
            yield f"{section}.{key}", [_with(material, numbers, section, key, factor) for factor in np.exp(STEPS).tolist()]


def _with(material: Material, numbers: Numbers, section: str, key: str, factor: float) -> Material:
    changed = deepcopy(numbers)
    value = changed[section][key]
    changed[section][key] = [factor * entry for entry in value] if isinstance(value, list | tuple) else factor * value
    return material_of(material, changed)
