"""Films under a rising voltage: the voltage at which each of them reaches given stretches.

All films, of all tests and all materials, are simulated together under ramps. Where the stretch passes a wanted one, the time, and
so the voltage, is located on the dense output of the stepper; a film ends at its last wanted stretch. Near runaway a small change
of the voltage changes the stretch without limit, while the voltage at a stretch stays well-conditioned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dielast.material.material import Material
from dielast.material.springs import EQUIBIAXIAL
from dielast.mechanics.equations import Films, films_of
from dielast.mechanics.film import FilmState
from dielast.mechanics.line import Line
from dielast.mechanics.passive.forms import disc, strip
from dielast.mechanics.point_material import PointMaterial
from dielast.mechanics.span import Controls
from dielast.numerics.arrays import Cases, Flags, Floats, paired
from dielast.numerics.integrate import Status
from dielast.numerics.roots import fall
from dielast.numerics.stride import TriedStep
from dielast.simulate.film_setup import ByAxis, out_of_reach
from dielast.simulate.follow import follow
from dielast.simulate.setup import prestretched

BEYOND = 4.0  # end of the ramp over the largest measured voltage; a film that has not moved far enough by then is far too stiff
POINTS = 7  # in the passive part of a disc


@dataclass(frozen=True, slots=True, eq=False)
class Ramps:
    """Films of any number of cases: `thickness` in m, `prestretch` of both axes, None for a free axis, reached within `ramp` s and
    held for `relax` s; `weight_stress` is the nominal stress in Pa of a weight on each axis, or None. The voltage then rises at
    `rate` in V/s, up to `BEYOND` times the largest measured `voltage`. `share` is that of the electrode of films with a passive
    part. Arrays are (cases,).

    The excursion of a film is ln of its relative stretch along axis 1, or of its area over that at rest, by `both` (cases,); the
    voltage is wanted where it has the values `wanted` (cases, m), ascending and padded with infinity. Of films in `total` (cases,)
    these are ln of the whole stretch.
    """

    controls: Controls
    thickness: Floats
    prestretch: ByAxis
    ramp: Floats
    relax: Floats
    weight_stress: ByAxis
    share: Floats | None
    temperature: Floats
    rate: Floats
    voltage: Floats
    wanted: Floats
    total: Flags
    both: Flags
    is_disc: bool = False


@dataclass(slots=True, eq=False)
class Crossings:
    """An observer of the stepper that stores the `time` (cases, m) at which the excursion from `rest` (cases,) passes each of the
    `wanted` (cases, m), and stops a case after the last one.
    """

    rest: Floats
    wanted: Floats
    both: Flags
    time: Floats = field(init=False)
    passed: Cases = field(init=False)
    last: Cases = field(init=False)
    electric: ClassVar = None

    def __post_init__(self) -> None:
        self.time = np.full(self.wanted.shape, np.nan)
        self.last = np.sum(np.isfinite(self.wanted), axis=1)
        self.passed = np.zeros_like(self.last)

    def begin(self, *piece: object, **last: object) -> None:
        """Nothing to do before a piece of load."""

    def __call__(self, stride: TriedStep) -> Flags | None:
        """Locate the wanted excursions within the step."""
        system, cases = films_of(stride), stride.cases
        reached = self.excursion(system, stride.after, stride.until, cases)
        ahead = np.append(self.wanted, np.full((len(self.wanted), 1), np.inf), axis=1)[cases, self.passed[cases]]
        due = np.flatnonzero(stride.accepted & (reached >= ahead))
        if due.size:
            place = np.arange(self.wanted.shape[1])
            within = (place >= self.passed[cases[due], None]) & (self.wanted[cases[due]] <= reached[due, None])
            row, goal = np.nonzero(within)
            column = due[row]
            border, wanted, twice = slice(system.border, None), self.wanted[cases[column], goal], paired(np.arange(column.size))

            def left(fraction: Floats) -> Floats:
                state = stride.dense(border, column[twice], fraction[twice])[:, : column.size]
                at = stride.time[column] + fraction * stride.step[column]
                return wanted - self.excursion(system, state, at, cases[column], column)

            fraction = fall(left, np.zeros(column.size), np.ones(column.size))
            self.time[cases[column], goal] = stride.begin[column] + stride.time[column] + fraction * stride.step[column]
            self.passed[cases[due]] += np.sum(within, axis=1)
        return self.passed[cases] >= self.last[cases]

    def excursion(self, system: Films, state: Floats, time: Floats, cases: Cases, columns: Cases | None = None) -> Floats:
        """The excursion (k,) in a `state` (rows, k) at `time` (k,) since the span began."""
        log_squared, _ = system.membrane(state, system.driven(time, state, columns))
        return self._excursion(log_squared, cases)

    def _excursion(self, log_squared: Floats, cases: Cases) -> Floats:
        return np.asarray(0.5 * (log_squared[0] + np.where(self.both[cases], log_squared[1], 0.0)) - self.rest[cases])


def voltages(materials: Sequence[Material], films: Ramps, rtol: float) -> Floats:
    """The voltage (cases, m) at which a film of each of the `materials`, one for each case, has the wanted excursions.

    NaN for a film that cannot be prestretched. Beyond the end of a ramp that was too low, the voltage goes on with the square root
    of the excursion, as at small strain; beyond a runaway it is that of the runaway. A wanted excursion below 0, as by an error of
    measurement, has the voltage of that above 0 with a minus sign.
    """
    points = PointMaterial.of(materials, films.temperature, rtol)
    held = [axis for axis in films.prestretch if axis is not None]
    found = np.full(films.wanted.shape, np.nan)
    possible = np.flatnonzero(~out_of_reach(points, held, films.ramp == 0)[0])
    first, second = films.prestretch
    alike = np.zeros(films.rate.size, dtype=bool)
    if first is not None and second is not None and films.controls[0] is films.controls[1]:
        alike = np.asarray(first == second)
    groups = (possible,) if films.share is not None else (possible[alike[possible]], possible[~alike[possible]])
    for part in groups:
        if part.size:
            pair = paired(part)
            found[pair] = _group(points.take(pair), films, pair, bool(alike[pair].all()), rtol)
    return found


def _group(points: PointMaterial, films: Ramps, part: Cases, alike: bool, rtol: float) -> Floats:
    """The voltages (k, m) of the films `part` (k,), which have the same form."""

    def of(values: ByAxis) -> ByAxis:
        first, second = (None if axis is None else axis[part] for axis in values)
        return first, second

    prestretch = of(films.prestretch)
    film, status = prestretched(
        FilmState.at_rest(points, EQUIBIAXIAL if alike else None),
        prestretch,
        films.ramp[part],
        films.relax[part],
        rtol,
        of(films.weight_stress),
    )
    if films.share is not None:
        first, second = prestretch
        assert first is not None
        assert second is not None
        share = films.share[part]
        film = film.framed(disc(share, first, POINTS) if films.is_disc else strip(share, first, second))
    both, wanted = films.both[part], films.wanted[part]
    at_rest = 0.5 * (film.log_squared_stretch[0] + np.where(both, film.log_squared_stretch[1], 0.0))
    wanted = np.where(films.total[part, None], wanted - at_rest[:, None], wanted)
    size = np.sort(np.abs(wanted), axis=1)
    order = np.argsort(np.abs(wanted), axis=1, kind="stable")
    rate, end = films.rate[part], BEYOND * films.voltage[part]
    crossings = Crossings(at_rest, size, both)
    ramp = Line.to(films.controls, (None, None, end / films.thickness[part]), end / rate)
    followed = follow(film, [ramp], rtol=rtol, recorders=[crossings])  # type: ignore[list-item]
    reached = crossings._excursion(followed.film.log_squared_stretch, np.arange(part.size))
    voltage = rate[:, None] * crossings.time
    with np.errstate(invalid="ignore", divide="ignore"):
        beyond = (rate * followed.time)[:, None] * np.where(
            (followed.status == Status.COMPLETED)[:, None], np.sqrt(np.where(reached > 0, size.T / reached, np.nan).T), 1.0
        )
    voltage = np.where(np.isfinite(voltage), voltage, beyond)
    placed = np.empty_like(voltage)
    np.put_along_axis(placed, order, voltage, axis=1)
    return np.where((status == Status.COMPLETED)[:, None] & np.isfinite(wanted), np.copysign(placed, wanted), np.nan)
