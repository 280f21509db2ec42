"""Films run through a voltage programme, and what is known of them then."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dielast.mechanics.course import Piece
from dielast.mechanics.criteria import CRITERIA, names
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.electric import CHARGE
from dielast.mechanics.event_arrays import EventArrays
from dielast.mechanics.point import Points
from dielast.mechanics.stability import TimeScale
from dielast.mechanics.watch import Watch
from dielast.numerics.columns import Cases, Floats
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
    """What some films did: the `record`, stretches and determinant at the `begin` (3, cases), what happened, how far they came in
    s, and their `Status`. Fields are nominal ones, whatever acts on the films; `extra` are the rows of `EXTRA` where films were
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
        """The runs of all cases, each of which is at its `place` (cases,) in the runs one after another."""

        def whole(name: str) -> Any:
            return np.concatenate([getattr(run, name) for run in runs], axis=-1)[..., place]

        happened = {
            criterion: EventArrays.joined([run.happened[criterion] for run in runs]).take(place) for criterion in runs[0].happened
        }
        time = np.concatenate([run.record.time for run in runs])[place]
        values = np.concatenate([run.record.values for run in runs], axis=1)[:, place]
        record = replace(runs[0].record, time=time, values=values)
        return cls(record, whole("begin"), happened, whole("reached"), whole("status"), whole("extra"))


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
    """Run some of the films, one of the setup's groups, through the pieces of their programme, or until one of `stops` happens."""
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
    """The record, and what happened, of films on which a charge acts, with the nominal field in its place."""
    values, (cases, rows) = record.values.copy(), record.time.shape
    many = points.take(np.repeat(np.arange(cases), rows))
    values[4] = nominal(many, values[:2].reshape(2, -1), values[4].ravel())[0].reshape(cases, rows)
    return replace(record, values=values), {
        criterion: replace(entry, field=nominal(points, entry.log_squared_stretch, entry.field)[0])
        for criterion, entry in happened.items()
    }
