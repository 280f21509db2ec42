"""Lives as what a device does in them: cycles of waveforms or of repeated steps, and the time under voltage."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dielast.commands.simulation.result import StatedCase
from dielast.commands.simulation.solver_steps import of_laps, order_of
from dielast.io.table import Column, Table
from dielast.mechanics.load import FilmStep, Waveform
from dielast.numerics.arrays import Cases, Floats


def use_columns(case: Cases, time: Floats, stated: Sequence[StatedCase], prefix: str = "") -> Table:
    """Columns of the cycles, if a programme has any, and of the time in s under voltage or charge, both (rows,), up to a `time`
    (rows,) in s in the programme of each `case` (rows,); a life without an end has no end in either.
    """
    used = np.array([_used(stated[k], at) for k, at in zip(case.tolist(), time.tolist(), strict=True)]).reshape(-1, 2).T
    cycling = any(one.recipe.repeat is not None for one in stated)
    cycling |= any(isinstance(timed.driven, Waveform) for one in stated for timed in one.steps)
    return [
        *([Column(f"{prefix}cycles", "1", used[0])] if cycling else []),
        Column(f"{prefix}actuated_time", "s", used[1]),
    ]


def _used(stated: StatedCase, time: float) -> tuple[float, float]:
    """The cycles up to a time in s, and the time in which voltage or charge is not 0."""
    if not np.isfinite(time):
        return time, time
    order = order_of(stated.recipe, stated.steps)
    of_lap = of_laps(stated.steps, order)
    laps = [sum(of_lap[number, lap].lasts for number, turn in order if turn == lap) for lap in (1, 2)]
    cycles = under = begin = 0.0
    before = stated.steps[0].before
    for number, turn in order:
        timed, passed, lap = of_lap[number, min(turn, 2)], time - begin, laps[turn > 1]
        if passed <= 0:
            break
        passed = min(passed, timed.lasts)
        cycles += passed / lap if turn and lap else 0.0
        if isinstance(timed.step, FilmStep) and timed.step.charge is not None:
            under += passed
        elif isinstance(timed.driven, Waveform):
            cycles += passed / float(np.max(timed.driven.period))
            under += passed if before or any(value for value, _ in timed.corners) else 0.0
        else:
            for value, lasts in timed.corners:
                under += min(passed, lasts) if before or value else 0.0
                before, passed = value, max(passed - lasts, 0.0)
        before, begin = timed.after if timed.driven is not None else before, begin + timed.lasts
    return cycles, under
