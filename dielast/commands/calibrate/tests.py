"""Read the tests of a recipe."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from dielast.base.errors import InputError, Mistakes, and_more, in_keys, located, placed, warn
from dielast.base.units import TIME
from dielast.calibration.doubts import gives_work, slack_of, softening, stress_at_rest
from dielast.calibration.estimate import USUAL_ERROR
from dielast.calibration.experiment import Experiment, MeasuredTest, corners, path_length
from dielast.calibration.ringing import loaded_at_rest, ringing, runs
from dielast.calibration.voltage import VoltageTest
from dielast.commands.calibrate.recipe import TestData
from dielast.commands.calibrate.simulated import recipe_tests
from dielast.commands.calibrate.voltage_tests import read_voltage_test
from dielast.io.files import Inputs
from dielast.io.text_table import MeasuredTable, read_measured
from dielast.material.checks import SQUEEZED
from dielast.material.material import Material
from dielast.numerics.arrays import Flags, Floats
from dielast.readings.quantities import mistaken, read_as, role_in

MOST_SEARCHED, MOST_SPANS = 3000, 3  # points that are searched for ringing, and times that a warning names
MOST_POINTS = 400  # of a test that are compared: more points carry no more information
FAR_FROM_REST, SLACK = 1.5, 0.1  # stretch, and stress over the largest of the test, that do not go together
FARTHEST = 20.0  # stretch that no specimen bears
ACCURACY = 0.01  # of the largest extension: that of an extensometer of class 1 (ISO 9513)
Rows = np.ndarray[tuple[int], np.dtype[np.int64]]
_TRUE = ("true", "cauchy")


def read_tests(
    tests: Sequence[TestData], inputs: Inputs, temperature: float, key: str, fixed: Sequence[Material] = ()
) -> list[Experiment]:
    """All tests under a `key`, in tables and recipes; `temperature` in degC is the default.

    Raises `InputError` with a line for every mistake, also for a test at a temperature at which the shift law of one of the
    materials does not hold whose shift law is `fixed`.
    """
    found, wrong = list[Experiment](), Mistakes()
    for index, (test, name) in enumerate(zip(tests, named(tests), strict=True)):
        made = wrong.tried(partial(_read, test, inputs, temperature, name, f"{key}[{index}]", fixed))
        found += made or ()
    wrong.refuse()
    return found


def _read(test: TestData, inputs: Inputs, temperature: float, name: str, key: str, fixed: Sequence[Material]) -> list[Experiment]:
    """The test of a table, or the tests of a recipe."""
    if test.recipe is None:
        with placed(lambda problem: problem.within(key=f"{key}.file") if problem.file else problem.at(key=key)):
            made = read_test(test, inputs, temperature, name, key)
        with placed(lambda problem: problem.within(key=f"{key}.temperature")):
            check_temperature(test, made.temperature, fixed)
        return [made]
    with placed(lambda problem: problem.within(key=f"{key}.recipe")):
        return list(recipe_tests(test.recipe, inputs, name, test.specimen_id or name, temperature))


def check_temperature(test: TestData, temperature: float, fixed: Sequence[Material]) -> None:
    """`InputError` with the file of a test at a temperature in degC at which the `fixed` shift law of a material does not hold."""
    for material in fixed:
        try:
            material.relaxation_time(temperature)
        except InputError as error:
            raise InputError(error.problems[0].text, file=test.file) from None


def named(tests: Sequence[TestData]) -> list[str]:
    """The names of the tests: label or file, with a number if several tests share it."""
    names = [test.label or _called(test) for test in tests]
    return [f"{name} ({names[: k + 1].count(name)})" if names.count(name) > 1 else name for k, name in enumerate(names)]


def read_test(test: TestData, inputs: Inputs, temperature: float, name: str, key: str) -> MeasuredTest | VoltageTest:
    """A test of a table under a `key`; raises `InputError` naming the file for columns that are missing or wrong."""
    assert test.file is not None
    if test.film is not None:
        return read_voltage_test(test, inputs, temperature, name)
    table = read_measured(inputs.read(test.file), test.file, test.text_format(), test.units)
    rows = table.rows_where(test.where)
    with in_keys({"specimen": f"{key}.specimen"}):
        stretch = _quantity(table, test, "stretch", rows)
        stress = _quantity(table, test, "stress", rows)
    lines = table.lines[rows]
    for row in np.flatnonzero(stretch <= 0)[:1]:
        line = int(lines[row])
        wanted = "a number above 0 is needed (1 is undeformed): is the column a strain? then state columns.strain"
        raise InputError(f"stretch {stretch[row]:g}: {wanted}", file=test.file, line=line)
    if test.rate is not None:
        if table.has("time"):
            warn(f"{test.file}: rate states the times in place of the column time: of a table with times, leave rate out")
        time = np.cumsum(np.abs(np.diff(stretch, prepend=1.0))) / test.rate
        moved = np.diff(time, prepend=-1.0) > 0
        time, stretch, stress = time[moved], stretch[moved], stress[moved]
    else:
        column = test.columns.time or "time"
        try:
            table.find(column, "time")
        except InputError as missing:
            raise table.error(f"{missing.problems[0].text}; state columns.time, or rate if the table has no times") from None
        time = table.column(column, "time", TIME, rows)
        time, stretch, stress, lines = _without_repetitions(time, stretch, stress, lines, test.file)
        for row in np.flatnonzero(np.diff(time, prepend=-1e-300) <= 0)[:1]:
            before = f"{time[row - 1]:g} s" if row else "the start"
            late = f"time {time[row]:g} s does not come after {before}: the times of a test must ascend from 0 s"
            if time[row] == 0 and row == 0:
                continue
            raise InputError(f"{late}; of a table of several tests, choose one by where", file=test.file, line=int(lines[row]))
    at = temperature if test.temperature is None else test.temperature
    with located(file=test.file):
        specimen = test.specimen_id or name
        whole = MeasuredTest(name, time, stretch, stress, at, test.mode, specimen, test.nominal_field, test.ramp_rate, test.slack)
        left_out = _left_out(test, whole, time)
        # every point left out stays, to be counted and shown
        kept = np.union1d(_thinned(time, stretch), np.flatnonzero(left_out))
        made = replace(whole, time=time[kept], stretch=stretch[kept], stress=stress[kept], left_out=left_out[kept])
    if gives_work(made):
        signs = "the stress has the other sign than the stretch has, so that the specimen gives more work than it takes"
        raise InputError(f"{signs}: tension is positive, change the sign of the column", file=test.file)
    _warn_of_beginning(test, made, float(stretch[0]), float(stress[0]))
    return made


def _left_out(test: TestData, whole: MeasuredTest, time: Floats) -> Flags:
    """The points (n,) at these times of a test that the misfit leaves out; warns of those that the recipe does not state."""
    stated = time < test.discard_before
    for k, (begin, end) in enumerate(test.discard):
        inside = (time >= begin) & (time <= end)
        if not inside.any():
            warn(f"discard[{k}]: there is no point from {begin:g} to {end:g} s")
        stated |= inside
    if test.ignore == "none":
        return stated
    resting, swinging = (np.zeros(time.size, dtype=bool) for _ in range(2))
    rows = _thinned(whole.time, whole.stretch, MOST_SEARCHED)
    offset = time.size - whole.time.size  # a point of a stretch reached at once
    part = replace(whole, time=whole.time[rows], stretch=whole.stretch[rows], stress=whole.stress[rows]) if offset == 0 else whole
    for begin, end in runs(ringing(part)):
        swinging |= (time >= part.time[begin]) & (time <= part.time[end - 1])
    resting[offset:] = loaded_at_rest(whole)
    for found, what in (
        (swinging & ~stated, "a force that swings as that of no film does which follows the measured extension"),
        (resting & ~stated & ~swinging, "a force at rest"),
    ):
        if found.any():
            spans = [f"{time[begin]:.4g} to {time[end - 1]:.4g} s" for begin, end in runs(found)]
            where = f"{', '.join(spans[:MOST_SPANS])}{and_more(len(spans) - MOST_SPANS) if len(spans) > MOST_SPANS else ''}"
            points = f"{np.count_nonzero(found)} of {time.size} points are left out of the misfit"
            warn(f'{points}, at {where}: {what}; ignore = "none" keeps them')
    return np.asarray(stated | swinging | resting)


def _warn_of_beginning(test: TestData, made: MeasuredTest, stretch: float, stress: float) -> None:
    """Warn of what a test shows about its rest, and of a first point of this stretch and stress that does not fit to it."""
    slack, offset = slack_of(made), stress_at_rest(made)
    if np.min(made.stretch) < SQUEEZED:
        squeezed = f"a stretch of {np.min(made.stretch):.4g} is compression (1 is undeformed)"
        warn(f"{test.file}: {squeezed}: is the column a strain? then state columns.strain")
    if np.max(made.stretch) > FARTHEST:
        far = f"the stretch reaches {np.max(made.stretch):.4g}"
        warn(f'{test.file}: {far}: is the column in per cent? then state its unit, such as "strain [%]"')
    elif stretch > FAR_FROM_REST and abs(stress) < SLACK * np.max(np.abs(made.stress)):
        loose = f"the first point has a stretch of {stretch:.4g}, but next to no stress"
        warn(f"{test.file}: {loose}: stretches count from the undeformed state, 1; is the column a stretch, but read as a strain?")
    elif test.ramp_rate is None and test.rate is None and begins_late(made):
        began = f"the first point is at {made.time[0]:g} s and a stretch of {made.stretch[0]:g}"
        warn(f"{test.file}: {began}: it is reached by a ramp from time 0; if the test was a ramp and a hold, state ramp_rate")
    elif slack > ACCURACY * (np.max(made.stretch) - 1):
        loose = f"the specimen is slack up to a stretch of {1 + slack:.3f} at least, or was pulled more slowly up to there"
        warn(f"{test.file}: {loose}: later points are on a steeper line from rest; stretches count from where the specimen is taut")
    if abs(offset) > USUAL_ERROR:
        warn(f"{test.file}: the stress at rest is {100 * offset:.2g} % of the largest: was the force zeroed?")
    if lost := softening(made):
        weaker = f"later loadings are softer than the first by {100 * lost:.0f} % beyond what relaxation in any film explains"
        advice = "no law here describes it: condition the specimens, or leave the first cycle out (discard)"
        warn(f"{test.file}: {weaker}: the specimen softens from cycle to cycle (Mullins); {advice}")


def _without_repetitions(
    time: Floats, stretch: Floats, stress: Floats, lines: Rows, file: str
) -> tuple[Floats, Floats, Floats, Rows]:
    """The columns with one row in the place of rows of one time and stretch, as rounded times have them: with their mean stress."""
    again = (np.diff(time, prepend=np.nan) == 0) & (np.diff(stretch, prepend=np.nan) == 0)
    if not again.any():
        return time, stretch, stress, lines
    first = int(np.flatnonzero(again)[0])
    more = f"; so do {count - 1} more" if (count := int(np.count_nonzero(again))) > 1 else ""
    repeated = f"line {lines[first]} repeats time and stretch of the row before, {time[first]:g} s{more}"
    warn(f"{file}: {repeated}: mean stresses are taken")
    row = np.cumsum(~again) - 1
    return time[~again], stretch[~again], np.bincount(row, stress) / np.bincount(row), lines[~again]


def begins_late(test: MeasuredTest) -> bool:
    """Whether a test covers most of its stretch in a ramp before its first point."""
    reach = float(np.max(np.abs(test.stretch - 1)))
    return test.corner_time[0] == 0 and test.corner_stretch[0] == 1 and abs(float(test.stretch[0]) - 1) > 0.5 * reach > 0


def _quantity(table: MeasuredTable, test: TestData, quantity: str, rows: Flags) -> Floats:
    """The stretch, or the nominal stress in Pa, of these rows."""
    role, column = role_in(table, quantity, test.columns)
    header = table.names[table.find(column, role)]
    if role == "stress" and any(word in header.casefold() for word in _TRUE):
        needed = "but nominal stress is needed: force over the undeformed section, in uniaxial loading true stress over the stretch"
        raise InputError(f'column "{header}" is a true stress, {needed}', file=test.file)
    if wrong := mistaken(table, column, role):
        raise InputError(wrong, file=test.file)
    return read_as(table, role, column, test.specimen, rows)


def _thinned(time: Floats, stretch: Floats, most: int = MOST_POINTS) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Rows of at most so many points, evenly spread along the curve, including the first and the last."""
    if time.size <= most:
        return np.arange(time.size)
    place = path_length(time, stretch)
    wanted = np.linspace(0.0, place[-1], most)
    chosen = np.searchsorted(place, wanted).clip(0, time.size - 1)
    # keep the turning points of the history
    return np.unique(np.concatenate(([0, time.size - 1], chosen, corners(time, stretch))))


def _called(test: TestData) -> str:
    chosen = ", ".join(f"{name} {value}" for name, value in test.where.items())
    return Path(test.file or test.recipe or "").stem + (f", {chosen}" if chosen else "")
