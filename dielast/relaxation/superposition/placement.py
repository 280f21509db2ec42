"""From a joint fit to the master curve: the shift law, and all results relative to the reference temperature."""

from contextlib import suppress

import numpy as np

from dielast.base.errors import InputError, warn
from dielast.material.shift import ShiftLaw
from dielast.numerics.arrays import Flags, Floats
from dielast.relaxation.superposition.binning import Binned
from dielast.relaxation.superposition.checks import (
    UNDETERMINED,
    Undetermined,
    warn_if_law_misses,
    warn_if_no_plateau,
    warn_if_rising,
)
from dielast.relaxation.superposition.gather import Gathered
from dielast.relaxation.superposition.joint_fit import MasterFit
from dielast.relaxation.superposition.result import MasterCurve, Placing, Stated
from dielast.relaxation.superposition.shiftfit import ShiftFit, fit_shift_law, misfit_without
from dielast.relaxation.superposition.sweepfit import BasisFit

SMOOTH_POINTS = 400

SAME = 0.5  # K; temperatures that are closer are one, as data.temperature_tolerance has it by default


def place_at_reference(
    data: Gathered,
    binned: Binned,
    imposed: Floats,
    basis_fit: BasisFit,
    outlying: Flags,
    undetermined: tuple[Undetermined, ...],
    anchor: int,
    law: str,
    reference: float,
    stated: Stated,
) -> MasterCurve:
    """Fit the law, and refer all results to the `reference` temperature in degC instead of the curve `anchor`.

    `imposed` (m,) is log10 b where it was prescribed, `outlying` (c, n) marks points far from their curve. Raises `InputError` if
    fewer than two shift factors are determined; warns of implausible shift factors, law and plateau.
    """
    temperature, m, fit, kind = data.temperature, data.temperature.size, basis_fit.fit, data.kind
    determined = ~np.isin(temperature, [entry.temperature for entry in undetermined])
    if np.count_nonzero(determined) < 2:
        reasons = dict.fromkeys(entry.reason for entry in undetermined)
        places = [(reason, ", ".join(f"{e.temperature:g}" for e in undetermined if e.reason == reason)) for reason in reasons]
        raise InputError("no shift factor is determined: " + "; ".join(f"at {where} degC {reason}" for reason, where in places))
    _check_reference(reference, temperature, determined)
    both_determined = np.ix_(determined, determined)
    slope = np.zeros(m)
    slope[determined] = np.gradient(fit.shift[determined], temperature[determined])
    thermometer = np.abs(slope) * stated.temperature_stderr
    measured = fit.covariance[:m, :m] + _relative(np.diag(thermometer**2), np.eye(m)[anchor])
    to_fit = (law, temperature[determined], fit.shift[determined], measured[both_determined], int(np.sum(determined[:anchor])))
    shift_fit = fit_shift_law(*to_fit, reference, superposed=not fit.misfit.sure)
    weight, excess = np.zeros(m), 0.0
    at_reference = determined & (temperature == reference)
    if np.any(at_reference):
        weight[at_reference], origin = 1.0, float(fit.shift[at_reference][0])
    else:
        weight[determined], origin, excess = shift_fit.origin_weight, shift_fit.origin, shift_fit.origin_excess
    shift = np.where(determined, fit.shift - origin, np.nan)
    covariance = np.diag(np.where(determined, 0.0, np.inf))
    covariance[both_determined] = _relative(measured, weight)[both_determined] + excess
    stderr = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    between = np.array([np.interp(reference, temperature, row) for row in np.eye(m)])
    raised = float(between @ fit.vertical)
    vertical = 10 ** (fit.vertical - raised + imposed)
    vertical_variance = np.diag(_relative(fit.covariance[m:, m:], between))
    by_law = _by_law(shift_fit.law, temperature)
    warn_if_rising(temperature[determined], shift[determined], stderr[determined], law)
    warn_if_law_misses(
        temperature[determined],
        shift[determined],
        stderr[determined],
        by_law[determined],
        shift_fit.misfit,
        len(shift_fit.names),
        lambda: misfit_without(*to_fit),
    )
    placed = np.where(determined, shift, np.where(_astray(shift_fit, temperature, determined), np.nan, by_law))
    used = (binned.bin_of_point >= 0) & data.good & np.isfinite(placed)[data.curve]
    curve, abscissa = data.curve[used], data.abscissa[used]
    reduced = abscissa / (10 ** placed[curve]) ** kind.time_power
    order = np.lexsort((abscissa, reduced))
    ordinates = (data.ordinates[:, used] * vertical[curve] ** kind.stiffness_power)[:, order]
    warn_if_no_plateau(
        fit.placed[0], kind, kind.time_power * np.log10(reduced[order]), kind.stiffness_power * np.log10(ordinates[0])
    )
    along = slice(None, None, kind.time_power)  # order of the smooth curves by ascending abscissa
    x = np.linspace(fit.placed[0].origin, fit.placed[0].end, SMOOTH_POINTS)
    stiffness = np.stack([10 ** (spline(x) - raised) for spline in fit.placed])
    return MasterCurve(
        measurement=kind.name,
        reference_temperature=reference,
        temperature=temperature,
        log10_shift_factor=shift,
        log10_shift_factor_stderr=stderr,
        log10_shift_factor_fit=by_law,
        covariance=covariance,
        vertical_shift=vertical,
        vertical_shift_stderr=vertical * np.log(10) * np.sqrt(np.maximum(vertical_variance, 0.0)),
        shift_fit=shift_fit,
        shifted_on=basis_fit.on,
        rms_residual_decades=_rms(fit, binned, outlying),
        point_temperature=temperature[curve][order],
        abscissa=abscissa[order],
        reduced_abscissa=reduced[order],
        ordinates=ordinates,
        smooth_abscissa=10 ** (kind.time_power * (x + origin))[along],
        smooth_ordinates=stiffness[:, along] ** kind.stiffness_power,
        equilibrium_modulus=float(stiffness[0, -1]),
        glassy_modulus=float(np.max(stiffness[0])),
        undetermined=undetermined,
        stated=stated,
        placing=Placing(fit.shift, fit.vertical, fit.covariance, thermometer, determined, anchor, origin, weight, excess),
        offset_spread=fit.offset_spread,
        tilt_spread=fit.tilt_spread,
        outlying_points=int(np.count_nonzero(np.any(outlying, axis=0))),
    )


