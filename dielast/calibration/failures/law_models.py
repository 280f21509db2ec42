"""The likelihood of each law of failure for specimens that have been simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from dielast.base.errors import InputError, and_more, warn
from dielast.calibration.failures.ageing import Ageing
from dielast.calibration.failures.exposures import Aged, Envelope, Exposure, Plain
from dielast.calibration.failures.law_names import DAMAGE_LAWS, LINES
from dielast.calibration.failures.laws import BARRIER, LawModel, LawOptions, LawParameter, barrier, interpolating
from dielast.calibration.failures.likelihood import Anchored, FailureModel, Location, Mixed, Observations, Seen
from dielast.calibration.failures.scatter_laws import WEIBULL, ScatterLaw, scatter_law
from dielast.calibration.failures.specimens import Simulated
from dielast.numerics.arrays import Cases, Floats


def law_model(name: str, tested: Simulated, options: LawOptions) -> LawModel:
    """The likelihood of the law `name` (one of `LAWS`) for the specimens.

    Raises `InputError` for scatter that the law does not take, specimens whose areas differ under a scatter without weakest
    link, and specimens that fail under a field that has been higher before, or does not rise, which no breakdown field
    describes.
    """
    specimens, is_damage = tested.specimens, name in DAMAGE_LAWS
    scatter = scatter_law(options.scatter)
    if is_damage and scatter is not WEIBULL:
        raise InputError(f"{name}: the damage at failure scatters by Weibull's law: state scatter = weibull", argument="scatter")
    area, options = _areas(specimens.area, scatter, options)
    rows = np.arange(len(specimens))
    if is_damage and np.any(once := (tested.seen == Seen.DEAD) & (tested.end == 0)):
        these = f"specimen {specimens.name[int(np.argmax(once))]}" + and_more(int(np.count_nonzero(once)) - 1)
        warn(f"law {name}: {these}: a failure at time 0, before any damage, is left out")
        rows = np.flatnonzero(~once)
    seen, between = tested.seen[rows], np.flatnonzero(tested.seen[rows] == Seen.BETWEEN)
    of_ends, ends, later = _ends(tested, rows)
    observations = Observations(seen, area[rows], later)
    if options.reference_humidity is None and np.all(np.isfinite(specimens.humidity[rows])):
        options = replace(options, reference_humidity=float(np.exp(np.mean(np.log(specimens.humidity[rows])))))
    factors, names, parameters = _factors(tested, rows, is_damage, options)
    known = dict(options.known)
    histories, first = tested.histories, len(names)
    thick: float | None = None
    nodes: tuple[float, ...] = ()
    exposure: Exposure
    location: Location
    if is_damage:
        kind = "eyring" if name == "eyring" else "power"
        failed = seen != Seen.SUSPENDED
        fields = tested.state[0][rows]
        typical = fields[failed & (fields > 0)] if np.any(failed & (fields > 0)) else fields[fields > 0]
        ageing = Ageing(kind, float(np.exp(np.mean(np.log(typical)))))
        exposure = Aged.along(histories, ageing, of_ends, ends)
        location = Anchored(ageing, options.time, factors, names)
        slope = LawParameter("damage.exponent", "1", 1 + first, linear=True)
        if name == "eyring":
            slope = LawParameter("damage.activation_field", "V/m", 1 + first, factor=ageing.centre, sign=-1, linear=True)
        own = [LawParameter("damage.field", "V/m", 0), slope, LawParameter("damage.shape", "1", 2 + first, sign=-1)]
        shifted = 1
    else:
        squares = specimens.equibiaxial[rows]
        if name == "table":
            nodes = options.nodes or _nodes(squares[seen != Seen.SUSPENDED] if np.any(seen != Seen.SUSPENDED) else squares)
            field_now, _, growth, _ = histories.at(of_ends, ends)
            most = np.log(np.max(histories.largest(of_ends, ends)[0], axis=1))
            with np.errstate(divide="ignore", invalid="ignore"):
                rises = (growth > 0) & (np.log(field_now) >= most - 1e-9)
                rate = np.where(rises, np.log(np.where(growth > 0, growth, 1.0)), -np.inf)
            _check_rising(tested, rows, seen, rises[: rows.size])
            exposure = Plain(most, rate)
            weight = interpolating(squares, nodes)
        else:
            field_now, stretch, growth, widening = histories.at(of_ends, ends)
            points = histories.largest(of_ends, ends)
            varied = specimens.thickness
            thick = float(np.median(varied))
            if np.ptp(varied) <= 1e-9 * thick:
                known.setdefault("thickness_exponent", 0.0)
            thinner = np.log(thick / varied[rows])
            with np.errstate(divide="ignore"):
                exposure = Envelope(
                    np.log(points[0]),
                    np.log(points[1]),
                    (np.log(field_now), np.log(stretch)),
                    np.concatenate((thinner, thinner[between])),
                    growth,
                    widening,
                )
            weight = np.ones((rows.size, 1))
        count = max(len(nodes), 1)
        fields_of = [f"breakdown.field[{k}]" for k in range(count)] if count > 1 else ["breakdown.field"]
        location = Mixed(weight, factors, tuple(fields_of), names)
        own = [LawParameter(path, "V/m", k) for k, path in enumerate(fields_of)]
        if name == "power":
            for k, key in enumerate(("stretch_exponent", "thickness_exponent")):
                if key not in known:
                    own.append(LawParameter(f"breakdown.{key}", "1", 1 + first + k, linear=True))
        last = count + first + len(exposure.slopes)
        spread = LawParameter("breakdown.shape", "1", last, sign=-1)
        if scatter.linear:
            spread = LawParameter("breakdown.relative", "1", last)
        own.append(spread)
        shifted = count
    parameters = [replace(parameter, coordinate=parameter.coordinate + shifted) for parameter in parameters]
    model = FailureModel(observations, exposure, location, scatter)
    known = _in_coordinates(known, model.names)
    return LawModel(name, model, rows, (*own, *parameters), known, options, nodes, thick, "activation_energy" in names)


def line_model(law: str, tested: Simulated, rows: Cases, scatter: str = "weibull") -> LawModel:
    """The likelihood of a law of the time over the voltage (one of `LINES`) for the specimens `rows`, without physics: ageing by
    the voltage instead of the field.

    For constant voltages it is ln t = c - s V or c - s ln V with Weibull or lognormal scatter; ramps count by the same exposure.
    """
    films, ends, later = _ends(tested, rows)
    centre = float(np.exp(np.mean(np.log(tested.voltage[rows]))))
    ageing = Ageing(LINES[law], centre)
    assert tested.voltages is not None
    exposure = Aged.along(tested.voltages, ageing, films, ends)
    model = FailureModel(
        Observations.of(tested.seen[rows], None, later),
        exposure,
        Mixed(np.ones((rows.size, 1)), np.zeros((rows.size, 0)), ("log_time",)),
        scatter_law("lognormal" if scatter == "normal" else scatter),
    )
    slope = LawParameter("exponent", "1", 1, linear=True)
    if law == "exponential":
        slope = LawParameter("volts_per_decade", "V", 1, factor=centre * float(np.log(10)), sign=-1, linear=True)
    at = 0.0 if law == "exponential" else centre
    parameters = LawParameter(f"time_at_{at:.4g}_V", "s", 0), slope, LawParameter("shape", "1", 2, sign=-1)
    return LawModel(law, model, rows, parameters, {}, LawOptions(scatter))


def _ends(tested: Simulated, rows: Cases) -> tuple[Cases, Floats, Cases]:
    """The films and the times in s of the ends of the specimens `rows` (n,), then of the later looks of those that failed between
    two, and the number (n,) of the end at which each was found failed.
    """
    seen, films, times = tested.seen[rows], tested.film[rows], tested.end[rows]
    between = np.flatnonzero(seen == Seen.BETWEEN)
    later = np.arange(rows.size)
    later[between] = rows.size + np.arange(between.size)
    ends = np.where(seen == Seen.BETWEEN, tested.specimens.intact[rows], times)
    return np.concatenate((films, films[between])), np.concatenate((ends, times[between])), later


def _areas(area: Floats, scatter: ScatterLaw, options: LawOptions) -> tuple[Floats, LawOptions]:
    """ln of the areas over the reference, and the options with this reference."""
    if not np.any(np.isfinite(area)):
        return np.zeros(area.size), options
    if not scatter.scales_with_area:
        if np.ptp(area) > 1e-9 * np.max(area):
            raise InputError("areas differ, and only Weibull scatter says how strength depends on area", argument="scatter")
        return np.zeros(area.size), options
    reference = options.reference_area or float(np.exp(np.mean(np.log(area))))
    return np.log(area / reference), replace(options, reference_area=reference)


def _nodes(prestretch: Floats) -> tuple[float, ...]:
    return tuple(sorted({float(f"{value:.9g}") for value in prestretch.tolist()}))


def _factors(
    tested: Simulated, rows: Cases, is_damage: bool, options: LawOptions
) -> tuple[Floats, tuple[str, ...], list[LawParameter]]:
    """Factors (n, m) on the log of the field or the life, their names, and their parameters: batches, and for lives temperature
    (Arrhenius) and humidity (Peck, Proc. IEEE Int. Rel. Phys. Symp. (1986) 44), where the specimens differ in them.
    """
    specimens = tested.specimens
    columns, names, parameters = list[Floats](), list[str](), list[LawParameter]()
    batches = list(dict.fromkeys(specimens.batch[row] for row in rows))
    which = np.array([batches.index(specimens.batch[row]) for row in rows])
    for k, batch in enumerate(batches[:-1]):  # the factors of all batches have the product 1
        columns.append((which == k).astype(float) - (which == len(batches) - 1))
        names.append(f"batch.{batch}")
        parameters.append(LawParameter(f"batch.{batch}", "1", len(names) - 1))
    temperature, humidity = specimens.temperature[rows], specimens.humidity[rows]
    if is_damage and np.ptp(temperature) > 0:
        columns.append(barrier(temperature, options.reference_temperature))
        names.append("activation_energy")
        parameters.append(LawParameter("damage.activation_energy", "J/mol", len(names) - 1, factor=BARRIER, linear=True))
    if is_damage and np.all(np.isfinite(humidity)) and np.ptp(humidity) > 0:
        assert options.reference_humidity is not None
        columns.append(-np.log(humidity / options.reference_humidity))
        names.append("humidity_exponent")
        parameters.append(LawParameter("humidity_exponent", "1", len(names) - 1, linear=True))
    return np.array(columns).T if columns else np.zeros((rows.size, 0)), tuple(names), parameters


def _check_rising(tested: Simulated, rows: Cases, seen: Cases, rises: Any) -> None:
    """`InputError` with a line for each specimen that failed under a field that did not rise to a new maximum."""
    steady = np.flatnonzero((seen == Seen.FAILED) & ~rises)
    if steady.size:
        text = "it fails under a field that does not rise, or was higher before: fit a law of damage"
        raise InputError(*(tested.specimens.problem(int(rows[k]), text) for k in steady))


def _in_coordinates(known: Mapping[str, float], names: Sequence[str]) -> dict[str, float]:
    """Known values as coordinates of the model, without those of other laws."""
    found = dict[str, float]()
    for name, value in known.items():
        if name == "shape":
            found["log_scatter"] = -float(np.log(value))
        elif name == "relative":
            found["log_scatter"] = float(np.log(value))
        elif name in names:
            found[name] = value
    return found
