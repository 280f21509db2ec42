"""Actuation: a prestretched and relaxed film moves under a voltage programme until it fails or the programme ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dielast.errors import InputError
from dielast.io.result import TabularResult
from dielast.io.table import Column, Frame, Table, case_table, to_frame
from dielast.material.material import Breakdown, Material
from dielast.material.springs import Floats
from dielast.mechanics.events import Happened, Kind, Watch
from dielast.mechanics.stability import ONE_PERCENT, TimeScale, stability
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleMeter, CycleTable
from dielast.simulate.film import programme
from dielast.simulate.follow import REASONS, Outcome
from dielast.simulate.record import Recorder, Wanted, check_cycles, check_end, ending, given_times, kept_cycles
from dielast.simulate.setup import Setup, set_up
from dielast.simulate.voltage import VoltageStep, some_of, spanning, voltage_pieces

NAMES = {
    Kind.BREAKDOWN: "breakdown",
    Kind.PULL_IN: "pull-in",
    Kind.LOSS_OF_TENSION_1: "loss-of-tension",
    Kind.LOSS_OF_TENSION_2: "loss-of-tension",
}
STOPS: dict[str, tuple[Kind, ...]] = {"breakdown": (Kind.BREAKDOWN,), "pull-in": (Kind.PULL_IN,), "end": ()}


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a film: `name` is breakdown, pull-in or loss-of-tension; `time` in s since the voltage programme
    began, V, V/m. Where two held axes lose their tension at different times, those are two events.
    """

    name: str
    time: float
    voltage: float
    stretch_1: float
    stretch_2: float
    true_field: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ActuationHistory(TabularResult):
    """What films did under voltage: arrays (cases, times) in s, V, Pa and V/m, `temperature` (cases,) in degC.

    Time starts with the voltage programme; the relative stretch is that over the prestretch; the nominal stress is mechanical;
    `stability` is the pull-in determinant over its value when the programme starts. `events` lists those of each case in order of
    time. An outcome is completed where the programme came to its end, or to the event named as its reason; after its time
    everything is NaN.
    """

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

    def case(self, row: int) -> dict[str, Floats]:
        """The columns of a case up to where it ended, (rows,), by their headers."""
        columns = {
            "time [s]": self.time,
            "voltage [V]": self.voltage,
            "stretch_1 [1]": self.stretch_1,
            "stretch_2 [1]": self.stretch_2,
            "relative_stretch_1 [1]": self.relative_stretch_1,
            "relative_stretch_2 [1]": self.relative_stretch_2,
            "nominal_stress_1 [Pa]": self.nominal_stress_1,
            "nominal_stress_2 [Pa]": self.nominal_stress_2,
            "true_field [V/m]": self.true_field,
            "stability [1]": self.stability,
        }
        reached = np.isfinite(self.stretch_1[row])
        return {header: values[row][reached] for header, values in columns.items()}

    def columns(self) -> Table:
        """All cases, one below the other."""
        return case_table(self.temperature.tolist(), [self.case(row) for row in range(self.time.shape[0])])

    def events_to_frame(self) -> Frame:
        """The events as a data frame, by case and time."""
        return to_frame(event_columns(self.events))

    @property
    def completed(self) -> bool:
        """Whether every case came to its end or to the event it was to stop at."""
        return all(outcome.completed for outcome in self.outcome)


def event_columns(events: Sequence[Sequence[Event]]) -> Table:
    """The table of the events of each case, in order of time."""
    flat = [(case, event) for case, own in enumerate(events) for event in own]
    numbers = {
        ("time", "s"): [event.time for _, event in flat],
        ("voltage", "V"): [event.voltage for _, event in flat],
        ("stretch_1", "1"): [event.stretch_1 for _, event in flat],
        ("stretch_2", "1"): [event.stretch_2 for _, event in flat],
        ("true_field", "V/m"): [event.true_field for _, event in flat],
    }
    return [
        Column("case", None, np.array([case for case, _ in flat], dtype=np.int64)),
        Column("event", None, [event.name for _, event in flat]),
        *(Column(name, unit, np.array(values, dtype=float)) for (name, unit), values in numbers.items()),
    ]


