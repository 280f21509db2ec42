"""Checks of a joint fit: shift factors that the data do not determine, points far from their curve, and implausible results."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dielast.base.errors import warn
from dielast.material.measurement_kind import MeasurementKind
from dielast.material.ramp import time_of_age
from dielast.material.shift import WLF, Arrhenius, VogelFulcherTammann
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.gather import Gathered
from dielast.relaxation.superposition.joint_errors import Misfit
from dielast.relaxation.superposition.joint_fit import MasterFit
from dielast.relaxation.superposition.points import FitPoints
from dielast.relaxation.superposition.spline import Spline

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

FAR = 8.0  # robust standard deviations, and
FACTOR = 0.05  # relative difference from its curve, above which a point is reported
# Share of the distance of a point from its curve, a choice: where points of other curves at its time are as far away, the point is
# not far, and the smooth curve is off.
SHARED = 0.5
NEIGHBOURS = 10  # points on either side whose scatter is compared, in addition to that of the whole curve
NAMED = 5  # number of points in a message
WORST = 3  # number of temperatures in the message about curves that do not superpose
STANDS_OUT = 1.4  # ratio to the misfit of all parts, above which a part of the curves is mentioned


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
    stderr, shaped, undetermined = fit.noise_stderr, have_shape(points, splines, fit.shift, peaks), []
    for k in np.flatnonzero(stderr > 0):
        if not shaped[k]:
            reason = "the curve is a plateau" if np.any(points.lift) else "tan delta is level"
        elif vertical and stderr[k] > DOUBTFUL and np.any(points.lift) and not _is_bent(_channels(points, int(k))):
            reason = "the curve is a straight line in log-log, which does not separate horizontal from vertical shifts"
        elif not np.isfinite(stderr[k]):
            reason = "the curve overlaps the others too little"
        elif stderr[k] > UNDETERMINED:
            reason = f"it is known to +- {stderr[k]:.2g} decades only{_for_offsets(_channels(points, int(k)), fit.offset_spread)}"
        else:
            continue
        undetermined.append(Undetermined(float(temperature[k]), reason))
    # with fewer than two others there is no law, and an error follows
    instead = f"; {filled}" if temperature.size - len(undetermined) >= 2 else ""
    for entry in undetermined:
        warn(f"{entry.temperature:g} degC: the shift factor is not determined: {entry.reason}{instead}")
    return tuple(undetermined)


def _for_offsets(curves: Sequence[tuple[Floats, Floats]], spread: float) -> str:
    """How far an offset of a whole curve by the `spread`, in decades of modulus, looks like a shift, if that is far."""
    slope = max(abs(float(np.polyfit(x, y, 1)[0])) for x, y in curves)
    if spread < DOUBTFUL * slope:
        return ""
    shift = f"looks like a shift by {spread / slope:.2g} decades"
    return f": the curve changes by {_percent(slope)} a decade, and an offset of {_percent(spread)}, as the curves have, {shift}"


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
        typical = max(robust_deviation(residual), 1e-14)
        weight = np.minimum(1.0, (TRUSTED * typical / np.maximum(np.abs(residual), 1e-100)) ** 2)
    return significance


def warn_if_rising(temperature: Floats, shift: Floats, stderr: Floats, law: str) -> None:
    """Warn of slower relaxation at a higher temperature, beyond the errors: of the first such pair of neighbours, or, if a law is
    asked for that allows it, of nothing if relaxation gets slower from each temperature to the next.
    """
    rise = np.diff(shift)
    sure = rise > 3 * np.hypot(stderr[1:], stderr[:-1]) + 1e-6
    throughout = rise.size > 1 and bool(np.all(rise > 0) and np.any(sure))
    if throughout and law not in (WLF.name, VogelFulcherTammann.name):
        return
    for k in np.flatnonzero(sure)[:1]:
        instead = f', or, if the material is so, such as a gel that dries, take law = "{Arrhenius.name}"' if throughout else ""
        warn(
            f"relaxation is slower at {temperature[k + 1]:g} than at {temperature[k]:g} degC "
            f"(log10 shift factor {shift[k + 1]:.3g} after {shift[k]:.3g}): are temperatures mixed up?{instead}"
        )


def warn_if_law_misses(
    temperature: Floats,
    shift: Floats,
    stderr: Floats,
    by_law: Floats,
    misfit: float,
    parameters: int,
    misfit_without: Callable[[], Floats],
) -> None:
    """Warn of a law that misses the shift factors by more than their errors, at the worst one; `misfit` is that of `ShiftFit`.

    `misfit_without` computes the misfits (m,) without one temperature each: if the law fits without one of them, that is named.
    """
    freedom = temperature.size - 1 - parameters
    miss = np.abs(by_law - shift)
    if _law_fits(misfit, max(freedom, 1)) or np.nanmax(miss) <= LAW_MISS:
        return
    k = int(np.nanargmax(miss))
    suspect = ""
    if freedom > 1:
        others = misfit_without()
        best = int(np.argmin(others))
        if _law_fits(others[best], freedom - 1):
            suspect = f"without {temperature[best]:g} degC it fits ({others[best]:.2g}): check the temperature of that test, or "
    warn(
        f"the law does not fit the shift factors: at {temperature[k]:g} degC it gives log10 a = {by_law[k]:.2f}, measured is "
        f"{shift[k]:.2f} +- {stderr[k]:.2g} (reduced chi-square {misfit:.3g}, should be about 1): {suspect}take another law, or a "
        "table"
    )


def _law_fits(misfit: float, freedom: int) -> bool:
    return bool(misfit <= max(LAW_MISFIT, 1 + LAW_MISFIT_SIGMA * np.sqrt(2 / freedom)))


def warn_if_no_plateau(curve: Spline, kind: MeasurementKind, x: Floats, stiffness: Floats) -> None:
    """Warn if the long end, at which the equilibrium modulus is read, is not level; `curve` is a storage modulus for a sweep.

    As no modulus rises, a rise is warned of only if the points at log10 times `x` (n,) with decimal logarithms `stiffness` (n,)
    rise by more than their scatter.
    """
    stretch = curve(np.array([curve.end - LAST_STRETCH, curve.end]))
    slope = float(stretch[1] - stretch[0]) / LAST_STRETCH
    last = x >= np.max(x) - LAST_STRETCH
    if -slope > PLATEAU_SLOPE or (slope > PLATEAU_SLOPE and _rise(x[last], stiffness[last])):
        meaning = "the modulus may still fall, and the equilibrium modulus, its last value, is an upper bound"
        if slope > 0:
            meaning = "no modulus rises in the course of time, and the equilibrium modulus, its last value, is not to be trusted"
        warn(
            f"the master curve has no plateau at its {kind.ends[1]} end, where it changes by {slope:.2g} decades of modulus per "
            f"decade of time: {meaning}"
        )


def _rise(x: Floats, y: Floats) -> bool:
    """Whether the straight line through points (n,) rises by more than its error, one-sided at 5 %."""
    from scipy.special import stdtrit

    spare = x.size - 2
    if spare < 1 or np.ptp(x) == 0:
        return True
    along, up = x - np.mean(x), y - np.mean(y)
    slope = float(along @ up / (along @ along))
    error = float(np.linalg.norm(up - slope * along) / np.sqrt(spare * (along @ along)))
    return slope > error * float(stdtrit(spare, 0.95))


def warn_if_offset(spread: float) -> None:
    """Warn of vertical offsets that horizontal shifts do not explain; `spread` in decades."""
    if spread > OFFSET:
        warn(
            f"the curves differ vertically by about {100 * (10**spread - 1):.0f} % beyond their noise: the shift factors allow for "
            'it, and vertical = "free" would measure it'
        )


def warn_if_misfit(temperature: Floats, misfit: Misfit, vertical: bool, kind: MeasurementKind) -> None:
    """Warn of curves that do not superpose, with the distance, the worst temperatures, and possible remedies."""
    if not misfit.matters:
        return
    worst = sorted(k for k in np.argsort(-misfit.by_curve, kind="stable")[:WORST] if misfit.by_curve[k] > misfit.rms)
    where = "most at " + ", ".join(f"{temperature[k]:g}" for k in worst) + " degC" if worst else "at all temperatures alike"
    early, late = misfit.by_part[0] > STANDS_OUT * misfit.rms, misfit.by_part[-1] > STANDS_OUT * misfit.rms
    where += f" and at {kind.regions[0]}" if early else f" and at {kind.regions[1]}" if late else ""
    remedies = [
        kind.remedy,
        "" if vertical else 'try vertical = "free"',
        "one shift factor for a temperature may be too little for this material",
    ]
    warn(
        f"the curves do not superpose: they miss the master curve by {_percent(misfit.rms)} rms over and above their "
        f"noise of {_percent(misfit.noise)}, {where} (the standard errors allow for it): "
        f"{'; or '.join(filter(None, remedies))}"
    )


def _percent(decades: float) -> str:
    return f"{100 * (10**decades - 1):.2g} %"


def warn_of_outliers(data: Gathered, imposed: Floats, fit: MasterFit, channels: int) -> Flags:
    """Warn of points whose distance from the smooth curves is far larger than that of others of their curve; returns their mask (c,
    n).

    `imposed` (m,) is log10 b where it was prescribed; the first `channels` ordinates were fitted. The distance is relative, not
    logarithmic, so that readings at a noise floor, which may be zero, are not outliers.
    """
    size = np.full(data.ordinates.shape, np.nan)
    log_time = data.log_time - fit.shift[data.curve]
    lift = (imposed + fit.vertical)[data.curve]
    for channel, spline in enumerate(fit.splines[:channels]):
        log_modulus = spline(np.clip(log_time, spline.origin, spline.end)) - lift
        ratio = data.ordinates[channel] / 10 ** (data.kind.stiffness_power * log_modulus)
        size[channel] = _alone(data.curve, log_time, ratio, _far(data.curve, ratio))
    far = np.isfinite(size) & data.good
    if np.any(far):
        _warn_of_points(data, size, np.argwhere(far))
    return np.asarray(far)


def _warn_of_points(data: Gathered, size: Floats, far: Index) -> None:
    """Warn of the worst of the points `far` (k, 2), given as channel and point, in their order."""
    unit, named = data.kind.abscissa[1], []
    worst = np.sort(np.argsort(-np.abs(np.log(size[tuple(far.T)])), kind="stable")[:NAMED])
    for channel, point in far[worst].tolist():
        name = f" ({data.kind.ordinates[channel][0].removesuffix('_modulus')})" if len(data.ordinates) > 1 else ""
        (measured,) = time_of_age(data.abscissa[[point]], float(data.ramp[point]))
        place = f"{data.temperature[data.curve[point]]:g} degC at {measured:.4g} {unit}{name}"
        named.append(f"{place}, {size[channel, point]:.3g} times what its curve leads to")
    more = f"; and {len(far) - NAMED} more" if len(far) > NAMED else ""
    one = len(far) == 1
    warn(
        f"{'a point lies' if one else f'{len(far)} points lie'} far off the master curve: {'; '.join(named)}{more}: "
        f"{'it has' if one else 'they have'} next to no weight in the shift factors, but {'is' if one else 'are'} still in the "
        f"master curve: check {'it' if one else 'them'}, or leave {'it' if one else 'them'} out"
    )


def _far(curve: Index, ratio: Floats) -> Floats:
    """The ratio (n,) of each point to the median of its curve if it is far from it, by the scatter of the curve and by that of its
    neighbours; NaN for all other points.
    """
    far = np.full(ratio.size, np.nan)
    for first, last in pairwise(np.searchsorted(curve, np.arange(int(curve[-1]) + 2)).tolist()):
        relative = ratio[first:last] / float(np.median(ratio[first:last]))
        distance = np.abs(relative - 1)
        for k in np.flatnonzero(distance > max(FAR * robust_deviation(distance), FACTOR)):
            near = distance[max(k - NEIGHBOURS, 0) : k + NEIGHBOURS + 1]
            if distance[k] > FAR * robust_deviation(near):
                far[first + k] = relative[k]
    return far


def _alone(curve: Index, log_time: Floats, ratio: Floats, far: Floats) -> Floats:
    """The ratios `far` (n,) of points whose distance those of other curves do not share at the same `log_time` (n,), else NaN.

    If they do, the smooth curve is off: few points do not determine how it bends within the distance of two of them. The same time
    is one within half the distance to the nearest point of the same curve.
    """
    far = far.copy()
    for k in np.flatnonzero(np.isfinite(far)):
        own = np.abs(np.delete(log_time, k)[np.delete(curve, k) == curve[k]] - log_time[k])
        others = (curve != curve[k]) & (np.abs(log_time - log_time[k]) <= np.min(own) / 2)
        if np.any(others) and np.median((ratio[others] - 1) / (ratio[k] - 1)) >= SHARED:
            far[k] = np.nan
    return far
