"""Pull-in: the film ceases to be in stable equilibrium (Eqs. 9 and 10 of DOI 10.1115/1.4030850, and `stability`)."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, Moment, Signal, WatchedFilms
from dielast.mechanics.point import Points
from dielast.mechanics.span import Control, Load
from dielast.mechanics.stability import Fold, Stability, TimeScale, stability
from dielast.numerics.columns import Floats, where

NO_MARGIN = 1e-3  # a margin at pull-in that is 0 but for rounding, as it is by definition
FOLD_MARGIN = 0.02  # of the film with all branches frozen: one that has less is at the end of an equilibrium


def held_modulus(points: Points, timescale: TimeScale, age: Floats) -> Floats:
    """Modulus (n, k) in Pa that the springs hold on to when the voltage has been on for `age` (k,) s. The damper, which is the last
    of the springs, is none of the film's.
    """
    modulus = points.modulus * timescale.weight(points, age)
    modulus[-1] = 0.0
    return np.asarray(modulus)


def stability_at(moment: Moment, timescale: TimeScale) -> Stability:
    """Determinant and margin (k,) of films watched for a time scale."""
    modulus = held_modulus(moment.points, timescale, moment.age)
    if moment.surroundings is not None:
        rim, whole = moment.surroundings.stiffness(modulus, moment.internal, moment.field)
        return Stability(rim, rim / whole)
    membrane = moment.internal, moment.log_squared_stretch, moment.nominal_stress
    watched = None if moment.points.circuit is None else timescale.watched(moment.age)
    return stability(moment.points, modulus, moment.controls, *membrane, moment.field, watched)


class PullIn(Criterion):
    """The stability margin falls to zero."""

    name: ClassVar[str] = "pull-in"
    marker: ClassVar[str] = "o"  # as in the paper's Fig. 13
    hatch: ClassVar[str] = "////"
    needs_springs: ClassVar[bool] = True
    found_in_jumps: ClassVar[bool] = False
    ends_equilibria: ClassVar[bool] = True

    def signal(self, films: WatchedFilms) -> Signal | None:
        """The margin, if an axis is free to move."""
        if films.controls == (Control.STRETCH, Control.STRETCH):
            return None
        return lambda moment: stability_at(moment, films.timescale).margin

    def refined(self, films: WatchedFilms, time: Floats, moment: Moment, load: Load) -> tuple[Floats, Moment]:
        """Pull-ins at the end of an equilibrium, where the damper has taken over, are at its fold.

        With a circuit there is none, as a film whose charge is frozen is stable. In a film with a passive part the steps around the
        fold are so short that it is found as exactly without: Newton's method moves it by less than 1e-9 in time and stretch from
        where it is found with an rtol of 1e-5 or less, and by less than 1e-6 with one of 1e-3.
        """
        if moment.points.circuit is not None or moment.surroundings is not None:
            return time, moment
        bare = _without_damper(moment.points)
        internal = np.broadcast_to(moment.internal, (2, *moment.internal.shape[1:])).copy()
        log_squared, nominal, field = moment.log_squared_stretch.copy(), moment.nominal_stress.copy(), moment.field.copy()
        frozen = stability(bare, bare.modulus, moment.controls, internal, log_squared, nominal, field)
        ends = where(frozen.margin < FOLD_MARGIN)
        if not ends.size:
            return time, moment
        points, driving, switched_on = moment.points.take(ends), load.take(ends), (moment.age - time)[ends]
        fold = Fold(
            bare.take(ends),
            moment.controls,
            driving.value,
            lambda at: held_modulus(points, films.timescale, switched_on + at),
            internal[:, :, ends],
            log_squared[:, ends],
            time[ends],
        )
        time, age = time.copy(), moment.age.copy()
        time[ends], internal[:, :, ends], log_squared[:, ends], nominal[:, ends] = fold.find()
        internal[:, -1, ends] = log_squared[:, ends]  # the damper has no part in it
        age[ends], field[ends] = switched_on + time[ends], driving.value(time[ends])[2]
        refined = replace(moment, age=age, internal=internal, log_squared_stretch=log_squared, nominal_stress=nominal, field=field)
        return time, refined

    def determinant(self, stability: Stability) -> Floats:
        """0 at a pull-in, but for a film that cannot hold a voltage applied at once."""
        return np.where(np.abs(stability.margin) < NO_MARGIN, 0.0, stability.determinant)


def _without_damper(points: Points) -> Points:
    """The same points, whose last spring, the damper, carries nothing."""
    return replace(points, modulus=np.concatenate((points.modulus[:-1], np.zeros_like(points.modulus[-1:]))))
