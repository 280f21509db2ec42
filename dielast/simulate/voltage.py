"""Voltage programmes: steps as a user states them, and cycles made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError
from dielast.gent import Floats
from dielast.load import Control, Piece, of_case


@dataclass(frozen=True, slots=True, eq=False)
class VoltageStep:
    """Go to a `voltage` (V) at a `rate` (V/s, negative to go down) or within a `duration` (s); neither: at once.

    A step with a duration alone is a hold. Every value may be one number or one a case.
    """

    voltage: ArrayLike | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    @classmethod
    def hold(cls, duration: ArrayLike) -> VoltageStep:
        """Keep the voltage for a `duration` in s."""
        return cls(duration=duration)


def triangle(amplitude: ArrayLike, period: float, cycles: int = 1, *, offset: ArrayLike = 0.0) -> tuple[VoltageStep, ...]:
    """Cycles from `offset` V, reached at once, up by `amplitude`, down by twice as much and back, straight in between; `period` in
    s.
    """
    _check_cycles(period, cycles)
    mid, swing = np.asarray(offset, dtype=float), np.asarray(amplitude, dtype=float)
    quarter = (
        VoltageStep(mid + swing, duration=period / 4),
        VoltageStep(mid - swing, duration=period / 2),
        VoltageStep(mid, duration=period / 4),
    )
    return _start(mid) + quarter * cycles


def sine(
    amplitude: ArrayLike, period: float, cycles: int = 1, *, offset: ArrayLike = 0.0, points: int = 100
) -> tuple[VoltageStep, ...]:
    """Cycles offset + amplitude sin(2 pi t / period), the offset reached at once, as straight lines between so many `points` a
    period.

    The lines fall short of the sine by up to pi^2 / (2 points^2) of the amplitude, 5e-4 for 100 points.
    """
    _check_cycles(period, cycles)
    if points < 4:
        raise InputError(f"{points} points a period do not make a sine: at least 4 are needed")
    mid, swing = np.asarray(offset, dtype=float), np.asarray(amplitude, dtype=float)
    phase = np.arange(1, points + 1) / points
    one = tuple(VoltageStep(mid + swing * np.sin(2 * np.pi * at), duration=period / points) for at in phase)
    return _start(mid) + one * cycles


def _start(offset: Floats) -> tuple[VoltageStep, ...]:
    """The step to where cycles start, if it is none from 0 V."""
    return (VoltageStep(offset),) if np.any(offset) else ()


def voltage_table(time: ArrayLike, voltage: ArrayLike) -> tuple[VoltageStep, ...]:
    """Steps through points (k,) of voltage in V over `time` in s since the programme began, straight in between.

    A first time above 0 is reached by a ramp from 0 V, a first time of 0 at once. `InputError` if time does not ascend.
    """
    times, values = np.asarray(time, dtype=float), np.asarray(voltage, dtype=float)
    if times.ndim != 1 or times.shape != values.shape or not times.size:
        raise InputError(f"a voltage table needs one voltage for each time, got {values.size} for {times.size}")
    if not np.all(np.isfinite(times)) or times[0] < 0:
        raise InputError("the times of a voltage table must be finite and not negative")
    gaps = np.diff(times, prepend=0.0)
    if np.any(gaps[1:] <= 0):
        late = int(np.argmax(gaps[1:] <= 0)) + 1
        raise InputError(f"the voltage table goes back in time: {times[late]:g} s follows {times[late - 1]:g} s")
    return tuple(VoltageStep(value, duration=gap) for value, gap in zip(values, gaps, strict=True))


def voltage_pieces(steps: Sequence[VoltageStep], controls: tuple[Control, Control], thickness: Floats, cases: int) -> list[Piece]:
    """The steps as pieces of load for so many cases, from 0 V. Raises `InputError` naming the step (counted from 0) that is
    wrong.
    """
    if not steps:
        raise InputError("a voltage programme needs at least one step")
    result = []
    present = np.zeros(cases)
    for index, step in enumerate(steps):
        try:
            voltage, duration = _resolve(step, present, cases)
        except InputError as error:
            raise InputError(f"step {index}: {error}") from None
        result.append(Piece(controls, (None, None, voltage / thickness), duration))
        present = voltage
    return result


def _resolve(step: VoltageStep, present: Floats, cases: int) -> tuple[Floats, Floats]:
    """Voltage at the end of a step and its duration (cases,)."""
    duration = None if step.duration is None else _values(step.duration, "duration", cases)
    if duration is not None and np.any(duration < 0):
        raise InputError(f"duration {float(duration.min()):g} s: it must not be negative")
    if step.voltage is None:
        if duration is None or step.rate is not None:
            raise InputError("a voltage, or the duration of a hold is needed")
        return present, duration
    voltage = _values(step.voltage, "voltage", cases)
    if step.rate is None:
        return voltage, np.zeros(cases) if duration is None else duration
    if duration is not None:
        raise InputError("a rate or a duration is needed, not both")
    rate, move = _values(step.rate, "rate", cases), voltage - present
    if np.any(rate == 0):
        raise InputError("rate 0 never reaches the voltage")
    if np.any(move * rate < 0):
        case = int(np.argmax(move * rate < 0))
        raise InputError(
            f"{of_case(case, cases)}rate {rate[case]:g} V/s leads away from the voltage: {move[case]:+g} V are to go, "
            f"so the rate must be {'positive' if move[case] > 0 else 'negative'}"
        )
    return voltage, move / rate


def _values(value: ArrayLike, name: str, cases: int) -> Floats:
    """One finite number for each case."""
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite")
    return np.ascontiguousarray(np.broadcast_to(array.reshape(-1), (cases,)))


def _check_cycles(period: float, cycles: int) -> None:
    """`InputError` unless there are cycles."""
    if not (np.isfinite(period) and period > 0):
        raise InputError(f"period {period:g} s: it must be positive")
    if cycles < 1:
        raise InputError(f"{cycles} cycles: at least one is needed")


def some_of(pieces: Sequence[Piece], cases: NDArray[np.intp]) -> list[Piece]:
    """Voltage pieces for some of the cases."""
    return [
        replace(
            piece,
            target=(None, None, None if piece.target[2] is None else piece.target[2][cases]),
            duration=None if piece.duration is None else piece.duration[cases],
        )
        for piece in pieces
    ]
