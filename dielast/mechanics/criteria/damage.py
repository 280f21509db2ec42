"""Damage: the film ages in the electric field until it fails (see `material.damage`)."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from dielast.material.material import Material
from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal, WatchedFilms
from dielast.numerics.arrays import Floats


class Damage(Criterion):
    """The damage D = int dD/dt dt over the voltage programme reaches 1."""

    name: ClassVar[str] = "damage"
    marker: ClassVar[str] = "D"
    hatch: ClassVar[str] = "\\\\\\\\"

    def concerns(self, materials: Sequence[Material]) -> bool:
        """Whether a material has a damage law."""
        return any(material.damage is not None for material in materials)

    def rate(self, films: WatchedFilms) -> Signal | None:
        """dD/dt (k,) in 1/s, 0 for films without a damage law."""
        laws = films.endurance.damage
        if laws is None:
            return None

        def rate(snapshot: FilmSnapshot) -> Floats:
            field = snapshot.true_field
            return np.asarray(laws.values(snapshot.cases, lambda law, columns: law.rate(field[columns]), 0.0))

        return rate
