"""The measurements that a recipe's `[data]` describes, read from plain tables or instruments' exports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.errors import InputError, Mistakes, Problem, warn
from dielast.io.files import Inputs
from dielast.material.checks import warn_of_strain, warn_of_tension
from dielast.readings.curve_recipe import CurveData
from dielast.readings.isotherms import WIDEST, isotherms, temperature_of_file
from dielast.readings.recipe import MECHANICAL, ROLES, MeasuredData, MeasurementData, MeasurementName
from dielast.readings.specimen import mistaken, nominal_stress, strain_of
from dielast.readings.specimen_recipe import Specimen
from dielast.readings.steps import MANY, Part, parts_of
from dielast.superposition.kramers_kronig import viscosity_factor, warn_if_inconsistent
from dielast.superposition.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.units import ZERO_CELSIUS

Array = NDArray[np.float64]

AGREEMENT = 0.01  # relative, between a column of frequencies and one of angular frequencies
HELD, CHANGES = 0.02, 0.2  # spread, relative to the largest, of what a test holds, and of what is not held
ONE_TEMPERATURE = (
    'of a test at one temperature "dielast spectrum" makes a material: kind = "spectrum", the same [data] with '
    'reference_temperature = "20 degC", and no [shift]'
)
VISCOSITY_AGREEMENT = 0.1  # the same for a complex viscosity, rounded as it may be


@dataclass(frozen=True, slots=True)
class Reading:
    """What was read: `measurements` of one kind by ascending temperature, and where they come from."""

    measurements: list[Measurement]
    measurement: MeasurementName
    test: str
    formats: tuple[str, ...]
    left_out: tuple[str, ...]
    listed: tuple[int, ...]

    @property
    def in_order(self) -> list[Measurement]:
        """The measurements in the order in which they stand in the data."""
        return [self.measurements[k] for k in self.listed]

    @property
    def summary(self) -> Mapping[str, Any]:
        """The same for the summary's section `[data]`."""
        steps = {"steps_left_out": list(self.left_out)} if self.left_out else {}
        return {"measurement": self.measurement, "test": self.test, "format": ", ".join(self.formats), **steps}


@dataclass(frozen=True, slots=True, eq=False)
class _Readings:
    """Rows (n,) in SI and degC: abscissa, one or two ordinates (c, n), Young's or tensile; set labels, -1 for none."""

    temperature: Array
    abscissa: Array
    ordinates: Array
    label: NDArray[np.intp]
    viscosity: Array


def read_measurements(data: MeasuredData, inputs: Inputs) -> list[Measurement]:
    """The measurements that `data` describes, all of one kind, by ascending temperature, ramps dropped.

    Raises `InputError` naming file and line, column, step or temperature.
    """
    return read_all(data, inputs).measurements


def read_curves(data: MeasuredData, inputs: Inputs) -> list[RelaxationCurve]:
    """The same for relaxation tests; raises `InputError` if `data` describes anything else."""
    reading = read_all(data, inputs)
    curves = [curve for curve in reading.measurements if isinstance(curve, RelaxationCurve)]
    if len(curves) < len(reading.measurements):
        raise InputError(f"relaxation tests are needed, these are {MANY[reading.measurement]}")
    return curves


def read_all(data: MeasuredData, inputs: Inputs) -> Reading:
    """The measurements and where they come from; raises `InputError` as `read_measurements` does."""
    parts: list[Part] = []
    left_out: list[str] = []
    for index, name in enumerate(data.names):
        found, others = parts_of(inputs.read(name), name, index, data)
        parts += found
        left_out += others
    kind, test = _one_kind(parts), _one_test(parts, data)
    for part in parts:
        _check_columns(part, data)
        machine = [role for role in ("extension", "force") if role in part.columns]
        if test == "shear" and machine:
            what = f"{' and '.join(machine)} are of a test in tension, but this one is in shear"
            raise InputError(f"{what}: state strain and stress, or modulus", file=part.table.source)
    if data.test is None:
        for part in parts:
            _warn_of_tension(part)
    if kind == "oscillation" and (data.ramp is not None or data.discard_before > 0):
        raise InputError("ramp and discard_before are times of a test over time: a frequency sweep has none")
    labels: dict[tuple[int, str], int] = {}
    readings = [_read(part, data, 3.0 if test == "shear" else 1.0, labels) for part in parts]
    source = np.repeat(np.arange(len(parts)), [reading.abscissa.size for reading in readings])
    temperature = np.concatenate([reading.temperature for reading in readings])
    abscissa = np.concatenate([reading.abscissa for reading in readings])
    ordinates = np.concatenate([reading.ordinates for reading in readings], axis=1)
    label = np.concatenate([reading.label for reading in readings])
    measurements: list[Measurement] = []
    first: list[int] = []
    for level, rows in isotherms(temperature, abscissa, source, label, data.temperature_tolerance):
        names = ", ".join(dict.fromkeys(parts[k].table.source for k in source[rows]))
        measurements.append(_measurement(kind, level, abscissa[rows], ordinates[:, rows], names))
        first.append(int(np.min(rows)))
    if kind == "oscillation":
        _check_viscosity(parts, readings)
        warn_if_inconsistent([sweep for sweep in measurements if isinstance(sweep, FrequencySweep)])
    formats = tuple(dict.fromkeys(part.format for part in parts))
    return Reading(measurements, kind, test, formats, tuple(left_out), tuple(np.argsort(first).tolist()))


