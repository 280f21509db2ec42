"""Loss of tension: the mechanical stress along a held axis falls to zero, beyond which a thin film wrinkles.

Around a disc, the passive film first loses tension at the rim, where its radial stress equals that of the disc.
"""

from typing import ClassVar

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal, WatchedFilms
from dielast.mechanics.point_material import FLOOR
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import Floats


class LossOfTension(Criterion):
    """The nominal stress along an `axis` (0 or 1) without prescribed stress, over that of the relaxed film, falls to zero."""

    name: ClassVar[str] = "loss-of-tension"
    marker: ClassVar[str] = "v"
    is_failure: ClassVar[bool] = False
    needs_springs: ClassVar[bool] = True

    def __init__(self, axis: int) -> None:
        self.axis = axis

    def possible(self, controls: Controls) -> bool:
        """Whether the stress along the axis is free to fall."""
        return controls[self.axis] is not Control.STRESS

    def signal(self, films: WatchedFilms) -> Signal | None:
        """The remaining fraction of the tension (k,); 1 for an axis without tension in the relaxed film, which can lose none."""
        if films.moved:
            scale = self._scale(films)

            def present(snapshot: FilmSnapshot) -> Floats:
                if not self.possible(snapshot.controls):
                    return np.full(snapshot.cases.size, np.nan)
                return np.asarray(snapshot.tension[self.axis] / scale[snapshot.cases])

            return present
        if not self.possible(films.controls):
            return None
        tension = films.nominal_stress[self.axis]
        has_tension = tension > films.stress_floor
        scale = np.where(has_tension, tension, 1.0)

        def remaining(snapshot: FilmSnapshot) -> Floats:
            stress = snapshot.tension[self.axis]
            return np.where(has_tension[snapshot.cases], stress / scale[snapshot.cases], 1.0)

        return remaining

    def arming(self, films: WatchedFilms) -> Floats | None:
        """Edges that move may stretch a film before they let it go slack: it must have had a tension."""
        return films.stress_floor / self._scale(films) if films.moved else None

    def _scale(self, films: WatchedFilms) -> Floats:
        """The stress (cases,) in Pa over which the tension of a film with moving edges counts: at least about the modulus of the
        equilibrium spring.
        """
        return np.asarray(np.maximum(films.nominal_stress[self.axis], films.stress_floor / FLOOR))
