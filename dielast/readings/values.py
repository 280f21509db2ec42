"""The readings of one table or step: abscissa and ordinates from its columns, in SI, Young's or tensile."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import located, warn
from dielast.base.units import LARGEST, ZERO_CELSIUS
from dielast.io.table import spoken
from dielast.material.checks import warn_of_strain
from dielast.material.measurement_kind import RELAXATION
from dielast.material.ramp import mean_age
from dielast.readings.columns_recipe import Specimen
from dielast.readings.isotherms import WIDEST
from dielast.readings.quantities import nominal_stress, strain_of
from dielast.readings.recipe import CurveData, MeasuredData, MeasurementData
from dielast.readings.steps import Part

FREQUENCY_AGREEMENT = 0.01  # relative tolerance between columns of frequency and of angular frequency
HELD, CHANGES = 0.02, 0.2  # spread relative to the largest value: at most that of a held quantity, at least that of another
ONE_TEMPERATURE = (
    'of a test at one temperature "dielast spectrum" makes a material: kind = "spectrum", the same [data] with '
    'reference_temperature = "20 degC", and no [shift]'
)


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Rows (n,) in SI and degC: abscissa, one or two ordinates (c, n), Young's or tensile; labels of sets, -1 for none; lines."""

    temperature: NDArray[np.float64]
    abscissa: NDArray[np.float64]
    ordinates: NDArray[np.float64]
    label: NDArray[np.intp]
    viscosity: NDArray[np.float64]
    line: NDArray[np.intp]


def read_part(part: Part, data: MeasuredData, per_shear: float, labels: dict[tuple[int, str], int]) -> Readings:
    """The readings of a part; `per_shear` is Young's modulus over the measured one, `labels` number the sets of all parts."""
    part = _complete(part, [role for role in part.columns if role not in ("complex_viscosity", "set")])
    if part.kind.over_frequency:
        abscissa = _angular_frequency(part)
    else:
        part = _in_time(part, data)
        abscissa = mean_age(part.column("time"), data.ramp or 0.0)
    if "temperature" in part.columns:
        temperature = part.column("temperature")
        _refuse(part, temperature <= -ZERO_CELSIUS, "temperature", "is at or below absolute zero")
        if part.is_export and np.ptp(temperature) <= WIDEST * data.temperature_tolerance:
            temperature = np.full(abscissa.size, round(float(np.mean(temperature)), 6))  # a step is one isothermal set
    else:
        temperature = np.full(abscissa.size, _stated_temperature(part, data))
    label = np.full(abscissa.size, -1)
    if "set" in part.columns:
        cells = part.table.cells[part.table.find(part.columns["set"], "set")]
        label = np.array([labels.setdefault((part.file, cell), len(labels)) for cell in cells], dtype=np.intp)
    viscosity = np.zeros(abscissa.size)
    if "complex_viscosity" in part.columns and (not part.is_export or part.filled("complex_viscosity").all()):
        viscosity = per_shear * part.column("complex_viscosity")
    with np.errstate(all="ignore"):
        ordinates = _ordinates(part, per_shear, data.specimen)
    _refuse(part, ~np.all(np.abs(ordinates) <= LARGEST, axis=0), part.kind.name, "is too large a number")
    return Readings(temperature, abscissa, ordinates, label, viscosity, part.table.lines)


def _complete(part: Part, roles: list[str]) -> Part:
    """The part with only those rows of an export that have all readings; warns of rows that have only some of them."""
    if not part.is_export:
        return part
    filled = {role: part.filled(role) for role in roles}
    rows = np.all(list(filled.values()), axis=0)
    partly = np.any([mask for role, mask in filled.items() if role not in ("temperature", "time")], axis=0) & ~rows
    if np.any(partly):
        first, count = int(part.table.lines[np.flatnonzero(partly)[0]]), int(np.count_nonzero(partly))
        many = f"{count} points lack" if count > 1 else "1 point lacks"
        warn(
            f'step "{part.step}": {many} a reading and {"are" if count > 1 else "is"} left out (line {first})',
            file=part.table.source,
        )
    if not np.any(rows):
        raise part.table.error(f'step "{part.step}" has no row with all of {", ".join(roles)}')
    return part.only(rows)


