"""Films simulated under a voltage programme, and the results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dielast.mechanics.course import Piece
from dielast.mechanics.criteria import CRITERIA, names
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.electric import CHARGE
from dielast.mechanics.point_material import Points
from dielast.mechanics.stability import TimeScale
from dielast.mechanics.watch import EventArrays, Watch
from dielast.numerics.arrays import Cases, Floats
from dielast.simulate.cycles import CycleMeter, CycleTable
from dielast.simulate.electrical import ElectricMeter, nominal
from dielast.simulate.events import first_of
from dielast.simulate.follow import follow
from dielast.simulate.profile import ProfileRecorder
from dielast.simulate.record import Record, Recorder
from dielast.simulate.setup import Setup
from dielast.simulate.wanted import Wanted
from dielast.simulate.wiring import Wiring


@dataclass(frozen=True, slots=True, eq=False)
class FilmRuns:
    """Results of films: the `record`; stretches and determinant at the beginning of the programme, `begin` (3, cases); the events
    that `happened`; the time `reached` in s, and the `Status`.

    Fields are nominal fields, also if the charge is prescribed. `extra` are the rows of `EXTRA` at the end of films that an event
    stopped, or no rows.
    """

    record: Record
    begin: Floats
    happened: Mapping[Criterion, EventArrays]
    reached: Floats
    status: Cases
    extra: Floats
    cycles: CycleTable | None = None
    profiler: ProfileRecorder | None = None

    @classmethod
    def joined(cls, runs: Sequence[FilmRuns], place: Cases) -> FilmRuns:
        """The cases of all runs, in the order given by their indices `place` (cases,) in the concatenated runs."""

        def joined_field(name: str) -> Any:
            return np.concatenate([getattr(run, name) for run in runs], axis=-1)[..., place]

        happened = {
            criterion: EventArrays.joined([run.happened[criterion] for run in runs]).take(place) for criterion in runs[0].happened
        }
        time = np.concatenate([run.record.time for run in runs])[place]
        values = np.concatenate([run.record.values for run in runs], axis=1)[:, place]
        record = replace(runs[0].record, time=time, values=values)
        return cls(record, joined_field("begin"), happened, joined_field("reached"), joined_field("status"), joined_field("extra"))


def run_films(
    setup: Setup,
    wiring: Wiring,
    part: Cases,
    timescale: TimeScale,
    stops: Sequence[str],
    pieces: Sequence[Piece],
    wanted: Wanted,
    electrical: bool,
    rtol: float,
    seen_at: Floats | None,
) -> FilmRuns:
    """Simulate the films `part` (k,), one of the groups of the setup, through their programme or until one of `stops` happens."""
    film = setup.film(part, rtol)
    film = replace(film, points=wiring.wired(film.points, part))
    watch = Watch(setup.watched(film, part, timescale), CRITERIA, (), stops)
    relaxed = film.moment(setup.controls, np.arange(part.size), np.zeros(part.size))
    stretch = np.exp(0.5 * relaxed.log_squared_stretch)
    leakage = wiring.leakage.take(part) if electrical else None
    electric = None if leakage is None else ElectricMeter(leakage, part.size)
    recorder = Recorder(wanted.take(part), part.size, film.points.rate.shape[0], watch, electric)
    meter = CycleMeter(film.points, stretch[0], False, leakage)
    begin = np.concatenate((stretch, watch.stability(relaxed).determinant[None]))
    profiler = None
    if seen_at is not None and setup.passive is not None:
        profiler = ProfileRecorder(seen_at, setup.passive.spread(part))
    followed = follow(film, pieces, rtol=rtol, watch=watch, recorder=recorder, meter=meter, profiler=profiler)
    record, happened = recorder.collect(), watch.happened
    extra = np.zeros((0, part.size))
    if electric is not None:
        last = first_of(happened, stops or names())
        extra = electric.ended(last.time)
        extra[0] = nominal(film.points, last.log_squared_stretch, last.field)[1]
    if film.points.electric is CHARGE:
        record, happened = _in_fields(film.points, record, happened)
    return FilmRuns(record, begin, happened, followed.time, followed.status, extra, meter.collect(), profiler)


def _in_fields(
    points: Points, record: Record, happened: Mapping[Criterion, EventArrays]
) -> tuple[Record, dict[Criterion, EventArrays]]:
    """Record and events of films under a charge, with the nominal field in place of the nominal charge density."""
    values, (cases, rows) = record.values.copy(), record.time.shape
    points_of_rows = points.take(np.repeat(np.arange(cases), rows))
    values[4] = nominal(points_of_rows, values[:2].reshape(2, -1), values[4].ravel())[0].reshape(cases, rows)
    return replace(record, values=values), {
        criterion: replace(entry, field=nominal(points, entry.log_squared_stretch, entry.field)[0])
        for criterion, entry in happened.items()
    }
