"""Loss of tension: the mechanical stress of an axis that is held falls to zero, beyond which a thin film wrinkles.

Around a disc the passive film goes slack first at the rim, where its radial stress is that of the disc.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, Moment, Signal, WatchedFilms
from dielast.mechanics.span import Control
from dielast.numerics.columns import Floats


class LossOfTension(Criterion):
    """The nominal stress along an `axis` (0 or 1) with no weight on it, over that of the relaxed film, falls to zero."""

    name: ClassVar[str] = "loss-of-tension"
    marker: ClassVar[str] = "v"
    is_failure: ClassVar[bool] = False

    def __init__(self, axis: int) -> None:
        self.axis = axis

    def signal(self, films: WatchedFilms) -> Signal | None:
        """The share of the tension that is left; 1 for an axis without tension, which has none to lose."""
        if films.controls[self.axis] is Control.STRESS:
            return None
        tension = films.nominal_stress[self.axis]
        has_tension = tension > films.stress_floor
        scale = np.where(has_tension, tension, 1.0)

        def left(moment: Moment) -> Floats:
            stress = moment.tension[self.axis]
            return np.where(has_tension[moment.cases], stress / scale[moment.cases], 1.0)

        return left
