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
from dielast.material.leakage import Leakage
from dielast.material.material import Material
from dielast.mechanics.course import Piece
from dielast.mechanics.criteria import CRITERIA, END, names
from dielast.mechanics.criteria.criterion import Criterion
from dielast.mechanics.criteria.loss_of_tension import LossOfTension
from dielast.mechanics.electric import CHARGE
from dielast.mechanics.event_arrays import EventArrays
from dielast.mechanics.history import electrical_pieces
from dielast.mechanics.load import ChargeStep, VoltageStep
from dielast.mechanics.point import Points
from dielast.mechanics.stability import ONE_PERCENT, TimeScale
from dielast.mechanics.watch import Watch
from dielast.numerics.columns import Cases, Floats
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleMeter, CycleTable
from dielast.simulate.electrical import UNITS, Electrical, ElectricMeter, nominal
from dielast.simulate.events import Event, event_columns, events_of, first_of
from dielast.simulate.film import Outcome
from dielast.simulate.film_setup import MESH_RTOL, FilmSetup
from dielast.simulate.follow import follow
from dielast.simulate.history import History
from dielast.simulate.profile import ProfileRecorder, Profiles, given_times
from dielast.simulate.record import Record, Recorder, ending
from dielast.simulate.setup import Setup, set_up
from dielast.simulate.wanted import Wanted, check_cycles, check_end
from dielast.simulate.wiring import Wiring


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ActuationHistory(History):
    """What films did under voltage: arrays (cases, times) in s, V, Pa and V/m, `temperature` (cases,) in degC.

    Time starts with the voltage programme; the relative stretch is that over the prestretch; the nominal stress is mechanical;
    `stability` is the pull-in determinant over its value when the programme starts. `events` lists those of each case in order of
    time; `damage` is None where no material has a damage law. An outcome is completed where the programme came to its end, or to
    the event named as its reason; after its time everything is NaN. The voltage is that of the film; charges, currents and energies
    are in `electrical`, None unless they were asked for.
    """

    UNITS: ClassVar = {
        **{"time": "s", "voltage": "V", "stretch_1": "1", "stretch_2": "1", "relative_stretch_1": "1", "relative_stretch_2": "1"},
        **{"nominal_stress_1": "Pa", "nominal_stress_2": "Pa", "true_field": "V/m", "stability": "1"},
        **{"damage": "1"},
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
    damage: Floats | None = None
    electrical: Electrical | None = None
    profiles: Profiles | None = None

    def case(self, row: int) -> dict[str, Floats]:
        """The columns of a case up to where it ended, (rows,), by their headers."""
        columns = super(ActuationHistory, self).case(row)
        if self.electrical is not None:
            reached = np.isfinite(self.stretch_1[row])
            known = {f"{name} [{unit}]": getattr(self.electrical, name) for name, unit in UNITS.items()}
            columns |= {header: values[row][reached] for header, values in known.items() if values is not None}
        return columns

    def events_to_frame(self) -> Frame:
        """The events as a data frame, by case and time."""
        return to_frame(event_columns(self.events))


def actuate(
    material: Material | Sequence[Material],
    steps: Sequence[VoltageStep] | Sequence[ChargeStep],
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
    source_resistance: ArrayLike | None = None,
    leakage: Leakage | None = None,
    electrode_area: ArrayLike | None = None,
    electrical: bool | None = None,
    profile: ArrayLike | None = None,
) -> ActuationHistory:
    """Films of undeformed `thickness` (m), prestretched, held for `relax` s, then driven through the `steps` from 0 V, or from a
    charge of 0.

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

    A source of voltage may have a `source_resistance` in ohm, between it and the electrode, of an `electrode_area` in m^2 on the
    undeformed film; through the film there may be a `leakage`. Charge, current and energies are given with any of these, with
    charges, or where `electrical` says so. None of these is known of films with a passive part. Raises `InputError` for anything
    wrong with the arguments; numerics that give up are an outcome.
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
        spanning=[
            *(value for step in steps for value in step.varied()),
            *(value for value in (source_resistance, electrode_area) if value is not None),
            *([] if leakage is None else leakage.varied()),
        ],
    )
    cases = setup.temperature.size
    charge = isinstance(next(iter(steps), None), ChargeStep)
    wiring = Wiring.of(charge, source_resistance, leakage, electrode_area, setup.thickness)
    pieces = electrical_pieces(steps, setup.controls, np.ones(cases) if charge else setup.thickness)
    with_circuit = charge or source_resistance is not None or leakage is not None
    electrical = with_circuit if electrical is None else electrical
    if setup.passive is not None and (with_circuit or electrical):
        named = {"steps": charge, "source_resistance": source_resistance is not None, "leakage": leakage is not None}
        argument = next((name for name, is_stated in named.items() if is_stated), "electrical")
        only = "a film with a passive part, boundary frame or strip, takes an ideal source of voltage alone"
        raise InputError(f"{only}, and says nothing of charge and energies", argument=argument)
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
    parts = setup.groups(wiring.has_circuit)
    taken = [[piece.take(part) for piece in pieces] for part in parts]
    runs = [
        _run(setup, wiring, part, pull_in_timescale, until, some, wanted, electrical, rtol, seen_at, slack)
        for part, some in zip(parts, taken, strict=True)
    ]
    place = np.empty(cases, dtype=np.intp)
    place[np.concatenate(parts)] = np.arange(sum(part.size for part in parts))
    ends = times is None if with_end is None else with_end
    tables = [run.cycles for run in runs if run.cycles is not None]
    cycling = CycleTable.joined(tables, place) if tables else None
    history, extra = _history(setup, _Run.joined(runs, place), (*until, *slack), ends, cycling)
    if electrical:
        known = _electrical(extra, setup.thickness, wiring, source_resistance is not None, leakage is not None)
        history = replace(history, electrical=known)
    if seen_at is None:
        return history
    ended = np.array([outcome.time for outcome in history.outcome])
    own = [case for run, part in zip(runs, parts, strict=True) if run.profiler for case in run.profiler.collect(ended[part])]
    return replace(history, profiles=Profiles(tuple(own[row] for row in place.tolist())))


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
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
    def joined(cls, runs: Sequence[_Run], place: Cases) -> _Run:
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


def _run(
    setup: Setup,
    wiring: Wiring,
    part: Cases,
    timescale: TimeScale,
    until: Sequence[str],
    pieces: Sequence[Piece],
    wanted: Wanted,
    electrical: bool,
    rtol: float,
    seen_at: Floats | None,
    slack: Sequence[str],
) -> _Run:
    """Run some of the films, one of the setup's groups, through the pieces of their programme."""
    film = setup.film(part, rtol)
    film = replace(film, points=wiring.wired(film.points, part))
    watch = Watch(setup.watched(film, part, timescale), CRITERIA, until, slack)
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
        last = first_of(happened, until or names())
        extra = electric.ended(last.time)
        extra[0] = nominal(film.points, last.log_squared_stretch, last.field)[1]
    if film.points.electric is CHARGE:
        record, happened = _in_fields(film.points, record, happened)
    return _Run(record, begin, happened, followed.time, followed.status, extra, meter.collect(), profiler)


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


def _electrical(extra: Floats, thickness: Floats, wiring: Wiring, has_resistance: bool, has_leakage: bool) -> Electrical:
    """What is electrical, from the rows of `EXTRA` (6, cases, times), of films of a thickness (cases,) in m."""
    charge, source, current, work, leaked, lost = extra
    area = None if wiring.area is None else wiring.area[:, None]
    return Electrical(
        charge_density=charge,
        current_density=current,
        electrical_energy=work,
        source_voltage=source * thickness[:, None] if has_resistance else None,
        charge=None if area is None else charge * area,
        current=None if area is None else current * area,
        leaked_energy=leaked if has_leakage else None,
        resistor_energy=lost if has_resistance else None,
    )


def _history(
    setup: Setup, run: _Run, stops: Sequence[str], with_end: bool, cycles: CycleTable | None
) -> tuple[ActuationHistory, Floats]:
    """Results in the user's terms, nothing of which is after the end of its case, and the rows of `EXTRA` with them."""
    record, reached = run.record, run.reached
    stopped = run.status == Status.STOPPED
    # an equilibrium that ends where the numerics give up may end a little later
    latest = np.fmax.reduce([np.zeros_like(reached), *(entry.time for entry in run.happened.values())])
    reached = np.where(stopped, reached, np.maximum(reached, latest))
    last = first_of(run.happened, stops)
    if stopped.any():
        reached = np.where(stopped, last.time, reached)
    # a time that was asked for may lie beyond the end by rounding
    record = replace(record, values=np.where(record.time > reached[:, None] * (1 + 1e-12), np.nan, record.values))
    if stopped.any() and with_end:
        at_end = np.concatenate((last.row, run.extra))
        record = ending(record, reached, np.where(stopped, at_end, np.nan))
    stretch, field = record.stretch, record.field
    history = ActuationHistory(
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
        damage=_damage(setup, record),
    )
    return history, record.electrical


def _damage(setup: Setup, record: Record) -> Floats | None:
    """The damage (cases, times), NaN for films of no damage law; None if no film has one."""
    if setup.damage is None:
        return None
    every = np.arange(record.time.shape[0])
    ages = setup.damage.ask(every, lambda law, columns: np.ones(columns.size), np.nan)
    (damage,) = record.exposed
    return np.asarray(damage * ages[:, None])


def _stopped_by(run: _Run, stops: Sequence[str], time: Floats) -> list[str]:
    """The name of what happened in each case at the `time` (cases,) at which the first of `stops` did, none if nothing did."""
    times = {name: first_of(run.happened, [name]).time for name in stops}
    return [next((name for name in stops if times[name][case] == at), "") for case, at in enumerate(time.tolist())]
