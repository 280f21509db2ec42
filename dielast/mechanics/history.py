"""The steps of a history, or of a voltage programme, as pieces of load."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, located
from dielast.mechanics.cases import numbers, one_set, spread
from dielast.mechanics.line import Line, lasts_at
from dielast.mechanics.load import ElectricalStep, Mode, Path, Step, Waveform
from dielast.mechanics.piece import Chain, Cycles, Piece
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import Floats


def case_count(steps: Sequence[Step] | Sequence[ElectricalStep], *others: ArrayLike | None) -> int:
    """The number of cases of the arrays in `steps` and `others`; `InputError` if their lengths disagree."""
    sizes = {np.size(other) for other in others if other is not None}
    for index, step in enumerate(steps):
        with located(step=index):
            sizes |= _sizes(step)
    return one_set(sizes)


def _sizes(step: Step | ElectricalStep) -> set[int]:
    """The sizes of the arrays in a step."""
    sizes = set[int]()
    for name in step.__match_args__:
        value = getattr(step, name)
        pair = isinstance(value, tuple) and name in ("stretch", "stress")
        if pair and len(value) != 2:
            raise InputError(f"a {name} of {len(value)} values: a tuple is a pair, one value for each axis")
        if isinstance(value, Path):
            sizes |= {np.size(entry) for entry in value.varied()}
        else:
            sizes |= {numbers(entry, name).size for entry in (value if pair else (value,)) if entry is not None}
    return sizes


def pieces(steps: Sequence[Step], mode: Mode | str, cases: int) -> list[Piece]:
    """The steps of a history as pieces for `cases` cases. Raises `InputError` with the step (counted from 0) that is wrong."""
    mode = Mode.of(mode)
    if not steps:
        raise InputError("a history needs at least one step")
    result: list[Piece] = []
    held: Controls = (Control.STRESS, Control.STRETCH if mode is Mode.PURE_SHEAR else Control.STRESS)
    for index, step in enumerate(steps):
        with located(step=index):
            result += _pieces(step, mode, held, cases, index)
        held = result[-1].controls
    return result


def _pieces(step: Step, mode: Mode, held: Controls, cases: int, number: int) -> list[Piece]:
    """One step as pieces; `held` are the controls of the preceding step."""
    if isinstance(path := step.target, Path):
        if step.rate is not None or step.duration is not None or (step.stretch is not None and step.stress is not None):
            raise InputError("a waveform or a track states its times itself: leave out rate, duration and the other quantity")
        control = Control.STRESS if step.stretch is None else Control.STRETCH
        _check_stretch(control, path.values())
        equibiaxial, pure_shear = mode is Mode.EQUIBIAXIAL, mode is Mode.PURE_SHEAR
        controls = (control, control if equibiaxial else Control.STRETCH if pure_shear else Control.STRESS)
        one = np.ones(cases)
        return path_pieces(
            path, controls, np.stack((0 * one, pure_shear * one, np.nan * one)), np.stack((one, equibiaxial * one, 0 * one)), number
        )
    if step.target is None:
        if step.duration is None or step.rate is not None:
            raise InputError("a stretch, a stress, or the duration of a hold is needed")
        return [Line.to(held, (None, None, None), pace(step.duration, step.rate, cases, "target")[0], step=number)]
    targets, paced = _targets(step, mode)
    first, second = (spread(value, control.value, cases) for control, value in targets)
    controls = (targets[0][0], targets[1][0])
    for control, values in zip(controls, (first, second), strict=True):
        _check_stretch(control, values)
    duration, rate = pace(step.duration, step.rate, cases, "target")
    return [Line.to(controls, (first, second, None), duration, rate, paced, number)]


def path_pieces(path: Path, controls: Controls, base: Floats, scale: Floats, step: int) -> list[Piece]:
    """A step that follows a path: its load is `base` + `scale` times the value of the path, both (3, cases).

    `base` is NaN and `scale` 0 for a quantity that keeps its value. A ramp leads to the first point of a track whose time is later
    than the beginning of the step.
    """
    if isinstance(path, Waveform):
        return [Cycles.of(controls, base, scale, path, step)]
    time, value = np.asarray(path.time, dtype=float), path.values()
    chain = Chain.of(controls, base, spread(path.scale, "scale", base.shape[1]) * scale, time - time[0], value, step)
    ramp = Line(controls, np.full_like(base, np.nan), chain.start, np.full(base.shape[1], time[0]), step=step)
    if time.size == 1:
        return [ramp]
    return [ramp, chain] if time[0] > 0 else [chain]


def pace(duration: ArrayLike | None, rate: ArrayLike | None, cases: int, goal: str) -> tuple[Floats, Floats | None]:
    """Duration in s and signed rate (cases,) of a step without a path; the duration has no meaning where there is a rate."""
    lasts = spread(0.0 if duration is None else duration, "duration", cases)
    if np.any(lasts < 0):
        raise InputError(f"{float(lasts.min()):g} s: it must not be negative", argument="duration")
    if rate is None:
        return lasts, None
    if duration is not None:
        raise InputError("a rate or a duration is needed, not both")
    rates = spread(rate, "rate", cases)
    if np.any(rates == 0):
        raise InputError(f"rate 0 never reaches the {goal}")
    return lasts, rates


def _check_stretch(control: Control, values: Floats) -> None:
    """`InputError` for a stretch that is not positive."""
    if control is Control.STRETCH and np.any(values <= 0):
        raise InputError(f"stretch {float(values.min()):g}: it must be positive (1 is undeformed)")


def _targets(step: Step, mode: Mode) -> tuple[list[tuple[Control, ArrayLike]], Control]:
    """Control and target of both axes, and the control to which the rate refers."""
    stated = {Control.STRETCH: step.stretch, Control.STRESS: step.stress}
    paced = Control.STRESS if step.stretch is None else Control.STRETCH
    if any(isinstance(value, tuple) for value in stated.values()):
        targets: list[tuple[Control, ArrayLike]] = []
        for axis in range(2):
            stated_here = [(control, pair[axis]) for control, pair in stated.items() if isinstance(pair, tuple)]
            prescribed = [(control, value) for control, value in stated_here if value is not None]
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


def electrical_pieces(steps: Sequence[ElectricalStep], controls: Controls, unit: Floats) -> list[Piece]:
    """The steps of an electrical programme, all of voltage or all of charge, as pieces of load that start from 0.

    Their values are divided by `unit` (cases,): the thickness of the films in m for voltages, 1 for charges per area. Raises
    `InputError` with the step (counted from 0) that is wrong.
    """
    if not steps:
        raise InputError("a voltage programme needs at least one step")
    result: list[Piece] = []
    kind, present = type(steps[0]), np.zeros(unit.size)
    keeps, zero = np.full(unit.size, np.nan), np.zeros(unit.size)
    for index, step in enumerate(steps):
        with located(step=index):
            if type(step) is not kind:
                raise InputError(f"a {step.QUANTITY} does not go with a {kind.QUANTITY}: all steps prescribe one or the other")
            if isinstance(step.target, Path):
                if step.rate is not None or step.duration is not None:
                    raise InputError("a waveform or a track states its times itself: leave out rate and duration")
                result += path_pieces(
                    step.target, controls, np.stack((keeps, keeps, zero)), np.stack((zero, zero, 1 / unit)), index
                )
                present = spread(step.target.last, step.QUANTITY, unit.size)
            else:
                present, duration = _electrical_ramp(step, present)
                result.append(Line.to(controls, (None, None, present / unit), duration, step=index))
    return result


def _electrical_ramp(step: ElectricalStep, present: Floats) -> tuple[Floats, Floats]:
    """The voltage or the charge (cases,) at the end of a step without a path, and the duration (cases,) of the step in s."""
    if step.target is None:
        if step.duration is None or step.rate is not None:
            raise InputError(f"a {step.QUANTITY}, or the duration of a hold is needed")
        target = present
    else:
        assert not isinstance(step.target, Path)
        target = spread(step.target, step.QUANTITY, present.size)
    lasts, rate = pace(step.duration, step.rate, present.size, step.QUANTITY)
    return target, lasts if rate is None else lasts_at(rate, target - present, step.QUANTITY, step.UNIT)


def duration_of(pieces: Sequence[Piece], cases: int) -> Floats:
    """The duration (cases,) in s of a history that begins at rest; NaN where it depends on how the films respond, as for a rate of
    the stress after a prescribed stretch. Raises `InputError` for a rate of the wrong sign.
    """
    at_rest: dict[Control, float] = {Control.STRETCH: 1.0, Control.STRESS: 0.0}
    known, field, total = [{kind: np.full(cases, value) for kind, value in at_rest.items()}] * 2, np.zeros(cases), np.zeros(cases)
    unknown = np.full(cases, np.nan)
    for piece in pieces:
        present = [axis.get(control, unknown) for axis, control in zip(known, piece.controls, strict=True)]
        begun = piece.begin(np.array([*present, field]))
        total = total + begun.duration
        *ends, field = begun.end
        known = [{control: end} for control, end in zip(piece.controls, ends, strict=True)]
    return total