def _check_reference(reference: float, temperature: Floats, determined: Flags) -> None:
    """Raise `InputError` if temperatures without a shift factor lie between the `reference` and all temperatures with one."""
    low, high = temperature[determined][[0, -1]].tolist()
    if (reference < low - SAME and temperature[0] < low) or (reference > high + SAME and temperature[-1] > high):
        nearest = low if reference < low else high
        raise InputError(
            f"{reference:g} degC lies among temperatures whose shift factors are not determined, and the law would be extrapolated "
            f"to it: take {nearest:g} degC, the nearest temperature with a shift factor",
            argument="reference_temperature",
        )


def _astray(fit: ShiftFit, temperature: Floats, determined: Flags) -> Flags:
    """Undetermined temperatures (m,) at which the law, from the nearest determined one on, is as uncertain as the data; warns of
    them, and of others at which the law is extrapolated.
    """
    measured = temperature[determined]
    stderr = np.zeros(temperature.size)
    for k in np.flatnonzero(~determined):
        nearest = measured[np.argmin(np.abs(temperature[k] - measured))]
        stderr[k] = fit.stderr_between(float(temperature[k]), float(nearest))
    astray = stderr > UNDETERMINED
    beyond = ~determined & ~astray & ((temperature < measured[0]) | (temperature > measured[-1])) & bool(fit.names)
    for at, then in (
        (astray, "does not know log10 a within half a decade: their points are left out"),
        (
            beyond,
            f"knows log10 a to +- {np.max(stderr[beyond], initial=0.0):.2g}, if it holds there: their points are placed by it",
        ),
    ):
        if np.any(at):
            places = ", ".join(f"{value:g}" for value in temperature[at])
            warn(f"at {places} degC the shift law is extrapolated and {then}")
    return astray


def _rms(fit: MasterFit, binned: Binned, outlying: Flags) -> float:
    """Root mean square distance, in decades, of the averages from the smooth curves through them, without averages that contain an
    outlying point (c, n), and without curves that were not fitted.
    """
    position = binned.log_time - fit.shift[binned.curve]
    residual = binned.log_modulus + fit.vertical[binned.curve] - np.stack([spline(position) for spline in fit.placed])
    residual[:, ~np.isfinite(fit.noise_stderr)[binned.curve]] = np.nan
    for row, far in zip(residual, outlying & (binned.bin_of_point >= 0), strict=True):
        row[binned.bin_of_point[far]] = np.nan
    return float(np.sqrt(np.nanmean(residual**2)))


def _relative(covariance: Floats, weight: Floats) -> Floats:
    """Covariance of values relative to their weighted mean."""
    relative = np.eye(weight.size) - weight
    return np.asarray(relative @ covariance @ relative.T)


def _by_law(law: ShiftLaw, temperature: Floats) -> Floats:
    """log10 a by the law; NaN outside of a table, and at a pole of the law."""
    values = np.full(temperature.size, np.nan)
    for k, value in enumerate(temperature):
        with suppress(InputError):
            values[k] = float(law.log10_shift_factor(value))
    return values
