"""What drives the time to failure of the films of `actuate`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.commands.actuate.recipe import ActuateRecipe
from dielast.commands.simulation.bounds import drawn_film
from dielast.commands.simulation.result import CaseResult
from dielast.commands.simulation.run import Simulation
from dielast.commands.simulation.sensitivity import SENSITIVITY, design_of, warn_of_left_out
from dielast.errors import in_a_draw
from dielast.io.files import Inputs
from dielast.io.table import Column
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.mechanics.cases import of_case
from dielast.mechanics.criteria import named
from dielast.recipe.cases import Case
from dielast.sharing.batches import solve_batches
from dielast.sharing.execution import Execution
from dielast.simulate.sensitivity import sensitivity_of


def with_sensitivity(
    simulation: Simulation,
    cases: Sequence[Case[ActuateRecipe]],
    materials: Sequence[Material],
    samples: Sequence[Sample | None],
    results: Sequence[CaseResult],
    inputs: Inputs,
    execution: Execution,
) -> list[CaseResult]:
    """The results with the sensitivity of the time to the first failure, in cases that ask for it."""
    asked = [number for number, case in enumerate(cases) if case.recipe.sensitivity]
    found = list(results)
    for number in asked:
        case, result, sample = cases[number], results[number], samples[number]
        design = design_of(materials[number], sample, case.recipe.uncertainty)
        # of a run for its life alone, one row is enough
        brief = replace(result, columns={"time [s]": np.zeros(1)})
        with in_a_draw(key=SENSITIVITY if sample is None else "uncertainty", case=of_case(number, len(cases))):
            one, drawn = drawn_film(case, design.sample, brief)
            factor = design.sample.thickness_factor
            runs = solve_batches(simulation.batches([one] * len(drawn), drawn, inputs, factor), execution, "draws")
        life = np.array([[_life(run)] for run in runs])
        found[number] = replace(result, sensitivity=sensitivity_of(design, life, [Column("case", None, np.array([number]))]))
    warn_of_left_out([known for result in found if (known := result.sensitivity) is not None])
    return found


def _life(result: CaseResult) -> float:
    """The time in s of the first failure, NaN without one."""
    times: list[Any] = [event.time for event in result.events or () if named(event.name).is_failure]
    return min(times, default=np.nan)
