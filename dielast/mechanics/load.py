"""Loads as a user states them: steps, waveforms, and tables over time.

A step prescribes, along each axis, a stretch or a nominal stress; uniaxial, equibiaxial and pure-shear loading and any mixture are
the same mechanism. Every value may be one number or one number a case, shape (cases,), or a waveform, or a table over time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, shown
from dielast.io.result import Result
from dielast.mechanics.cases import numbers
from dielast.numerics.columns import Floats

SHAPES = ("sine", "triangle")


class Mode(Enum):
    """What a single prescribed value means for the two axes."""

    UNIAXIAL = "uniaxial"
    EQUIBIAXIAL = "equibiaxial"
    PURE_SHEAR = "pure-shear"


@dataclass(frozen=True, slots=True, eq=False)
class Waveform:
    """Cycles from `low` to `high` and back, of a "sine" or a "triangle", each within a `period` in s; all but the number of
    `cycles` may be one number or one a case. `InputError` for a period or a number of cycles that is not positive.
    """

    low: ArrayLike
    high: ArrayLike
    period: ArrayLike
    cycles: int = 1
    shape: str = "sine"

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(f"{shown(self.shape)}: it must be one of {', '.join(SHAPES)}", argument="waveform")
        if not isinstance(self.cycles, int | np.integer) or self.cycles < 1:
            raise InputError(f"{self.cycles}: a whole number of at least one is needed", argument="cycles")
        for name in ("low", "high", "period"):
            values = numbers(getattr(self, name), name)
            if not np.all(np.isfinite(values)):
                raise InputError("it must be finite", argument=name)
        if np.any((period := numbers(self.period, "period")) <= 0):
            raise InputError(f"{float(period.min()):g} s: it must be positive", argument="period")

    def values(self) -> Floats:
        """All values that it turns around at."""
        return np.concatenate((numbers(self.low, "low"), numbers(self.high, "high")))

    def varied(self) -> tuple[ArrayLike, ...]:
        """What may differ from case to case."""
        return self.low, self.high, self.period

    @property
    def duration(self) -> float:
        """Of all cycles in s, in the slowest case."""
        return float(np.max(self.period)) * self.cycles

    @property
    def last(self) -> ArrayLike:
        """The value at its end."""
        return self.low


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Points of `time` in s and `value`, both (points,), straight in between: what a machine went through, or is to follow.

    The step begins at time 0: a first point above 0 is reached by a ramp from the present state, one at 0 at once. `InputError`
    unless times ascend.
    """

    time: ArrayLike
    value: ArrayLike
    scale: ArrayLike = 1.0
    """Factor on the values, one number or one a case."""

    def __post_init__(self) -> None:
        times, values = np.asarray(self.time, dtype=float), np.asarray(self.value, dtype=float)
        if times.ndim != 1 or times.shape != values.shape or not times.size:
            raise InputError(f"a history needs one value for each time, got {values.size} for {times.size}")
        if not np.all(np.isfinite(times)) or times[0] < 0:
            raise InputError("the times of a history must be finite and not negative")
        if not np.all(np.isfinite(values)):
            raise InputError("the values of a history must be finite")
        if np.any(late := np.diff(times) <= 0):
            row = int(np.argmax(late)) + 1
            raise InputError(f"the history goes back in time: {times[row]:g} s follows {times[row - 1]:g} s")

    def values(self) -> Floats:
        """The values of all points."""
        return np.asarray(self.value, dtype=float)

    def varied(self) -> tuple[ArrayLike, ...]:
        """What may differ from case to case."""
        return (self.scale,)

    @property
    def duration(self) -> float:
        """To the last point in s."""
        return float(np.asarray(self.time)[-1])

    @property
    def last(self) -> ArrayLike:
        """The value at its end."""
        return np.asarray(self.values()[-1] * np.asarray(self.scale))


Path = Waveform | Track


class _AnyStep(Result):
    """What all steps share: one with a `duration` alone holds what is there."""

    __slots__ = ()

    rate: ArrayLike | None
    duration: ArrayLike | None

    @classmethod
    def hold(cls, duration: ArrayLike) -> Self:
        """Keep what is prescribed for a `duration` in s; a charge is kept by an open circuit."""
        made: Callable[..., Self] = cls
        return made(duration=duration)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Step(_AnyStep):
    """One step of a history: go to `stretch` or nominal `stress` (Pa) at a `rate` (1/s, Pa/s), within a `duration` (s), or at once;
    or follow a `Waveform` or a `Track` of one of them.

    One value is understood by the loading mode; a pair (a tuple, for a list is one value for each case) prescribes both axes,
    with None for an axis that the other keyword prescribes. A step with a duration alone is a hold. A rate carries its sign:
    negative to unload; in a pair it is that of the axis that moves furthest.
    """

    stretch: ArrayLike | Path | tuple[ArrayLike | None, ArrayLike | None] | None = None
    stress: ArrayLike | Path | tuple[ArrayLike | None, ArrayLike | None] | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None


class _SourceStep(_AnyStep):
    """What steps of a source share: one without a `target` holds what is there. `QUANTITY` is what they prescribe, in `UNIT`."""

    __slots__ = ()

    QUANTITY: ClassVar[str]
    UNIT: ClassVar[str]

    @property
    def target(self) -> ArrayLike | Path | None:
        """The value to reach, or the path to follow, of the quantity; None in a hold."""
        target: ArrayLike | Path | None = getattr(self, self.QUANTITY)
        return target

    def varied(self) -> list[ArrayLike]:
        """All numbers of which there may be one for each case."""
        target = self.target.varied() if isinstance(self.target, Path) else (self.target,)
        return [value for value in (*target, self.rate, self.duration) if value is not None]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class VoltageStep(_SourceStep):
    """Go to a `voltage` (V) at a `rate` (V/s, negative to go down) or within a `duration` (s), neither: at once; or follow a
    `Waveform` or a `Track` of the voltage.

    A step with a duration alone is a hold. Every value may be one number or one a case.
    """

    voltage: ArrayLike | Path | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    QUANTITY: ClassVar = "voltage"
    UNIT: ClassVar = "V"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ChargeStep(_SourceStep):
    """Let the source have delivered a `charge` (C/m^2 of undeformed area) in all, at a `rate` (A/m^2, negative to take charge back)
    or within a `duration` (s), neither: at once; or follow a `Waveform` or a `Track` of that charge.

    A step with a duration alone is a hold, an open circuit. Without leakage the film has this charge, and else as much less as has
    leaked. Every value may be one number or one a case.
    """

    charge: ArrayLike | Path | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    QUANTITY: ClassVar = "charge"
    UNIT: ClassVar = "C/m^2"


ElectricalStep = VoltageStep | ChargeStep
