"""Load histories: steps as a user states them, and the linear pieces that the solver runs through.

A step prescribes, along each axis, a stretch or a nominal stress; uniaxial, equibiaxial and pure-shear loading and any mixture are
the same mechanism. Every value may be one number or one number a case, shape (cases,).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError, shown

Floats = NDArray[np.float64]


class Control(Enum):
    """What a load prescribes along one axis."""

    STRETCH = "stretch"
    STRESS = "stress"


class Mode(Enum):
    """What a single prescribed value means for the two axes."""

    UNIAXIAL = "uniaxial"
    EQUIBIAXIAL = "equibiaxial"
    PURE_SHEAR = "pure-shear"


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One step of a history: go to `stretch` or nominal `stress` (Pa) at a `rate` (1/s, Pa/s), within a `duration` (s), or at once.

    One value is understood by the loading mode; a pair (a tuple, for a list is one value for each case) prescribes both axes,
    with None for an axis that the other keyword prescribes. A step with a duration alone is a hold. A rate carries its sign:
    negative to unload; in a pair it is that of the axis that moves furthest.
    """

    stretch: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None
    stress: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None
    rate: ArrayLike | None = None
    duration: ArrayLike | None = None

    @classmethod
    def hold(cls, duration: ArrayLike) -> Step:
        """Keep what is prescribed for a `duration` in s."""
        return cls(duration=duration)


@dataclass(frozen=True, slots=True, eq=False)
class Ramp:
    """A linear piece of load: stretch or nominal stress of axes 1 and 2, and the nominal field, `start` and `rate` (3, cases)."""

    controls: tuple[Control, Control]
    start: Floats
    rate: Floats
    constant: bool
    electric: bool

    @classmethod
    def between(cls, controls: tuple[Control, Control], start: Floats, end: Floats, duration: Floats) -> Ramp:
        """The straight line from `start` to `end` (3, cases) within `duration` (cases,); constant where the duration is 0."""
        rate = np.where(duration > 0, end - start, 0.0) / np.where(duration > 0, duration, 1.0)
        return cls(controls, start, rate, not np.any(rate), bool(np.any(start[2]) or np.any(rate[2])))

    def take(self, cases: NDArray[np.intp]) -> Ramp:
        """The same for some of the cases."""
        return Ramp(self.controls, self.start[:, cases], self.rate[:, cases], self.constant, self.electric)

    def value(self, time: Floats) -> Floats:
        """Prescribed values (3, cases) at `time` (cases,) since the piece began."""
        return self.start if self.constant else np.asarray(self.start + self.rate * time)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A linear piece of a history before it is known where it starts.

    `target` holds the end values of axes 1 and 2 and of the nominal field V/L_3 (V/m), each (cases,), or None for what stays as it
    is when the piece begins, such as a dead load after a hold at constant stretch. Either `duration` (s; 0 is at once) or `rate` is
    given, the signed rate of the `paced` quantity.
    """

    controls: tuple[Control, Control]
    target: tuple[Floats | None, Floats | None, Floats | None]
    duration: Floats | None = None
    rate: Floats | None = None
    paced: Control = Control.STRETCH

    def resolve(self, present: Floats) -> tuple[Floats, Floats]:
        """End values (3, cases) and duration (cases,) from the `present` values; `InputError` for a rate of the wrong sign."""
        end = np.array([now if target is None else target for now, target in zip(present, self.target, strict=True)])
        if self.duration is not None:
            return end, self.duration
        rate = np.zeros(present.shape[1]) if self.rate is None else self.rate
        paced = [control is self.paced and target is not None for control, target in zip(self.controls, self.target, strict=False)]
        moves = (end - present)[:2][paced]
        move = np.take_along_axis(moves, np.argmax(np.abs(moves), axis=0)[None], axis=0)[0]
        # a target that is reached already, but for rounding
        move = np.where(np.abs(move) <= 1e-12 * np.abs(end[:2]).max(axis=0), 0.0, move)
        against = move * rate < 0
        if np.any(against):
            case = int(np.argmax(against))
            raise InputError(
                f"{of_case(case, move.size)}rate {rate[case]:g} leads away from the target: "
                f"{move[case]:+g} of {self.paced.value} is to go, "
                f"so the rate must be {'positive' if move[case] > 0 else 'negative'}"
            )
        return end, np.abs(move / rate)


def table(time: ArrayLike, *, stretch: ArrayLike | None = None, stress: ArrayLike | None = None) -> tuple[Step, ...]:
    """Steps through points (k,) of stretch or nominal stress (Pa) over `time` in s since the first begins, straight in between.

    A first time above 0 is reached by a ramp from the present state, one of 0 at once. `InputError` if time does not ascend.
    """
    times, values = np.asarray(time, dtype=float), np.asarray(stress if stretch is None else stretch, dtype=float)
    if times.ndim != 1 or times.shape != values.shape or not times.size:
        raise InputError(f"a history needs one value for each time, got {values.size} for {times.size}")
    if not np.all(np.isfinite(times)) or times[0] < 0:
        raise InputError("the times of a history must be finite and not negative")
    gaps = np.diff(times, prepend=0.0)
    if np.any(gaps[1:] <= 0):
        late = int(np.argmax(gaps[1:] <= 0)) + 1
        raise InputError(f"the history goes back in time: {times[late]:g} s follows {times[late - 1]:g} s")
    if stretch is None:
        return tuple(Step(stress=value, duration=gap) for value, gap in zip(values, gaps, strict=True))
    return tuple(Step(stretch=value, duration=gap) for value, gap in zip(values, gaps, strict=True))


def of_case(case: int, cases: int) -> str:
    """How an error message about one of so many cases begins; a lone case needs no name."""
    return f"case {case}: " if cases > 1 else ""


def numbers(values: ArrayLike, name: str) -> Floats:
    """One number or a list of them as an array (cases,); `InputError` beginning with `name` for anything else."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: {shown(values)}: a number in SI units, or a list of numbers, is needed") from None
    if array.ndim > 1 or not array.size:
        raise InputError(f"{name}: an array of shape {array.shape}: one number, or one for each case, is needed")
    return array.reshape(-1)


