"""A recipe's steps as the solver takes them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from dielast.base.errors import InputError, Problem, placed, reached_by, warn
from dielast.base.units import CHARGE, CHARGE_DENSITY, FORCE, NUMBER, STRESS, TIME, TIMES, VOLTAGE
from dielast.commands.simulation.recipe import KEYS
from dielast.commands.simulation.timed_steps import SolverStep, TimedStep, TimedSteps
from dielast.io.files import Inputs
from dielast.mechanics.cases import of_case
from dielast.mechanics.load import ChargeStep, FilmStep, Repeat, Step, Track, VoltageStep, Waveform
from dielast.numerics.arrays import Floats

if TYPE_CHECKING:
    from dielast.io.text_table import MeasuredTable

STEPS: dict[str, Callable[..., SolverStep]] = {"voltage": VoltageStep, "charge": ChargeStep, "stretch": Step, "stress": Step}
"""The step of the solver that prescribes a quantity, as an argument of this name."""
IN_WORDS = {"stretch": "a stretch of {:g}", "stress": "a nominal stress of {:g} Pa", "voltage": "{:g} V", "charge": "{:g} C/m^2"}
OWN = ("stretch_1", "nominal_stress_1")


def solver_steps(recipe: Any, inputs: Inputs) -> TimedSteps:
    """The recipe's steps as the solver takes them; forces become nominal stresses, tables become ramps.

    Raises `InputError` for tables that cannot be read, and for a rate at which the duration of a step is implausible.
    """
    if recipe.load is not None:
        inputs.read(recipe.load)
    timed: list[TimedStep] = []
    begin, present = 0.0, recipe.step[0].REST
    edges = recipe.film.prestretch if getattr(recipe, "programme", False) else (1.0, 1.0)
    for index, step in enumerate(recipe.step):
        with nullcontext() if step.table is None else reached_by(f"step[{index}].table"):
            stated = list(_of_recipe(index, step, recipe, inputs))
        for of_solver in stated:
            entry = TimedStep(of_solver, index, begin, present, edges)
            if step.table is not None and (not timed or timed[-1].number != index):
                _warn_of_beginning(entry, step.table, _control(recipe, step))
            edges = entry.stretched
            if of_solver.rate is not None and entry.lasts > 0 and not TIMES[0] <= entry.lasts <= TIMES[1]:
                needed = f"from {TIMES[0]:g} to {TIMES[1]:g} s is needed"
                raise InputError(f"the step takes {entry.lasts:.3g} s; {needed}", key=f"step[{index}].rate")
            timed.append(entry)
            begin, present = entry.end, entry.after
    repeat = getattr(recipe, "repeat", None)
    return TimedSteps(timed, None if repeat is None else Repeat(repeat.times, *(repeat.steps or ())))


def _warn_of_beginning(entry: TimedStep, table: str, control: str) -> None:
    """Warn of a table of load that begins farther from what was before, in time or in value, than any two of its points are."""
    if not isinstance(track := entry.driven, Track) or np.size(track.time) < 3:
        return
    time, values, before = np.asarray(track.time, dtype=float), track.values(), entry.before
    late, far = time[0] > np.max(np.diff(time)), abs(values[0] - before) > np.max(np.abs(np.diff(values)))
    if (late or far) and values[0] != before:
        how = f"at {time[0]:g} s: until then it goes there evenly" if time[0] > 0 else "at 0 s: it goes there at once"
        warn(f"{table}: the table begins with {IN_WORDS[control].format(values[0])} {how}, from {before:g}")


def _of_recipe(index: int, step: Any, recipe: Any, inputs: Inputs) -> Iterable[SolverStep]:
    """A step of the recipe as the solver takes it; several steps for a table with jumps."""
    if getattr(recipe, "programme", False):
        return [_of_programme(index, step, recipe, inputs)]
    control = _control(recipe, step)
    make = STEPS[control]
    if step.hold is not None:
        return [make(duration=step.hold)]
    if step.table is not None:
        return (make(**{control: track}) for track in _followed(index, step, recipe, inputs))
    if step.waveform is not None:
        return [make(**{control: _cycling(step, recipe)})]
    _, value, rate, unit = step.aim()
    area = _area_for(unit, recipe)
    return [make(**{control: value / area}, rate=None if rate is None else rate / area, duration=step.duration)]


def _of_programme(index: int, step: Any, recipe: Any, inputs: Inputs) -> FilmStep:
    """A step of a programme of edges and electrodes as the solver takes it."""
    if step.hold is not None:
        return FilmStep(duration=step.hold)
    if step.table is not None:
        return FilmStep(**_film_tracks(index, step, recipe, inputs))
    values: dict[str, Any] = {"circuit": step.circuit}
    for key in ("stretch", "stress", "force"):
        if (ends := getattr(step, key)) is None:
            continue
        low, high = (None if end is None else _at_edges(end, key, recipe) for end in ends)
        if low is not None:
            waves = [Waveform(a, b, step.period, step.cycles or 1, step.waveform) for a, b in zip(low, high or (), strict=True)]
            values["stress" if key == "force" else key] = waves[0] if len(waves) == 1 else tuple(waves)
        elif high is not None:
            values["stress" if key == "force" else key] = high[0] if len(high) == 1 else high
    if step.waveform is not None and step.high is not None:
        values["voltage" if step.high[1] == VOLTAGE.unit else "charge"] = _cycling(step, recipe)
        values["phase"] = step.phase or 0.0
    elif step.voltage is not None:
        values["voltage"] = step.voltage
    elif step.charge is not None:
        values["charge"] = step.charge[0] / _area_for(step.charge[1], recipe)
    rate = None if step.rate is None else step.rate[0] / _area_for(step.rate[1].removesuffix("/s"), recipe)
    return FilmStep(**values, rate=rate, duration=step.duration)


def _at_edges(values: Sequence[float], key: str, recipe: Any) -> tuple[float, ...]:
    """What the edges go to, a force as a nominal stress in Pa; in a mode of one axis, a pair has the values of both."""
    if key != "force":
        return tuple(values)
    film = recipe.film
    widths = [film.width_across(axis) for axis in range(2)]
    both = values if len(values) == 2 else (values[0],) * (1 if widths[0] == widths[1] or recipe.mode != "equibiaxial" else 2)
    return tuple(value / (width * film.thickness) for value, width in zip(both, widths, strict=False))


def _table(step: Any, inputs: Inputs) -> tuple[MeasuredTable, dict[str, str | int]]:
    """The table of load that a step names, and the columns that the step states, by role."""
    from dielast.io.cells import TextFormat
    from dielast.io.text_table import read_measured

    points = read_measured(inputs.read(step.table), step.table, TextFormat(sheet=step.sheet))
    return points, {} if step.columns is None else step.columns.by_role


def _film_tracks(index: int, step: Any, recipe: Any, inputs: Inputs) -> dict[str, Any]:
    """The columns of a table for edges and electrodes as tracks; by default its voltage."""
    points, stated = _table(step, inputs)
    with placed(lambda problem: problem.within(key=f"step[{index}].columns")):
        time = ascending_times(points, column=stated.pop("time", "time"))
        columns = stated or {"voltage": "voltage"}
        return {role: Track(time, _values(index, points, role, column, recipe)) for role, column in columns.items()}


def _values(index: int, points: MeasuredTable, role: str, column: str | int, recipe: Any) -> Floats:
    """What drives a film, from a column of a table of load, in SI."""
    if role == "charge":
        return _charges(index, points, column, recipe)
    return points.column(column, role, {"voltage": VOLTAGE, "stretch": NUMBER, "stress": STRESS}[role])


def _followed(index: int, step: Any, recipe: Any, inputs: Inputs) -> Iterator[Track]:
    """Ramps through the points of a table, and jumps if it is a result of dielast with jumps; its times begin with the step."""
    from dielast.readings.quantities import read_as, role_in

    control, (points, stated) = _control(recipe, step), _table(step, inputs)
    key = f"step[{index}].columns"

    def check(role: str, column: str | int) -> None:
        """The column must exist."""
        with placed(lambda problem: problem.within(key=f"{key}.{role}")):
            points.find(column, role)

    time_column = stated.get("time", "time")
    check("time", time_column)
    column: str | int
    if control in ("voltage", "charge"):
        role, column = control, stated.get(control, control)
        if column == "charge" and not points.has("charge") and points.has("charge_density"):
            column = "charge_density"
        jumps = points.has("true_field")
    else:
        with placed(lambda problem: problem.within(key=key)):
            role, column = role_in(points, control, step.columns)
        jumps = column in OWN
    check(role, column)
    time = ascending_times(points, jumps, time_column)
    if control in ("voltage", "charge"):
        values = _values(index, points, control, column, recipe)
    else:
        values = read_as(points, role, column, recipe.specimen)
        for row in np.flatnonzero(values <= 0)[:1] if control == "stretch" else ():
            raise points.error(f"stretch {values[row]:g}: a number above 0 is needed (1 is undeformed)", row)
    return tracks(time, values)


def tracks(time: Floats, values: Floats) -> Iterator[Track]:
    """Points of a table of load (k,) as tracks; a new one begins at each jump, that is, at two points of one time."""
    for first, end in pairwise([0, *(np.flatnonzero(np.diff(time) == 0) + 1).tolist(), time.size]):
        yield Track(time[first:end] - (time[first] if first else 0.0), values[first:end])


def _cycling(step: Any, recipe: Any) -> Waveform:
    """Cycles between two values; of a force or a stress according to their unit. By default the lower value is that at rest."""
    (low, _), (high, unit) = (value if isinstance(value, tuple) else (value, "") for value in (step.low, step.high))
    area = _area_for(unit, recipe)
    low = (step.REST if low is None else low) / area
    return Waveform(low, high / area, step.period, step.cycles or 1, step.waveform)


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


def ascending_times(points: MeasuredTable, jumps: bool = False, column: str | int = "time") -> Floats:
    """The times in the `column` of a table of load in s; with `jumps` they may repeat.

    Raises `InputError` naming the line unless they ascend from 0 or later, or if it is a result of several cases.
    """
    if points.has("case"):
        number = points.cells[points.find("case", "case")]
        for row, case in enumerate(number):
            if case != number[0]:
                ends = f"case {number[0]} ends and case {case} begins, so that times do not ascend"
                raise points.error(f"{ends}: a load is one case, so leave only its rows in the table", row)
    time = points.column(column, "time", TIME)
    before = np.append(-1.0, time[:-1])
    late = time < before if jumps else time <= before
    for row in np.flatnonzero(late | (time < 0) | (time > TIMES[1]))[:1]:
        if time[row] > TIMES[1]:
            raise points.error(f"time {time[row]:g} s: at most {TIMES[1]:g} s is needed", row)
        what = f"does not come after {before[row]:g} s" if row and time[row] >= 0 else "is negative"
        raise points.error(f"time {time[row]:g} s {what}; the times of a load must ascend from 0 s", row)
    return time
