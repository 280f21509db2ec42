"""Voltage programmes: steps as a user states them, and the pieces of load that they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, located
from dielast.io.result import Result
from dielast.mechanics.cases import spread
from dielast.mechanics.course import Piece
from dielast.mechanics.history import pace, path_pieces
from dielast.mechanics.line import Ramp, lasts_at
from dielast.mechanics.load import Path
from dielast.mechanics.span import Controls
from dielast.numerics.columns import Floats


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class VoltageStep(Result):
    """Go to a `voltage` (V) at a `rate` (V/s, negative to go down) or within a `duration` (s), neither: at once; or follow a
    `Waveform` or a `Track` of the voltage.

    A step with a duration alone is a hold. Every value may be one number or one a case.
    """

    voltage: ArrayLike | Path | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    @classmethod
    def hold(cls, duration: ArrayLike) -> VoltageStep:
        """Keep the voltage for a `duration` in s."""
        return cls(duration=duration)

    def varied(self) -> list[ArrayLike]:
        """All numbers of which there may be one for each case."""
        voltage = self.voltage.varied() if isinstance(self.voltage, Path) else (self.voltage,)
        return [value for value in (*voltage, self.rate, self.duration) if value is not None]


def voltage_pieces(steps: Sequence[VoltageStep], controls: Controls, thickness: Floats) -> list[Piece]:
    """The steps as pieces of load, from 0 V, for films of a `thickness` (cases,) in m. Raises `InputError` naming the step (counted
    from 0) that is wrong.
    """
    if not steps:
        raise InputError("a voltage programme needs at least one step")
    result: list[Piece] = []
    present = np.zeros(thickness.size)
    for index, step in enumerate(steps):
        with located(step=index):
            if isinstance(step.voltage, Path):
                if step.rate is not None or step.duration is not None:
                    raise InputError("a waveform or a track has its pace with it")
                result += path_pieces(step.voltage, controls, (False, False, True), 1 / thickness, index)
                present = spread(step.voltage.last, "voltage", thickness.size)
                continue
            voltage, duration = _ramp(step, present)
        result.append(Ramp(controls, (None, None, voltage / thickness), duration, origin=index))
        present = voltage
    return result


def _ramp(step: VoltageStep, present: Floats) -> tuple[Floats, Floats]:
    """Voltage at the end of a step that is no path, and its duration in s (cases,)."""
    if step.voltage is None:
        if step.duration is None or step.rate is not None:
            raise InputError("a voltage, or the duration of a hold is needed")
        voltage = present
    else:
        assert not isinstance(step.voltage, Path)
        voltage = spread(step.voltage, "voltage", present.size)
    lasts, rate = pace(step.duration, step.rate, present.size, "voltage")
    return voltage, lasts if rate is None else lasts_at(rate, voltage - present, "voltage", " V/s", "V are")
