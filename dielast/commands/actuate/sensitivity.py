"""What drives the time to failure of the films of `actuate`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.commands.simulation.bounds import drawn_film
from dielast.commands.simulation.result import CaseResult
from dielast.commands.simulation.run import Known, Solve
from dielast.commands.simulation.sensitivity import SENSITIVITY, variation_of, warn_of_left_out
from dielast.errors import in_a_draw
from dielast.io.table import Column
from dielast.mechanics.cases import of_case
from dielast.mechanics.criteria import named
from dielast.simulate.sensitivity import sensitivity_of


def with_sensitivity(known: Sequence[Known], solve: Solve) -> list[CaseResult]:
    """The results, with the sensitivity of the time to the first failure in cases whose recipe states it."""
    found = [result for _, _, _, result in known]
    for number, (case, material, sample, result) in enumerate(known):
        if not case.recipe.sensitivity:
            continue
        variation = variation_of(material, sample, case.recipe.uncertainty)
        # a run that only gives a life needs one row
        brief = replace(result, columns={"time [s]": np.zeros(1)})
        with in_a_draw(key=SENSITIVITY if sample is None else "uncertainty", case=of_case(number, len(known))):
            one, drawn = drawn_film(case, variation.sample, brief)
            runs = solve(one, drawn, variation.sample.thickness_factor)
        life = np.array([[_life(run)] for run in runs])
        found[number] = replace(result, sensitivity=sensitivity_of(variation, life, [Column("case", None, np.array([number]))]))
    warn_of_left_out([each for result in found if (each := result.sensitivity) is not None])
    return found


def _life(result: CaseResult) -> float:
    """The time in s of the first failure, NaN without one."""
    times: list[Any] = [event.time for event in result.events or () if named(event.name).is_failure]
    return min(times, default=np.nan)