def _in_time(part: Part, data: MeasuredData) -> Part:
    """The part with only the rows to use: from the first time of the recipe on, and in an export those after the step."""
    time = part.column("time")
    kept = time >= data.first_time if data.first_time > 0 else time > 0 if part.is_export else np.ones(time.size, dtype=bool)
    _refuse(part, (time <= 0) & kept, "time", f"is not above zero: {_begin(part, time)}")
    if not np.any(kept):
        raise part.table.error(f"no points are left from {data.first_time:g} s on (see discard_before and ramp)")
    return part.only(kept)


def _begin(part: Part, time: NDArray[np.float64]) -> str:
    """What to state of a test whose times begin at zero, with the duration of the ramp if the columns show it."""
    if np.any(time < 0) or not np.any(time > 0):
        return "discard_before drops the points up to a time"
    applied = ("strain", "extension", "stretch") if part.kind.stiffness_power > 0 else ("stress", "force")
    example, shown = "1 s", "such as"
    for role in [role for role in applied if role in part.columns]:
        reached = reached_at(time, np.abs(part.column(role) - (role == "stretch")))
        if reached is not None:
            example, shown = f"{reached:.3g} s", f"here until the {role} is reached:"
    return (
        f'if the test begins with a ramp, state its duration, {shown} ramp = "{example}" (or discard_before, if time '
        "counts from a step)"
    )


def reached_at(time: NDArray[np.float64], load: NDArray[np.float64]) -> float | None:
    """The time in s, of all (n,), at which a `load` (n,) comes to its value in the later half; None if it is there at first."""
    reached = np.flatnonzero(load >= (1 - HELD) * float(np.median(load[time >= np.median(time)])))
    return float(time[reached[0]]) if reached.size and reached[0] > 0 else None


def is_held(time: NDArray[np.float64], load: NDArray[np.float64]) -> bool:
    """Whether a `load` (n,) stays the same in the later half of the times in s (n,)."""
    later = load[time >= np.median(time)]
    return later.size > 1 and float(np.ptp(later)) <= HELD * float(np.max(np.abs(later), initial=1e-300))


def _angular_frequency(part: Part) -> NDArray[np.float64]:
    """Angular frequency in rad/s; if the table has both frequencies, they must agree, as it is unknown which is right."""
    measured = {role: part.column(role) for role in ("frequency", "angular_frequency") if role in part.columns}
    for role, values in measured.items():
        _refuse(part, values <= 0, spoken(role), "is not above zero")
    if len(measured) == 2:
        hertz, omega = measured["frequency"], measured["angular_frequency"]
        for k in np.flatnonzero(np.abs(2 * np.pi * hertz / omega - 1) > FREQUENCY_AGREEMENT)[:1]:
            both = f"frequency {hertz[k]:.4g} Hz and angular frequency {omega[k]:.4g} rad/s"
            raise part.table.error(f"{both} contradict each other: {hertz[k]:.4g} Hz are {2 * np.pi * hertz[k]:.4g} rad/s", k)
    return measured["angular_frequency"] if "angular_frequency" in measured else 2 * np.pi * measured["frequency"]