def actuate(
    material: Material | Sequence[Material],
    steps: Sequence[VoltageStep],
    *,
    thickness: ArrayLike,
    prestretch: ArrayLike | tuple[ArrayLike | None, ArrayLike | None] = 1.0,
    prestretch_rate: ArrayLike | None = None,
    relax: float = 0.0,
    boundary: str | tuple[str, str] = "dead-load",
    temperature: ArrayLike | None = None,
    breakdown_field: ArrayLike | Breakdown | None = None,
    pull_in_timescale: TimeScale = ONE_PERCENT,
    stop_at: str = "breakdown",
    times: ArrayLike | None = None,
    points_per_decade: int = 30,
    with_end: bool | None = None,
    rtol: float = 1e-6,
    cycles: str | Sequence[int] | None = None,
) -> ActuationHistory:
    """Films of undeformed `thickness` (m), prestretched, held for `relax` s, then driven through the voltage `steps` from 0 V.

    `prestretch` is equibiaxial, or a pair (tuple) with None for an axis left free of stress; it is reached at `prestretch_rate`
    (1/s, of the larger axis; both ramp together) or at once. `boundary` says for each axis whether it is then a "dead-load", the
    nominal stress reached, or "clamped". `breakdown_field` in V/m, or over prestretch (the root of both axes' product), the
    material's by default. A run ends with the first event `stop_at`, "breakdown" or "pull-in", or goes through them all to the
    "end" of the programme. Cases, `temperature`, `times` (since the programme began), `points_per_decade` and `rtol` as in
    `creep`, and the `cycles` of waveforms, which are about the relative stretch of axis 1. The history of a run that stops ends
    `with_end`, with the film as it was at the event, by default unless `times` are given. Raises `InputError` for anything wrong
    with the arguments; numerics that give up are an outcome.
    """
    if stop_at not in STOPS:
        raise InputError(f"{stop_at!r}: it must be one of {', '.join(STOPS)}", argument="stop_at")
    if points_per_decade < 1:
        raise InputError(f"{points_per_decade}: at least one is needed", argument="points_per_decade")
    setup = set_up(
        material,
        prestretch,
        spanning=spanning(steps),
        thickness=thickness,
        prestretch_rate=prestretch_rate,
        relax=relax,
        boundary=boundary,
        temperature=temperature,
        breakdown_field=breakdown_field,
        breakdown_needed=stop_at == "breakdown",
        rtol=rtol,
    )
    cases = setup.temperature.size
    pieces = voltage_pieces(steps, setup.controls, setup.thickness, cases)
    wanted = Wanted(None if times is None else given_times(times, cases), points_per_decade, kept_cycles(cycles))
    check_cycles(wanted.cycles, pieces)
    lasts = [piece.resolve(np.zeros((3, cases))).duration for piece in pieces]
    check_end(wanted.times, np.sum(lasts, axis=0), "programme")
    parts, runs = setup.groups(), []
    begin, happened, reached, status = (
        np.empty((3, cases)),
        Happened.nothing(cases),
        np.empty(cases),
        np.empty(cases, dtype=np.intp),
    )
    for part in parts:
        film = setup.film(part, rtol)
        watch = Watch(setup.controls, setup.breakdown_field[part], pull_in_timescale, STOPS[stop_at])
        relaxed, zero = film.condition, np.zeros(part.size)
        begin[:2, part] = np.exp(0.5 * relaxed.log_squared_stretch)
        begin[2, part] = stability(
            film.points,
            watch.held_modulus(film.points, zero),
            setup.controls,
            relaxed.internal,
            relaxed.log_squared_stretch,
            relaxed.nominal_stress,
            zero,
        ).determinant
        recorder = Recorder(wanted.take(part), part.size, film.points.rate.shape[0], watch)
        meter = CycleMeter(film.points.permittivity, begin[0, part], False)
        reached[part], status[part] = programme(film, some_of(pieces, part), watch, rtol=rtol, recorder=recorder, meter=meter)
        happened.put(part, watch.happened)
        runs.append((*recorder.collect()[:2], meter.collect()))
    time, values = np.empty((cases, runs[0][0].shape[1])), np.empty((*runs[0][1].shape[:1], cases, runs[0][1].shape[2]))
    for part, (rows, filled, _) in zip(parts, runs, strict=True):
        time[part], values[:, part] = rows, filled
    ends = times is None if with_end is None else with_end
    table = CycleTable.assembled(parts, [metered for _, _, metered in runs], cases)
    return _history(setup, time, values, begin, happened, reached, status, stop_at, ends, table)


def _history(
    setup: Setup,
    time: Floats,
    values: Floats,
    begin: Floats,
    happened: Happened,
    reached: Floats,
    status: NDArray[np.intp],
    stop_at: str,
    with_end: bool,
    cycles: CycleTable | None,
) -> ActuationHistory:
    """Results in the user's terms, nothing of which is after the end of its case."""
    stopped = status == Status.STOPPED
    if stopped.any():
        kind = STOPS[stop_at][0]
        reached = np.where(stopped, happened.time[kind], reached)
    # an equilibrium that ends where the numerics give up may end a little later
    latest = np.max(np.where(np.isnan(happened.time), 0.0, happened.time), axis=0)
    reached = np.where(stopped, reached, np.maximum(reached, latest))
    # a time that was asked for may lie beyond the end by rounding
    values = np.where(time > reached[:, None] * (1 + 1e-12), np.nan, values)
    if stopped.any() and with_end:
        time, values = ending(time, values, reached, np.where(stopped, happened.state(kind), np.nan))
    stretch = np.exp(0.5 * values[:2])
    outcome = tuple(
        Outcome(True, float(at), stop_at)
        if state == Status.STOPPED
        else Outcome(state == Status.COMPLETED, float(at), REASONS.get(Status(state), ""))
        for at, state in zip(reached, status.tolist(), strict=True)
    )
    return ActuationHistory(
        temperature=setup.temperature,
        time=time,
        voltage=values[4] * setup.thickness[:, None],
        stretch_1=stretch[0],
        stretch_2=stretch[1],
        relative_stretch_1=stretch[0] / begin[0, :, None],
        relative_stretch_2=stretch[1] / begin[1, :, None],
        nominal_stress_1=values[2],
        nominal_stress_2=values[3],
        true_field=values[4] * stretch[0] * stretch[1],
        stability=values[5] / begin[2, :, None],
        events=tuple(_events(happened, case, float(setup.thickness[case]), float(end)) for case, end in enumerate(reached)),
        outcome=outcome,
        cycles=cycles,
    )


def _events(happened: Happened, case: int, thickness: float, end: float) -> tuple[Event, ...]:
    """The events of one case up to its end, in order of time."""
    events: list[Event] = []
    for kind, name in NAMES.items():
        time, field = float(happened.time[kind, case]), float(happened.field[kind, case])
        first, second = np.exp(0.5 * happened.log_squared_stretch[:, kind, case]).tolist()
        # what both axes lose at one moment is lost once
        if time <= end and not any(event.name == name and event.time == time for event in events):
            events.append(Event(name, time, field * thickness, first, second, field * first * second))
    return tuple(sorted(events, key=lambda event: event.time))