def _measurement(kind: MeasurementName, temperature: float, abscissa: Array, ordinates: Array, source: str) -> Measurement:
    match kind:
        case "relaxation":
            return RelaxationCurve(temperature, abscissa, ordinates[0], source)
        case "creep":
            return CreepCurve(temperature, abscissa, ordinates[0], source)
        case "oscillation":
            return FrequencySweep(temperature, abscissa, ordinates[0], ordinates[1], source)


def _one_kind(parts: list[Part]) -> MeasurementName:
    first: dict[MeasurementName, Part] = {}
    for part in parts:
        first.setdefault(part.measurement, part)
    if len(first) > 1:
        found = " and ".join(f'{MANY[kind]} ({part.table.source}, "{part.step}")' for kind, part in first.items())
        named = " or ".join(f'"{kind}"' for kind in first)
        raise InputError(f"there are {found}: one kind makes a master curve: say measurement = {named}")
    return parts[0].measurement


def _one_test(parts: list[Part], data: MeasuredData) -> str:
    if data.test is not None:
        return data.test
    tests = {part.test: part for part in parts}
    for test, part in tests.items():
        if test is None:
            raise InputError('the export does not say what modulus it is: say test = "tension" or "shear"', file=part.table.source)
    if len(tests) > 1:
        found = " and ".join(f"{test} ({part.table.source})" for test, part in tests.items())
        raise InputError(f'there are tests in {found}: leave one out, or say test = "tension" or "shear"')
    return str(parts[0].test)


def _check_columns(part: Part, data: MeasuredData) -> None:
    """Raise `InputError` for all columns of a plain table that are not there or in a wrong unit, with the recipe's keys."""
    wrong = Mistakes()
    for role, wanted in part.columns.items() if not part.is_export else ():
        try:
            part.table.check(wanted, role, ROLES.get(role))
        except InputError as error:
            key = f" (data.columns.{role})" if data.columns is not None and role in data.columns.model_fields_set else ""
            told = mistaken(part.table, wanted, role)
            problems = [Problem(told, file=part.table.source)] if told else error.problems
            wrong += [problem.adding(key) for problem in problems]
    wrong.refuse()


def _warn_of_tension(part: Part) -> None:
    """A plain table is taken for one of tension unless the recipe says otherwise."""
    if not part.is_export:
        used = [part.table.names[part.table.find(part.columns[role], role)] for role in MECHANICAL if role in part.columns]
        warn_of_tension(used, part.table.source)


def _read(part: Part, data: MeasuredData, per_shear: float, labels: dict[tuple[int, str], int]) -> _Readings:
    """The readings of a part; `per_shear` is Young's modulus over the measured one, `labels` numbers the sets met so far."""
    table, roles = part.table, [role for role in part.columns if role not in ("complex_viscosity", "set")]
    rows = part.rows(roles)
    _warn_of_gaps(part, roles, rows)
    if part.measurement != "oscillation":
        rows[rows] = _in_time(part, rows, data)

    def column(role: str) -> Array:
        return table.column(part.columns[role], role, ROLES[role], rows)

    lines = table.lines[rows]
    if part.measurement == "oscillation":
        abscissa = _angular_frequency(part, column, lines)
    else:
        # A ramp acts like a step at its middle, to second order in ramp/time: L. J. Zapas and J. C. Phillips, J. Res. Natl. Bur.
        # Stand. A 75 (1971) 33. Counted from its start, the shift factors would come out wrong by tenths of a decade.
        abscissa = column("time") - 0.5 * (data.ramp or 0.0)
    if "temperature" in part.columns:
        temperature = column("temperature")
        _refuse(part, lines, temperature <= -ZERO_CELSIUS, "temperature", "is at or below absolute zero")
        if part.is_export and np.ptp(temperature) <= WIDEST * data.temperature_tolerance:
            temperature = np.full(abscissa.size, round(float(np.mean(temperature)), 6))  # a step is one isothermal set
    else:
        temperature = np.full(abscissa.size, _stated_temperature(part, data))
    label = np.full(abscissa.size, -1)
    if "set" in part.columns:
        cells = table.cells[table.find(part.columns["set"], "set")]
        label = np.array([labels.setdefault((part.file, cells[row]), len(labels)) for row in np.flatnonzero(rows)], dtype=np.intp)
    viscosity = np.zeros(abscissa.size)
    if "complex_viscosity" in part.columns and (not part.is_export or part.filled("complex_viscosity")[rows].all()):
        viscosity = per_shear * column("complex_viscosity")
    with np.errstate(all="ignore"):
        ordinates = _ordinates(part, column, lines, per_shear, data.specimen)
    _refuse(part, lines, ~np.all(np.isfinite(ordinates), axis=0), part.measurement, "is too large a number")
    _refuse_most(part, lines, np.any(ordinates <= 0, axis=0))
    return _Readings(temperature, abscissa, ordinates, label, viscosity)


