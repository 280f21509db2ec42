"""Load histories: steps as a user states them, and the pieces that the solver runs through.

A step prescribes, along each axis, a stretch or a nominal stress; uniaxial, equibiaxial and pure-shear loading and any mixture are
the same mechanism. Every value may be one number or one number a case, shape (cases,), or a waveform, or a table over time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError, located, shown
from dielast.io.result import Result
from dielast.mechanics.course import Chain, Course, Cycles, Line
from dielast.mechanics.span import Control, Controls

Floats = NDArray[np.float64]


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
        """What it comes to."""
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
        """Where it ends."""
        return self.low

    def extremes(self) -> tuple[Floats, Floats]:
        """The least and the largest value."""
        low, high = np.asarray(self.low, dtype=float), np.asarray(self.high, dtype=float)
        return np.minimum(low, high), np.maximum(low, high)

    def spread(self, cases: int, scale: Floats) -> Waveform:
        """The same for so many cases, low and high multiplied by `scale` (cases,)."""
        low, high, period = (spread(getattr(self, name), name, cases) for name in ("low", "high", "period"))
        return Waveform(low * scale, high * scale, period, self.cycles, self.shape)

    def take(self, cases: NDArray[np.intp]) -> Waveform:
        """That of some of the cases."""
        low, high, period = (np.asarray(part)[cases] for part in (self.low, self.high, self.period))
        return Waveform(low, high, period, self.cycles, self.shape)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Points of `time` in s and `value`, both (points,), straight in between: what a machine went through, or is to follow.

    The step begins at time 0: a first point above 0 is reached by a ramp from the present state, one at 0 at once. `InputError`
    unless times ascend.
    """

    time: ArrayLike
    value: ArrayLike
    scale: ArrayLike = 1.0
    """What the values are multiplied by, one number or one a case."""

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
        """What it comes to."""
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
        """Where it ends."""
        return np.asarray(self.values()[-1] * np.asarray(self.scale))

    def extremes(self) -> tuple[Floats, Floats]:
        """The least and the largest value."""
        return self.values().min() * np.asarray(self.scale), self.values().max() * np.asarray(self.scale)

    def spread(self, cases: int, scale: Floats) -> Track:
        """The same for so many cases, with another `scale` (cases,) on top."""
        times, values = np.asarray(self.time, dtype=float), np.asarray(self.value, dtype=float)
        return Track(times, values, spread(self.scale, "scale", cases) * scale)

    def take(self, cases: NDArray[np.intp]) -> Track:
        """That of some of the cases."""
        return Track(self.time, self.value, np.asarray(self.scale)[cases])


