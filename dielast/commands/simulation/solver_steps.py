"""A recipe's steps as the solver takes them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.commands.simulation.recipe import KEYS
from dielast.errors import InputError, Problem, placed
from dielast.io.files import Inputs
from dielast.mechanics.cases import of_case
from dielast.mechanics.load import ChargeStep, ElectricalStep, Path, Step, Track, VoltageStep, Waveform
from dielast.numerics.arrays import Floats
from dielast.units import CHARGE, CHARGE_DENSITY, FORCE, TIME, TIMES, VOLTAGE

if TYPE_CHECKING:
    from dielast.io.text_table import MeasuredTable

STEPS: dict[str, type[ElectricalStep]] = {"voltage": VoltageStep, "charge": ChargeStep}
OWN = ("stretch_1", "nominal_stress_1")


@dataclass(frozen=True, slots=True)
class Entry:
    """One step of a history for the solver, and the recipe step (from 0) it comes from; what is not stated is None."""

    origin: int
    control: str | None
    target: float | Path | None
    rate: float | None = None
    duration: float | None = None
    still: bool = False
    """Whether the target is what is there already."""

    @property
    def shape(self) -> tuple[Any, ...]:
        """The properties that entries must share to be solved together."""
        path: tuple[Any, ...] = ()
        if isinstance(self.target, Waveform):
            path = (self.target.shape, self.target.cycles)
        elif isinstance(self.target, Track):
            path = (np.asarray(self.target.time).tobytes(), np.asarray(self.target.value).tobytes())
        return (self.control, self.rate is None, self.duration is None, self.duration == 0, self.still, path)


def joined(entries: Sequence[Entry], recipe: Any) -> Step | ElectricalStep:
    """The same step of several cases as one of the solver; `recipe` is that of one of the cases. Its values are arrays (cases,), or
    of shape () if all entries are those of one case.
    """
    first = entries[0]
    alike = all(entry is first for entry in entries)

    def of_cases(values: Sequence[Any]) -> Floats | None:
        return None if values[0] is None else np.array(values[0] if alike else values)

    target: Any = first.target
    if not isinstance(target, Path):
        target = of_cases([entry.target for entry in entries])
    elif isinstance(target, Waveform) and not alike:
        waves = [entry.target for entry in entries if isinstance(entry.target, Waveform)]
        low, high, period = ([getattr(wave, part) for wave in waves] for part in ("low", "high", "period"))
        target = Waveform(low, high, period, target.cycles, target.shape)
    step_type = STEPS.get(_control(recipe, recipe.step[0]), Step)
    rate, duration = of_cases([entry.rate for entry in entries]), of_cases([entry.duration for entry in entries])
    return step_type(**({} if first.control is None else {first.control: target}), rate=rate, duration=duration)


def solver_steps(recipe: Any, inputs: Inputs) -> list[Entry]:
    """The recipe's steps as the solver takes them; forces become nominal stresses, tables become ramps."""
    if recipe.load is not None:
        inputs.read(recipe.load)
    entries: list[Entry] = []
    for index, step in enumerate(recipe.step):
        if step.hold is not None:
            entries.append(Entry(index, None, None, None, step.hold))
        elif step.table is not None:
            entries += _followed(index, step, recipe, inputs)
        elif step.waveform is not None:
            entries.append(_cycling(index, step, recipe))
        else:
            _, value, rate, unit = step.aim()
            area = _area_for(unit, recipe)
            entries.append(Entry(index, _control(recipe, step), value / area, None if rate is None else rate / area, step.duration))
    return marked_still(entries, recipe.step[0].REST)


def marked_still(entries: Sequence[Entry], rest: float) -> list[Entry]:
    """The entries, marked as `still` if they do not change the load, which begins at `rest`. Still and moving entries are never
    solved together, so that no result depends on the other cases.

    Raises `InputError` for a rate at which the duration of an entry is implausible.
    """
    present, marked = rest, []
    for entry in entries:
        took = lasting(entry, present)
        if entry.rate is not None and took > 0 and not TIMES[0] <= took <= TIMES[1]:
            needed = f"from {TIMES[0]:g} to {TIMES[1]:g} s is needed"
            raise InputError(f"the step takes {took:.3g} s; {needed}", key=f"step[{entry.origin}].rate")
        marked.append(replace(entry, still=not isinstance(entry.target, Path) and entry.target in (None, present)))
        present = reached(entry, present)
    return marked


