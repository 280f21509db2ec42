"""The cycles and the time under voltage up to a moment in a programme."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dielast import FilmStep
from dielast.commands.actuate.uses import use_columns
from dielast.commands.simulation.solver_steps import TimedStep


def uses(time: float, times: int) -> tuple[float, float]:
    """Of edges that go from 1 to 3 and back to 2 at a rate, with a voltage in between: 6 s at first, then 4 s each time."""
    stated = [FilmStep(stretch=3.0, rate=0.5), FilmStep(voltage=1e3, duration=1.0), FilmStep(stretch=2.0, voltage=0.0, rate=-1.0)]
    steps, begin, before, edges = [], 0.0, 0.0, (1.0, 1.0)
    for number, step in enumerate(stated):
        timed = TimedStep(step, number, begin, before, edges)
        begin, before, edges = timed.end, timed.after, timed.stretched
        steps.append(timed)
    case: Any = SimpleNamespace(steps=steps, recipe=SimpleNamespace(repeat=SimpleNamespace(times=times, steps=None)))
    cycles, actuated = use_columns(np.zeros(1, dtype=np.intp), np.array([time]), [case])
    return float(cycles.values[0]), float(actuated.values[0])


@pytest.mark.parametrize(
    ("time", "cycles", "actuated"), [(3.0, 0.5, 0.0), (6.0, 1.0, 2.0), (8.0, 1.5, 2.0), (10.0, 2.0, 4.0), (18.0, 4.0, 8.0)]
)
def test_a_repeated_step_at_a_rate_begins_where_the_cycle_ends(time: float, cycles: float, actuated: float) -> None:
    assert uses(time, 10) == pytest.approx((cycles, actuated))