def case_count(steps: Sequence[Step], *others: ArrayLike) -> int:
    """Number of cases that the arrays in `steps` and `others` span; `InputError` if their lengths disagree."""
    sizes = {np.size(other) for other in others}
    for index, step in enumerate(steps):
        if not isinstance(step, Step):
            raise InputError(f"step {index}: {shown(step)}: a Step is needed")
        pairs = {"stretch": step.stretch, "stress": step.stress}
        for name, given in pairs.items():
            if isinstance(given, tuple) and len(given) != 2:
                raise InputError(f"step {index}: a {name} of {len(given)} values: a tuple is a pair, one value for each axis")
            for value in given if isinstance(given, tuple) else (given,):
                sizes.add(1 if value is None else numbers(value, f"step {index}: {name}").size)
        for name, value in (("rate", step.rate), ("duration", step.duration)):
            sizes.add(1 if value is None else numbers(value, f"step {index}: {name}").size)
    sizes.discard(1)
    if len(sizes) > 1:
        raise InputError(f"arrays of {' and '.join(map(str, sorted(sizes)))} values do not make one set of cases")
    return sizes.pop() if sizes else 1


def pieces(steps: Sequence[Step], mode: Mode | str, cases: int) -> list[Piece]:
    """The steps of a history as pieces for so many cases. Raises `InputError` naming the step (counted from 0) that is wrong."""
    try:
        mode = Mode(mode)
    except ValueError:
        raise InputError(f"mode {mode!r} is not one of {', '.join(known.value for known in Mode)}") from None
    if not steps:
        raise InputError("a history needs at least one step")
    result: list[Piece] = []
    held: tuple[Control, Control] = (Control.STRESS, Control.STRETCH if mode is Mode.PURE_SHEAR else Control.STRESS)
    for index, step in enumerate(steps):
        try:
            piece = _piece(step, mode, held, cases)
        except InputError as error:
            raise InputError(f"step {index}: {error}") from None
        held = piece.controls
        result.append(piece)
    return result


def _piece(step: Step, mode: Mode, held: tuple[Control, Control], cases: int) -> Piece:
    """One step as a piece; `held` are the controls of the step before."""
    duration = None if step.duration is None else _values(step.duration, "duration", cases)
    if duration is not None and np.any(duration < 0):
        raise InputError(f"duration {float(duration.min()):g} s: it must not be negative")
    if step.stretch is None and step.stress is None:
        if duration is None or step.rate is not None:
            raise InputError("a stretch, a stress, or the duration of a hold is needed")
        return Piece(held, (None, None, None), duration)
    targets, paced = _targets(step, mode)
    values: list[Floats] = []
    for control, value in targets:
        values.append(_values(value, control.value, cases))
        if control is Control.STRETCH and np.any(values[-1] <= 0):
            raise InputError(f"stretch {float(values[-1].min()):g}: it must be positive (1 is undeformed)")
    controls = (targets[0][0], targets[1][0])
    if step.rate is None:
        return Piece(controls, (values[0], values[1], None), np.zeros(cases) if duration is None else duration, paced=paced)
    rate = _values(step.rate, "rate", cases)
    if duration is not None:
        raise InputError("a rate or a duration is needed, not both")
    if np.any(rate == 0):
        raise InputError("rate 0 never reaches the target")
    return Piece(controls, (values[0], values[1], None), rate=rate, paced=paced)


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
    assert not isinstance(value, tuple)
    first: tuple[Control, ArrayLike] = (paced, value)
    second = {Mode.UNIAXIAL: (Control.STRESS, 0.0), Mode.EQUIBIAXIAL: first, Mode.PURE_SHEAR: (Control.STRETCH, 1.0)}[mode]
    return [first, second], paced


def _values(value: ArrayLike, name: str, cases: int) -> Floats:
    """One finite number for each case."""
    array = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be finite")
    return np.ascontiguousarray(np.broadcast_to(array.reshape(-1), (cases,)))
