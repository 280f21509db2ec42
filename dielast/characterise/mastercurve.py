"""Time-temperature superposition: from relaxation curves at several temperatures to one master curve.

Every curve of log modulus over log time is slid along the time until all lie on one smooth curve (Sec. 2.3 of DOI
10.1115/1.4030850). The shift factors, the smooth curve and, if asked for, vertical shifts are fitted together, with no starting
values from the user. Reduced time is t / a, reduced modulus b E; log10 a > 0 below the reference temperature.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.binning import Binned, bin_curves
from dielast.characterise.doubt import (
    Undetermined,
    find_undetermined,
    warn_if_law_misses,
    warn_if_no_plateau,
    warn_if_offset,
    warn_if_rising,
)
from dielast.characterise.gather import Gathered, gather
from dielast.characterise.masterfit import MasterFit, Points, fit_master
from dielast.characterise.measurement import RelaxationCurve
from dielast.characterise.misfit import warn_if_misfit
from dielast.characterise.overlap import starting_shifts
from dielast.characterise.shiftfit import LawName, ShiftFit, fit_shift_law
from dielast.errors import InputError, warn
from dielast.shift import ShiftLaw
from dielast.units import ZERO_CELSIUS

__all__ = ["MasterCurve", "RelaxationCurve", "ShiftFit", "Undetermined", "build_master_curve"]

Array = NDArray[np.float64]
Vertical = Literal["none", "density-temperature", "free"]

SMOOTH_POINTS = 400
MIN_BINS = 3


@dataclass(frozen=True, slots=True, eq=False)
class MasterCurve:
    """A master curve of m temperatures, ascending; SI units and degC.

    `log10_shift_factor`, its standard error (both (m,)) and its `covariance` (m, m) are measured, relative to the reference
    temperature. Where the data do not determine a shift it is NaN, its standard error infinite, and `undetermined` says why. The
    errors hold noise, curves that do not superpose and, where the reference temperature was not measured, what the law leaves open
    (infinite if it is 50 K and more below all data that do not determine C2).
    `log10_shift_factor_fit` (m,) is the fitted law; NaN for a temperature that a table lacks. `vertical_shift` (m,) is b.

    The points used, sorted by reduced time: `point_temperature`, `time`, `reduced_time` (s) and `relaxation_modulus` (Young's, Pa,
    times b). Points of an undetermined temperature are placed by the law, or left out if that is a table. `smooth_reduced_time`
    and `smooth_modulus` are the fitted curve, `equilibrium_modulus` its value at the longest reduced time, `glassy_modulus` its
    maximum. `rms_residual_decades`, of log10 modulus, is that of the fitted points, which are averages over 1/20 decade of time.
    """

    reference_temperature: float
    temperature: Array
    log10_shift_factor: Array
    log10_shift_factor_stderr: Array
    log10_shift_factor_fit: Array
    covariance: Array
    vertical_shift: Array
    vertical_shift_stderr: Array
    shift_fit: ShiftFit
    rms_residual_decades: float
    point_temperature: Array
    time: Array
    reduced_time: Array
    relaxation_modulus: Array
    smooth_reduced_time: Array
    smooth_modulus: Array
    equilibrium_modulus: float
    glassy_modulus: float
    undetermined: tuple[Undetermined, ...]

    @property
    def law(self) -> ShiftLaw:
        """The fitted shift law, about the reference temperature."""
        return self.shift_fit.law

    @property
    def law_parameters(self) -> dict[str, float]:
        """Parameters of the law by name: C1 and C2 (K), or activation_energy (J/mol); none for a table."""
        return self.shift_fit.parameters

    @property
    def law_stderr(self) -> dict[str, float]:
        """Standard errors of the parameters; infinite where the data do not determine them."""
        return self.shift_fit.stderr

    @property
    def law_covariance(self) -> Array:
        """Covariance of the parameters, in the order of `law_parameters`."""
        return self.shift_fit.covariance


def build_master_curve(
    curves: Sequence[RelaxationCurve],
    *,
    reference_temperature: float,
    law: LawName = "wlf",
    vertical: Vertical = "none",
    thermal_expansion: float = 0.0,
) -> MasterCurve:
    """Build the master curve of relaxation `curves`, in any order, at `reference_temperature` (degC), measured or not.

    `vertical` shifts the modulus too: "density-temperature" by b = rho_ref T_ref / (rho T), T in kelvin, with rho_ref / rho =
    1 + `thermal_expansion` (T - T_ref), where `thermal_expansion` (1/K) is that of the volume; "free" fits b with the shifts.

    Raises `InputError` for fewer than two temperatures, for a curve that cannot be used, and for curves that do not overlap. Warns
    of each temperature whose shift the data do not determine, and of results that look wrong.
    """
    reference = float(reference_temperature)
    if not -ZERO_CELSIUS < reference < np.inf:
        raise InputError(f"reference temperature {reference:g} degC is not a temperature above absolute zero")
    data = gather(curves)
    temperature = data.temperature
    if not temperature[0] <= reference <= temperature[-1]:
        warn(
            f"reference temperature {reference:g} degC is outside the measured {temperature[0]:g} to {temperature[-1]:g} degC: "
            "the master curve is extrapolated by the shift law"
        )
    imposed = np.zeros(temperature.size)
    if vertical == "density-temperature":
        imposed = _density_temperature(temperature, reference, thermal_expansion)
    binned = bin_curves(data.curve, data.time, data.modulus)
    _check_usable(data, binned)
    log_modulus = binned.log_modulus + imposed[binned.curve]
    anchor = _steepest(temperature.size, binned.curve, log_modulus)
    start = starting_shifts(temperature, binned.curve, binned.log_time, log_modulus, anchor)
    points = Points(binned.curve, binned.log_time, log_modulus, binned.variance, temperature.size)
    fit = fit_master(points, start, anchor, vertical == "free")
    warn_if_misfit(temperature, fit.misfit, vertical == "free")
    warn_if_offset(fit.offset_spread)
    undetermined = find_undetermined(temperature, points, fit, vertical == "free")
    return _finish(data, binned, imposed, fit, undetermined, anchor, law, reference)


def _density_temperature(temperature: Array, reference: float, expansion: float) -> Array:
    """log10 of b = rho_ref T_ref / (rho T)."""
    expanded = 1 + expansion * (temperature - reference)
    for k in np.flatnonzero(~(expanded > 0))[:1]:
        raise InputError(f"thermal expansion {expansion:g} /K gives no positive density at {temperature[k]:g} degC")
    return np.asarray(np.log10(expanded * (reference + ZERO_CELSIUS) / (temperature + ZERO_CELSIUS)))


def _check_usable(data: Gathered, binned: Binned) -> None:
    m = data.temperature.size
    used = np.bincount(binned.curve, minlength=m)
    dropped = np.bincount(data.curve[(binned.bin_of_point < 0) & (data.modulus > 0)], minlength=m)
    for k in np.flatnonzero(used < MIN_BINS)[:1]:
        floor = f" ({dropped[k]} are noise floor)" if dropped[k] else ""
        raise InputError(
            f"{data.temperature[k]:g} degC: only {used[k]} distinct points in log time{floor}; at least {MIN_BINS} are needed"
        )
    if np.any(dropped):
        where = ", ".join(f"{data.temperature[k]:g} degC ({dropped[k]})" for k in np.flatnonzero(dropped))
        warn(f"points at the long end of curves that are lost in noise are left out: {where}")


def _steepest(curves: int, curve: NDArray[np.intp], log_modulus: Array) -> int:
    """The curve that falls furthest: it is held fast in the fit, so that the others are not measured against a plateau."""
    bounds = np.searchsorted(curve, np.arange(curves + 1))
    return int(np.argmax([np.subtract(*np.percentile(log_modulus[a:b], (90, 10))) for a, b in pairwise(bounds)]))


def _finish(
    data: Gathered,
    binned: Binned,
    imposed: Array,
    fit: MasterFit,
    undetermined: tuple[Undetermined, ...],
    anchor: int,
    law: LawName,
    reference: float,
) -> MasterCurve:
    """Fit the law and move everything from the curve that was held fast to the reference temperature."""
    temperature, m = data.temperature, data.temperature.size
    sure = ~np.isin(temperature, [entry.temperature for entry in undetermined])
    if np.count_nonzero(sure) < 2:
        reasons = dict.fromkeys(entry.reason for entry in undetermined)
        said = [(reason, ", ".join(f"{e.temperature:g}" for e in undetermined if e.reason == reason)) for reason in reasons]
        raise InputError("no shift factor is determined: " + "; ".join(f"at {where} degC {reason}" for reason, where in said))
    known = np.ix_(sure, sure)
    shift_fit = fit_shift_law(
        law, temperature[sure], fit.shift[sure], fit.covariance[:m, :m][known], int(np.sum(sure[:anchor])), reference
    )
    weight, excess = np.zeros(m), 0.0
    here = sure & (temperature == reference)
    if np.any(here):
        weight[here], origin = 1.0, float(fit.shift[here][0])
    else:
        weight[sure], origin, excess = shift_fit.origin_weight, shift_fit.origin, shift_fit.origin_excess
    shift = np.where(sure, fit.shift - origin, np.nan)
    covariance = np.diag(np.where(sure, 0.0, np.inf))
    covariance[known] = _relative(fit.covariance[:m, :m], weight)[known] + excess
    stderr = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    between = np.array([np.interp(reference, temperature, row) for row in np.eye(m)])
    raised = float(between @ fit.vertical)
    vertical = 10 ** (fit.vertical - raised + imposed)
    vertical_variance = np.diag(_relative(fit.covariance[m:, m:], between))
    by_law = _law_values(shift_fit.law, temperature)
    warn_if_rising(temperature[sure], shift[sure], stderr[sure])
    warn_if_law_misses(temperature[sure], shift[sure], stderr[sure], by_law[sure], shift_fit.misfit, len(shift_fit.names))
    warn_if_no_plateau(fit.spline)

    placed = np.where(sure, shift, by_law)
    used = (binned.bin_of_point >= 0) & (data.modulus > 0) & np.isfinite(placed)[data.curve]
    curve, time = data.curve[used], data.time[used]
    reduced = time / 10 ** placed[curve]
    order = np.lexsort((time, reduced))
    x = np.linspace(fit.spline.origin, fit.spline.end, SMOOTH_POINTS)
    smooth = 10 ** (fit.spline(x) - raised)
    return MasterCurve(
        reference_temperature=reference,
        temperature=temperature,
        log10_shift_factor=shift,
        log10_shift_factor_stderr=stderr,
        log10_shift_factor_fit=by_law,
        covariance=covariance,
        vertical_shift=vertical,
        vertical_shift_stderr=vertical * np.log(10) * np.sqrt(np.maximum(vertical_variance, 0.0)),
        shift_fit=shift_fit,
        rms_residual_decades=float(np.sqrt(np.mean(fit.residual**2))),
        point_temperature=temperature[curve][order],
        time=time[order],
        reduced_time=reduced[order],
        relaxation_modulus=(data.modulus[used] * vertical[curve])[order],
        smooth_reduced_time=10 ** (x + origin),
        smooth_modulus=smooth,
        equilibrium_modulus=float(smooth[-1]),
        glassy_modulus=float(np.max(smooth)),
        undetermined=undetermined,
    )


def _relative(covariance: Array, weight: Array) -> Array:
    """Covariance of values taken relative to a weighted mean of themselves."""
    relative = np.eye(weight.size) - weight
    return np.asarray(relative @ covariance @ relative.T)


def _law_values(law: ShiftLaw, temperature: Array) -> Array:
    """log10 a by the law; NaN where a table ends or a law has its pole."""
    values = np.full(temperature.size, np.nan)
    for k, value in enumerate(temperature):
        with suppress(InputError):
            values[k] = float(law.log10_shift_factor(value))
    return values
