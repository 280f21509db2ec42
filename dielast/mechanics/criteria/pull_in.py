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


def stability_at(snapshot: FilmSnapshot, timescale: TimeScale) -> Stability:
    """Determinant and margin (k,) of films watched for a time scale."""
    watched = timescale.watched(snapshot.age)
    if snapshot.surroundings is not None:
        rim, springs_alone = snapshot.surroundings.stiffness(watched, snapshot.internal, snapshot.electrical)
        return Stability(rim, rim / springs_alone)
    membrane = snapshot.internal, snapshot.log_squared_stretch, snapshot.nominal_stress
    return stability(snapshot.points, snapshot.controls, *membrane, snapshot.electrical, watched)


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
        return lambda snapshot: stability_at(snapshot, films.timescale).margin

    def refined(self, films: WatchedFilms, time: Floats, snapshot: FilmSnapshot, load: Load) -> tuple[Floats, FilmSnapshot]:
        """A pull-in at the end of an equilibrium, where the damper takes over, is moved to the exact fold.

        A film with a circuit has no fold, as it is stable at frozen charge. In a film with a passive part, the steps around the
        fold are so short that the pull-in is exact without this correction: Newton's method would change its time and stretch by
        less than 1e-9 for an rtol up to 1e-5, and by less than 1e-6 for an rtol of 1e-3.
        """
        if snapshot.points.circuit is not None or snapshot.surroundings is not None:
            return time, snapshot
        undamped = snapshot.points.undamped()
        internal = np.broadcast_to(snapshot.internal, (2, *snapshot.internal.shape[1:])).copy()
        log_squared, nominal, electrical = (
            snapshot.log_squared_stretch.copy(),
            snapshot.nominal_stress.copy(),
            snapshot.electrical.copy(),
        )
        frozen = stability(undamped, snapshot.controls, internal, log_squared, nominal, electrical)
        ends = where(frozen.margin < FOLD_MARGIN)
        if not ends.size:
            return time, snapshot
        driving, switched_on = load.take(ends), (snapshot.age - time)[ends]
        fold = Fold(
            undamped.take(ends),
            snapshot.controls,
            driving.value,
            lambda at: films.timescale.watched(switched_on + at),
            internal[:, :, ends],
            log_squared[:, ends],
            time[ends],
        )
        time, age = time.copy(), snapshot.age.copy()
        time[ends], internal[:, :, ends], log_squared[:, ends], nominal[:, ends] = fold.find()
        internal[:, -1, ends] = log_squared[:, ends]  # the damper is free of stress
        age[ends], electrical[ends] = switched_on + time[ends], driving.value(time[ends])[2]
        there = replace(snapshot, age=age, internal=internal, electrical=electrical)
        return time, replace(there, log_squared_stretch=log_squared, nominal_stress=nominal)

    def determinant(self, stability: Stability) -> Floats:
        """0 at a pull-in, except in a film that cannot hold a voltage applied at once."""
        return np.where(np.abs(stability.margin) < NO_MARGIN, 0.0, stability.determinant)