Path = Waveform | Track
SHAPES = ("sine", "triangle")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Step(Result):
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

    @classmethod
    def hold(cls, duration: ArrayLike) -> Step:
        """Keep what is prescribed for a `duration` in s."""
        return cls(duration=duration)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A piece of a history before it is known where it starts, from step `origin` (from 0) of the history.

    `target` holds the end values of axes 1 and 2 and of the nominal field V/L_3 (V/m), each (cases,), or None for what stays as it
    is when the piece begins, such as a dead load after a hold at constant stretch. Either `duration` (s; 0 is at once) or `rate` is
    given, the signed rate of the `paced` quantity. A `path` is followed by the `driven` axes and field, from its first value on, to
    which the piece jumps if it is not there.
    """

    controls: Controls
    target: tuple[Floats | None, Floats | None, Floats | None]
    duration: Floats | None = None
    rate: Floats | None = None
    paced: Control = Control.STRETCH
    path: Path | None = None
    driven: tuple[bool, bool, bool] = (False, False, False)
    origin: int = 0

    def resolve(self, present: Floats) -> Course:
        """The course from the `present` values (3, cases) on; `InputError` for a rate of the wrong sign."""
        end = np.array([now if target is None else target for now, target in zip(present, self.target, strict=True)])
        path, driven = self.path, np.array(self.driven)
        if isinstance(path, Waveform):
            wave = np.asarray(path.low), np.asarray(path.high), np.asarray(path.period)
            return Cycles.of(self.controls, end, driven, wave, path.cycles, path.shape == "triangle")
        if isinstance(path, Track):
            return Chain.of(self.controls, end, driven, *(np.asarray(part) for part in (path.time, path.value, path.scale)))
        duration = self.duration if self.duration is not None else self._duration(present, end)
        return Line(self.controls, np.where(duration > 0, present, end), end, duration)

    def _duration(self, present: Floats, end: Floats) -> Floats:
        """How long it takes at the rate (cases,)."""
        rate = np.zeros(present.shape[1]) if self.rate is None else self.rate
        paced = [control is self.paced and target is not None for control, target in zip(self.controls, self.target, strict=False)]
        moves = (end - present)[:2][paced]
        move = np.take_along_axis(moves, np.argmax(np.abs(moves), axis=0)[None], axis=0)[0]
        # a target that is reached already, but for rounding
        move = np.where(np.abs(move) <= 1e-12 * np.abs(end[:2]).max(axis=0), 0.0, move)
        against = move * rate < 0
        if np.any(against):
            case = int(np.argmax(against))
            wrong = wrong_way(float(rate[case]), float(move[case]), self.paced.value)
            raise InputError(wrong, step=self.origin, case=of_case(case, move.size))
        return np.asarray(np.abs(move / rate))


def path_pieces(
    path: Path,
    controls: Controls,
    driven: tuple[bool, bool, bool],
    cases: int,
    scale: Floats,
    origin: int,
    lateral: Floats | None = None,
) -> list[Piece]:
    """A step that follows a path, multiplied by `scale` (cases,), along the `driven` axes and field; `lateral` (cases,) is what
    axis 2 is held at, unless it is driven or keeps its value.
    """
    follows = path.spread(cases, scale)

    def piece(begins: Floats, duration: Floats | None, path: Path | None) -> Piece:
        first, second, third = (begins if yes else None for yes in driven)
        target = (first, lateral if second is None else second, third)
        return Piece(controls, target, duration, path=path, driven=driven, origin=origin)

    if isinstance(follows, Waveform):
        return [piece(np.asarray(follows.low), None, follows)]
    time, value, scaled = np.asarray(follows.time), np.asarray(follows.value), np.asarray(follows.scale)
    ramp = piece(value[0] * scaled, np.full(cases, time[0]), None)
    if time.size == 1:
        return [ramp]
    rest = piece(value[0] * scaled, None, Track(time - time[0], value, scaled))
    return [ramp, rest] if time[0] > 0 else [rest]


def wrong_way(rate: float, move: float, quantity: str, unit: str = "") -> str:
    """What is wrong with a `rate` of a `quantity` whose sign is not that of the `move` to make, in the `unit` if it is stated."""
    name, pace = (quantity, f"{rate:g} {unit}/s") if unit else ("target", f"{rate:g}")
    to_go = f"{move:+g} {unit} are" if unit else f"{move:+g} of {quantity} is"
    sign = "positive" if move > 0 else "negative"
    return f"rate {pace} leads away from the {name}: {to_go} to go, so the rate must be {sign}"


def of_case(case: int, cases: int) -> int | None:
    """The case that an error names as its place: none where there is one only."""
    return case if cases > 1 else None


def numbers(values: ArrayLike, name: str) -> Floats:
    """One number or a list of them as an array (cases,); `InputError` with the argument `name` for anything else."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{shown(values)}: a number in SI units, or a list of numbers, is needed", argument=name) from None
    if array.ndim > 1 or not array.size:
        raise InputError(f"an array of shape {array.shape}: one number, or one for each case, is needed", argument=name)
    return array.reshape(-1)


def case_count(steps: Sequence[Step], *others: ArrayLike) -> int:
    """Number of cases that the arrays in `steps` and `others` span; `InputError` if their lengths disagree."""
    sizes = {np.size(other) for other in others}
    for index, step in enumerate(steps):
        with located(step=index):
            sizes |= _sizes(step)
    sizes.discard(1)
    if len(sizes) > 1:
        raise InputError(f"arrays of {' and '.join(map(str, sorted(sizes)))} values do not make one set of cases")
    return sizes.pop() if sizes else 1


def _sizes(step: Step) -> set[int]:
    """The lengths of the arrays in a step."""
    if not isinstance(step, Step):
        raise InputError(f"{shown(step)}: a Step is needed")
    given: dict[str, tuple[Any, ...]] = {"rate": (step.rate,), "duration": (step.duration,)}
    sizes = set[int]()
    for name, value in (("stretch", step.stretch), ("stress", step.stress)):
        if isinstance(value, tuple) and len(value) != 2:
            raise InputError(f"a {name} of {len(value)} values: a tuple is a pair, one value for each axis")
        if isinstance(value, Path):
            sizes |= {np.size(part) for part in value.varied()}
        else:
            given[name] = value if isinstance(value, tuple) else (value,)
    return sizes | {numbers(value, name).size for name, values in given.items() for value in values if value is not None}


