"""Actuation: a prestretched and relaxed film moves under a voltage programme until it fails or the programme ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dielast.errors import InputError, shown
from dielast.io.table import Frame, to_frame
from dielast.material.breakdown import BreakdownLaw
from dielast.material.material import Material
from dielast.mechanics.course import Piece
from dielast.mechanics.criteria import CRITERIA, END, names
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.happening import Happening
from dielast.mechanics.history import voltage_pieces
from dielast.mechanics.load import VoltageStep
from dielast.mechanics.stability import ONE_PERCENT, TimeScale
from dielast.mechanics.watch import Watch
from dielast.numerics.columns import Cases, Floats
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleMeter, CycleTable
from dielast.simulate.events import Event, event_columns, events_of, first_of
from dielast.simulate.film import Outcome
from dielast.simulate.follow import follow
from dielast.simulate.history import History
from dielast.simulate.profile import ProfileRecorder, Profiles, given_times
from dielast.simulate.record import Record, Recorder, ending
from dielast.simulate.setup import MESH_RTOL, FilmSetup, Setup, set_up
from dielast.simulate.wanted import Wanted, check_cycles, check_end


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ActuationHistory(History):
    """What films did under voltage: arrays (cases, times) in s, V, Pa and V/m, `temperature` (cases,) in degC.

    Time starts with the voltage programme; the relative stretch is that over the prestretch; the nominal stress is mechanical;
    `stability` is the pull-in determinant over its value when the programme starts. `events` lists those of each case in order of
    time. An outcome is completed where the programme came to its end, or to the event named as its reason; after its time
    everything is NaN.
    """

    UNITS: ClassVar = {
        **{"time": "s", "voltage": "V", "stretch_1": "1", "stretch_2": "1", "relative_stretch_1": "1", "relative_stretch_2": "1"},
        **{"nominal_stress_1": "Pa", "nominal_stress_2": "Pa", "true_field": "V/m", "stability": "1"},
    }

    temperature: Floats
    time: Floats
    voltage: Floats
    stretch_1: Floats
    stretch_2: Floats
    relative_stretch_1: Floats
    relative_stretch_2: Floats
    nominal_stress_1: Floats
    nominal_stress_2: Floats
    true_field: Floats
    stability: Floats
    events: tuple[tuple[Event, ...], ...]
    outcome: tuple[Outcome, ...]
    cycles: CycleTable | None = None
    profiles: Profiles | None = None

    def events_to_frame(self) -> Frame:
        """The events as a data frame, by case and time."""
        return to_frame(event_columns(self.events))


def actuate(
    material: Material | Sequence[Material],
    steps: Sequence[VoltageStep],
    *,
    thickness: ArrayLike,
    prestretch: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] = 1.0,
    prestretch_rate: ArrayLike | None = None,
    relax: float = 0.0,
    boundary: str | tuple[str, str] = "dead-load",
    electrode_share: ArrayLike | None = None,
    mesh_rtol: float = MESH_RTOL,
    force: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None,
    width: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] | None = None,
    temperature: ArrayLike | None = None,
    breakdown_field: ArrayLike | BreakdownLaw | None = None,
    pull_in_timescale: TimeScale = ONE_PERCENT,
    stop_at: str = "breakdown",
    times: ArrayLike | None = None,
    points_per_decade: int = 30,
    with_end: bool | None = None,
    rtol: float = 1e-6,
    cycles: str | Sequence[int] | None = None,
    profile: ArrayLike | None = None,
) -> ActuationHistory:
    """Films of undeformed `thickness` (m), prestretched, held for `relax` s, then driven through the voltage `steps` from 0 V.

    `prestretch` is equibiaxial, or a pair (tuple) with None for an axis left free of stress; it is reached at `prestretch_rate`
    (1/s, of the larger axis; both ramp together) or at once. A `force` in N on a `width` in m hangs on it from the beginning (see
    `FilmSetup`). `boundary` says for each axis whether it is then a "dead-load", the
    nominal stress reached, or "clamped"; "frame" and "strip" are films with a passive part, of which the electrode covers
    `electrode_share` (see `FilmSetup`). `breakdown_field` in V/m, or over prestretch (the root of both axes' product), the
    material's by default. A run ends with the first event `stop_at`, such as "breakdown", "pull-in" or "loss-of-tension", or goes
    through them all to the "end" of the programme; one that is to stop at breakdown also stops where a passive part goes slack.
    Cases, `temperature`, `times` (since the programme began), `points_per_decade` and `rtol` as in `creep`, and the `cycles` of
    waveforms, which are about the relative stretch of axis 1. Films with a passive part have `profiles` at the times of `profile`.
    The history of a run that stops ends `with_end`, with the film as it was at the event, by default unless `times` are given.
    Raises `InputError` for anything wrong with the arguments; numerics that give up are an outcome.
    """
    if stop_at not in (*names(), END):
        raise InputError(f"{stop_at!r}: it must be one of {', '.join((*names(), END))}", argument="stop_at")
    materials = [material] if isinstance(material, Material) else list(material)
    if stop_at != END and not any(known.concerns(materials) for known in CRITERIA if known.name == stop_at):
        needed = f"the material file needs [{stop_at}] with field, time and exponent"
        raise InputError(f"{shown(stop_at)} cannot happen: {needed}", argument="stop_at")
    if points_per_decade < 1:
        raise InputError(f"{points_per_decade}: at least one is needed", argument="points_per_decade")
    setup = set_up(
        material,
        FilmSetup(thickness, prestretch, prestretch_rate, relax, boundary, electrode_share, mesh_rtol, force, width),
        temperature=temperature,
        breakdown_field=breakdown_field,
        breakdown_needed=stop_at == "breakdown",
        rtol=rtol,
        spanning=[value for step in steps for value in step.varied()],
    )
    cases = setup.temperature.size
    pieces = voltage_pieces(steps, setup.controls, setup.thickness)
    wanted = Wanted.of(times, cases, points_per_decade, cycles)
    check_cycles(wanted.cycles, pieces)
    whole = np.sum([piece.begin(np.zeros((3, cases))).duration for piece in pieces], axis=0)
    check_end(wanted.times, whole, "programme")
    seen_at = given_times(profile)
    if seen_at is not None:
        if setup.passive is None:
            raise InputError("it is of films with a passive part, boundary frame or strip", argument="profile")
        check_end(np.broadcast_to(seen_at, (cases, seen_at.size)), whole, "programme", "profile")
    until = () if stop_at == END else (stop_at,)
    # a passive film that is slack wrinkles, which these equations know nothing of
    slack = (LossOfTension.name,) if setup.passive is not None and stop_at == "breakdown" else ()
    parts = setup.groups()
    runs = [
        _run(setup, part, pull_in_timescale, until, [piece.take(part) for piece in pieces], wanted, rtol, seen_at, slack)
        for part in parts
    ]
    place = np.empty(cases, dtype=np.intp)
    place[np.concatenate(parts)] = np.arange(sum(part.size for part in parts))
    ends = times is None if with_end is None else with_end
    tables = [run.cycles for run in runs if run.cycles is not None]
    history = _history(
        setup, _Run.joined(runs, place), (*until, *slack), ends, CycleTable.joined(tables, place) if tables else None
    )
    if seen_at is None:
        return history
    ended = np.array([outcome.time for outcome in history.outcome])
    own = [case for run, part in zip(runs, parts, strict=True) if run.profiler for case in run.profiler.collect(ended[part])]
    return replace(history, profiles=Profiles(tuple(own[row] for row in place.tolist())))


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """What some films did: the `record`, stretches and determinant at the `begin` (3, cases), what happened, how far they came in
    s, and their `Status`.
    """

    record: Record
    begin: Floats
    happened: Mapping[Criterion, Happening]
    reached: Floats
    status: Cases
    cycles: CycleTable | None = None
    profiler: ProfileRecorder | None = None

    @classmethod
    def joined(cls, runs: Sequence[_Run], place: Cases) -> _Run:
        """The runs of all cases, each of which is at its `place` (cases,) in the runs one after another."""

        def whole(name: str) -> Any:
            return np.concatenate([getattr(run, name) for run in runs], axis=-1)[..., place]

        happened = {
            criterion: Happening.joined([run.happened[criterion] for run in runs]).take(place) for criterion in runs[0].happened
        }
        time = np.concatenate([run.record.time for run in runs])[place]
        record = Record(time, np.concatenate([run.record.values for run in runs], axis=1)[:, place])
        return cls(record, whole("begin"), happened, whole("reached"), whole("status"))


def _run(
    setup: Setup,
    part: Cases,
    timescale: TimeScale,
    until: Sequence[str],
    pieces: Sequence[Piece],
    wanted: Wanted,
    rtol: float,
    seen_at: Floats | None,
    slack: Sequence[str],
) -> _Run:
    """Run some of the films, one of the setup's groups, through the pieces of their programme."""
    film = setup.film(part, rtol)
    watch = Watch(setup.watched(film, part, timescale), CRITERIA, until, slack)
    relaxed = film.moment(setup.controls, np.arange(part.size), np.zeros(part.size))
    stretch = np.exp(0.5 * relaxed.log_squared_stretch)
    recorder = Recorder(wanted.take(part), part.size, film.points.rate.shape[0], watch)
    meter = CycleMeter(film.points, stretch[0], False)
    begin = np.concatenate((stretch, watch.stability(relaxed).determinant[None]))
    profiler = None
    if seen_at is not None and setup.passive is not None:
        profiler = ProfileRecorder(seen_at, setup.passive.spread(part))
    followed = follow(film, pieces, rtol=rtol, watch=watch, recorder=recorder, meter=meter, profiler=profiler)
    ran = watch.happened, followed.time, followed.status, meter.collect()
    return _Run(recorder.collect(), begin, *ran, profiler)


def _history(setup: Setup, run: _Run, stops: Sequence[str], with_end: bool, cycles: CycleTable | None) -> ActuationHistory:
    """Results in the user's terms, nothing of which is after the end of its case."""
    record, reached = run.record, run.reached
    stopped = run.status == Status.STOPPED
    # an equilibrium that ends where the numerics give up may end a little later
    latest = np.fmax.reduce([np.zeros_like(reached), *(entry.time for entry in run.happened.values())])
    reached = np.where(stopped, reached, np.maximum(reached, latest))
    last = first_of(run.happened, stops)
    if stopped.any():
        reached = np.where(stopped, last.time, reached)
    # a time that was asked for may lie beyond the end by rounding
    record = Record(record.time, np.where(record.time > reached[:, None] * (1 + 1e-12), np.nan, record.values))
    if stopped.any() and with_end:
        record = ending(record, reached, np.where(stopped, last.row, np.nan))
    stretch, field = record.stretch, record.field
    return ActuationHistory(
        temperature=setup.temperature,
        time=record.time,
        voltage=field * setup.thickness[:, None],
        stretch_1=stretch[0],
        stretch_2=stretch[1],
        relative_stretch_1=stretch[0] / run.begin[0, :, None],
        relative_stretch_2=stretch[1] / run.begin[1, :, None],
        nominal_stress_1=record.nominal_stress[0],
        nominal_stress_2=record.nominal_stress[1],
        true_field=field * stretch[0] * stretch[1],
        stability=record.determinant / run.begin[2, :, None],
        events=tuple(events_of(run.happened, case, float(setup.thickness[case]), float(end)) for case, end in enumerate(reached)),
        outcome=tuple(
            Outcome.of(*ended)
            for ended in zip(run.status.tolist(), reached.tolist(), _stopped_by(run, stops, last.time), strict=True)
        ),
        cycles=cycles,
    )


def _stopped_by(run: _Run, stops: Sequence[str], time: Floats) -> list[str]:
    """The name of what happened in each case at the `time` (cases,) at which the first of `stops` did, none if nothing did."""
    times = {name: first_of(run.happened, [name]).time for name in stops}
    return [next((name for name in stops if times[name][case] == at), "") for case, at in enumerate(time.tolist())]
