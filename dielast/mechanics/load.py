"""Loads as a user states them: steps, waveforms, and tables over time.

A step prescribes a stretch or a nominal stress along each axis; uniaxial, equibiaxial and pure-shear loading are special cases of
this. Every value may be one number, one number per case (cases,), a waveform, or a table over time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, shown
from dielast.io.result import Result
from dielast.material.argument_types import checked
from dielast.mechanics.cases import numbers
from dielast.numerics.arrays import Floats

SHAPES = ("sine", "triangle")


class Mode(Enum):
    """What a single prescribed value means for the two axes."""

    UNIAXIAL = "uniaxial"
    EQUIBIAXIAL = "equibiaxial"
    PURE_SHEAR = "pure-shear"

    @classmethod
    def of(cls, mode: Mode | str) -> Mode:
        """The mode, or that of this name; `InputError` with the argument `mode` for another name."""
        try:
            return cls(mode)
        except ValueError:
            raise InputError(f"{mode!r} is not one of {', '.join(known.value for known in cls)}", argument="mode") from None


@checked
@dataclass(frozen=True, slots=True, eq=False)
class Waveform:
    """Cycles from `low` to `high` and back to `low`, of a "sine" or a "triangle", each with a `period` in s.

    All but the number of `cycles` may be one number or one number per case. Raises `InputError` for a period or a number of cycles
    that is not positive, and for a value that is not finite.
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
        """All values at which it turns around."""
        return np.concatenate((numbers(self.low, "low"), numbers(self.high, "high")))

    def varied(self) -> tuple[ArrayLike, ...]:
        """The values that may differ from case to case."""
        return self.low, self.high, self.period

    @property
    def duration(self) -> float:
        """The duration of all cycles in s, in the slowest case."""
        return float(np.max(self.period)) * self.cycles

    @property
    def last(self) -> ArrayLike:
        """The value at the end."""
        return self.low