def pieces(steps: Sequence[Step], mode: Mode | str, cases: int) -> list[Piece]:
    """The steps of a history as pieces for so many cases. Raises `InputError` naming the step (counted from 0) that is wrong."""
    try:
        mode = Mode(mode)
    except ValueError:
        raise InputError(f"{mode!r} is not one of {', '.join(known.value for known in Mode)}", argument="mode") from None
    if not steps:
        raise InputError("a history needs at least one step")
    result: list[Piece] = []
    held: tuple[Control, Control] = (Control.STRESS, Control.STRETCH if mode is Mode.PURE_SHEAR else Control.STRESS)
    for index, step in enumerate(steps):
        with located(step=index):
            result += _pieces(step, mode, held, cases, index)
        held = result[-1].controls
    return result


def _pieces(step: Step, mode: Mode, held: Controls, cases: int, origin: int) -> list[Piece]:
    """One step as pieces; `held` are the controls of the step before."""
    path = step.stretch if isinstance(step.stretch, Path) else step.stress if isinstance(step.stress, Path) else None
    if path is not None:
        if step.rate is not None or step.duration is not None or (step.stretch is not None and step.stress is not None):
            raise InputError("a waveform or a track has its pace with it, and stands alone")
        control = Control.STRESS if step.stretch is None else Control.STRETCH
        if control is Control.STRETCH and np.any(path.values() <= 0):
            raise InputError(f"stretch {float(path.values().min()):g}: it must be positive (1 is undeformed)")
        both = mode is Mode.EQUIBIAXIAL
        controls = (control, control if both else Control.STRETCH if mode is Mode.PURE_SHEAR else Control.STRESS)
        lateral = None if both else np.full(cases, float(mode is Mode.PURE_SHEAR))
        return path_pieces(path, controls, (True, both, False), cases, np.ones(cases), origin, lateral)
    duration = None if step.duration is None else spread(step.duration, "duration", cases)
    if duration is not None and np.any(duration < 0):
        raise InputError(f"{float(duration.min()):g} s: it must not be negative", argument="duration")
    if step.stretch is None and step.stress is None:
        if duration is None or step.rate is not None:
            raise InputError("a stretch, a stress, or the duration of a hold is needed")
        return [Piece(held, (None, None, None), duration, origin=origin)]
    targets, paced = _targets(step, mode)
    values: list[Floats] = []
    for control, value in targets:
        values.append(spread(value, control.value, cases))
        if control is Control.STRETCH and np.any(values[-1] <= 0):
            raise InputError(f"stretch {float(values[-1].min()):g}: it must be positive (1 is undeformed)")
    controls = (targets[0][0], targets[1][0])
    if step.rate is None:
        lasts = np.zeros(cases) if duration is None else duration
        return [Piece(controls, (values[0], values[1], None), lasts, paced=paced, origin=origin)]
    rate = spread(step.rate, "rate", cases)
    if duration is not None:
        raise InputError("a rate or a duration is needed, not both")
    if np.any(rate == 0):
        raise InputError("rate 0 never reaches the target")
    return [Piece(controls, (values[0], values[1], None), rate=rate, paced=paced, origin=origin)]


def _targets(step: Step, mode: Mode) -> tuple[list[tuple[Control, ArrayLike]], Control]:
    """Control and target of both axes, and what the rate is a rate of."""
    given = {Control.STRETCH: step.stretch, Control.STRESS: step.stress}
    paced = Control.STRESS if step.stretch is None else Control.STRETCH
    if any(isinstance(value, tuple) for value in given.values()):
        targets: list[tuple[Control, ArrayLike]] = []
        for axis in range(2):
            wanted = [(control, pair[axis]) for control, pair in given.items() if isinstance(pair, tuple)]
            prescribed = [(control, value) for control, value in wanted if value is not None]
            if len(prescribed) != 1:
                raise InputError(f"axis {axis + 1} needs either a stretch or a stress")
            targets.append(prescribed[0])
        return targets, paced
    if step.stretch is not None and step.stress is not None:
        raise InputError("a stretch or a stress is needed, not both")
    value = step.stress if step.stretch is None else step.stretch
    assert value is not None
    assert not isinstance(value, tuple | Path)
    first: tuple[Control, ArrayLike] = (paced, value)
    second = {Mode.UNIAXIAL: (Control.STRESS, 0.0), Mode.EQUIBIAXIAL: first, Mode.PURE_SHEAR: (Control.STRETCH, 1.0)}[mode]
    return [first, second], paced


def spread(value: ArrayLike, name: str, cases: int) -> Floats:
    """One finite number for each case."""
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)):
        raise InputError("it must be finite", argument=name)
    return np.ascontiguousarray(np.broadcast_to(array.reshape(-1), (cases,)))
