"""Voltage programmes: steps as a user states them, and the pieces of load that they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError, located
from dielast.io.result import Result
from dielast.material.springs import Floats
from dielast.mechanics.load import Path, Piece, of_case, path_pieces, spread, wrong_way
from dielast.mechanics.span import Control


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


def spanning(steps: Sequence[VoltageStep]) -> list[ArrayLike]:
    """All numbers of the steps that there may be one of for each case."""
    found: list[ArrayLike | None] = []
    for step in steps:
        found += (
            [*step.voltage.varied(), step.rate, step.duration]
            if isinstance(step.voltage, Path)
            else [step.voltage, step.rate, step.duration]
        )
    return [value for value in found if value is not None]


def voltage_pieces(steps: Sequence[VoltageStep], controls: tuple[Control, Control], thickness: Floats, cases: int) -> list[Piece]:
    """The steps as pieces of load for so many cases, from 0 V. Raises `InputError` naming the step (counted from 0) that is
    wrong.
    """
    if not steps:
        raise InputError("a voltage programme needs at least one step")
    result: list[Piece] = []
    present = np.zeros(cases)
    for index, step in enumerate(steps):
        with located(step=index):
            if isinstance(step.voltage, Path):
                if step.rate is not None or step.duration is not None:
                    raise InputError("a waveform or a track has its pace with it")
                result += path_pieces(step.voltage, controls, (False, False, True), cases, 1 / thickness, index)
                present = spread(step.voltage.last, "voltage", cases)
                continue
            voltage, duration = _resolve(step, present, cases)
        result.append(Piece(controls, (None, None, voltage / thickness), duration, origin=index))
        present = voltage
    return result


def _resolve(step: VoltageStep, present: Floats, cases: int) -> tuple[Floats, Floats]:
    """Voltage at the end of a step and its duration (cases,)."""
    duration = None if step.duration is None else spread(step.duration, "duration", cases)
    if duration is not None and np.any(duration < 0):
        raise InputError(f"{float(duration.min()):g} s: it must not be negative", argument="duration")
    if step.voltage is None:
        if duration is None or step.rate is not None:
            raise InputError("a voltage, or the duration of a hold is needed")
        return present, duration
    assert not isinstance(step.voltage, Path)
    voltage = spread(step.voltage, "voltage", cases)
    if step.rate is None:
        return voltage, np.zeros(cases) if duration is None else duration
    if duration is not None:
        raise InputError("a rate or a duration is needed, not both")
    rate, move = spread(step.rate, "rate", cases), voltage - present
    if np.any(rate == 0):
        raise InputError("rate 0 never reaches the voltage")
    if np.any(move * rate < 0):
        case = int(np.argmax(move * rate < 0))
        raise InputError(wrong_way(float(rate[case]), float(move[case]), "voltage", "V"), case=of_case(case, cases))
    return voltage, move / rate


def some_of(pieces: Sequence[Piece], cases: NDArray[np.intp]) -> list[Piece]:
    """Voltage pieces for some of the cases."""
    return [
        replace(
            piece,
            target=(None, None, None if piece.target[2] is None else piece.target[2][cases]),
            duration=None if piece.duration is None else piece.duration[cases],
            path=None if piece.path is None else piece.path.take(cases),
        )
        for piece in pieces
    ]
