"""A recipe's steps as the solver takes them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError
from dielast.files import Inputs
from dielast.load import Step
from dielast.recipe.simulation import CreepRecipe, HistoryStep, LoadStep, Output, RelaxRecipe, StretchStep
from dielast.simulate.output import HOLD_DECADES, RAMP_DECADES
from dielast.units import FORCE, NUMBER, STRESS, TIME, TIMES

if TYPE_CHECKING:
    from dielast.measured import MeasuredTable

Array = NDArray[np.float64]
# what an error of the solver begins with -> the key that it is about
KEYS = {
    "prestretch rate": "film.prestretch_rate",
    "prestretch": "film.prestretch",
    "output time": "output.times",
    "temperature": "temperature",
    "material": "material",
}
# columns of a table of load, the first that is there being followed: a user's names, then those of dielast's own results
STRETCHES = {"stretch": NUMBER, "stretch_1": NUMBER}
LOADS = {"force": FORCE, "stress": STRESS, "nominal_stress_1": STRESS}
OWN = ("stretch_1", "nominal_stress_1")
Recipe = RelaxRecipe | CreepRecipe


@dataclass(frozen=True, slots=True)
class Entry:
    """One step of a history for the solver, and the recipe step (from 0) it comes from; what is not stated is None."""

    origin: int
    control: str | None
    target: float | None
    rate: float | None
    duration: float | None
    still: bool = False
    """Whether the target is what is there already."""

    @property
    def shape(self) -> tuple[Any, ...]:
        """What entries must share to be run together."""
        return (self.control, self.rate is None, self.duration is None, self.duration == 0, self.still)


def values_of(entries: Sequence[Entry], name: str) -> Array | None:
    """One value of the same step of several cases, as an array (cases,), or () if it is one case again and again."""
    if getattr(entries[0], name) is None:
        return None
    if all(entry is entries[0] for entry in entries):
        return np.array(getattr(entries[0], name))
    return np.array([getattr(entry, name) for entry in entries])


def joined(entries: Sequence[Entry]) -> Step:
    """The same step of several cases as one, with arrays as in `values_of`."""
    targets = {} if entries[0].control is None else {entries[0].control: values_of(entries, "target")}
    return Step(**targets, rate=values_of(entries, "rate"), duration=values_of(entries, "duration"))


def solver_steps(recipe: Recipe, inputs: Inputs) -> list[Entry]:
    """The recipe's steps as the solver takes them; forces become nominal stresses, tables become ramps."""
    if recipe.load is not None:
        inputs.read(recipe.load)
    entries: list[Entry] = []
    for index, step in enumerate(recipe.step):
        if step.hold is not None:
            entries.append(Entry(index, None, None, None, step.hold))
        elif step.table is not None:
            entries += _followed(index, step, step.table, recipe, inputs)
        elif isinstance(step, StretchStep):
            entries.append(Entry(index, "stretch", step.stretch, step.rate, step.duration))
        elif isinstance(step, LoadStep):
            entries.append(_loaded(index, step, recipe))
    return marked_still(entries, 1.0 if recipe.kind == "relax" else 0.0)


def output_times(output: Output, entries: Sequence[Entry], rest: float) -> tuple[float, ...] | None:
    """The times at which a history is put out, or None where the solver's own are right: log-spaced from the start of each entry.

    A recipe's step that takes many entries, a table or a waveform, is one series all the same, and shows each of its points.
    `rest` is the value that is prescribed to begin with.
    """
    if output.times is not None:
        return tuple(output.times)
    if len({entry.origin for entry in entries}) == len(entries):
        return None
    times, start, present = [np.zeros(1)], 0.0, rest
    for _, group in groupby(entries, key=lambda entry: entry.origin):
        own = list(group)
        ends: list[float] = []
        for entry in own:
            ends.append(lasting(entry, present) + (ends[-1] if ends else 0.0))
            present = present if entry.target is None else entry.target
        decades = HOLD_DECADES if len(own) == 1 and own[0].still else RAMP_DECADES
        spaced = ends[-1] * np.logspace(-decades, 0, decades * output.points_per_decade + 1)
        times += [start + spaced, start + np.array(ends)]
        start += ends[-1]
    return tuple(np.unique(np.concatenate(times)).tolist())


def marked_still(entries: Sequence[Entry], rest: float) -> list[Entry]:
    """The entries with those marked that lead nowhere, from `rest` on: no case is solved in another way for its company's sake.

    Raises `InputError` for a rate at which an entry would last for no time that can be meant.
    """
    present, marked = rest, []
    for entry in entries:
        took = lasting(entry, present)
        if entry.rate is not None and took > 0 and not TIMES[0] <= took <= TIMES[1]:
            needed = f"from {TIMES[0]:g} to {TIMES[1]:g} s is needed"
            raise InputError(f"step[{entry.origin}].rate: the step takes {took:.3g} s; {needed}")
        marked.append(replace(entry, still=entry.target is None or entry.target == present))
        present = present if entry.target is None else entry.target
    return marked


