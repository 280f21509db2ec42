"""Time-temperature superposition: from measurements at several temperatures to one master curve.

Every curve of log modulus over log time is shifted along time until all lie on one smooth curve (Sec. 2.3 of DOI
10.1115/1.4030850). The shift factors, the smooth curve and, if requested, vertical shifts are fitted together, without starting
values from the user. Reduced time is t / a, reduced angular frequency omega a, reduced moduli are b E, reduced compliances J / b;
log10 a > 0 below the reference temperature.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from dielast.base.errors import InputError, shown, warn, without_warnings
from dielast.material.measurement import Measurement, is_temperature
from dielast.material.modulus import EntropicModulus
from dielast.material.ramp import without_ramp
from dielast.material.shift import SHIFTS
from dielast.numerics.arrays import Floats
from dielast.relaxation.superposition.binning import Binned
from dielast.relaxation.superposition.checks import find_undetermined, warn_if_misfit, warn_if_offset, warn_of_outliers
from dielast.relaxation.superposition.gather import Gathered, usable_curves
from dielast.relaxation.superposition.joint_fit import Fitted, best_fit, with_errors
from dielast.relaxation.superposition.overlap import starting_shifts, steepest
from dielast.relaxation.superposition.placement import place_at_reference
from dielast.relaxation.superposition.points import points_of
from dielast.relaxation.superposition.ramp import after_step, find_ramp, left_out, warn_if_modulus_rises, warn_of_ramp
from dielast.relaxation.superposition.result import MasterCurve, Stated
from dielast.relaxation.superposition.sweepfit import Basis, BasisFit, fit_sweeps, warn_of_others

Vertical = Literal["none", "density-temperature", "free"]
ShiftOn = Basis | Literal["auto"]

TEMPERATURE_STDERR = (
    0.3  # K; with it, 90 % intervals hold 83 % of the published steps of log10 a of measured melts, with 0.1 K 71 %
)


def build_master_curve(
    curves: Sequence[Measurement],
    *,
    reference_temperature: float,
    law: str = "wlf",
    vertical: Vertical = "none",
    thermal_expansion: float = 0.0,
    on: ShiftOn = "auto",
    temperature_stderr: float = TEMPERATURE_STDERR,
    drift: float = 0.0,
) -> MasterCurve:
    """Build the master curve of `curves` of one kind, in any order, at `reference_temperature` (degC), measured or not.

    `law` is the shift law to fit, or "table". `vertical` also shifts the modulus: "density-temperature" by b = rho_ref T_ref / (rho
    T) with T in kelvin and rho_ref / rho = 1 + `thermal_expansion` (T - T_ref), where `thermal_expansion` (1/K) is that of the
    volume; "free" fits b together with the shifts.

    Frequency sweeps are shifted `on` storage and loss "moduli" together; on "tan-delta" alone, which vertical shifts do not change
    (b is then fitted to the moduli at these shifts); or on the "storage" modulus alone. "auto" uses a basis that predicts omitted
    points: both moduli if they do, else the basis with the most certain shifts.

    Two errors that the scatter of points does not show are stated by the user. `temperature_stderr` is the independent standard
    error of each temperature in K, which changes a shift factor along the slope of log10 a over T. `drift` is the relative standard
    deviation of the modulus of the specimen from one temperature to the next, in the order of `curves`: a random walk, whose first
    step leads from the material to the first curve. Both contribute to all standard errors. Offsets of whole curves beyond a stated
    drift, and tilts, are estimated.

    A ramp that all tests over time begin with is found by its likelihood, unless the `ramp_taken_out` of a curve is
    stated, 0 for a step. It is taken out with a warning if there are readings before twice its duration, or else
    only named, and the standard errors allow for it. Shifts after a ramp are read from moduli as after a step, to second order by
    the smooth curve; the points of the result are as measured, over mean ages.

    Curves with fewer than three distinct points, and single curves without a modulus in common with any other, are omitted with a
    warning. Warns of each temperature whose shift the data do not determine, of points far from the master curve, and of
    implausible results. Raises `InputError` for an unknown option, fewer than two temperatures, curves of several kinds, a curve
    that is mostly zero or negative, and groups of curves that do not overlap.
    """
    curves = list(curves)
    reference = float(reference_temperature)
    expansion = float(thermal_expansion)
    stated = Stated(float(temperature_stderr), float(drift))
    if not is_temperature(reference):
        raise InputError(f"{reference:g} degC is not a temperature above absolute zero", argument="reference_temperature")
    if not 0 <= stated.temperature_stderr < np.inf:
        raise InputError(f"{stated.temperature_stderr:g} K: it must be finite and not negative", argument="temperature_stderr")
    if not 0 <= stated.drift < 1:
        raise InputError(f"{stated.drift:g}: a share from 0 to 1 is needed, such as 0.02 for 2 %", argument="drift")
    fitted = [known.name for known in SHIFTS if known.is_fitted]
    choices = {"law": (law, fitted), "vertical": (vertical, get_args(Vertical)), "on": (on, ["auto", *get_args(Basis)])}
    for argument, (choice, allowed) in choices.items():
        if choice not in allowed:
            raise InputError(f"{shown(choice)}: one of {', '.join(allowed)} is needed", argument=argument)
    free = vertical == "free"
    data, binned, imposed = prepare(curves, reference, vertical, expansion)
    temperature, swept = data.temperature, len(data.ordinates) > 1
    if on != "auto" and not swept:
        raise InputError(f'"{on}" is for frequency sweeps; {data.kind.name} curves have one modulus only', argument="on")
    if not temperature[0] <= reference <= temperature[-1]:
        warn(
            f"reference temperature {reference:g} degC is outside the measured {temperature[0]:g} to {temperature[-1]:g} degC: "
            "the master curve is extrapolated by the shift law"
        )
    ramp, doubt = 0.0, None
    if swept:
        anchor = steepest(binned)
        start = starting_shifts(temperature, binned, anchor, data.kind)
        basis_fit = fit_sweeps(binned, start, anchor, free, on, stated.walk(data.order))
    else:
        plain, problem = _fitted(data, binned, free, stated)
        if all(curve.ramp_taken_out is None for curve in curves):
            found = find_ramp(data, binned, plain, free, stated.walk(data.order))
            refit, lost = None, list[float]()
            if found is not None and left_out(found.duration, data):
                with without_warnings():  # as above
                    after = prepare(curves, reference, vertical, expansion, found.duration)
                    refit, _ = _fitted(after[0], after[1], free, stated)
                lost = np.setdiff1d(temperature, after[0].temperature).tolist()
                if refit is not None:
                    ramp, plain = found.duration, refit
                    data, binned, imposed = after
                    temperature, doubt = data.temperature, found.covariance(refit.state)
            if found is None:
                warn_if_modulus_rises(data, binned)
            else:
                warn_of_ramp(found.duration, data, taken_out=refit is not None, lost=lost)
                if refit is None and plain is not None:
                    doubt = found.doubt(plain.anchor, plain.state)
        if plain is not None and np.any(data.ramp > 0):
            binned = after_step(data, binned, plain)
            plain, problem = _fitted(data, binned, free, stated, plain.anchor)  # to which the error of the duration refers
        if plain is None:
            raise problem
        points, anchor = points_of(binned), plain.anchor
        fit = with_errors(points, plain, free, compared=False, doubt=doubt)
        basis_fit = BasisFit(fit, "moduli", points, fit.splines)
    outlying = warn_of_outliers(data, imposed, basis_fit.fit, 1 if basis_fit.on == "storage" else len(data.ordinates))
    warn_if_misfit(temperature, basis_fit.fit.misfit, free, data.kind)
    warn_if_offset(basis_fit.fit.offset_spread)
    here = temperature == reference
    warn_of_others(temperature, basis_fit, np.where(here, 1.0, 0.0) if np.any(here) else np.eye(temperature.size)[anchor])
    instead = "its points are left out" if law == "table" else "its points are placed by the shift law"
    undetermined = find_undetermined(temperature, basis_fit.points, basis_fit.splines, basis_fit.fit, free, swept, instead)
    master = place_at_reference(data, binned, imposed, basis_fit, outlying, undetermined, anchor, law, reference, stated)
    return replace(master, ramp=ramp)


def prepare(
    curves: Sequence[Measurement], reference: float, vertical: Vertical, expansion: float, ramp: float = 0.0
) -> tuple[Gathered, Binned, Floats]:
    """The usable curves without a `ramp` in s that was found, their averages as they are shifted along time, and the log10 b (m,)
    that this includes.
    """
    data, binned = usable_curves(without_ramp(curves, ramp))
    imposed = np.zeros(data.temperature.size)
    if vertical == "density-temperature":
        imposed = _density_temperature(data.temperature, reference, expansion)
    return data, replace(binned, log_modulus=binned.log_modulus + imposed[binned.curve]), imposed


def _fitted(
    data: Gathered, binned: Binned, vertical: bool, stated: Stated, anchor: int | None = None
) -> tuple[Fitted | None, InputError]:
    """The best fit of tests over time, or why there is none: curves that do not overlap.

    The `anchor` is the number of the curve that is not shifted, None for the steepest one.
    """
    anchor = steepest(binned) if anchor is None else anchor
    try:
        start = starting_shifts(data.temperature, binned, anchor, data.kind)
    except InputError as problem:
        return None, problem
    return best_fit(points_of(binned), [start], anchor, vertical, stated.walk(data.order)), InputError()


def _density_temperature(temperature: Floats, reference: float, expansion: float) -> Floats:
    """log10 of b = rho_ref T_ref / (rho T)."""
    expanded = 1 + expansion * (temperature - reference)
    for k in np.flatnonzero(~(expanded > 0))[:1]:
        raise InputError(f"{expansion:g} /K gives no positive density at {temperature[k]:g} degC", argument="thermal_expansion")
    return np.asarray(-np.log10(EntropicModulus(expansion).factor(temperature, reference)))
