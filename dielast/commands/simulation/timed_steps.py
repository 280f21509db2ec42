"""The steps of one case in time: when each begins, what it prescribes, and the laps in which steps run again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import fsum
from typing import Any, NamedTuple, overload

import numpy as np

from dielast.mechanics.load import ElectricalStep, FilmStep, Path, Repeat, Step, Track, Waveform

SolverStep = Step | ElectricalStep


@dataclass(frozen=True, slots=True, eq=False)
class TimedStep:
    """A `step` of the solver in the history of one case, and the `number` (from 0) of the recipe's step that it comes from.

    It begins at the time `begin` in s, with the prescribed value `before`.
    """

    step: SolverStep
    number: int
    begin: float
    before: float
    edges: tuple[float, float] = (1.0, 1.0)
    """The stretch of the edges before a step that moves them, NaN where it is not known."""

    @property
    def driven(self) -> Any:
        """The quantity that it goes to or follows, None in a hold: of a programme of edges and electrodes, the voltage."""
        return self.step.voltage if isinstance(self.step, FilmStep) else self.step.target

    @property
    def stretched(self) -> tuple[float, float]:
        """The stretch of the edges at its end, NaN where it is not known."""
        if not isinstance(self.step, FilmStep) or self.step.edges is None:
            return self.edges
        pair = self.step.stretch if isinstance(self.step.stretch, tuple) else (self.step.stretch,) * 2
        first, second = (np.nan if value is None else _number(value.last if isinstance(value, Path) else value) for value in pair)
        return first, second

    @property
    def lasts(self) -> float:
        """The duration in s; 0 at a rate of 0, which the solver refuses."""
        target, rate, duration = self.step.target, self.step.rate, self.step.duration
        if isinstance(self.step, FilmStep) and target is not None:
            path = next((value for value in _flat(self.step.edges, self.step.electrodes) if isinstance(value, Path)), None)
            if path is None and rate is not None and self.step.stretch is not None:
                moves = [abs(end - begin) for begin, end in zip(self.edges, self.stretched, strict=True)]
                return float(np.nanmax([*moves, 0.0])) / abs(_number(rate)) if rate != 0 else 0.0
            target = path or target
        if isinstance(target, Path):
            return target.duration
        if rate is None:
            return 0.0 if duration is None else _number(duration)
        return abs((_number(target) - self.before) / _number(rate)) if target is not None and rate != 0 else 0.0

    @property
    def end(self) -> float:
        """The time in s at which the step ends."""
        return self.begin + self.lasts

    @property
    def after(self) -> float:
        """The prescribed value at the end."""
        target = self.driven
        return self.before if target is None else _number(target.last if isinstance(target, Path) else target)

    @property
    def corners(self) -> list[tuple[float, float]]:
        """The values that it reaches in turn (for a waveform, in its first cycle), and the time to each value in s."""
        target = self.driven
        if isinstance(target, Track):
            return list(zip(target.values().tolist(), np.diff(np.asarray(target.time), prepend=0.0).tolist(), strict=True))
        if isinstance(target, Waveform):
            low, half = self.after, 0.5 * _number(target.period)
            turns = [(low, 0.0), (_number(target.high), half), (low, half)]
            return turns if target.cycles == 1 else [*turns, (low, 2 * half * (target.cycles - 1))]
        return [(self.after, self.lasts)]

    @property
    def shape(self) -> tuple[Any, ...]:
        """The properties that steps must share to be solved together.

        Those that change the load and those that do not are never solved together, so that no result depends on the other cases.
        """
        target, step = self.driven, self.step
        path = _shape_of(target)
        still = path is None and self.after == self.before
        shape = target is None, step.rate is None, step.duration is None, step.duration == 0, still, path
        if not isinstance(step, FilmStep):
            return shape
        edges = step.edges if isinstance(step.edges, tuple) else (step.edges,)
        named = step.circuit, step.stretch is None, step.charge is None, self.edges == self.stretched, not step.phase
        alike = edges[0] == edges[-1] or isinstance(edges[0], Path)
        return *shape, named, len(edges), alike, *((edge is None, _shape_of(edge)) for edge in (*edges, step.charge))


def _shape_of(path: Any) -> tuple[Any, ...] | None:
    """The properties of a path that those of other cases must have to be solved together; None for another value."""
    if isinstance(path, Waveform):
        return path.shape, path.cycles
    return (np.asarray(path.time).tobytes(), np.asarray(path.value).tobytes()) if isinstance(path, Track) else None


def _flat(*values: Any) -> list[Any]:
    """The values, with those of pairs in their place."""
    return [entry for value in values for entry in (value if isinstance(value, tuple) else (value,))]


def joined(steps: Sequence[SolverStep]) -> SolverStep:
    """The same step of several cases as one whose values are arrays (cases,); a step that all of them share as it is."""
    first = steps[0]
    if all(step is first for step in steps):
        return first

    def of_cases(values: Sequence[Any]) -> Any:
        path = values[0]
        if path is None or isinstance(path, Track | str):
            return path
        if isinstance(path, tuple):
            return tuple(of_cases(axis) for axis in zip(*values, strict=True))
        if isinstance(path, Waveform):
            low, high, period = ([getattr(wave, name) for wave in values] for name in ("low", "high", "period"))
            return Waveform(low, high, period, path.cycles, path.shape)
        return np.array(values)

    return type(first)(*(of_cases([getattr(step, name) for step in steps]) for name in first.__match_args__))


class Run(NamedTuple):
    """A run of the step at a `place` among those of a case, in s; its `lap` counts from 1, and is 0 outside of the cycle."""

    step: TimedStep
    place: int
    lap: int
    lasts: float


@dataclass(frozen=True, slots=True, eq=False)
class TimedSteps(Sequence[TimedStep]):
    """The steps of a case in their order, of which some may `repeat`."""

    steps: Sequence[TimedStep]
    repeat: Repeat | None = None

    @overload
    def __getitem__(self, place: int) -> TimedStep: ...

    @overload
    def __getitem__(self, place: slice) -> Sequence[TimedStep]: ...

    def __getitem__(self, place: int | slice) -> TimedStep | Sequence[TimedStep]:
        return self.steps[place]

    def __len__(self) -> int:
        return len(self.steps)

    def runs(self) -> Iterator[Run]:
        """Every run of every step; those of a later lap than the first begin where the cycle ends."""
        count = len(self.steps)
        order = [(place, 0) for place in range(count)] if self.repeat is None else self.repeat.expanded(count)
        known, last = dict[tuple[int, int], tuple[TimedStep, float]](), self.steps[0]
        for place, lap in order:
            if (found := known.get((place, min(lap, 2)))) is None:
                step = self.steps[place]
                if lap > 1:
                    step = replace(step, before=last.after, edges=last.stretched)
                found = known[place, min(lap, 2)] = step, step.lasts
                last = step
            yield Run(found[0], place, lap, found[1])

    @property
    def end(self) -> float:
        """The time in s at which the last of them ends, all laps included."""
        return self.steps[-1].end if self.repeat is None else fsum(run.lasts for run in self.runs())

    @property
    def targets(self) -> list[float]:
        """All values that they prescribe."""
        return [value for timed in self.steps if timed.step.target is not None for value, _ in timed.corners]

    @property
    def reached_at_once(self) -> float:
        """The largest magnitude that the first of them reach in no time."""
        largest = 0.0
        for timed in self.steps:
            for value, lasts in timed.corners:
                if lasts > 0:
                    return largest
                largest = max(largest, abs(value))
        return largest


def _number(value: Any) -> float:
    """The value of a step of one case."""
    return float(np.asarray(value))
