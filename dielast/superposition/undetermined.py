"""Shift factors that the data do not determine, and implausible results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dielast.errors import warn
from dielast.material.measurement_kind import MeasurementKind
from dielast.numerics.arrays import Flags, Floats
from dielast.superposition.joint_fit import MasterFit
from dielast.superposition.points import FitPoints
from dielast.superposition.spline import Spline

UNDETERMINED = 0.5  # decades of standard error above which a shift factor is not a measurement
DOUBTFUL = 0.05  # decades of standard error above which, with free vertical shifts, a curve must show a curvature
SIGNIFICANT = 4.0  # standard errors of a significant slope or curvature
PLATEAU_RISE = 0.005  # decades of modulus over a whole curve
PLATEAU_SLOPE = 0.05  # decades of modulus per decade of time,
LAST_STRETCH = 0.5  # over this interval of log time at the long end
OFFSET = 0.01  # decades
LAW_MISFIT = 4.0  # reduced chi-square,
LAW_MISFIT_SIGMA = 5.0  # its excess over 1 in standard deviations,
LAW_MISS = 0.03  # and decades, above which a law does not fit
ROBUST_ROUNDS = 9
TRUSTED = 2.5  # standard deviations above which the weight of a point is reduced


@dataclass(frozen=True, slots=True)
class Undetermined:
    """A temperature (degC) whose shift factor the data do not determine, and the reason."""

    temperature: float
    reason: str


def find_undetermined(
    temperature: Floats, points: FitPoints, splines: Sequence[Spline], fit: MasterFit, vertical: bool, peaks: bool, filled: str
) -> tuple[Undetermined, ...]:
    """The temperatures whose shift is undetermined: its error is too large, or the curve has no shape beyond noise. Warns of each.

    `splines` are the smooth curves of the channels of `points`, and `filled` says what happens to a temperature without a shift. A
    straight line can be shifted along itself, and noise makes every line appear slightly curved, so that the standard error of the
    fit alone is too small. One channel must therefore show a significant slope or, with free `vertical` shifts of notable error, a
    significant curvature. With `peaks`, as in loss moduli and tan delta, a curvature is as good as a slope.
    """
    stderr = fit.noise_stderr
    undetermined = []
    shaped = have_shape(points, splines, fit.shift, peaks)
    for k in np.flatnonzero(stderr > 0):
        if not shaped[k]:
            reason = "the curve is a plateau" if np.any(points.lift) else "tan delta is level"
        elif vertical and stderr[k] > DOUBTFUL and np.any(points.lift) and not _is_bent(_channels(points, int(k))):
            reason = "the curve is a straight line in log-log, whose horizontal and vertical shift cannot be told apart"
        elif stderr[k] > UNDETERMINED:
            reason = "the curve overlaps the others too little"
        else:
            continue
        undetermined.append(Undetermined(float(temperature[k]), reason))
        warn(f"{temperature[k]:g} degC: the shift factor is not determined: {reason}; {filled}")
    return tuple(undetermined)


def have_shape(points: FitPoints, splines: Sequence[Spline], shift: Floats, peaks: bool) -> Flags:
    """Whether (m,) a channel of each curve has a slope, or with `peaks` a curvature, beyond noise."""
    return np.array(
        [
            any(_is_shaped(x, y, spline(x - shift[k]), peaks) for (x, y), spline in zip(_channels(points, k), splines, strict=True))
            for k in range(points.curves)
        ]
    )


def _channels(points: FitPoints, curve: int) -> list[tuple[Floats, Floats]]:
    """Log time and log modulus of one curve in every channel."""
    series = curve + points.curves * np.arange(points.channels)
    first, last = (np.searchsorted(points.series, series, side=side).tolist() for side in ("left", "right"))
    return [(points.log_time[a:b], points.log_modulus[a:b]) for a, b in zip(first, last, strict=True)]


def _is_shaped(x: Floats, y: Floats, smooth: Floats, peaks: bool) -> bool:
    sloping = _significance(x, y, 1) >= SIGNIFICANT or (peaks and _significance(x, y, 2) >= SIGNIFICANT)
    return sloping and float(np.ptp(smooth)) >= PLATEAU_RISE


def _is_bent(curves: Sequence[tuple[Floats, Floats]]) -> bool:
    """Whether a channel is curved, or the difference of two channels, which no vertical shift changes, has a slope."""
    if any(_significance(x, y, 2) >= SIGNIFICANT for x, y in curves):
        return True
    return len(curves) == 2 and _significance(curves[0][0], curves[1][1] - curves[0][1], 1) >= SIGNIFICANT


def _significance(x: Floats, y: Floats, degree: int) -> float:
    """The highest coefficient of a polynomial through the points in standard errors, robust against outliers."""
    if x.size < degree + 2:
        return 0.0
    z = (x - np.mean(x)) / max(float(np.ptp(x)), 1e-300)
    vander = np.vander(z, degree + 1, increasing=True)
    weight = np.ones(x.size)
    for _ in range(ROBUST_ROUNDS):
        root = np.sqrt(weight)
        basis, triangle = np.linalg.qr(vander * root[:, None])
        part = basis.T @ (y * root)
        residual = y - vander @ np.linalg.solve(triangle, part)
        variance = float(weight @ residual**2) / max(float(np.sum(weight)) - degree - 1, 1.0)
        significance = float(abs(part[-1]) / np.sqrt(max(variance, 1e-28)))
        if significance >= SIGNIFICANT:
            break
        typical = max(float(np.median(np.abs(residual))) / 0.6745, 1e-14)
        weight = np.minimum(1.0, (TRUSTED * typical / np.maximum(np.abs(residual), 1e-100)) ** 2)
    return significance


def warn_if_rising(temperature: Floats, shift: Floats, stderr: Floats) -> None:
    """Warn of the first pair of neighbouring temperatures with slower relaxation at the higher one, beyond the errors."""
    rise = np.diff(shift) - 3 * np.hypot(stderr[1:], stderr[:-1])
    for k in np.flatnonzero(rise > 1e-6)[:1]:
        warn(
            f"relaxation is slower at {temperature[k + 1]:g} than at {temperature[k]:g} degC "
            f"(log10 shift factor {shift[k + 1]:.3g} after {shift[k]:.3g}): are temperatures mixed up?"
        )


def warn_if_law_misses(temperature: Floats, shift: Floats, stderr: Floats, by_law: Floats, misfit: float, parameters: int) -> None:
    """Warn of a law that misses the shift factors by more than their errors, at the worst one; `misfit` is that of `ShiftFit`."""
    freedom = max(temperature.size - 1 - parameters, 1)
    miss = np.abs(by_law - shift)
    if misfit > max(LAW_MISFIT, 1 + LAW_MISFIT_SIGMA * np.sqrt(2 / freedom)) and np.nanmax(miss) > LAW_MISS:
        k = int(np.nanargmax(miss))
        warn(
            f"the law does not fit the shift factors: at {temperature[k]:g} degC it gives log10 a = {by_law[k]:.2f}, measured is "
            f"{shift[k]:.2f} +- {stderr[k]:.2g} (reduced chi-square {misfit:.3g}, should be about 1): take another law, or a table"
        )


def warn_if_no_plateau(curve: Spline, kind: MeasurementKind) -> None:
    """Warn if the long end, at which the equilibrium modulus is read, is not level; `curve` is a storage modulus for a sweep."""
    stretch = curve(np.array([curve.end - LAST_STRETCH, curve.end]))
    slope = float(stretch[1] - stretch[0]) / LAST_STRETCH
    if abs(slope) > PLATEAU_SLOPE:
        meaning = "the modulus may still fall, and the equilibrium modulus, its last value, is an upper bound"
        if slope > 0:
            meaning = "no modulus rises in the course of time, and the equilibrium modulus, its last value, is not to be trusted"
        warn(
            f"the master curve has no plateau at its {kind.ends[1]} end, where it changes by {slope:.2g} decades of modulus per "
            f"decade of time: {meaning}"
        )


def warn_if_offset(spread: float) -> None:
    """Warn of vertical offsets that horizontal shifts do not explain; `spread` in decades."""
    if spread > OFFSET:
        warn(
            f"the curves differ vertically by about {100 * (10**spread - 1):.0f} % beyond their noise: the shift factors allow for "
            'it, and vertical = "free" would measure it'
        )
