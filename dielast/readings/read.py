"""The measurements that `[data]` of a recipe describes, read from plain tables or instruments' exports."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError, Mistakes, Problem, in_keys, warn
from dielast.io.files import Inputs
from dielast.io.table import spoken
from dielast.material.checks import warn_of_tension
from dielast.material.measurement import FrequencySweep, Measurement, measurement_of
from dielast.material.measurement_kind import RELAXATION, MeasurementKind
from dielast.readings.columns_recipe import MECHANICAL, ROLES
from dielast.readings.isotherms import isotherms
from dielast.readings.kramers_kronig import viscosity_factor, warn_if_inconsistent
from dielast.readings.quantities import mistaken
from dielast.readings.recipe import MeasuredData
from dielast.readings.steps import Part, parts_of
from dielast.readings.values import Readings, read_part

LOW = 0.1  # of the largest value of a curve, below which its noise floor lies
NEIGHBOURS = 2  # readings on either side that show how large a value should be
FEWEST_STEPS, FALLING = 4, 0.8  # rows, and share of rows in which the time falls, that show columns taken for each other
VISCOSITY_AGREEMENT = 0.1  # in ln; tolerance for a rounded complex viscosity


@dataclass(frozen=True, slots=True)
class Dataset:
    """Measurements of one kind by ascending temperature, and their origin."""

    measurements: list[Measurement]
    kind: MeasurementKind
    deformation: str
    formats: tuple[str, ...]
    left_out: tuple[str, ...]
    listed: tuple[int, ...]

    @property
    def in_order(self) -> list[Measurement]:
        """The measurements in the order of the data."""
        return [self.measurements[k] for k in self.listed]

    @property
    def summary(self) -> Mapping[str, Any]:
        """The data set for the section `[data]` of a summary."""
        steps = {"steps_left_out": list(self.left_out)} if self.left_out else {}
        return {"measurement": self.kind.name, "test": self.deformation, "format": ", ".join(self.formats), **steps}


def read_all(data: MeasuredData, inputs: Inputs) -> Dataset:
    """The measurements that `data` describes, all of one kind and without ramps, and their origin.

    Raises `InputError` with file and line, column, step or temperature.
    """
    parts: list[Part] = []
    left_out: list[str] = []
    for index, name in enumerate(data.names):
        file_parts, others = parts_of(inputs.read(name), name, index, data)
        parts += file_parts
        left_out += others
    kind, deformation = _one_kind(parts), _one_deformation(parts, data)
    for part in parts:
        _check_columns(part, data)
        machine = [role for role in ("extension", "force") if role in part.columns]
        if deformation == "shear" and machine:
            what = f"{' and '.join(machine)} are of a test in tension, but this one is in shear"
            raise part.table.error(f"{what}: state strain and stress, or modulus")
    for part in parts if data.test is None else ():
        if not part.is_export:  # read as a test in tension by default, but the names may be those of one in shear
            used = [part.table.names[part.table.find(part.columns[role], role)] for role in MECHANICAL if role in part.columns]
            warn_of_tension(used, part.table.source)
    if kind.over_frequency and (data.ramp is not None or data.discard_before > 0):
        raise InputError("ramp and discard_before belong to a test over time: leave them out for a frequency sweep")
    labels: dict[tuple[int, str], int] = {}
    with in_keys({"specimen": "data.specimen"}):
        readings = [read_part(part, data, 3.0 if deformation == "shear" else 1.0, labels) for part in parts]
    source = np.repeat(np.arange(len(parts)), [reading.abscissa.size for reading in readings])
    temperature = np.concatenate([reading.temperature for reading in readings])
    columns = np.concatenate([np.vstack([reading.abscissa, reading.ordinates]) for reading in readings], axis=1)
    label, line = (np.concatenate([getattr(reading, name) for reading in readings]) for name in ("label", "line"))
    measurements: list[Measurement] = []
    first: list[int] = []
    for level, rows in isotherms(temperature, columns[0], source, label, data.temperature_tolerance):
        files = [parts[k].table.source for k in source[rows]]
        _check_signs(kind, level, columns[:, rows], files, line[rows])
        if kind is RELAXATION and not all(part.is_export for part in parts):
            _warn_of_swapped(columns[:, rows[np.argsort(line[rows], kind="stable")]], files[0])
        names = ", ".join(dict.fromkeys(files))
        measurements.append(measurement_of(kind, level, columns[:, rows], names, data.ramp))
        first.append(int(np.min(rows)))
    if kind.over_frequency:
        _check_viscosity(parts, readings)
        warn_if_inconsistent([sweep for sweep in measurements if isinstance(sweep, FrequencySweep)])
    else:
        _warn_of_running_clock(measurements)
    formats = tuple(dict.fromkeys(part.format for part in parts))
    return Dataset(measurements, kind, deformation, formats, tuple(left_out), tuple(np.argsort(first).tolist()))


def _one_kind(parts: list[Part]) -> MeasurementKind:
    first = {part.kind: part for part in reversed(parts)}
    if len(first) > 1:
        kinds = list(dict.fromkeys(part.kind for part in parts))
        tests = " and ".join(f'{kind.tests} ({first[kind].table.source}, "{first[kind].step}")' for kind in kinds)
        named = " or ".join(f'"{kind.name}"' for kind in kinds)
        raise InputError(f"there are {tests}: one kind makes a master curve: state measurement = {named}")
    return parts[0].kind


def _one_deformation(parts: list[Part], data: MeasuredData) -> str:
    if data.test is not None:
        return data.test
    deformations = {part.deformation: part for part in parts}
    for deformation, part in deformations.items():
        if deformation is None:
            raise part.table.error('the export does not name the kind of modulus: state test = "tension" or "shear"')
    if len(deformations) > 1:
        tests = " and ".join(f"{deformation} ({part.table.source})" for deformation, part in deformations.items())
        raise InputError(f'there are tests in {tests}: leave one out, or state test = "tension" or "shear"')
    return str(parts[0].deformation)


def _check_columns(part: Part, data: MeasuredData) -> None:
    """`InputError` for all columns of a plain table that are missing or in a wrong unit, with the keys of the recipe."""
    wrong = Mistakes()
    for role, column in part.columns.items() if not part.is_export else ():
        try:
            part.table.check(column, role, ROLES.get(role))
        except InputError as error:
            key = f" (data.columns.{role})" if data.columns is not None and role in data.columns.model_fields_set else ""
            instead = mistaken(part.table, column, role)
            problems = [Problem(instead, file=part.table.source)] if instead else error.problems
            wrong += [problem.adding(key) for problem in problems]
    wrong.refuse()


def _check_signs(
    kind: MeasurementKind, temperature: float, columns: NDArray[np.float64], source: Sequence[str], line: NDArray[np.intp]
) -> None:
    """Warn of the rows (n,) of a curve, abscissa and ordinates `columns` (1 + c, n), that have an ordinate of zero or below.

    They are noise floor where the readings beside them are low, else wrong. `source` and `line` are file and line of each row.
    Raises `InputError` if most rows are not positive.
    """
    below = columns[1:] <= 0
    rows, at = np.any(below, axis=0), f"at {temperature:g} degC"
    if 2 * np.count_nonzero(rows) > rows.size:
        text = f"{np.count_nonzero(rows)} of {rows.size} {kind.values} {at} are zero or negative: positive {kind.values} are needed"
        raise InputError(text, file=source[int(np.argmax(rows))], line=int(line[np.argmax(rows)]))
    order = np.argsort(columns[0], kind="stable")
    amid = np.zeros(below.shape, dtype=bool)
    for high, values in zip(amid, np.abs(columns[1:, order]), strict=True):
        around = np.lib.stride_tricks.sliding_window_view(np.pad(values, NEIGHBOURS, mode="reflect"), 2 * NEIGHBOURS + 1)
        high[order] = np.sort(np.delete(around, NEIGHBOURS, axis=1), axis=1)[:, NEIGHBOURS - 1] > LOW * values.max()
    wrong = np.any(below & amid, axis=0)
    for chosen, what in (
        (wrong, "amid large values, which is no noise floor: correct these rows, or delete them; they are left out"),
        (
            rows & ~wrong,
            "where the curve is low: left out as its noise floor; if it should not be, check the zero of the sensor",
        ),
    ):
        if np.any(chosen):
            first, others = int(np.argmax(chosen)), int(np.count_nonzero(chosen)) - 1
            name = spoken(kind.ordinates[int(np.argmax(below[:, first]))][0])
            more = f" here, and in {others} more row{'s' if others > 1 else ''}," if others else ""
            warn(f"the {name} {at} is zero or negative{more} {what}", file=source[first], line=int(line[first]))


def _warn_of_swapped(columns: NDArray[np.float64], source: str) -> None:
    """Warn of a relaxation test in whose rows, in the order of the file, the time falls and the modulus rises (2, n): a table lists
    times as they pass, so that its columns were probably taken for each other.
    """
    times, moduli = np.diff(columns[:2])
    if times.size >= FEWEST_STEPS and np.all(moduli > 0) and np.mean(times < 0) > FALLING:
        warn("from row to row the time falls and the modulus rises: are the columns of time and modulus swapped?", file=source)


def _warn_of_running_clock(measurements: Sequence[Measurement]) -> None:
    """Warn if the times of no two tests overlap: a clock, perhaps, that runs on from one test to the next."""
    spans = sorted(
        (float(np.min(time)), float(np.max(time)), test.temperature) for test in measurements for time in test.columns[:1]
    )
    if len(spans) > 1 and all(one[1] < other[0] for one, other in pairwise(spans)):
        (_, end, before), (begin, _, after) = spans[:2]
        warn(
            f"the times of the tests follow one another: at {before:g} degC up to {end:.4g} s, at {after:g} degC from "
            f"{begin:.4g} s on: if the clock runs on from test to test, count the times of each test from its own step"
        )


def _check_viscosity(parts: list[Part], readings: list[Readings]) -> None:
    """Warn if a complex viscosity shows that the frequencies are in another unit than stated; |eta*| = |E*| / omega."""
    for part, reading in zip(parts, readings, strict=True):
        if not np.any(reading.viscosity > 0):
            continue
        sweep = FrequencySweep(float(reading.temperature[0]), reading.abscissa, reading.ordinates[0], reading.ordinates[1])
        factor = viscosity_factor(sweep, reading.viscosity)
        stated = [role for role in ("frequency", "angular_frequency") if role in part.columns]
        for off, truth in ((2 * np.pi, "Hz"), (1 / (2 * np.pi), "rad/s")):
            if abs(np.log(factor / off)) < VISCOSITY_AGREEMENT:
                text = f"the complex viscosity fits if what is stated as {spoken(stated[0])} is in {truth}"
                warn(text, file=part.table.source)
                return
        if abs(np.log(factor)) > VISCOSITY_AGREEMENT:
            warn(f"complex modulus over angular frequency is {factor:.3g} times the complex viscosity", file=part.table.source)
            return
