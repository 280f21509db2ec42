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
from dielast.numerics.columns import Cases, Flags, Floats, paired
from dielast.numerics.stride import Stride

UNITS = {
    **{"time": "s", "radius": "1", "stretch_1": "1", "stretch_2": "1"},
    **{"nominal_stress_1": "Pa", "nominal_stress_2": "Pa"},
}
"""Units of the columns of a profile."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Profiles(TabularResult):
    """Of each case the columns (rows,) by header, one time below the other: the radius over that of the electrode, of a disc in a
    frame; of a strip the place along its length, over half that of the electrode. The electrode's edge is there twice, as the
    active and as the passive part see it. Axis 1 is the radius, or the length; stresses are nominal, the Maxwell stress included.
    """

    cases: tuple[Mapping[str, Floats], ...]

    def columns(self) -> Table:
        """All cases, one below the other."""
        return profile_table(self.cases)


def profile_table(cases: Sequence[Mapping[str, Floats]]) -> Table:
    """The profiles of cases, one below the other."""
    headers = [f"{name} [{unit}]" for name, unit in UNITS.items()]
    counts = [case[headers[0]].size for case in cases]
    values = [np.concatenate([case[header] for case in cases]) for header in headers]
    columns = [Column(name, unit, column) for (name, unit), column in zip(UNITS.items(), values, strict=True)]
    return [Column("case", None, np.repeat(np.arange(len(cases)), counts)), *columns]


def given_times(times: object) -> Floats | None:
    """Times of profiles as an array (k,); `InputError` unless they are finite, not negative and ascend."""
    if times is None:
        return None
    array = np.atleast_1d(np.asarray(times, dtype=float))
    if array.ndim != 1 or not array.size or not np.all(np.isfinite(array)) or array[0] < 0 or np.any(np.diff(array) <= 0):
        raise InputError("finite times that ascend from 0 are needed", argument="profile")
    return array


@dataclass(slots=True, eq=False)
class ProfileRecorder:
    """Observes the stepper; between pieces of load, `begin` is called. What is never reached stays NaN."""

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
        """A piece of load begins at `start` (cases,) in s since the programme began."""
        self._start = start
        if self.times[0] == 0:
            first = paired(np.flatnonzero(alive & (start == 0)))
            if first.size:
                self._write(system.take(first), state[:, first], np.zeros(first.size), first, np.zeros(first.size, dtype=np.intp))

    def __call__(self, stride: Stride) -> None:
        """Write what lies within the step."""
        begin = self._start[stride.cases] + stride.begin
        slack = 1e-12 * (begin + stride.until)  # a time that was asked for may lie beyond the end by rounding
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
        """Write films at a time (k,) since their span began."""
        assert isinstance(system, FramedFilms)
        now = Surroundings(system.assembly, state[system.border :])
        stresses = now.stresses(system.internal(state), system.load.value(local)[2])
        everywhere = np.concatenate((now.stretch(), stresses))
        self._values[:, :, cases, row] = np.einsum("rpc,apc->arc", self.spread.weight[..., cases], everywhere)

    def collect(self, ends: Floats) -> list[Mapping[str, Floats]]:
        """The profiles of each case up to where it ended, in s (cases,)."""
        radii = len(self.spread.radius)
        result: list[Mapping[str, Floats]] = []
        for case, end in enumerate(ends.tolist()):
            there = np.isfinite(self._values[0, 0, case]) & (self.times <= end * (1 + 1e-12))
            columns = [
                np.repeat(self.times[there], radii),
                np.tile(self.spread.radius[:, case], np.count_nonzero(there)),
                *(values[:, case, there].T.ravel() for values in self._values),
            ]
            result.append({f"{name} [{unit}]": column for (name, unit), column in zip(UNITS.items(), columns, strict=True)})
        return result
