"""Films simulated under a voltage programme, and the results in the quantities of the user."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dielast.io.table import Frame, to_frame
from dielast.material.springs import UNIAXIAL
from dielast.mechanics.criteria import CRITERIA
from dielast.mechanics.laps import Pieces
from dielast.mechanics.stability import TimeScale
from dielast.mechanics.watch import Watch
from dielast.numerics.arrays import Cases, Floats
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleMeter, CycleTable
from dielast.simulate.electrical import ElectricMeter
from dielast.simulate.events import Event, event_columns, events_of, first_of
from dielast.simulate.follow import follow
from dielast.simulate.history import History, Outcome
from dielast.simulate.output import Output
from dielast.simulate.profile import ProfileRecorder, Profiles
from dielast.simulate.quantities import FILMS, SolvedFilms, values_of
from dielast.simulate.record import ending
from dielast.simulate.recorder import Recorder
from dielast.simulate.setup import Setup
from dielast.simulate.wiring import Wiring


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ActuationHistory(History):
    """Histories of films under voltage: `values` (cases, times) in SI by header, as attributes too; `temperature` (cases,) in degC.

    `time` begins with the voltage programme, `voltage` is that of the film. Relative stretches and the area strain are relative to
    the prestretch, nominal stresses are total, Maxwell stress included, and `stability` is the pull-in determinant over the size of
    its value at the beginning of the programme, or, where edges move, over that of the springs alone; `thickness_stretch` and
    `capacitance` are per undeformed thickness and area. `events` lists the events of each case in order of time. Without a damage
    law there is no `damage`; charge, current and energies are there if they were requested, per undeformed area and volume;
    `profiles` are None unless they were requested.

    The outcome of a case is completed if the programme ran to its end or to the event that is its reason. All arrays are NaN after
    the time of the outcome.
    """

    QUANTITIES: ClassVar = FILMS

    temperature: Floats
    values: Mapping[str, Floats]
    events: tuple[tuple[Event, ...], ...]
    outcome: tuple[Outcome, ...]
    cycles: CycleTable | None = None
    profiles: Profiles | None = None

    def events_to_frame(self) -> Frame:
        """The events as a data frame, by case and time."""
        return to_frame(event_columns(self.events))


def run_films(
    setup: Setup,
    part: Cases,
    wiring: Wiring,
    pieces: Pieces,
    output: Output,
    *,
    timescale: TimeScale,
    stops: Sequence[str],
    rtol: float,
    alike: bool = True,
    lone: bool = False,
    density: Floats | None = None,
) -> ActuationHistory:
    """Simulate the films `part` (k,), one of the groups of the setup, through their programme or until one of `stops` happens.

    The load keeps equal axes `alike`, or begins along axis 1 alone (`lone`) in undeformed films; `density` (cases,) in kg/m^3 is
    that of the films.
    """
    film = setup.film(part, rtol, alike)
    points = replace(wiring.wired(film.points, part), edges=setup.springs(part, np.exp(0.5 * film.log_squared_stretch)))
    thickness, watched = setup.thickness[part], setup.watched(film, part, timescale, wiring.programme)
    if wiring.programme:
        points = points.with_damper_floor(rtol)
    symmetry = UNIAXIAL if lone and film.symmetry is None else film.symmetry
    film = replace(film, points=points, symmetry=symmetry, wires=wiring.wires(part) if wiring.programme else None)
    watch = Watch(watched, CRITERIA, (), stops)
    relaxed = film.snapshot(setup.controls, np.arange(part.size), np.zeros(part.size))
    begin = np.exp(0.5 * relaxed.log_squared_stretch)
    leakage = wiring.leakage.take(part) if wiring.electrical else None
    electric = None if leakage is None else ElectricMeter(leakage, part.size)
    recorders = [Recorder(output.take(part), watch, electric, pieces.laps)]
    if output.profile_rows is not None and (spread := setup.spread(part)) is not None:
        recorders.append(ProfileRecorder(Output(output.profile_rows[part]), spread=spread))
    meter = CycleMeter(points, begin[0], False, leakage, wiring.programme, None if density is None else density[part], electric)
    followed = follow(film, pieces.take(part), rtol=rtol, watch=watch, recorders=recorders, meter=meter)
    # those of a course that was kept, if there was one
    watch, recorders, meter = followed.watch or watch, list(followed.recorders), followed.meter or meter
    electric = recorders[0].electric
    record, happened = recorders[0].collect(), watch.happened
    stopped, last = followed.status == Status.STOPPED, first_of(happened, stops)
    # events located in an equilibrium that ends where the numerics give up may be slightly later
    latest = np.fmax.reduce([np.zeros(part.size), *(entry.time for entry in happened.values())])
    reached = np.where(stopped, last.time, np.maximum(followed.time, latest))
    at_end = last.row
    if electric is not None:
        ended = electric.ended(last.time)
        ended[0] = last.charge
        at_end = np.concatenate((at_end, ended, last.stored[None]))
    # a requested time may exceed the end by rounding
    record = replace(record, values=np.where(record.time > reached[:, None] * (1 + 1e-12), np.nan, record.values))
    if stopped.any() and output.to_the_end:
        record = ending(record, reached, np.where(stopped, at_end, np.nan))
    events = [events_of(happened, case, float(thickness[case]), end) for case, end in enumerate(reached.tolist())]
    reasons = [_reason(in_order, stops, end) for in_order, end in zip(events, reached.tolist(), strict=True)]
    with_damage = None
    if (laws := setup.endurance.damage) is not None:  # NaN for films without a damage law
        with_damage = laws.values(part, lambda law, columns: np.ones(columns.size), np.nan)
    solved = SolvedFilms(
        record,
        points,
        wiring.take(part),
        thickness,
        np.stack([np.ones(part.size) if stretch is None else stretch[part] for stretch in setup.prestretch]),
        begin,
        np.ones(part.size) if wiring.programme else watch.stability(relaxed).determinant,
        with_damage,
        np.zeros(part.size)
        if electric is None
        else relaxed.points.stored(relaxed.internal, relaxed.log_squared_stretch, relaxed.electrical),
    )
    return ActuationHistory(
        temperature=setup.temperature[part],
        values=values_of(FILMS, solved),
        events=tuple(events),
        outcome=tuple(map(Outcome.of, followed.status.tolist(), reached.tolist(), reasons)),
        cycles=meter.collect(),
        profiles=next((recorder.profiles(reached) for recorder in recorders if isinstance(recorder, ProfileRecorder)), None),
    )


def _reason(events: Sequence[Event], stops: Sequence[str], end: float) -> str:
    """The name of the event of `stops` at the `end` in s of a film, the first of several `events`; empty without one."""
    return next((event.name for event in events if event.time == end and event.name in stops), "")
