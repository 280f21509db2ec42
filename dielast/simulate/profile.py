"""Stretches and stresses across a film with a passive part, at stated times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dielast.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.mechanics.passive.forms import Spread
from dielast.mechanics.passive.framed import FramedFilms, Surroundings
from dielast.mechanics.symmetric import Films
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.stride import Stride

UNITS = {
    **{"time": "s", "radius": "1", "stretch_1": "1", "stretch_2": "1"},
    **{"nominal_stress_1": "Pa", "nominal_stress_2": "Pa"},
}
"""The columns of a profile, with their units."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Profiles(TabularResult):
    """The columns (rows,) of each case by header, one time after another.

    The radius of a disc in a frame is over that of the electrode; for a strip, it is the place along the length over half the
    length of the electrode. The edge of the electrode appears twice, on its active and on its passive side. Axis 1 is the radius,
    or the length. Stresses are nominal and include the Maxwell stress.
    """

    cases: tuple[Mapping[str, Floats], ...]

    def columns(self) -> Table:
        """The table of all cases, one after another."""
        return profile_table(self.cases)


def profile_table(cases: Sequence[Mapping[str, Floats]]) -> Table:
    """The table of the profiles of all cases, one after another."""
    headers = [f"{name} [{unit}]" for name, unit in UNITS.items()]
    counts = [case[headers[0]].size for case in cases]
    values = [np.concatenate([case[header] for case in cases]) for header in headers]
    columns = [Column(name, unit, column) for (name, unit), column in zip(UNITS.items(), values, strict=True)]
    return [Column("case", None, np.repeat(np.arange(len(cases)), counts)), *columns]


def given_times(times: object) -> Floats | None:
    """Times of profiles as an array (k,); `InputError` unless they are finite, not negative and ascending."""
    if times is None:
        return None
    array = np.atleast_1d(np.asarray(times, dtype=float))
    if array.ndim != 1 or not array.size or not np.all(np.isfinite(array)) or array[0] < 0 or np.any(np.diff(array) <= 0):
        raise InputError("finite times that ascend from 0 are needed", argument="profile")
    return array


@dataclass(slots=True, eq=False)
class ProfileRecorder:
    """An observer of the stepper that stores profiles. `begin` is to be called before a piece of load.

    Profiles at times that a film does not reach are NaN.
    """

    times: Floats
    spread: Spread
    _values: Floats = field(init=False)
    """Stretches and nominal stresses (4, radii, cases, times)."""
    _start: Floats = field(init=False)

    def __post_init__(self) -> None:
        radii, cases = self.spread.radius.shape
        self._values = np.full((4, radii, cases, self.times.size), np.nan)
        self._start = np.zeros(cases)

    def begin(self, system: Films, state: Floats, start: Floats, alive: Flags) -> None:
        """Begin a piece of load at `start` (cases,) in s since the programme began."""
        self._start = start
        if self.times[0] == 0:
            first = paired(np.flatnonzero(alive & (start == 0)))
            if first.size:
                self._write(system.take(first), state[:, first], np.zeros(first.size), first, np.zeros(first.size, dtype=np.intp))

    def __call__(self, stride: Stride) -> None:
        """Store the profiles at times within the step."""
        begin = self._start[stride.cases] + stride.begin
        slack = 1e-12 * (begin + stride.until)  # a requested time may exceed the end by rounding
        for row, time in enumerate(self.times.tolist()):
            within = stride.accepted & (time > begin + stride.time) & (time <= begin + stride.until + slack)
            if within.any():
                columns = paired(np.flatnonzero(within))
                local = time - begin[columns]
                fraction = np.minimum((local - stride.time[columns]) / stride.step[columns], 1.0)
                state = stride.dense(slice(None), columns, fraction)
                assert isinstance(stride.system, Films)
                self._write(stride.system.take(columns), state, local, stride.cases[columns], np.full(columns.size, row))

    def _write(self, system: Films, state: Floats, local: Floats, cases: Cases, row: Cases) -> None:
        """Store the profiles of films at time `local` (k,) in s since their span began."""
        assert isinstance(system, FramedFilms)
        now = Surroundings(system.assembly, state[system.border :])
        stresses = now.stresses(system.internal(state), system.load.value(local)[2])
        at_points = np.concatenate((now.stretch(), stresses))
        self._values[:, :, cases, row] = np.einsum("rpc,apc->arc", self.spread.weight[..., cases], at_points)

    def collect(self, ends: Floats) -> list[Mapping[str, Floats]]:
        """The profiles of each case up to its end (cases,) in s."""
        radii = len(self.spread.radius)
        result: list[Mapping[str, Floats]] = []
        for case, end in enumerate(ends.tolist()):
            shown = np.isfinite(self._values[0, 0, case]) & (self.times <= end * (1 + 1e-12))
            columns = [
                np.repeat(self.times[shown], radii),
                np.tile(self.spread.radius[:, case], np.count_nonzero(shown)),
                *(values[:, case, shown].T.ravel() for values in self._values),
            ]
            result.append({f"{name} [{unit}]": column for (name, unit), column in zip(UNITS.items(), columns, strict=True)})
        return result
