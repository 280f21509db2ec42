"""Lives as what a device does in them: cycles of its waveforms, and the time under voltage."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dielast.commands.simulation.solver_steps import TimedStep
from dielast.io.table import Column, Table
from dielast.mechanics.load import Waveform
from dielast.numerics.arrays import Cases, Floats


def use_columns(case: Cases, time: Floats, programmes: Sequence[Sequence[TimedStep]], prefix: str = "") -> Table:
    """Columns of the cycles, if a programme has a waveform, and of the time in s under voltage or charge, both (rows,), up to a
    `time` (rows,) in s in the programme of each `case` (rows,); a life without an end has no end in either.
    """
    used = np.array([_used(programmes[k], at) for k, at in zip(case.tolist(), time.tolist(), strict=True)]).reshape(-1, 2).T
    waves = any(isinstance(timed.step.target, Waveform) for steps in programmes for timed in steps)
    return [
        *([Column(f"{prefix}cycles", "1", used[0])] if waves else []),
        Column(f"{prefix}actuated_time", "s", used[1]),
    ]


def _used(steps: Sequence[TimedStep], time: float) -> tuple[float, float]:
    """The cycles of all waveforms up to a time in s, and the time in which voltage or charge is not 0."""
    if not np.isfinite(time):
        return time, time
    cycles = under = 0.0
    for timed in steps:
        target, passed = timed.step.target, min(time, timed.end) - timed.begin
        if passed <= 0:
            continue
        if isinstance(target, Waveform):
            cycles += passed / float(np.max(target.period))
            under += passed if timed.before or any(value for value, _ in timed.corners) else 0.0
            continue
        before = timed.before
        for value, lasts in timed.corners:
            under += min(passed, lasts) if before or value else 0.0
            before, passed = value, max(passed - lasts, 0.0)
    return cycles, under
