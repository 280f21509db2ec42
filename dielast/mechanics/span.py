"""One smooth span of load in each case, with value and rate in closed form.

Rows are the stretch or nominal stress of axis 1 and of axis 2, and the electrical quantity that the source prescribes: the nominal
field V/L_3 in V/m, or the nominal charge density in C/m^2.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Self

import numpy as np

from dielast.numerics.arrays import ByCase, Cases, Flags, Floats


class Control(Enum):
    """What a load prescribes along one axis."""

    STRETCH = "stretch"
    STRESS = "stress"
    NEITHER = "neither"  # the active part within a passive part: both its stretch and its stress are unknowns


Controls = tuple[Control, Control]


def stretch_prescribed(controls: Controls) -> Flags:
    """Mask (2, 1) of the axes whose stretch is prescribed."""
    return np.array([[control is Control.STRETCH] for control in controls])


@dataclass(frozen=True, slots=True, eq=False)
class Wave(ByCase):
    """swing (cos(angle) - cos(angle + pace t)) with `swing` (3, cases), `angle` in rad and `pace` in rad/s (cases,)."""

    swing: Floats
    angle: Floats
    pace: Floats

    def value(self, time: Floats) -> Floats:
        """Values (3, cases) at `time` (cases,) in s."""
        half = 0.5 * self.pace * time
        return np.asarray(self.swing * (2 * np.sin(self.angle + half) * np.sin(half)))

    def slope(self, time: Floats) -> Floats:
        """Rates (3, cases) at `time` (cases,) in s, per s."""
        return np.asarray(self.swing * (self.pace * np.sin(self.angle + self.pace * time)))

    def bend(self, time: Floats) -> Floats:
        """Second derivatives (3, cases) at `time` (cases,) in s, per s^2."""
        return np.asarray(self.swing * (np.square(self.pace) * np.cos(self.angle + self.pace * time)))


@dataclass(frozen=True, slots=True, eq=False)
class Load(ByCase):
    """A straight line start + rate t in each case, `start` and `rate` (3, cases), plus a `wave` if there is one.

    `moving` (cases,) marks cases whose load varies; `still` says that no load varies, `electric` that there is a Maxwell stress.
    """

    controls: Controls
    start: Floats
    rate: Floats
    wave: Wave | None = None
    moving: Flags = field(init=False)
    still: bool = field(init=False)
    electric: bool = field(init=False)

    def __post_init__(self) -> None:
        moves = self.rate != 0
        if self.wave is not None:
            moves = moves | (self.wave.swing != 0)
        object.__setattr__(self, "moving", moves.any(axis=0))
        object.__setattr__(self, "still", not self.moving.any())
        object.__setattr__(self, "electric", bool(np.any(self.start[2]) or np.any(moves[2])))

    @classmethod
    def between(cls, controls: Controls, start: Floats, end: Floats, duration: Floats) -> Load:
        """The straight line from `start` to `end` (3, cases) within `duration` (cases,); constant where the duration is 0."""
        rate = np.where(duration > 0, end - start, 0.0) / np.where(duration > 0, duration, 1.0)
        return cls(controls, start, np.asarray(rate))

    def put(self, columns: Cases, other: Load) -> Load:
        """This load, with its `columns` (k,) replaced by those of `other`, a load of k cases."""
        count = self.start.shape[1]
        if columns.size == count:
            return other
        source = np.arange(count)
        source[columns] = count + np.arange(columns.size)
        return Load.joined([self, other]).take(source)

    def value(self, time: Floats, cases: Cases | None = None) -> Floats:
        """Prescribed values (3, k) of `cases` (k,), by default of all, at `time` (k,) in s since the span began."""
        start, rate = (self.start, self.rate) if cases is None else (self.start[:, cases], self.rate[:, cases])
        if self.still:
            return start
        line = start + rate * time
        if self.wave is None:
            return line
        return line + (self.wave if cases is None else self.wave.take(cases)).value(time)

    def values(self, times: Floats) -> Floats:
        """Prescribed values (k, 3, cases) at `times` (k, cases) in s since the span began."""
        return self.start[None].repeat(len(times), axis=0) if self.still else self.value(times[:, None])

    def slope(self, time: Floats) -> Floats:
        """The rates (3, cases) of the prescribed values, per s, at `time` (cases,) in s since the span began."""
        return self.rate if self.wave is None else self.rate + self.wave.slope(time)

    def slopes(self, times: Floats) -> Floats:
        """The rates (k, 3, cases) of the prescribed values, per s, at `times` (k, cases) in s since the span began."""
        return self.rate[None].repeat(len(times), axis=0) if self.wave is None else self.slope(times[:, None])

    def bend(self, time: Floats) -> Floats:
        """The second derivatives (3, cases) of the prescribed values, per s^2, at `time` (cases,) in s since the span began."""
        return np.zeros_like(self.rate) if self.wave is None else self.wave.bend(time)


class UnderLoad(ByCase):
    """Common to all forms of films: frozen dataclasses with a `load`, which is one smooth span of load in each case."""

    __slots__ = ()

    load: Load

    @property
    def electric(self) -> bool:
        """Whether there may be a Maxwell stress."""
        return self.load.electric

    def driven(self, time: Floats, state: Floats, cases: Cases | None = None) -> Floats:
        """The prescribed values (3, k) of `cases` (k,), by default of all, at `time` (k,) in s since the span of load began, in the
        `state` (rows, k).
        """
        return self.load.value(time, cases)

    def driven_by(self, columns: Cases, load: Load) -> Self:
        """These films, with another span of load in `columns` (k,)."""
        return replace(self, load=self.load.put(columns, load))  # type: ignore[type-var]