@checked
@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A table of `time` in s and `value`, both (points,), with straight lines between the points, such as the record of a machine.

    The step begins at time 0. If the first time is above 0, a ramp leads from the present value to the first point; if it is 0, the
    load jumps to the first point. Raises `InputError` unless all numbers are finite, and times ascend and are not negative.
    """

    time: ArrayLike
    value: ArrayLike
    scale: ArrayLike = 1.0
    """Factor on the values, one number or one number per case."""

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
        """The values (points,), without the `scale`."""
        return np.asarray(self.value, dtype=float)

    def varied(self) -> tuple[ArrayLike, ...]:
        """The values that may differ from case to case."""
        return (self.scale,)

    @property
    def duration(self) -> float:
        """The time of the last point in s."""
        return float(np.asarray(self.time)[-1])

    @property
    def last(self) -> ArrayLike:
        """The value at the end."""
        return np.asarray(self.values()[-1] * np.asarray(self.scale))


Path = Waveform | Track


class _AnyStep(Result):
    """Common to all steps: a step with only a `duration` is a hold."""

    __slots__ = ()

    __match_args__: tuple[str, ...]
    rate: ArrayLike | None
    duration: ArrayLike | None

    @property
    def target(self) -> Any:
        """The value to reach, or the path to follow; None in a hold."""
        raise NotImplementedError

    @property
    def cycles(self) -> int:
        """The number of cycles of the waveform that the step follows, 0 without one."""
        return int(getattr(self.target, "cycles", 0))

    @classmethod
    def hold(cls, duration: ArrayLike) -> Self:
        """Keep the prescribed values for a `duration` in s; a charge is kept by an open circuit."""
        step_type: Callable[..., Self] = cls
        return step_type(duration=duration)


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Step(_AnyStep):
    """One step of a history: go to `stretch` or nominal `stress` (Pa) at a `rate` (1/s, Pa/s), within a `duration` (s), or at once;
    or follow a `Waveform` or a `Track` of one of them.

    The loading mode says what a single value means for both axes. A pair (a tuple; a list is one value per case) prescribes both
    axes, with None for an axis that the other keyword prescribes. A step with only a duration is a hold. A rate has a sign,
    negative to unload; with a pair, it refers to the axis with the largest change.
    """

    stretch: ArrayLike | Path | tuple[ArrayLike | None, ArrayLike | None] | None = None
    stress: ArrayLike | Path | tuple[ArrayLike | None, ArrayLike | None] | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    @property
    def target(self) -> ArrayLike | Path | tuple[ArrayLike | None, ArrayLike | None] | None:
        """The stretch, or else the stress: to reach, or the path to follow; None in a hold. A rate is that of this quantity."""
        return self.stress if self.stretch is None else self.stretch


class _SourceStep(_AnyStep):
    """Common to the steps of a source: a step without a `target` is a hold. `QUANTITY` is what they prescribe, in `UNIT`."""

    __slots__ = ()

    QUANTITY: ClassVar[str]
    UNIT: ClassVar[str]

    @property
    def target(self) -> ArrayLike | Path | None:
        """The value to reach, or the path to follow; None in a hold."""
        target: ArrayLike | Path | None = getattr(self, self.QUANTITY)
        return target


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class VoltageStep(_SourceStep):
    """Go to a `voltage` (V) at a `rate` (V/s, negative to go down), within a `duration` (s), or at once if neither is given; or
    follow a `Waveform` or a `Track` of the voltage.

    A step with only a duration is a hold. Every value may be one number or one number per case.
    """

    voltage: ArrayLike | Path | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    QUANTITY: ClassVar = "voltage"
    UNIT: ClassVar = "V"


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ChargeStep(_SourceStep):
    """Prescribe the total `charge` (C/m^2 of undeformed area) that the source has delivered at the end of the step, reached at a
    `rate` (A/m^2, negative to withdraw charge), within a `duration` (s), or at once if neither is given; or follow a `Waveform` or
    a `Track` of that charge.

    A step with only a duration is a hold, in an open circuit. The charge on the film is this charge less the charge that has leaked
    through the film. Every value may be one number or one number per case.
    """

    charge: ArrayLike | Path | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    QUANTITY: ClassVar = "charge"
    UNIT: ClassVar = "C/m^2"


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FilmStep(_AnyStep):
    """One step of a programme of edges and electrodes, each of which goes to its target within the step's one `duration` (s), at a
    `rate`, or at once; or both follow waveforms of one period, or tracks of equal times; or one of them goes straight to its target
    during the waveform of the other. What is left out stays as it was.

    `stretch` or nominal `stress` (Pa) is what holds the edges from here on, as in `Step`. `voltage` (V), `charge` (C/m^2 of
    undeformed area) or `circuit` is what drives the electrodes: a voltage begins at that of the film; a charge is that on the film,
    less what leaks from here on; in an "open" circuit the charge stays, and "closed" is a source at its last voltage. A rate is
    that of the stretch or stress, or else of the electrical quantity. The waveform of the electrodes is ahead of that of the edges
    by the `phase` (rad).
    """

    stretch: ArrayLike | Path | tuple[ArrayLike | None, ArrayLike | None] | None = None
    stress: ArrayLike | Path | tuple[ArrayLike | None, ArrayLike | None] | None = None
    voltage: ArrayLike | Path | None = None
    charge: ArrayLike | Path | None = None
    circuit: str | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None
    phase: ArrayLike = 0.0

    @property
    def edges(self) -> Any:
        """What the edges go to or follow, None if they stay as they are."""
        return self.stress if self.stretch is None else self.stretch

    @property
    def electrodes(self) -> ArrayLike | Path | None:
        """The voltage or charge to go to or to follow, None if it stays as it is."""
        return self.charge if self.voltage is None else self.voltage

    @property
    def target(self) -> Any:
        """What a rate is that of: the target of the edges, or else of the electrodes."""
        return self.electrodes if self.edges is None else self.edges


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Repeat(Result):
    """The steps from `first` to `last` of a programme, counted from 0, run `times` times, as a cycle.

    Raises `InputError` for numbers that are no such steps or times.
    """

    times: int
    first: int = 0
    last: int | None = None

    def __post_init__(self) -> None:
        if self.times < 1:
            raise InputError(f"{self.times}: a whole number of at least one is needed", argument="times")

    def expanded(self, count: int) -> list[tuple[int, int]]:
        """The number of each step and of its lap, from 1, or 0 outside of the cycle, of a programme of `count` steps."""
        last = count - 1 if self.last is None else self.last
        if not 0 <= self.first <= last < count:
            raise InputError(f"steps {self.first} to {last}: there are steps 0 to {count - 1}", argument="steps")
        cycle = range(self.first, last + 1)
        laps = [(step, lap) for lap in range(1, self.times + 1) for step in cycle]
        return [*((step, 0) for step in range(self.first)), *laps, *((step, 0) for step in range(last + 1, count))]


ElectricalStep = VoltageStep | ChargeStep | FilmStep


@checked
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Programme(Result):
    """The `steps` that drive a film, some of which may `repeat`, as a cycle; the `mode` says what one stretch or stress of a
    `FilmStep` means for both axes.
    """

    steps: Sequence[ElectricalStep]
    mode: Mode | str = Mode.EQUIBIAXIAL
    repeat: Repeat | None = None

    @classmethod
    def of(cls, steps: Programme | Sequence[ElectricalStep]) -> Programme:
        """The programme that is stated, or that of these steps alone."""
        return steps if isinstance(steps, Programme) else cls(steps)

    @property
    def moves_edges(self) -> bool:
        """Whether it has laps, or drives the edges, and not the electrodes alone."""
        return self.repeat is not None or any(isinstance(step, FilmStep) for step in self.steps)