def reached(entry: Entry, present: float) -> float:
    """The prescribed value after an entry."""
    if isinstance(entry.target, Path):
        return float(np.asarray(entry.target.last))
    return present if entry.target is None else entry.target


def corners(entry: Entry, present: float) -> list[tuple[float, float]]:
    """The values that an entry reaches in turn (for a waveform, in its first cycle), and the time to each value in s."""
    target = entry.target
    if isinstance(target, Track):
        time, values = np.asarray(target.time), np.asarray(target.value)
        return list(zip(values.tolist(), np.diff(time, prepend=0.0).tolist(), strict=True))
    if isinstance(target, Waveform):
        low, half = reached(entry, present), 0.5 * float(np.asarray(target.period))
        turns = [(low, 0.0), (float(np.asarray(target.high)), half), (low, half)]
        return turns if target.cycles == 1 else [*turns, (low, 2 * half * (target.cycles - 1))]
    return [(reached(entry, present), lasting(entry, present))]


def aims(entries: Sequence[Entry]) -> list[float]:
    """All target values of the entries."""
    return [value for entry in entries if entry.target is not None for value, _ in corners(entry, 0.0)]


def reached_at_once(entries: Sequence[Entry]) -> float:
    """The largest magnitude that the first entries reach in no time."""
    largest, present = 0.0, 0.0
    for entry in entries:
        for value, lasts in corners(entry, present):
            if lasts > 0:
                return largest
            largest, present = max(largest, abs(value)), value
    return largest


def lasting(entry: Entry, present: float) -> float:
    """The duration of an entry in s; 0 at a rate of 0, which the solver refuses."""
    if isinstance(entry.target, Path):
        return entry.target.duration
    if entry.rate is None:
        return entry.duration or 0.0
    return abs((entry.target - present) / entry.rate) if entry.target is not None and entry.rate != 0 else 0.0


def timed(entries: Sequence[Entry], rest: float) -> Iterator[tuple[float, float, Entry]]:
    """The times in s at which every entry begins and ends, and the entry; the load begins at `rest`."""
    begin, present = 0.0, rest
    for entry in entries:
        end = begin + lasting(entry, present)
        yield begin, end, entry
        begin, present = end, reached(entry, present)


def end_of(entries: Sequence[Entry], rest: float) -> float:
    """The time in s at which the last entry ends; the load begins at `rest`."""
    return max(end for _, end, _ in timed(entries, rest))


def _followed(index: int, step: Any, recipe: Any, inputs: Inputs) -> list[Entry]:
    """Ramps through the points of a table, and jumps if it is a result of dielast with jumps; its times begin with the step."""
    from dielast.io.cells import TextFormat
    from dielast.io.text_table import read_measured
    from dielast.readings.specimen import read_as, role_in

    name, control, columns = step.table, _control(recipe, step), step.columns
    points = read_measured(inputs.read(name), name, TextFormat(sheet=step.sheet))
    key = f"step[{index}].columns"

    def check(role: str, column: str | int) -> None:
        """The column must exist."""
        with placed(lambda problem: problem.within(key=f"{key}.{role}")):
            points.find(column, role)

    time_column = (columns and columns.time) or "time"
    check("time", time_column)
    if control in ("voltage", "charge"):
        role, column = control, (columns and getattr(columns, control)) or control
        if column == "charge" and not points.has("charge") and points.has("charge_density"):
            column = "charge_density"
        jumps = points.has("true_field")
    else:
        with placed(lambda problem: problem.within(key=key)):
            role, column = role_in(points, control, columns)
        jumps = column in OWN
    check(role, column)
    time = ascending_times(points, name, jumps, time_column)
    if control == "voltage":
        values = points.column(column, control, VOLTAGE)
    elif control == "charge":
        values = _charges(index, points, column, recipe)
    else:
        values = read_as(points, role, column, recipe.specimen)
        for row in np.flatnonzero(values <= 0)[:1] if control == "stretch" else ():
            needed = f"stretch {values[row]:g}: a number above 0 is needed (1 is undeformed)"
            raise InputError(needed, file=name, line=points.lines[row])
    return tracks(index, control, time, values)


