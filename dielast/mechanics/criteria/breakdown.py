"""Electrical breakdown: the true field reaches the breakdown field E_EB (Sec. 3.4 of DOI 10.1115/1.4030850)."""

from typing import ClassVar

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, FilmSnapshot, Signal, WatchedFilms
from dielast.numerics.arrays import Floats


class ElectricalBreakdown(Criterion):
    """The signal 1 - |E|/E_EB, which falls to zero at breakdown."""

    name: ClassVar[str] = "breakdown"
    marker: ClassVar[str] = "x"  # as in the paper's Fig. 13
    hatch: ClassVar[str] = ""

    def signal(self, films: WatchedFilms) -> Signal | None:
        """1 - |E|/E_EB; None if no breakdown field is known. E_EB follows the present state of the film where its law says so."""
        field, following = films.endurance.breakdown_field, films.endurance.following
        if not np.any(np.isfinite(field)):
            return None

        def margin(snapshot: FilmSnapshot) -> Floats:
            limit = field[snapshot.cases]
            if following is not None:
                limit = limit * following.ratio(snapshot.cases, snapshot.log_area)
            return np.asarray(1 - snapshot.true_field / limit)

        return margin
