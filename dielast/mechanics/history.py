"""The steps of a history, or of a voltage programme, as pieces of load."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, located
from dielast.mechanics.cases import numbers, one_set, spread
from dielast.mechanics.line import Line, lasts_at
from dielast.mechanics.load import ElectricalStep, Mode, Path, Step, Waveform
from dielast.mechanics.piece import Chain, Cycles, Piece
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import Floats

Made = TypeVar("Made")

LATERAL = {Mode.UNIAXIAL: (Control.STRESS, 0.0), Mode.PURE_SHEAR: (Control.STRETCH, 1.0)}
"""What a mode prescribes along axis 2; in the other mode, this is what a step prescribes along axis 1."""


def case_count(steps: Sequence[Step] | Sequence[ElectricalStep], *others: ArrayLike | None) -> int:
    """The number of cases of the arrays in `steps` and `others`; `InputError` if their lengths disagree."""
    sizes = {np.size(other) for other in others if other is not None}
    return one_set(sizes.union(*_step_by_step(map(_sizes, steps))))


def pieces(steps: Sequence[Step], mode: Mode | str, cases: int) -> list[Piece]:
    """The steps of a history as pieces for `cases` cases. Raises `InputError` with the step (counted from 0) that is wrong."""
    mode = Mode.of(mode)
    if not steps:
        raise InputError("at least one step is needed", argument="steps")
    return _numbered(_pieces_of_steps(steps, mode, cases))


def electrical_pieces(steps: Sequence[ElectricalStep], controls: Controls, unit: Floats) -> list[Piece]:
    """The steps of an electrical programme, all of voltage or all of charge, as pieces of load that start from 0.

    Their values are divided by `unit` (cases,): the thickness of the films in m for voltages, 1 for charges per area. Raises
    `InputError` with the step (counted from 0) that is wrong.
    """
    if not steps:
        raise InputError("at least one step is needed", argument="steps")
    return _numbered(_pieces_of_programme(steps, controls, unit))


def _step_by_step(made: Iterator[Made]) -> list[Made]:
    """What an iterator makes of one step after the other; an `InputError` on the way names the step."""
    result: list[Made] = []
    while True:
        with located(step=len(result)):
            of_step = next(made, None)
        if of_step is None:
            return result
        result.append(of_step)


def _numbered(made: Iterator[list[Piece]]) -> list[Piece]:
    """The pieces of one step after the other, with the number of the step."""
    return [replace(piece, step=step) for step, of_step in enumerate(_step_by_step(made)) for piece in of_step]


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


def _pieces_of_steps(steps: Sequence[Step], mode: Mode, cases: int) -> Iterator[list[Piece]]:
    """The pieces of each step of a history."""
    controls: Controls = (Control.STRESS, LATERAL.get(mode, (Control.STRESS, 0.0))[0])
    for step in steps:
        paced = Control.STRESS if step.stretch is None else Control.STRETCH
        path = step.stress if isinstance(step.stress, Path) else step.stretch
        if isinstance(path, Path):
            if step.rate is not None or step.duration is not None or (step.stretch is not None and step.stress is not None):
                raise InputError("a waveform or a track states its times itself: leave out rate, duration and the other quantity")
            _check_stretch(paced, path.values())
            lateral, value = LATERAL.get(mode, (paced, 0.0))
            controls, follows = (paced, lateral), float(mode not in LATERAL)
            yield _along(path, controls, base=(0.0, value, np.nan), scale=(1.0, follows, 0.0), cases=cases)
            continue
        if step.target is None:
            yield _hold(step, controls, cases, "a stretch, a stress")
            continue
        targets = _targets(step, paced, mode)
        first, second = (spread(value, control.value, cases) for control, value in targets)
        controls = (targets[0][0], targets[1][0])
        for control, values in zip(controls, (first, second), strict=True):
            _check_stretch(control, values)
        yield [Line.to(controls, (first, second, None), *_pace(step, cases, "target"), paced)]


def _pieces_of_programme(steps: Sequence[ElectricalStep], controls: Controls, unit: Floats) -> Iterator[list[Piece]]:
    """The pieces of each step of an electrical programme."""
    kind, present, cases = type(steps[0]), np.zeros_like(unit), unit.size
    for step in steps:
        if type(step) is not kind:
            raise InputError(f"a {step.QUANTITY} does not go with a {kind.QUANTITY}: all steps prescribe one or the other")
        if isinstance(step.target, Path):
            if step.rate is not None or step.duration is not None:
                raise InputError("a waveform or a track states its times itself: leave out rate and duration")
            present = spread(step.target.last, step.QUANTITY, cases)
            yield _along(step.target, controls, base=(np.nan, np.nan, 0.0), scale=(0.0, 0.0, 1 / unit), cases=cases)
            continue
        if step.target is None:
            yield _hold(step, controls, cases, f"a {step.QUANTITY}")
            continue
        before, present = present, spread(step.target, step.QUANTITY, cases)
        lasts, rate = _pace(step, cases, step.QUANTITY)
        if rate is not None:
            lasts = lasts_at(rate, present - before, step.QUANTITY, step.UNIT)
        yield [Line.to(controls, (None, None, present / unit), lasts)]


def _hold(step: Step | ElectricalStep, controls: Controls, cases: int, needed: str) -> list[Piece]:
    """A step without a target, in which the load stays as it is; `needed` is what else a step may prescribe."""
    if step.duration is None or step.rate is not None:
        raise InputError(f"{needed}, or the duration of a hold is needed")
    return [Line.to(controls, (None, None, None), _lasts(step.duration, cases))]


def _along(path: Path, controls: Controls, base: Sequence[ArrayLike], scale: Sequence[ArrayLike], cases: int) -> list[Piece]:
    """A step that follows a path: each row of its load is `base` + `scale` times the value of the path, NaN where it stays.

    A ramp leads to the first point of a track whose time is later than the beginning of the step.
    """
    start, factor = (np.stack([np.broadcast_to(row, cases) for row in rows]) for rows in (base, scale))
    if isinstance(path, Waveform):
        return [Cycles.of(controls, start, factor, path)]
    time, value = np.asarray(path.time, dtype=float), path.values()
    chain = Chain.of(controls, start, factor * spread(path.scale, "scale", cases), time - time[0], value)
    ramp = Line(controls, np.full_like(start, np.nan), chain.start, np.full(cases, time[0]))
    if time.size == 1:
        return [ramp]
    return [ramp, chain] if time[0] > 0 else [chain]


def _targets(step: Step, paced: Control, mode: Mode) -> Sequence[tuple[Control, ArrayLike]]:
    """Control and target of both axes; `paced` is the control to which a rate refers."""
    stated = {Control.STRETCH: step.stretch, Control.STRESS: step.stress}
    if any(isinstance(value, tuple) for value in stated.values()):
        targets: list[tuple[Control, ArrayLike]] = []
        for axis in range(2):
            stated_here = [(control, pair[axis]) for control, pair in stated.items() if isinstance(pair, tuple)]
            prescribed = [(control, value) for control, value in stated_here if value is not None]
            if len(prescribed) != 1:
                raise InputError(f"axis {axis + 1} needs either a stretch or a stress")
            targets.append(prescribed[0])
        return targets
    if step.stretch is not None and step.stress is not None:
        raise InputError("a stretch or a stress is needed, not both")
    value = stated[paced]
    assert value is not None
    assert not isinstance(value, tuple | Path)
    return (paced, value), LATERAL.get(mode, (paced, value))


def _pace(step: Step | ElectricalStep, cases: int, goal: str) -> tuple[Floats, Floats | None]:
    """Duration in s and signed rate (cases,) of a step to a target; the duration has no meaning where there is a rate."""
    lasts = _lasts(0.0 if step.duration is None else step.duration, cases)
    if step.rate is None:
        return lasts, None
    if step.duration is not None:
        raise InputError("a rate or a duration is needed, not both")
    rates = spread(step.rate, "rate", cases)
    if np.any(rates == 0):
        raise InputError(f"rate 0 never reaches the {goal}")
    return lasts, rates


def _lasts(duration: ArrayLike, cases: int) -> Floats:
    """A duration (cases,) in s; `InputError` for one that is negative."""
    lasts = spread(duration, "duration", cases)
    if np.any(lasts < 0):
        raise InputError(f"{float(lasts.min()):g} s: it must not be negative", argument="duration")
    return lasts


def _check_stretch(control: Control, values: Floats) -> None:
    """`InputError` for a stretch that is not positive."""
    if control is Control.STRETCH and np.any(values <= 0):
        raise InputError(f"stretch {float(values.min()):g}: it must be positive (1 is undeformed)")


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