def tracks(index: int, control: str, time: Floats, values: Floats) -> list[Entry]:
    """Points of a table of load (k,) as entries; a new entry begins at each jump, that is, at two points of one time."""
    entries, starts = [], [0, *(np.flatnonzero(np.diff(time) == 0) + 1).tolist(), time.size]
    for first, end in pairwise(starts):
        begin = time[first] if first else 0.0
        entries.append(Entry(index, control, Track(time[first:end] - begin, values[first:end])))
    return entries


def _cycling(index: int, step: Any, recipe: Any) -> Entry:
    """Cycles between two values; of a force or a stress according to their unit. By default the lower value is that at rest."""
    (low, _), (high, unit) = (value if isinstance(value, tuple) else (value, "") for value in (step.low, step.high))
    area = _area_for(unit, recipe)
    low = (step.REST if low is None else low) / area
    return Entry(index, _control(recipe, step), Waveform(low, high / area, step.period, step.cycles or 1, step.waveform))


def _control(recipe: Any, step: Any) -> str:
    """The quantity that a step prescribes: as stated in the recipe for all steps, or that of the step itself."""
    return str(getattr(recipe, "control", step.CONTROL))


def _charges(index: int, points: MeasuredTable, column: str | int, recipe: Any) -> Floats:
    """Charges in C/m^2 of undeformed area from a table of such charges, or of charges of the electrode."""
    is_density = points.names[points.find(column, "charge")].strip() == "charge_density"
    if not is_density:
        # the unit tells charge densities from charges
        with suppress(InputError):
            points.check(column, "charge", CHARGE_DENSITY)
            is_density = True
    if is_density:
        return points.column(column, "charge", CHARGE_DENSITY)
    values = points.column(column, "charge", CHARGE)
    if recipe.film.electrode_diameter is None:
        raise InputError("a table of charges in C needs film.electrode_diameter", key=f"step[{index}].table")
    return values / _area_for(CHARGE.unit, recipe)


def _area_for(unit: str, recipe: Any) -> float:
    """The area by which a value in this unit is divided: the cross-section for a force, the electrode for a charge, else 1."""
    if unit == CHARGE.unit:
        return float(recipe.film.electrode_area)
    if unit != FORCE.unit:
        return 1.0
    area: float | None = recipe.specimen.area if recipe.specimen is not None else None
    if area is None:
        raise InputError("a force needs [specimen] with width and thickness, or state stress")
    return area


def in_recipe_terms(problem: Problem, origin: Sequence[int], members: Sequence[int], cases: int) -> Problem:
    """A problem of the solver in the terms of the recipe: its key, and the number of the case if there are several `cases`.

    `origin` holds the number of the recipe's step for each step of the solver, `members` the cases that the solver was called for.
    """
    row = 0 if len(members) == 1 else problem.case
    problem = replace(problem, case=None if row is None else of_case(members[row], cases))
    if problem.step is None:
        return problem.in_keys(KEYS)
    key = f"step[{origin[problem.step]}]" + (f".{problem.argument}" if problem.argument else "")
    return replace(problem, step=None, key=key)


def ascending_times(points: MeasuredTable, name: str, jumps: bool = False, column: str | int = "time") -> Floats:
    """The times in the `column` of a table of load in s; with `jumps` they may repeat.

    Raises `InputError` naming the line unless they ascend from 0 or later, or if it is a result of several cases.
    """
    if points.has("case"):
        number = points.cells[points.find("case", "case")]
        for line, case in zip(points.lines, number, strict=True):
            if case != number[0]:
                ends = f"case {number[0]} ends and case {case} begins, so that times do not ascend"
                raise InputError(f"{ends}: a load is one case, so leave only its rows in the table", file=name, line=line)
    time = points.column(column, "time", TIME)
    before = np.append(-1.0, time[:-1])
    late = time < before if jumps else time <= before
    wrong = np.flatnonzero(late | (time < 0) | (time > TIMES[1]))
    if wrong.size:
        row = int(wrong[0])
        if time[row] > TIMES[1]:
            raise InputError(f"time {time[row]:g} s: at most {TIMES[1]:g} s is needed", file=name, line=points.lines[row])
        what = f"does not come after {before[row]:g} s" if row and time[row] >= 0 else "is negative"
        raise InputError(
            f"time {time[row]:g} s {what}; the times of a load must ascend from 0 s", file=name, line=points.lines[row]
        )
    return time