def lasting(entry: Entry, present: float) -> float:
    """How long an entry takes in s; 0 at a rate of 0, which the solver refuses."""
    if entry.rate is None:
        return entry.duration or 0.0
    return abs((entry.target - present) / entry.rate) if entry.target is not None and entry.rate != 0 else 0.0


def _loaded(index: int, step: LoadStep, recipe: Recipe) -> Entry:
    area = _area(recipe) if step.force is not None else 1.0
    target = step.stress if step.force is None else step.force
    assert target is not None
    return Entry(index, "stress", target / area, step.rate[0] / area if step.rate is not None else None, step.duration)


def _followed(index: int, step: HistoryStep, name: str, recipe: Recipe, inputs: Inputs) -> list[Entry]:
    """Ramps through the points of a table, jumps where a result of dielast's jumps; its times count from the start of the step."""
    from dielast.measured import read_measured

    points = read_measured(inputs.read(name), name)
    control, known = ("stretch", STRETCHES) if isinstance(step, StretchStep) else ("stress", LOADS)
    column = next((column for column in known if points.has(column)), control)
    time = ascending_times(points, name, jumps=column in OWN)
    values = points.column(column, column, known[column]) / (_area(recipe) if column == "force" else 1.0)
    if control == "stretch":
        for row in np.flatnonzero(values <= 0)[:1]:
            raise InputError(
                f"{name}: line {points.lines[row]}: stretch {values[row]:g}: a number above 0 is needed (1 is undeformed)"
            )
    durations = np.diff(time, prepend=0.0)
    return [Entry(index, control, value, None, lasts) for value, lasts in zip(values.tolist(), durations.tolist(), strict=True)]


def _area(recipe: Recipe) -> float:
    specimen = recipe.specimen if isinstance(recipe, CreepRecipe) else None
    if specimen is None:
        raise InputError("a force needs [specimen] with width and thickness, or state stress")
    return specimen.area


def in_recipe_terms(line: str, origin: Sequence[int], members: Sequence[int], cases: int) -> str:
    """An error of the solver in the recipe's terms: the key, and of so many `cases` the one that is meant.

    `origin` says which of the recipe's steps each of the solver's came from, `members` which cases the solver was given.
    """
    found = re.match(r"(?:step (\d+): )?(?:case (\d+): )?", line)
    assert found is not None
    step, case = found.groups()
    told = in_keys(line[found.end() :]) if step is None else f"step[{origin[int(step)]}]: {line[found.end() :]}"
    one = int(case) if case is not None else 0 if len(members) == 1 else None
    return told if one is None or cases == 1 else f"case {members[one]}: {told}"


def in_keys(said: str) -> str:
    """What the solver says of one of its arguments, said of the recipe's key for it."""
    if "has no permittivity" in said:
        said += ": state [dielectric] permittivity in the material file"
    for words, key in KEYS.items():
        if said.startswith(f"{words} "):
            return f"{key}: {said.removeprefix(f'{words} ')}"
    return f"breakdown: {said}" if said.startswith("a breakdown field") else said


def ascending_times(points: MeasuredTable, name: str, jumps: bool = False) -> Array:
    """The times of a table of load in s; with `jumps` they may repeat.

    Raises `InputError` naming the line unless they ascend from 0 or later, or if it is a result of several cases.
    """
    if points.has("case"):
        number = points.cells[points.find("case", "case")]
        for line, own in zip(points.lines, number, strict=True):
            if own != number[0]:
                ends = f"case {number[0]} ends and case {own} begins, so that times do not ascend"
                raise InputError(f"{name}: line {line}: {ends}: a load is one case, so leave only its rows in the table")
    time = points.column("time", "time", TIME)
    before = np.append(-1.0, time[:-1])
    late = time < before if jumps else time <= before
    wrong = np.flatnonzero(late | (time < 0) | (time > TIMES[1]))
    if wrong.size:
        row = int(wrong[0])
        if time[row] > TIMES[1]:
            raise InputError(f"{name}: line {points.lines[row]}: time {time[row]:g} s: at most {TIMES[1]:g} s is needed")
        what = f"does not come after {before[row]:g} s" if row and time[row] >= 0 else "is negative"
        raise InputError(f"{name}: line {points.lines[row]}: time {time[row]:g} s {what}; the times of a load must ascend from 0 s")
    return time
