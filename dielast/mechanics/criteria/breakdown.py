"""Electrical breakdown: the true field reaches the breakdown field E_EB (Sec. 3.4 of DOI 10.1115/1.4030850)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from dielast.mechanics.criteria.criterion import Criterion, Moment, Signal, WatchedFilms
from dielast.numerics.columns import Floats


class ElectricalBreakdown(Criterion):
    """1 - |E|/E_EB falls to zero."""

    name: ClassVar[str] = "breakdown"
    marker: ClassVar[str] = "x"  # as in the paper's Fig. 13
    hatch: ClassVar[str] = ""

    def signal(self, films: WatchedFilms) -> Signal | None:
        """1 - |E|/E_EB, if a breakdown field is known: that of the film as it is at the moment, where the law says so."""
        if not np.any(np.isfinite(films.breakdown_field)):
            return None

        def margin(moment: Moment) -> Floats:
            limit = films.breakdown_field[moment.cases]
            if films.following is not None:
                limit = limit * films.following.ratio(moment.cases, moment.log_area)
            return np.asarray(1 - moment.true_field / limit)

        return margin
