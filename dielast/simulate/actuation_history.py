"""Results of actuation: histories of films under a voltage programme, in the quantities of the user."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from dielast.io.table import Frame, to_frame
from dielast.numerics.arrays import Floats
from dielast.numerics.integrate import Status
from dielast.simulate.cycles import CycleTable
from dielast.simulate.electrical import UNITS, Electrical
from dielast.simulate.events import Event, event_columns, events_of, first_of
from dielast.simulate.film import Outcome
from dielast.simulate.film_runs import FilmRuns
from dielast.simulate.history import History
from dielast.simulate.profile import Profiles
from dielast.simulate.record import Record, ending
from dielast.simulate.setup import Setup
from dielast.simulate.wiring import Wiring


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ActuationHistory(History):
    """Histories of films under voltage: arrays (cases, times) in s, V, Pa and V/m, `temperature` (cases,) in degC.

    `time` begins with the voltage programme, `voltage` is that of the film. Relative stretches are relative to the prestretch,
    nominal stresses are mechanical (without the Maxwell stress), and `stability` is the pull-in determinant over its value at the
    beginning of the programme. `events` lists the events of each case in order of time. `damage` is None if no material has a
    damage law, `electrical` and `profiles` are None unless they were requested.

    The outcome of a case is completed if the programme ran to its end or to the event that is its reason. All arrays are NaN after
    the time of the outcome.
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
        """The columns (rows,) of a case up to its end, by their headers."""
        columns = super(ActuationHistory, self).case(row)
        if self.electrical is not None:
            reached = np.isfinite(self.stretch_1[row])
            electrical_columns = {f"{name} [{unit}]": getattr(self.electrical, name) for name, unit in UNITS.items()}
            columns |= {header: values[row][reached] for header, values in electrical_columns.items() if values is not None}
        return columns

    def events_to_frame(self) -> Frame:
        """The events as a data frame, by case and time."""
        return to_frame(event_columns(self.events))


def history_of(
    setup: Setup, run: FilmRuns, stops: Sequence[str], with_end: bool, cycles: CycleTable | None
) -> tuple[ActuationHistory, Floats]:
    """The results in the quantities of the user, up to the end of each case, and the rows of `EXTRA` at the same times."""
    record, reached = run.record, run.reached
    stopped = run.status == Status.STOPPED
    # events located in an equilibrium that ends where the numerics give up may be slightly later
    latest = np.fmax.reduce([np.zeros_like(reached), *(entry.time for entry in run.happened.values())])
    reached = np.where(stopped, reached, np.maximum(reached, latest))
    last = first_of(run.happened, stops)
    if stopped.any():
        reached = np.where(stopped, last.time, reached)
    # a requested time may exceed the end by rounding
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
    """The damage (cases, times), NaN for films without a damage law; None if no film has one."""
    if setup.damage is None:
        return None
    every = np.arange(record.time.shape[0])
    ages = setup.damage.values(every, lambda law, columns: np.ones(columns.size), np.nan)
    (damage,) = record.exposed
    return np.asarray(damage * ages[:, None])


def _stopped_by(run: FilmRuns, stops: Sequence[str], time: Floats) -> list[str]:
    """The name of the first event of `stops` in each case, which happened at `time` (cases,); empty if none did."""
    times = {name: first_of(run.happened, [name]).time for name in stops}
    return [next((name for name in stops if times[name][case] == at), "") for case, at in enumerate(time.tolist())]


def electrical_of(extra: Floats, thickness: Floats, wiring: Wiring, has_resistance: bool, has_leakage: bool) -> Electrical:
    """The electrical quantities of films of `thickness` (cases,) in m, from the rows of `EXTRA` (6, cases, times)."""
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