def _in_time(part: Part, rows: NDArray[np.bool_], data: MeasuredData) -> NDArray[np.bool_]:
    """Which of `rows` count: from the first time on that the recipe names, and in an export from when the step was made."""
    time = part.table.column(part.columns["time"], "time", ROLES["time"], rows)
    kept = time >= data.first_time if data.first_time > 0 else time > 0 if part.is_export else np.ones(time.size, dtype=bool)
    lines = part.table.lines[rows]
    _refuse(part, lines, (time <= 0) & kept, "time", "is not above zero; discard_before drops the points up to a time")
    if not np.any(kept):
        raise InputError(f"no points are left from {data.first_time:g} s on (see discard_before and ramp)", file=part.table.source)
    return kept


def _angular_frequency(part: Part, column: Callable[[str], Array], lines: NDArray[np.int64]) -> Array:
    """Angular frequency in rad/s; where both are there they must agree, since nothing tells which of them is right."""
    found = {}
    for role in ("frequency", "angular_frequency"):
        if role in part.columns:
            found[role] = column(role)
            _refuse(part, lines, found[role] <= 0, role.replace("_", " "), "is not above zero")
    if len(found) == 2:
        hertz, omega = found["frequency"], found["angular_frequency"]
        for k in np.flatnonzero(np.abs(2 * np.pi * hertz / omega - 1) > AGREEMENT)[:1]:
            raise InputError(
                f"frequency {hertz[k]:.4g} Hz and angular frequency {omega[k]:.4g} rad/s "
                f"contradict each other: {hertz[k]:.4g} Hz are {2 * np.pi * hertz[k]:.4g} rad/s",
                file=part.table.source,
                line=lines[k],
            )
    return found["angular_frequency"] if "angular_frequency" in found else 2 * np.pi * found["frequency"]


def _ordinates(
    part: Part, column: Callable[[str], Array], lines: NDArray[np.int64], per_shear: float, specimen: Specimen | None
) -> Array:
    """Young's moduli in Pa or tensile compliance in 1/Pa, shape (c, n); stress over strain is the paper's modulus, Sec. 2.1.1."""
    given = part.columns
    if part.measurement == "oscillation":
        if "loss" in given:
            moduli = np.stack((column("storage"), column("loss")))
        elif "storage" in given:
            moduli = column("storage") * np.stack((np.ones(lines.size), column("tan_delta")))
        else:
            tangent = column("tan_delta")
            moduli = column("complex_modulus") / np.hypot(1.0, tangent) * np.stack((np.ones(lines.size), tangent))
        return np.asarray(per_shear * moduli)
    over, under = ("stress", "strain") if part.measurement == "relaxation" else ("strain", "stress")
    plain = "modulus" if part.measurement == "relaxation" else "compliance"
    scale = per_shear if part.measurement == "relaxation" else 1 / per_shear
    if plain in given:
        return np.asarray(scale * column(plain))[None]
    if "stretch" in given:
        strain = column("stretch") - 1
    else:
        strain = column("strain") if "strain" in given else strain_of(column("extension"), specimen)
    stress = column("stress") if "stress" in given else nominal_stress(column("force"), specimen)
    numerator, divisor = (stress, strain) if under == "strain" else (strain, stress)
    warn_of_strain(strain)
    _warn_of_held(part, held=divisor, answer=numerator)
    _refuse(part, lines, divisor == 0, under, f"is zero, so {over} / {under} is no {plain}")
    return np.asarray(scale * numerator / divisor)[None]


