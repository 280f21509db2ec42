"""The films of maps and designs, relaxed once for the material and once for every draw, and their lives under constant voltages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from dielast.base.errors import InputError, in_a_draw
from dielast.material.breakdown import BreakdownLaw
from dielast.material.material import Material
from dielast.mechanics.criteria import CRITERIA, failures_of
from dielast.mechanics.criteria.criterion import Criterion, WatchedFilms
from dielast.mechanics.film import FilmState
from dielast.mechanics.line import Line
from dielast.mechanics.span import Controls
from dielast.mechanics.stability import TimeScale
from dielast.mechanics.watch import EventArrays, Watch
from dielast.numerics.arrays import ByCase, Cases, Floats, paired
from dielast.simulate.film_setup import Film, OfAxes, reachable
from dielast.simulate.follow import follow
from dielast.simulate.options import Failure, Solver
from dielast.simulate.output import Output
from dielast.simulate.recorder import Recorder
from dielast.simulate.setup import Setup, set_up

if TYPE_CHECKING:
    from dielast.material.scatter import Sample

DRAWN_RTOL = 5e-4  # default for draws; times are then accurate to 0.1 %, usually far less than the differences between draws


@dataclass(frozen=True, slots=True, eq=False)
class FilmEvents:
    """The events that `happened` to films (k,), their `Status`, and their relative stretches.

    `stretched` (2, times, k) are the relative stretches at the requested times, over those when the voltage is applied; NaN for
    times that a film does not reach.
    """

    happened: Mapping[Criterion, EventArrays]
    status: Cases
    stretched: Floats
    begin: Floats
    """The stretches (2, k) when the voltage is applied."""

    def relative_stretch(self, event: EventArrays) -> Floats:
        """The relative stretches (2, k) at an event."""
        return np.asarray(np.exp(0.5 * event.log_squared_stretch) / self.begin)


@dataclass(frozen=True, slots=True, eq=False)
class Group(ByCase):
    """Relaxed films that run together, one per column. `films` are their numbers in the grid: first the films of the material, then
    those of each draw. `rtol` is the tolerance of their solution.
    """

    film: FilmState
    films: Cases
    watched: WatchedFilms
    thickness: Floats
    rtol: float

    @classmethod
    def all_of(cls, setup: Setup, timescale: TimeScale, numbers: Cases, rtol: float) -> tuple[Self, ...]:
        """The films of a setup, with their `numbers` (films,) and this pull-in time scale."""
        groups = []
        for columns in setup.groups():
            films = np.flatnonzero(np.bincount(columns))  # np.unique would load numpy.ma, which is slow
            film = setup.film(columns, rtol)
            groups.append(cls(film, numbers[films], setup.watched(film, columns, timescale), setup.thickness[films], rtol))
        return tuple(groups)

    def lives(
        self,
        columns: Cases,
        voltage: Floats,
        *,
        horizon: float,
        ramp: float = 0.0,
        watched: Sequence[str],
        until: Sequence[str] = (),
        ends: Sequence[str] = (),
        times: Sequence[float] = (),
    ) -> FilmEvents:
        """Simulate `columns` (k,) under a `voltage` (k,) in V, which is reached within `ramp` s and held up to `horizon` s.

        `watched` names the criteria to evaluate. A film ends when all events in `until`, or any event in `ends`, have happened.
        """
        count, controls = columns.size, self.watched.controls
        columns, voltage = paired(columns), np.repeat(voltage, 2) if count == 1 else voltage
        film, field = self.film.take(columns), voltage / self.thickness[columns]
        watch = Watch(self.watched.take(columns), [criterion for criterion in CRITERIA if criterion.name in watched], until, ends)
        pieces = [Line.to(controls, (None, None, field), np.full(field.size, ramp))]
        if horizon > ramp:
            pieces.append(Line.to(controls, (None, None, None), np.full(field.size, horizon - ramp)))
        begin = np.exp(0.5 * film.log_squared_stretch)
        recorders = [Recorder(Output(np.broadcast_to(np.array(times), (field.size, len(times)))))] if len(times) else []
        followed = follow(film, pieces, rtol=self.rtol, watch=watch, recorders=recorders)
        watch, status = followed.watch or watch, followed.status
        stretched = np.zeros((2, 0, field.size))
        for recorder in followed.recorders:
            stretched = recorder.collect().stretch.transpose(0, 2, 1) / begin[:, None]
        happened = {criterion: entry.take(np.arange(count)) for criterion, entry in watch.happened.items()}
        return FilmEvents(happened, status[:count], stretched[..., :count], begin[:, :count])


@dataclass(frozen=True, slots=True, eq=False)
class FilmGrid:
    """Films in `groups`, relaxed: those of the material (films,), then those of each of the `draws` but for the films that lock
    below their prestretch in a draw; before that, their `setups`.

    Of the films of the material: `temperature` (films,) in degC, `prestretch` (films, 2), undeformed `thickness` (films,) in m,
    `electrode_share` (films,) if they have a passive part, and `breakdown_field` (films,) in V/m, infinite where none is known.
    `controls` are those of all films, `failures` are the names of the failures that can happen to them.
    """

    controls: Controls
    temperature: Floats
    prestretch: Floats
    thickness: Floats
    electrode_share: Floats | None
    breakdown_field: Floats
    failures: tuple[str, ...]
    timescale: TimeScale
    draws: int = 0
    groups: tuple[Group, ...] = ()
    setups: tuple[tuple[Setup, Cases, float], ...] = ()
    """As long as they are not relaxed, the films of the material, and those of all draws, with their numbers and the tolerance of
    their solution.
    """

    def relaxed(self) -> Self:
        """The same films, prestretched and relaxed. Raises `NumericsError` if the prestretch of a film cannot be computed."""
        groups = self.groups
        for of_draws, (setup, numbers, rtol) in enumerate(self.setups):
            with in_a_draw(argument="sample") if of_draws else nullcontext():
                groups += Group.all_of(setup, self.timescale, numbers, rtol)
        return replace(self, groups=groups, setups=())

    def chunks(self, size: int, cells: int = 1, drawn: bool | None = None) -> list[tuple[int, int]]:
        """First and end of chunks of at most `size` cells, each within one group. Every film has this number of `cells`, which are
        numbered through groups and films; with `drawn`, only those of the draws, or only those of the material.
        """
        result, first = [], 0
        for group in self.groups:
            end = first + cells * group.films.size
            if drawn is None or drawn == (group.films[0] >= self.breakdown_field.size):
                result += [(start, min(start + size, end)) for start in range(first, end, size)]
            first = end
        return result

    def cells_of(self, first: int, end: int, cells: int = 1) -> tuple[Group, Cases]:
        """The group of a chunk, and the numbers (k,) of the chunk's cells within the group."""
        begin = 0
        for group in self.groups:
            if first < begin + cells * group.films.size:
                break
            begin += cells * group.films.size
        return group, np.arange(first - begin, end - begin)


