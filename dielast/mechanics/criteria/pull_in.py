"""Pull-in: the film ceases to be in stable equilibrium (Eqs. 9 and 10 of DOI 10.1115/1.4030850, and `stability`)."""

from dataclasses import replace
from typing import ClassVar

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal, WatchedFilms
from dielast.mechanics.span import Control, Controls, Load
from dielast.mechanics.stability import Fold, Stability, TimeScale, stability
from dielast.numerics.arrays import Floats, where

NO_MARGIN = 1e-3  # a smaller margin at pull-in is rounding: it is 0 by definition
FOLD_MARGIN = 0.02  # margin with all branches frozen, below which a pull-in is at the end of an equilibrium


def stability_at(moment: FilmSnapshot, timescale: TimeScale) -> Stability:
    """Determinant and margin (k,) of films watched for a time scale."""
    watched = timescale.watched(moment.age)
    if moment.surroundings is not None:
        rim, springs_alone = moment.surroundings.stiffness(watched, moment.internal, moment.field)
        return Stability(rim, rim / springs_alone)
    membrane = moment.internal, moment.log_squared_stretch, moment.nominal_stress
    return stability(moment.points, moment.controls, *membrane, moment.field, watched)


class PullIn(Criterion):
    """The stability margin, which falls to zero at pull-in."""

    name: ClassVar[str] = "pull-in"
    marker: ClassVar[str] = "o"  # as in the paper's Fig. 13
    hatch: ClassVar[str] = "////"
    needs_springs: ClassVar[bool] = True
    ends_equilibria: ClassVar[bool] = True

    def possible(self, controls: Controls) -> bool:
        """Whether an axis is free to run away."""
        return controls != (Control.STRETCH, Control.STRETCH)

    def signal(self, films: WatchedFilms) -> Signal | None:
        """The margin; None if both axes are held throughout."""
        if not self.possible(films.controls) and not films.moved:
            return None
        return lambda moment: stability_at(moment, films.timescale).margin

    def refined(self, films: WatchedFilms, time: Floats, moment: FilmSnapshot, load: Load) -> tuple[Floats, FilmSnapshot]:
        """A pull-in at the end of an equilibrium, where the damper takes over, is moved to the exact fold.

        A film with a circuit has no fold, as it is stable at frozen charge. In a film with a passive part, the steps around the
        fold are so short that the pull-in is exact without this correction: Newton's method would change its time and stretch by
        less than 1e-9 for an rtol up to 1e-5, and by less than 1e-6 for an rtol of 1e-3.
        """
        if moment.points.circuit is not None or moment.surroundings is not None:
            return time, moment
        undamped = moment.points.undamped()
        internal = np.broadcast_to(moment.internal, (2, *moment.internal.shape[1:])).copy()
        log_squared, nominal, field = moment.log_squared_stretch.copy(), moment.nominal_stress.copy(), moment.field.copy()
        frozen = stability(undamped, moment.controls, internal, log_squared, nominal, field)
        ends = where(frozen.margin < FOLD_MARGIN)
        if not ends.size:
            return time, moment
        driving, switched_on = load.take(ends), (moment.age - time)[ends]
        fold = Fold(
            undamped.take(ends),
            moment.controls,
            driving.value,
            lambda at: films.timescale.watched(switched_on + at),
            internal[:, :, ends],
            log_squared[:, ends],
            time[ends],
        )
        time, age = time.copy(), moment.age.copy()
        time[ends], internal[:, :, ends], log_squared[:, ends], nominal[:, ends] = fold.find()
        internal[:, -1, ends] = log_squared[:, ends]  # the damper is free of stress
        age[ends], field[ends] = switched_on + time[ends], driving.value(time[ends])[2]
        refined = replace(moment, age=age, internal=internal, log_squared_stretch=log_squared, nominal_stress=nominal, field=field)
        return time, refined

    def determinant(self, stability: Stability) -> Floats:
        """0 at a pull-in, except in a film that cannot hold a voltage applied at once."""
        return np.where(np.abs(stability.margin) < NO_MARGIN, 0.0, stability.determinant)