def _warn_of_held(part: Part, held: Array, answer: Array) -> None:
    """Warn where what the test holds, the strain of relaxation or the stress of creep, changes, and its answer does not."""
    spread = [float(np.ptp(np.abs(own))) / float(np.max(np.abs(own), initial=1e-300)) for own in (held, answer)]
    if spread[0] > CHANGES > HELD > spread[1]:
        constant, other = ("stress", "creep") if part.measurement == "relaxation" else ("strain", "relaxation")
        warn(
            f'the {constant} is constant and the other changes, as in {other}: say measurement = "{other}" if that was measured',
            file=part.table.source,
        )


def _stated_temperature(part: Part, data: MeasuredData) -> float:
    if part.temperature is not None:
        return part.temperature
    source, in_step = part.table.source, part.temperature_in_step()
    if isinstance(data, MeasurementData) and (data.temperatures is not None or data.temperature_in_name is not None):
        return temperature_of_file(data, part.file, source)
    if in_step is not None:
        return in_step
    if isinstance(data, CurveData):
        if data.reference_temperature is None:
            raise InputError('the data state no temperature: say reference_temperature = "20 degC"', file=source)
        return data.reference_temperature
    if part.is_export:
        raise InputError(
            f'step "{part.step}" has no temperature: export it, or say temperatures or temperature_in_name', file=source
        )
    assert isinstance(data, MeasurementData)
    raise InputError(
        f'temperatures are needed from {data.sources}, or from headers such as "E (20 °C) [MPa]"; {ONE_TEMPERATURE}', file=source
    )


def _warn_of_gaps(part: Part, roles: list[str], rows: NDArray[np.bool_]) -> None:
    """Rows of an export that hold some of what is needed and lack the rest."""
    if not part.is_export:
        return
    partly = np.any([part.filled(role) for role in roles if role not in ("temperature", "time")], axis=0) & ~rows
    if np.any(partly):
        first, count = int(part.table.lines[np.flatnonzero(partly)[0]]), int(np.count_nonzero(partly))
        many = f"{count} points lack" if count > 1 else "1 point lacks"
        warn(
            f'step "{part.step}": {many} a reading and {"are" if count > 1 else "is"} left out (line {first})',
            file=part.table.source,
        )
    if not np.any(rows):
        raise InputError(f'step "{part.step}" has no row with all of {", ".join(roles)}', file=part.table.source)


def _refuse(part: Part, lines: NDArray[np.int64], wrong: NDArray[np.bool_], role: str, why: str) -> None:
    if np.any(wrong):
        first, count = int(np.flatnonzero(wrong)[0]), int(np.count_nonzero(wrong))
        raise InputError(
            f"{role} {why}" + (f" ({count} such rows)" if count > 1 else ""), file=part.table.source, line=lines[first]
        )


def _refuse_most(part: Part, lines: NDArray[np.int64], wrong: NDArray[np.bool_]) -> None:
    """A few values at a noise floor may be zero or negative; a file that is so for the most part is not what it is said to be."""
    if 2 * np.count_nonzero(wrong) > wrong.size:
        many = {"relaxation": "moduli", "oscillation": "storage or loss moduli", "creep": "compliances"}[part.measurement]
        first, count = lines[np.flatnonzero(wrong)[0]], np.count_nonzero(wrong)
        raise InputError(
            f"{count} of {wrong.size} {many} are zero or negative: positive {many} are needed", file=part.table.source, line=first
        )


def _check_viscosity(parts: list[Part], readings: list[_Readings]) -> None:
    """Warn where a complex viscosity says that the frequencies are not what they are said to be; |eta*| = |E*| / omega."""
    for part, reading in zip(parts, readings, strict=True):
        if not np.any(reading.viscosity > 0):
            continue
        sweep = FrequencySweep(float(reading.temperature[0]), reading.abscissa, reading.ordinates[0], reading.ordinates[1])
        factor = viscosity_factor(sweep, reading.viscosity)
        said = [role for role in ("frequency", "angular_frequency") if role in part.columns]
        for off, truth in ((2 * np.pi, "Hz"), (1 / (2 * np.pi), "rad/s")):
            if abs(np.log(factor / off)) < VISCOSITY_AGREEMENT:
                warn(
                    f"the complex viscosity fits if what is given as {said[0].replace('_', ' ')} is in {truth}",
                    file=part.table.source,
                )
                return
        if abs(np.log(factor)) > VISCOSITY_AGREEMENT:
            warn(f"complex modulus over angular frequency is {factor:.3g} times the complex viscosity", file=part.table.source)
            return