def axis_of(values: ArrayLike, name: str) -> Floats:
    """The values as an axis (n,) of a grid; `InputError` unless they are a list of finite numbers."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    if array.ndim != 1 or not array.size:
        raise InputError("a list of numbers, which is not empty, is needed", argument=name)
    if not np.all(np.isfinite(array)):
        raise InputError("every value must be finite", argument=name)
    return array


def prestretches_of(prestretch: OfAxes) -> Floats:
    """The prestretches (n, 2) of axes 1 and 2, from a list of numbers (equibiaxial) or of pairs."""
    pairs = np.asarray(prestretch, dtype=float)
    pairs = np.stack((pairs, pairs), axis=-1) if pairs.ndim < 2 else pairs
    pairs = pairs.reshape(-1, 2) if pairs.shape[-1] == 2 else pairs
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not pairs.size:
        raise InputError("a list of numbers or of pairs, which is not empty, is needed", argument="prestretch")
    return pairs


def lay_out(
    material: Material,
    film: Film,
    *,
    failure: Failure,
    solver: Solver,
    sample: Sample | None = None,
    copies: int = 1,
) -> FilmGrid:
    """Films of the material, not yet relaxed, for every combination of the axes temperature, thickness, prestretch and electrode
    share of the `film`, the last varying fastest, and `copies` of all of them.

    A breakdown field may be a number, or one for each prestretch. With a `sample`, also the films of its draws, solved to the
    `drawn_rtol` of the `solver`, by default a larger tolerance; the films of the material then have the area of those of the
    sample. Of several prestretches, a draw has the films whose springs reach them: that a film was prestretched rules out the
    draws that lock below. Raises `InputError` for invalid arguments.
    """
    if failure.stop_at is not None:
        raise InputError("maps and designs follow films up to all of their failures: leave it out", argument="stop_at")
    temperature = axis_of(material.reference_temperature if film.temperature is None else film.temperature, "temperature")
    pairs, thick = prestretches_of(film.prestretch), axis_of(film.thickness, "thickness")
    shares = None if film.electrode_share is None else axis_of(film.electrode_share, "electrode_share")
    sizes = temperature.size, thick.size, len(pairs), 1 if shares is None else shares.size, copies
    of_temperature, of_thickness, of_pair, of_share, _ = (index.ravel() for index in np.indices(sizes))
    temperature, prestretch, thickness = temperature[of_temperature], pairs[of_pair], thick[of_thickness]
    share = None if shares is None else shares[of_share]
    breakdown_field = failure.breakdown_field
    if breakdown_field is not None and not isinstance(breakdown_field, BreakdownLaw):
        fields = np.asarray(breakdown_field, dtype=float).reshape(-1)
        if fields.size not in (1, len(pairs)):
            text = f"{fields.size} fields for {len(pairs)} prestretches: one, or one for each is needed"
            raise InputError(text, argument="breakdown_field")
        breakdown_field = fields[of_pair] if fields.size > 1 else fields
    for axis, weight in enumerate(film.forces):
        if weight is not None and np.any(pairs[:, axis] != 1):
            stated = "this axis is stretched by its weight: state a prestretch of 1"
            raise InputError(f"axis {axis + 1}: {stated}", argument="prestretch")

    def of_all(
        materials: Sequence[Material], field: Floats | BreakdownLaw | None, thick: Floats, rtol: float, rows: Cases
    ) -> Setup:
        """The setup of the films `rows` of all materials, one material after another."""
        pair = np.tile(prestretch.T, len(materials))[:, rows]
        first, second = (axis if weight is None else None for axis, weight in zip(pair, film.forces, strict=True))
        every = [material for material in materials for _ in temperature] if len(materials) > 1 else list(materials)
        if field is not None and not isinstance(field, BreakdownLaw) and field.size > 1:
            field = field[rows]
        return set_up(
            every if len(every) == 1 else [every[row] for row in rows],
            replace(
                film,
                thickness=thick[rows],
                prestretch=(first, second),
                electrode_share=None if share is None else np.tile(share, len(materials))[rows],
                temperature=np.tile(temperature, len(materials))[rows],
            ),
            breakdown_field=field,
            solver=replace(solver, rtol=rtol),
        )

    central = material if sample is None else sample.typical(material)
    setup = of_all([central], breakdown_field, thickness, solver.rtol, np.arange(temperature.size))
    setups, draws = [(setup, np.arange(temperature.size), solver.rtol)], 0
    failures = failures_of([material, *(() if sample is None else sample.materials)])
    if sample is not None:
        films, draws = temperature.size, len(sample)
        field = breakdown_field
        if field is not None and not isinstance(field, BreakdownLaw):
            field = np.tile(setup.endurance.breakdown_field, draws)
        tolerance = solver.drawn_rtol or max(solver.rtol, DRAWN_RTOL)
        thick = np.tile(thickness, draws) * np.repeat(sample.thickness_factor, films)
        rows = np.arange(draws * films)
        if len(pairs) > 1 and all(force is None for force in film.forces):
            reached = reachable(sample.materials, prestretch, film.prestretch_rate is None)
            # where no draw reaches a prestretch, the first of them says so
            if not reached.all() and reached.any(axis=0).all():
                rows = np.flatnonzero(reached)
        with in_a_draw(argument="sample"):
            drawn = of_all(sample.aged(), field, thick, tolerance, rows)
            scaled = drawn.endurance.breakdown_field * np.repeat(sample.breakdown_factor, films)[rows]
            setups.append((replace(drawn, endurance=replace(drawn.endurance, breakdown_field=scaled)), films + rows, tolerance))
    field_of_films, films_of_grid = setup.endurance.breakdown_field, (temperature, prestretch, thickness, share)
    return FilmGrid(
        setup.controls, *films_of_grid, field_of_films, failures, failure.pull_in_timescale, draws, setups=tuple(setups)
    )
