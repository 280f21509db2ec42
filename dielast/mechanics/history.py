"""The steps of a history, or of a voltage programme, as pieces of load."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, located, shown
from dielast.mechanics.cases import numbers, one_set, spread
from dielast.mechanics.electric import ELECTRIC, Drive
from dielast.mechanics.laps import Pieces
from dielast.mechanics.line import Line, lasts_at
from dielast.mechanics.load import ElectricalStep, FilmStep, Mode, Path, Programme, Step, Track, VoltageStep, Waveform
from dielast.mechanics.piece import Chain, Cycles, Piece
from dielast.mechanics.span import Control, Controls
from dielast.numerics.arrays import Floats

Made = TypeVar("Made")
Target = tuple[Control, Any]
"""What is prescribed along an axis: a value, a path, or None for the value that is there."""

LATERAL: dict[Mode, Target] = {Mode.UNIAXIAL: (Control.STRESS, 0.0), Mode.PURE_SHEAR: (Control.STRETCH, 1.0)}
"""What a mode prescribes along axis 2; in the other mode, this is what a step prescribes along axis 1."""
LATERAL_OF_FILMS: dict[Mode, Target] = {**LATERAL, Mode.PURE_SHEAR: (Control.STRETCH, None)}
"""The same in a programme of films, whose prestretch along axis 2 stays."""


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


def electrical_pieces(programme: Programme, controls: Controls, unit: Floats, *, edges: bool = False) -> Pieces:
    """The steps of a programme of electrodes, or of `edges` and electrodes, as pieces of load that start from 0 at these controls.

    Their values are divided by `unit` (cases,): the thickness of the films in m for voltages, 1 for charges per area; where edges
    move as well it is the thickness. Under pure shear, the stretch of axis 2 stays. Raises `InputError` with the step (counted from
    0) that is wrong.
    """
    steps, repeat = programme.steps, programme.repeat
    if not steps:
        raise InputError("at least one step is needed", argument="steps")
    if edges:
        order = [(step, 0) for step in range(len(steps))]
        if repeat is not None:
            order = replace(repeat, times=min(repeat.times, 2)).expanded(len(steps))
            if any(step.cycles for step in steps):
                raise InputError("a waveform repeats itself: leave repeat out, or state the cycle in steps", argument="repeat")
        made = _pieces_of_films(((step, lap, steps[step]) for step, lap in order), Mode.of(programme.mode), controls, unit)
        return Pieces([piece for of_step in made for piece in of_step], 0 if repeat is None else repeat.times)
    return Pieces(_numbered(_pieces_of_programme(steps, controls, unit)))


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
        if isinstance(value, str):
            continue
        pair = isinstance(value, tuple) and name in ("stretch", "stress")
        if pair and len(value) != 2:
            raise InputError(f"a {name} of {len(value)} values: a tuple is a pair, one value for each axis")
        for entry in value if pair else (value,):
            if isinstance(entry, Path):
                sizes |= {np.size(varied) for varied in entry.varied()}
            elif entry is not None:
                sizes.add(numbers(entry, name).size)
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
            controls = paced, lateral
            yield _along((path, value if mode in LATERAL else path, None), controls, cases)
            continue
        if step.target is None:
            yield _hold(step, controls, cases, "a stretch, a stress")
            continue
        targets = _targets(step, paced, mode, LATERAL)
        first, second = (spread(value, control.value, cases) for control, value in targets)
        controls = (targets[0][0], targets[1][0])
        for control, values in zip(controls, (first, second), strict=True):
            _check_stretch(control, values)
        yield [Line.to(controls, (first, second, None), *_pace(step, cases, "target"), paced)]


def _pieces_of_programme(steps: Sequence[ElectricalStep], controls: Controls, unit: Floats) -> Iterator[list[Piece]]:
    """The pieces of each step of an electrical programme."""
    kind, present, cases = type(steps[0]), np.zeros_like(unit), unit.size
    for step in steps:
        assert not isinstance(step, FilmStep)
        if type(step) is not kind:
            assert not issubclass(kind, FilmStep)
            raise InputError(f"a {step.QUANTITY} does not go with a {kind.QUANTITY}: all steps prescribe one or the other")
        if isinstance(step.target, Path):
            if step.rate is not None or step.duration is not None:
                raise InputError("a waveform or a track states its times itself: leave out rate and duration")
            present = spread(step.target.last, step.QUANTITY, cases)
            yield _along((None, None, step.target), controls, cases, unit)
            continue
        if step.target is None:
            yield _hold(step, controls, cases, f"a {step.QUANTITY}")
            continue
        before, present = present, spread(step.target, step.QUANTITY, cases)
        lasts, rate = _pace(step, cases, step.QUANTITY)
        if rate is not None:
            lasts = lasts_at(rate, present - before, step.QUANTITY, step.UNIT)
        yield [Line.to(controls, (None, None, present / unit), lasts)]


def _pieces_of_films(
    steps: Iterable[tuple[int, int, ElectricalStep]], mode: Mode, controls: Controls, unit: Floats
) -> Iterator[list[Piece]]:
    """The pieces of each of the `steps` of a programme of edges and electrodes, which have numbers and laps."""
    source = np.zeros_like(unit)  # the voltage to which a circuit closes
    for number, lap, step in steps:
        with located(step=number):
            of_step, controls, source = _pieces_of_film(_as_film_step(step), mode, controls, source, unit)
        yield [replace(piece, step=number, lap=lap) for piece in of_step]


def _as_film_step(step: ElectricalStep) -> FilmStep:
    """A step of the electrodes alone as one of edges and electrodes."""
    if isinstance(step, FilmStep):
        return step
    voltage, charge = (step.voltage, None) if isinstance(step, VoltageStep) else (None, step.charge)
    return FilmStep(voltage=voltage, charge=charge, rate=step.rate, duration=step.duration)


def _pieces_of_film(
    step: FilmStep, mode: Mode, controls: Controls, source: Floats, unit: Floats
) -> tuple[list[Piece], Controls, Floats]:
    """The pieces of a step after edges under these `controls` and a last voltage `source` (cases,) in V, and both after it."""
    cases = unit.size
    drive, electrodes = _electrodes(step)
    closing: list[Piece] = []
    if step.circuit == "closed" and electrodes is None:  # a switch, on a source at its last voltage
        closing = [Line.to(controls, (None, None, source / unit), np.zeros(cases), drive=drive)]
    edges: list[ArrayLike | Path | None] = [None, None]
    paced: Control | Drive = drive or Drive.VOLTAGE
    if step.edges is not None:
        if Control.NEITHER in controls:
            raise InputError("a frame or the bars of a strip hold the film: its edges cannot be moved", argument=_stated(step)[0])
        paced = Control.STRESS if step.stretch is None else Control.STRETCH
        aims = _targets(step, paced, mode, LATERAL_OF_FILMS)
        controls, edges = (aims[0][0], aims[1][0]), [aims[0][1], aims[1][1]]
        for control, value in aims:
            if value is not None:
                _check_edge(control, value)
    rows = *edges, electrodes
    scale = np.ones_like(unit) if drive is Drive.CHARGE else unit
    if drive is Drive.VOLTAGE and electrodes is not None:
        source = spread(electrodes.last if isinstance(electrodes, Path) else electrodes, "voltage", cases)
    if any(isinstance(row, Path) for row in rows):
        _check_paths(step, rows)
        # beside waveforms of the edges the electrodes go straight to their target, and the reverse
        waved = [any(isinstance(row, Path) for row in of) for of in (rows[:ELECTRIC], rows[ELECTRIC:])]
        straight = (not waved[0], not waved[0], not waved[1])
        along = _along(rows, controls, cases, scale, spread(step.phase, "phase", cases), straight)
        return [*closing, *(replace(piece, drive=drive) for piece in along)], controls, source
    if step.edges is None and step.electrodes is None and (step.rate is not None or step.duration is step.circuit is None):
        raise InputError("a stretch, a stress, a voltage, a charge, a circuit, or the duration of a hold is needed")
    lasts, rate = _pace(step, cases, "target")
    if rate is not None and isinstance(paced, Drive):
        rate = rate / scale
    first, second, third = (None if row is None or isinstance(row, Path) else spread(row, "step", cases) for row in rows)
    target = first, second, None if third is None else third / scale
    return [*closing, Line.to(controls, target, lasts, rate, paced, drive)], controls, source


def _stated(step: FilmStep) -> list[str]:
    """What a step prescribes of edges and electrodes, by argument."""
    return [name for name in ("stretch", "stress", "voltage", "charge", "circuit") if getattr(step, name) is not None]


def _electrodes(step: FilmStep) -> tuple[Drive | None, ArrayLike | Path | None]:
    """The drive of the electrodes in a step, None for the present one, and their target, None if it stays as it is."""
    if step.circuit not in (None, "open", "closed"):
        raise InputError(f'{shown(step.circuit)}: "open" or "closed" is needed', argument="circuit")
    if step.voltage is not None and step.charge is not None:
        raise InputError("a voltage or a charge is needed, not both", argument="charge")
    if step.circuit == "closed" and step.charge is not None:
        raise InputError("a closed circuit has the voltage of its source: state a voltage, or leave circuit out", argument="charge")
    if step.circuit == "open" and step.electrodes is not None:
        quantity = "voltage" if step.charge is None else "charge"
        raise InputError(f"an open circuit keeps its charge: leave out the {quantity}, or circuit", argument=quantity)
    if step.voltage is not None:
        return Drive.VOLTAGE, step.voltage
    if step.charge is not None or step.circuit == "open":
        return Drive.CHARGE, step.charge
    return (Drive.VOLTAGE if step.circuit == "closed" else None), None


def _check_edge(control: Control, value: ArrayLike | Path) -> None:
    """`InputError` for a stretch that is not positive, and for a stress that a film cannot bear."""
    values = value.values() if isinstance(value, Path) else numbers(value, control.value)
    if isinstance(value, Track):
        values = values * float(np.min(value.scale))
    _check_stretch(control, values)
    if control is Control.STRESS and np.any(values < 0):
        raise InputError(f"{float(values.min()):g} Pa: a film bears no compression; at least 0 is needed", argument="stress")


def _check_paths(step: FilmStep, rows: Sequence[ArrayLike | Path | None]) -> None:
    """`InputError` for paths that do not run together."""
    if step.rate is not None or step.duration is not None:
        raise InputError("a waveform or a track states its times itself: leave out rate and duration")
    paths = [row for row in rows if isinstance(row, Path)]
    alone = step.electrodes if any(isinstance(row, Path) for row in rows[:ELECTRIC]) else step.edges
    single = alone is not None and not any(isinstance(row, Path) for row in (alone if isinstance(alone, tuple) else (alone,)))
    if single and any(isinstance(row, Track) for row in paths):
        raise InputError("a track goes with a track: the other quantity needs one, or is left out")
    for first, other in pairwise(paths):
        if isinstance(first, Waveform) and isinstance(other, Waveform):
            alike = (first.shape, first.cycles) == (other.shape, other.cycles) and np.array_equal(first.period, other.period)
        else:
            alike = isinstance(first, Track) and isinstance(other, Track) and np.array_equal(first.time, other.time)
        if not alike:
            raise InputError(
                "edges and electrodes need waveforms of one shape, period and number of cycles, or tracks of equal times"
            )


def _hold(step: Step | ElectricalStep, controls: Controls, cases: int, needed: str) -> list[Piece]:
    """A step without a target, in which the load stays as it is; `needed` is what else a step may prescribe."""
    if step.duration is None or step.rate is not None:
        raise InputError(f"{needed}, or the duration of a hold is needed")
    return [Line.to(controls, (None, None, None), _lasts(step.duration, cases))]


def _along(
    rows: Sequence[ArrayLike | Path | None],
    controls: Controls,
    cases: int,
    unit: ArrayLike = 1.0,
    phase: Floats | None = None,
    straight: tuple[bool, bool, bool] = (False, False, False),
) -> list[Piece]:
    """A step that follows paths: `rows` of its load follow a path, are constant, or stay as they are (None).

    The electrical row is divided by `unit`; its waveform is ahead by the `phase` (cases,) in rad. Beside a waveform, the rows that
    go `straight` reach their value at its end. A ramp leads to the first point of a track whose time is later than the beginning of
    the step.
    """
    path = next(row for row in rows if isinstance(row, Path))
    factors = [np.ones(cases), np.ones(cases), np.broadcast_to(1 / np.asarray(unit), cases)]
    if isinstance(path, Waveform):
        low, high, aim = np.full((3, 3, cases), np.nan)
        for index, row in enumerate(rows):
            if isinstance(row, Waveform):
                low[index], high[index] = (spread(end, "waveform", cases) * factors[index] for end in (row.low, row.high))
            elif row is not None:
                assert not isinstance(row, Track)
                value = spread(row, "step", cases) * factors[index]
                if straight[index]:
                    aim[index] = value
                else:
                    low[index] = high[index] = value
        lead = None
        if phase is not None and phase.any():
            lead = np.zeros((3, cases))
            lead[ELECTRIC] = phase / (2 * np.pi)
        return [Cycles.of(controls, low, high, path, lead, None if np.isnan(aim).all() else aim)]
    time, value = np.asarray(path.time, dtype=float), np.tile(path.values()[:, None], 3)
    base, scale = np.full((3, cases), np.nan), np.zeros((3, cases))
    for index, row in enumerate(rows):
        if isinstance(row, Track):
            base[index], scale[index] = 0.0, factors[index] * spread(row.scale, "scale", cases)
            value[:, index] = row.values()
        elif row is not None:
            assert not isinstance(row, Waveform)
            base[index] = spread(row, "step", cases) * factors[index]
    chain = Chain.of(controls, base, scale, time - time[0], value)
    ramp = Line(controls, np.full_like(base, np.nan), chain.start, np.full(cases, time[0]))
    if time.size == 1:
        return [ramp]
    return [ramp, chain] if time[0] > 0 else [chain]


def _targets(step: Step | FilmStep, paced: Control, mode: Mode, lateral: Mapping[Mode, Target]) -> Sequence[Target]:
    """Control and target of both axes; `paced` is the control to which a rate refers, `lateral` what a mode prescribes along
    axis 2.
    """
    stated = {Control.STRETCH: step.stretch, Control.STRESS: step.stress}
    if any(isinstance(value, tuple) for value in stated.values()):
        targets: list[Target] = []
        for axis in range(2):
            stated_here = [(control, pair[axis]) for control, pair in stated.items() if isinstance(pair, tuple)]
            prescribed = [(control, value) for control, value in stated_here if value is not None]
            if len(prescribed) != 1:
                raise InputError(f"axis {axis + 1} needs either a stretch or a stress")
            targets.append(prescribed[0])
        return targets
    if step.stretch is not None and step.stress is not None:
        raise InputError("a stretch or a stress is needed, not both")
    first = paced, stated[paced]
    return first, lateral.get(mode, first)


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


def duration_of(pieces: Sequence[Piece], cases: int, begin: Sequence[Mapping[Control, Floats]] | None = None) -> Floats:
    """The duration (cases,) in s of a history that begins at rest; NaN where it depends on how the films respond, as for a rate of
    the stress after a prescribed stretch. Raises `InputError` for a rate of the wrong sign.

    `begin` has what is known of both axes at the beginning, by default that they are at rest.
    """
    at_rest = {Control.STRETCH: np.ones(cases), Control.STRESS: np.zeros(cases)}
    known, field, total = list(begin or (at_rest, at_rest)), np.zeros(cases), np.zeros(cases)
    unknown, drive = np.full(cases, np.nan), Drive.VOLTAGE
    for piece in pieces:
        if piece.drive not in (None, drive):
            field, drive = unknown, piece.drive or drive
        present = [axis.get(control, unknown) for axis, control in zip(known, piece.controls, strict=True)]
        begun = piece.begin(np.array([*present, field]))
        total = total + begun.duration
        *ends, field = begun.end
        known = [{control: end} for control, end in zip(piece.controls, ends, strict=True)]
    return total
