"""Time-temperature superposition: from measurements at several temperatures to one master curve.

Every curve of log modulus over log time is slid along the time until all lie on one smooth curve (Sec. 2.3 of DOI
10.1115/1.4030850). The shift factors, the smooth curve and, if asked for, vertical shifts are fitted together, with no starting
values from the user. Reduced time is t / a, reduced angular frequency omega a, reduced moduli are b E, reduced compliances J / b;
log10 a > 0 below the reference temperature.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dielast.errors import DielastWarning, InputError, warn
from dielast.material.shift import ShiftLaw
from dielast.superposition.condense import Condensed, condense
from dielast.superposition.effects import walk
from dielast.superposition.gather import Gathered, gather, where
from dielast.superposition.masterfit import fit_master
from dielast.superposition.measurement import CreepCurve, FrequencySweep, Measurement, RelaxationCurve
from dielast.superposition.misfit import warn_if_misfit
from dielast.superposition.outliers import warn_of_outliers
from dielast.superposition.overlap import find_isolated, starting_shifts
from dielast.superposition.shiftfit import LawName, ShiftFit, fit_shift_law
from dielast.superposition.spline import Spline
from dielast.superposition.superposed import MasterCurve, Stated
from dielast.superposition.sweepfit import Basis, Superposition, fit_sweeps, points_of, warn_of_others
from dielast.superposition.undetermined import (
    UNDETERMINED,
    Undetermined,
    find_undetermined,
    warn_if_law_misses,
    warn_if_no_plateau,
    warn_if_offset,
    warn_if_rising,
)
from dielast.units import ZERO_CELSIUS

__all__ = [
    "CreepCurve",
    "FrequencySweep",
    "MasterCurve",
    "Measurement",
    "RelaxationCurve",
    "ShiftFit",
    "Stated",
    "Undetermined",
    "build_master_curve",
]

Array = NDArray[np.float64]
Vertical = Literal["none", "density-temperature", "free"]
ShiftOn = Basis | Literal["auto"]

TEMPERATURE_STDERR = 0.1  # K, of a good thermostat
SMOOTH_POINTS = 400
MIN_BINS = 3


def build_master_curve(
    curves: Sequence[Measurement],
    *,
    reference_temperature: float,
    law: LawName = "wlf",
    vertical: Vertical = "none",
    thermal_expansion: float = 0.0,
    on: ShiftOn = "auto",
    temperature_stderr: float = TEMPERATURE_STDERR,
    drift: float = 0.0,
) -> MasterCurve:
    """Build the master curve of `curves` of one kind, in any order, at `reference_temperature` (degC), measured or not.

    `vertical` shifts the modulus too: "density-temperature" by b = rho_ref T_ref / (rho T), T in kelvin, with rho_ref / rho =
    1 + `thermal_expansion` (T - T_ref), where `thermal_expansion` (1/K) is that of the volume; "free" fits b with the shifts.
    Frequency sweeps are shifted `on` storage and loss "moduli" together, on "tan-delta" alone, which no vertical shift changes (b
    is then found from the moduli so shifted), or on the "storage" modulus alone; "auto" takes what predicts points left out and has
    most to go by.

    What no scatter of points tells is stated: `temperature_stderr` is the standard error in K of each temperature, by itself, which
    moves a shift factor along the slope of log10 a over T; `drift` is the relative standard deviation by which the modulus of the
    specimen changes from one temperature to the next, in the order in which the curves are given, a random walk whose first step is
    that from the material to the first curve. Both are in all standard errors. Offsets of whole curves beyond a stated drift are
    estimated, and so are tilts.

    Curves of fewer than three points apart, and single ones that share no modulus with any other, are left out with a warning.
    Raises `InputError` for fewer than two temperatures, for curves of several kinds, for one that is mostly zero or negative, and
    for groups of curves that do not overlap. Warns of each temperature whose shift the data do not determine, of points far off the
    master curve, and of results that look wrong.
    """
    reference = float(reference_temperature)
    if not -ZERO_CELSIUS < reference < np.inf:
        raise InputError(f"{reference:g} degC is not a temperature above absolute zero", argument="reference_temperature")
    if not 0 <= temperature_stderr < np.inf:
        raise InputError(f"{temperature_stderr:g} K: it must be finite and not negative", argument="temperature_stderr")
    if not 0 <= drift < 1:
        raise InputError(f"{drift:g}: a share from 0 to 1 is needed, such as 0.02 for 2 %", argument="drift")
    data, condensed = _usable(curves)
    temperature, swept = data.temperature, data.measurement == "oscillation"
    if on != "auto" and not swept:
        raise InputError(f'"{on}" is for frequency sweeps; {data.measurement} curves have one modulus only', argument="on")
    if not temperature[0] <= reference <= temperature[-1]:
        warn(
            f"reference temperature {reference:g} degC is outside the measured {temperature[0]:g} to {temperature[-1]:g} degC: "
            "the master curve is extrapolated by the shift law"
        )
    imposed = np.zeros(temperature.size)
    if vertical == "density-temperature":
        imposed = _density_temperature(temperature, reference, thermal_expansion)
    condensed = replace(condensed, log_modulus=condensed.log_modulus + imposed[condensed.curve])
    falling = condensed.log_modulus[0]
    anchor = _steepest(temperature.size, condensed.curve, falling)
    start = starting_shifts(temperature, condensed.curve, condensed.log_time, falling, anchor, data.measurement)
    free = vertical == "free"
    drifts = walk(data.order, drift / np.log(10)) if drift > 0 else None
    if swept:
        found = fit_sweeps(temperature, condensed, start, anchor, free, on, drifts)
    else:
        points = points_of(condensed, temperature.size)
        fit = fit_master(points, [start], anchor, free, drifts)
        found = Superposition(fit, "moduli", points, fit.splines)
    warn_of_outliers(data, imposed, found.fit, 1 if found.on == "storage" else len(data.ordinates))
    warn_if_misfit(temperature, found.fit.misfit, free, data.measurement)
    warn_if_offset(found.fit.offset_spread)
    here = temperature == reference
    warn_of_others(temperature, found, np.where(here, 1.0, 0.0) if np.any(here) else np.eye(temperature.size)[anchor])
    filled = "its points are left out" if law == "table" else "its points are placed by the shift law"
    undetermined = find_undetermined(temperature, found.points, found.splines, found.fit, free, swept, filled)
    stated = Stated(float(temperature_stderr), float(drift))
    return _finish(data, condensed, imposed, found, undetermined, anchor, law, reference, stated)


def _density_temperature(temperature: Array, reference: float, expansion: float) -> Array:
    """log10 of b = rho_ref T_ref / (rho T)."""
    expanded = 1 + expansion * (temperature - reference)
    for k in np.flatnonzero(~(expanded > 0))[:1]:
        raise InputError(f"{expansion:g} /K gives no positive density at {temperature[k]:g} degC", argument="thermal_expansion")
    return np.asarray(np.log10(expanded * (reference + ZERO_CELSIUS) / (temperature + ZERO_CELSIUS)))


def _usable(curves: Sequence[Measurement]) -> tuple[Gathered, Condensed]:
    """All curves that can be used, gathered and condensed; those too short, and single ones that join no other, are left out.

    Warns of each; raises `InputError` if fewer than two are left.
    """
    rest, reasons = list(curves), []
    while True:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DielastWarning)  # heard below, once
            data = gather(rest)
        condensed = condense(data)
        out = _too_short(data, condensed)
        if not out and data.temperature.size > 2:
            out = find_isolated(data.temperature, condensed.curve, condensed.log_modulus[0], data.measurement)
        if not out:
            break
        said = {data.temperature[k]: f"{where(curves, data.temperature[k])}: {reason}" for k, reason in out.items()}
        if data.temperature.size - len(said) < 2:
            raise InputError(next(iter(said.values())))
        reasons += list(said.values())
        rest = [curve for curve in rest if curve.temperature not in said]
    for reason in reasons:
        warn(f"{reason}; this curve is left out")
    data = gather(rest)
    end = {"creep": "short", "oscillation": "low-frequency"}.get(data.measurement, "long")
    dropped = np.bincount(data.curve[(condensed.bin_of_point < 0) & data.good], minlength=data.temperature.size)
    if np.any(dropped):
        places = ", ".join(f"{data.temperature[k]:g} degC ({dropped[k]})" for k in np.flatnonzero(dropped))
        warn(f"points at the {end} end of curves that are lost in noise are left out: {places}")
    return data, condensed


def _too_short(data: Gathered, condensed: Condensed) -> dict[int, str]:
    """Why curves, by number, have too few points."""
    m = data.temperature.size
    used = np.bincount(condensed.curve, minlength=m)
    dropped = np.bincount(data.curve[(condensed.bin_of_point < 0) & data.good], minlength=m)
    axis = "frequency" if data.measurement == "oscillation" else "time"
    found = {}
    for k in np.flatnonzero(used < MIN_BINS).tolist():
        floor = f" ({dropped[k]} are noise floor)" if dropped[k] else ""
        found[k] = f"only {used[k]} distinct points in log {axis}{floor}; at least {MIN_BINS} are needed"
    return found


def _steepest(curves: int, curve: NDArray[np.intp], log_modulus: Array) -> int:
    """The curve that falls furthest: it is held fast in the fit, so that the others are not measured against a plateau."""
    bounds = np.searchsorted(curve, np.arange(curves + 1))
    return int(np.argmax([np.subtract(*np.percentile(log_modulus[a:b], (90, 10))) for a, b in pairwise(bounds)]))


def _finish(
    data: Gathered,
    condensed: Condensed,
    imposed: Array,
    found: Superposition,
    undetermined: tuple[Undetermined, ...],
    anchor: int,
    law: LawName,
    reference: float,
    stated: Stated,
) -> MasterCurve:
    """Fit the law and move everything from the curve that was held fast to the reference temperature."""
    temperature, m, fit = data.temperature, data.temperature.size, found.fit
    sure = ~np.isin(temperature, [entry.temperature for entry in undetermined])
    if np.count_nonzero(sure) < 2:
        reasons = dict.fromkeys(entry.reason for entry in undetermined)
        said = [(reason, ", ".join(f"{e.temperature:g}" for e in undetermined if e.reason == reason)) for reason in reasons]
        raise InputError("no shift factor is determined: " + "; ".join(f"at {where} degC {reason}" for reason, where in said))
    known = np.ix_(sure, sure)
    slope = np.zeros(m)
    slope[sure] = np.gradient(fit.shift[sure], temperature[sure])
    thermometer = np.diag((slope * stated.temperature_stderr) ** 2)
    own = fit.covariance[:m, :m] + _relative(thermometer, np.eye(m)[anchor])
    shift_fit = fit_shift_law(law, temperature[sure], fit.shift[sure], own[known], int(np.sum(sure[:anchor])), reference)
    weight, excess = np.zeros(m), 0.0
    here = sure & (temperature == reference)
    if np.any(here):
        weight[here], origin = 1.0, float(fit.shift[here][0])
    else:
        weight[sure], origin, excess = shift_fit.origin_weight, shift_fit.origin, shift_fit.origin_excess
    shift = np.where(sure, fit.shift - origin, np.nan)
    covariance = np.diag(np.where(sure, 0.0, np.inf))
    covariance[known] = _relative(own, weight)[known] + excess
    stderr = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    between = np.array([np.interp(reference, temperature, row) for row in np.eye(m)])
    raised = float(between @ fit.vertical)
    vertical = 10 ** (fit.vertical - raised + imposed)
    vertical_variance = np.diag(_relative(fit.covariance[m:, m:], between))
    by_law = _law_values(shift_fit.law, temperature)
    warn_if_rising(temperature[sure], shift[sure], stderr[sure])
    warn_if_law_misses(temperature[sure], shift[sure], stderr[sure], by_law[sure], shift_fit.misfit, len(shift_fit.names))
    warn_if_no_plateau(fit.splines[0], data.measurement)

    # an extrapolated law places a curve only where it knows the place better than a curve that is undetermined
    astray = ~sure & (_law_stderr(shift_fit, temperature, temperature[sure]) > UNDETERMINED)
    if np.any(astray):
        places = ", ".join(f"{value:g}" for value in temperature[astray])
        warn(
            f"at {places} degC the shift law is extrapolated and does not know log10 a within half a decade: "
            "their points are left out"
        )
    placed = np.where(sure, shift, np.where(astray, np.nan, by_law))
    used = (condensed.bin_of_point >= 0) & data.good & np.isfinite(placed)[data.curve]
    curve, abscissa = data.curve[used], data.abscissa[used]
    swept, compliant = data.measurement == "oscillation", data.measurement == "creep"
    factor = 10 ** placed[curve]
    reduced = abscissa * factor if swept else abscissa / factor
    order = np.lexsort((abscissa, reduced))
    x = np.linspace(fit.splines[0].origin, fit.splines[0].end, SMOOTH_POINTS)

    def ordinates(splines: Sequence[Spline]) -> Array:
        values = np.stack([10 ** (spline(x) - raised) for spline in splines])
        return values[:, ::-1] if swept else 1 / values if compliant else values

    modulus = 10 ** (fit.splines[0](x) - raised)
    measured, level = data.ordinates[:, used], vertical[curve]
    return MasterCurve(
        measurement=data.measurement,
        reference_temperature=reference,
        temperature=temperature,
        log10_shift_factor=shift,
        log10_shift_factor_stderr=stderr,
        log10_shift_factor_fit=by_law,
        covariance=covariance,
        vertical_shift=vertical,
        vertical_shift_stderr=vertical * np.log(10) * np.sqrt(np.maximum(vertical_variance, 0.0)),
        shift_fit=shift_fit,
        shifted_on=found.on,
        rms_residual_decades=float(np.sqrt(np.mean(fit.residual**2))),
        point_temperature=temperature[curve][order],
        abscissa=abscissa[order],
        reduced_abscissa=reduced[order],
        ordinates=(measured / level if compliant else measured * level)[:, order],
        smooth_abscissa=10 ** -(x + origin)[::-1] if swept else 10 ** (x + origin),
        smooth_ordinates=ordinates(fit.splines),
        equilibrium_modulus=float(modulus[-1]),
        glassy_modulus=float(np.max(modulus)),
        undetermined=undetermined,
        stated=stated,
        log10_shift_factor_slope=slope,
        offset_spread=fit.offset_spread,
        tilt_spread=fit.tilt_spread,
        placed_ordinates=ordinates(fit.placed),
    )


def _relative(covariance: Array, weight: Array) -> Array:
    """Covariance of values taken relative to a weighted mean of themselves."""
    relative = np.eye(weight.size) - weight
    return np.asarray(relative @ covariance @ relative.T)


def _with_constant(law: ShiftLaw, name: str, value: float) -> ShiftLaw:
    """The law with another constant."""
    changed: ShiftLaw = replace(law, **{name: value})  # type: ignore[type-var]
    return changed


def _law_stderr(fit: ShiftFit, temperature: Array, known: Array) -> Array:
    """Standard error (m,) of the law's log10 a relative to the nearest of the `known` temperatures, from its constants; 0 for a
    table, or where the constants have no finite errors.
    """
    if not fit.names or not np.all(np.isfinite(fit.covariance)):
        return np.zeros(temperature.size)
    nearest = known[np.argmin(np.abs(temperature[:, None] - known), axis=1)]
    slope = np.empty((len(fit.names), temperature.size))
    for row, (name, value) in enumerate(fit.parameters.items()):
        step = 1e-4 * abs(value) or 1e-6
        up, down = (
            _law_values(law, temperature) - _law_values(law, nearest)
            for law in (_with_constant(fit.law, name, value + sign * step) for sign in (1, -1))
        )
        slope[row] = (up - down) / (2 * step)
    return np.asarray(np.sqrt(np.maximum(np.einsum("pm,pq,qm->m", slope, fit.covariance, slope), 0.0)))


def _law_values(law: ShiftLaw, temperature: Array) -> Array:
    """log10 a by the law; NaN where a table ends or a law has its pole."""
    values = np.full(temperature.size, np.nan)
    for k, value in enumerate(temperature):
        with suppress(InputError):
            values[k] = float(law.log10_shift_factor(value))
    return values
