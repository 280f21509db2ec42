"""A film whose numbers are changed one at a time, for the logarithmic derivatives of a result with respect to each number."""

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
"""Changes of the logarithm of a number."""
STEPS = STEP * np.array([-2.0, -1.0, 1.0, 2.0])
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / (12 * STEP)
"""Weights of the results at `STEPS` in the central difference of fourth order."""
CLOSE = np.array([0.0, -1.0, 1.0, 0.0]) / (2 * STEP)
"""Weights of the results at `STEPS` in the central difference of second order."""
FIELD, THICKNESS = "breakdown field", "thickness"
ELSEWHERE = (("nonequilibrium", "shear_modulus"), ("breakdown", "field"))  # varied by SCALE and FIELD instead
ABSCISSAE = ("prestretch", "temperature", "temperature_degC")  # keys of the abscissae of tables, which are not varied


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Perturbed(Result):
    """The `names` of the varied numbers, and the `sample` of films: four for each number, which is multiplied by exp(STEPS)."""

    names: tuple[str, ...]
    sample: Sample

    @classmethod
    def of(cls, material: Material) -> Perturbed:
        """Every number of a material, by its path in a material file, followed by breakdown field and thickness of the film.

        The numbers of a list change together. Numbers that are 0 are not varied.
        """
        changed = list(_changed(material))
        films = [member for _, members in changed for member in members]
        steady, moved = np.ones(len(films)), np.exp(STEPS)
        ones = np.ones(STEPS.size)
        field = np.concatenate((steady, moved, ones))
        thickness = np.concatenate((steady, ones, moved))
        plain = [material] * (2 * STEPS.size)
        # with a separate scatter of the damage, the factor on the breakdown field does not change the field of the damage law
        damage = np.ones(field.size) if material.damage is not None else None
        return cls((*(name for name, _ in changed), FIELD, THICKNESS), Sample((*films, *plain), field, thickness, damage))

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
            yield f"{section}.{key}", [_with(material, numbers, section, key, factor) for factor in np.exp(STEPS).tolist()]


def _with(material: Material, numbers: Numbers, section: str, key: str, factor: float) -> Material:
    changed = deepcopy(numbers)
    value = changed[section][key]
    changed[section][key] = [factor * entry for entry in value] if isinstance(value, list | tuple) else factor * value
    return material_of(material, changed)