def _ordinates(part: Part, per_shear: float, specimen: Specimen | None) -> NDArray[np.float64]:
    """Young's moduli in Pa or tensile compliance in 1/Pa, (c, n); stress over strain is the modulus of Sec. 2.1.1 of the paper."""
    columns, column = part.columns, part.column
    if part.kind.over_frequency:
        if "loss" in columns:
            moduli = np.stack((column("storage"), column("loss")))
        elif "storage" in columns:
            moduli = column("storage") * np.stack((np.ones(part.table.lines.size), column("tan_delta")))
        else:
            tangent = column("tan_delta")
            moduli = column("complex_modulus") / np.hypot(1.0, tangent) * np.stack((np.ones(tangent.size), tangent))
        return np.asarray(per_shear * moduli)
    # a modulus is stress over strain, a compliance strain over stress; shear moduli are a third of Young's
    scale, plain = per_shear**part.kind.stiffness_power, part.kind.value
    if plain in columns:
        return np.asarray(scale * column(plain))[None]
    if "stretch" in columns:
        strain = column("stretch") - 1
    else:
        strain = column("strain") if "strain" in columns else strain_of(column("extension"), specimen)
    stress = column("stress") if "stress" in columns else nominal_stress(column("force"), specimen)
    with located(file=part.table.source):
        warn_of_strain(strain)
    over, under = (("stress", stress), ("strain", strain))[:: part.kind.stiffness_power]
    _warn_of_held(part, held=under[1], response=over[1])
    _refuse(part, under[1] == 0, under[0], f"is zero, so {over[0]} / {under[0]} is no {plain}")
    return np.asarray(scale * over[1] / under[1])[None]


def _warn_of_held(part: Part, held: NDArray[np.float64], response: NDArray[np.float64]) -> None:
    """Warn if the strain of a relaxation test, or the stress of a creep test, changes, and the other of the two does not."""
    spread = [float(np.ptp(np.abs(values))) / float(np.max(np.abs(values), initial=1e-300)) for values in (held, response)]
    if spread[0] > CHANGES > HELD > spread[1]:
        constant, other = ("stress", "creep") if part.kind is RELAXATION else ("strain", "relaxation")
        warn(
            f'the {constant} is constant and the other changes, as in {other}: state measurement = "{other}" if that was measured',
            file=part.table.source,
        )


def _stated_temperature(part: Part, data: MeasuredData) -> float:
    if part.temperature is not None:
        return part.temperature
    in_step = part.temperature_in_step()
    if isinstance(data, MeasurementData) and (data.temperatures is not None or data.temperature_in_name is not None):
        return _temperature_of_file(data, part)
    if in_step is not None:
        return in_step
    if isinstance(data, CurveData):
        if data.reference_temperature is None:
            raise part.table.error('the data state no temperature: state reference_temperature = "20 degC"')
        return data.reference_temperature
    if part.is_export:
        raise part.table.error(f'step "{part.step}" has no temperature: export it, or say temperatures or temperature_in_name')
    assert isinstance(data, MeasurementData)
    headers = 'headers such as "E (20 °C) [MPa]"'
    raise part.table.error(f"temperatures are needed from {data.sources}, or from {headers}; {ONE_TEMPERATURE}")


def _temperature_of_file(data: MeasurementData, part: Part) -> float:
    """The temperature in degC that the recipe, or the name of the file, states for the file of a part."""
    if data.temperatures is not None:
        return float(data.temperatures[part.file])
    pattern = re.escape(data.temperature_in_name or "").replace(r"\{degC\}", r"(?P<degC>[+-]?\d+(?:\.\d+)?)")
    match = re.search(pattern.replace(r"\{K\}", r"(?P<K>\d+(?:\.\d+)?)"), Path(part.table.source).name)
    if match is None:
        raise part.table.error(f'the name does not fit temperature_in_name = "{data.temperature_in_name}"')
    groups = match.groupdict()
    return float(groups["degC"]) if groups.get("degC") else float(groups["K"]) - ZERO_CELSIUS


def _refuse(part: Part, wrong: NDArray[np.bool_], role: str, why: str) -> None:
    if np.any(wrong):
        first, count = int(np.flatnonzero(wrong)[0]), int(np.count_nonzero(wrong))
        more = f" ({count} such rows)" if count > 1 else ""
        raise part.table.error(f"{role} {why}{more}", first)
