"""Shift factors of frequency sweeps: from storage and loss modulus together, from their ratio, or from the storage modulus alone.

The two moduli share the shift factors, and each has a smooth curve. Errors of geometry and force change both moduli alike, and
cancel in their ratio, tan delta. The common scatter is therefore removed before the fit: log G'' is replaced by log G'' - beta log
G', with beta such that the scatter of the two channels is uncorrelated (beta = 0: separate errors, beta = 1: tan delta).

If both moduli belong to one process, they determine the shifts better together than their ratio or one modulus alone. This is
tested: each part of all curves is omitted in turn and predicted from the others. A basis that does not predict the omitted points
is rejected, and among several that do, the one with the most certain shifts is used.
"""

from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np

from dielast.base.errors import warn
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.numerics.robust import robust_deviation
from dielast.relaxation.superposition.binning import Binned
from dielast.relaxation.superposition.checks import have_shape
from dielast.relaxation.superposition.effects import Drift
from dielast.relaxation.superposition.joint_fit import MasterFit, fit_held, fit_master
from dielast.relaxation.superposition.overlap import matching_shifts
from dielast.relaxation.superposition.points import FitPoints, loss_tangent, one_channel, points_of
from dielast.relaxation.superposition.spline import Spline

Array = TypeVar("Array", Floats, Flags)
Basis = Literal["moduli", "tan-delta", "storage"]

UNKNOWN = 0.5  # decades; larger standard errors are equally bad
EXACT = 1e-5  # decades; smaller standard errors are equally good
CORRELATED = 3.0  # standard errors of a significant correlation
OUTLIER = 3.0  # standard deviations at which a residual is clipped
DISAGREE = 3.0  # joint standard errors, and
NOTABLE = 0.02  # decades, above which two bases contradict each other
BASIS_WORDS: dict[Basis, str] = {"moduli": "both moduli", "tan-delta": "tan delta", "storage": "the storage modulus alone"}
MISSED = 1.5  # mean square distance of omitted points, in variances, above which curves do not superpose


@dataclass(frozen=True, slots=True, eq=False)
class OtherShifts:
    """Shifts (m,) from a basis that was not used, their covariance (m, m), and where (m,) both bases determine a shift."""

    on: Basis
    shift: Floats
    covariance: Floats
    comparable: Flags


@dataclass(frozen=True, slots=True, eq=False)
class BasisFit:
    """A fit of all channels (storage before loss modulus), the basis `on` which it was shifted, with its points and curves, and the
    shifts from `others`, for comparison.
    """

    fit: MasterFit
    on: Basis
    points: FitPoints
    splines: tuple[Spline, ...]
    others: tuple[OtherShifts, ...] = ()


def fit_sweeps(
    data: Binned, start: Floats, anchor: int, vertical: bool, on: Basis | Literal["auto"], drift: Drift | None
) -> BasisFit:
    """Fit frequency sweeps on the basis `on`, or with "auto" on the best basis that predicts omitted points.

    Every basis is fitted from several starts, and the best fit is used: the shifts of both moduli, the starting values `start` (m,)
    of the storage moduli, and the best match of both moduli with a neighbour. With "auto" the result includes the shifts from the
    other bases. `drift` is that of `fit_master`.
    """
    m = start.size
    raw, ratio = points_of(data), loss_tangent(data)
    storage, loss = one_channel(raw, 0), one_channel(raw, 1)
    starts = [matching_shifts(data, anchor), start]
    together = fit_master(raw, starts, anchor, vertical, drift)
    alone = fit_master(storage, [together.shift, start], anchor, vertical, drift)
    firm = have_shape(storage, alone.splines, alone.shift, False)
    connected = np.flatnonzero(~_apart(storage, loss, firm, anchor))
    if on != "storage" and 2 <= connected.size < m:
        part = None if drift is None else drift.among(connected)
        place = int(np.searchsorted(connected, anchor))
        joined = fit_sweeps(_only(data, connected), start[connected], place, vertical, on, part)
        points = {"moduli": raw, "tan-delta": ratio, "storage": storage}[joined.on]
        return _of_all_curves(joined, connected, points, start)
    if on == "storage":
        return _on_storage(alone, storage, loss, anchor)
    beta = _common(raw, together)
    points, fit = raw, together
    if beta:
        points = points_of(data, beta)
        fit = fit_master(points, [together.shift], anchor, vertical, drift)
    moduli = _uncombined(fit, beta)
    if on == "moduli":
        return BasisFit(moduli, on, raw, moduli.splines)
    tangent = fit_master(ratio, [fit.shift, starts[0]], anchor, False)
    shaped = have_shape(ratio, tangent.splines, tangent.shift, True)
    fits: dict[Basis, MasterFit] = {"moduli": fit, "tan-delta": tangent, "storage": alone}
    taken = on if on != "auto" else _choose(fits, bool(np.all(shaped)))
    comparable = {"moduli": firm | shaped, "tan-delta": shaped, "storage": firm}
    others = tuple(
        OtherShifts(basis, other.shift, other.covariance[:m, :m], comparable[basis] & comparable[taken])
        for basis, other in fits.items()
        if basis != taken and on == "auto"
    )
    if taken == "storage":
        return replace(_on_storage(alone, storage, loss, anchor), others=others)
    if taken == "moduli":
        return BasisFit(moduli, taken, raw, moduli.splines, others)
    held = _uncombined(fit_held(points, tangent, anchor, vertical), beta)
    return BasisFit(replace(held, offset_spread=fit.offset_spread), taken, ratio, tangent.splines, others)


def _choose(fits: dict[Basis, MasterFit], tangent_tells: bool) -> Basis:
    """Both moduli if they predict omitted points, else the most certain basis among those that do, or among all if none does."""
    if not tangent_tells:
        fits = {basis: fit for basis, fit in fits.items() if basis != "tan-delta"}
    missed = {basis: max(fit.left_out) for basis, fit in fits.items()}
    if missed["moduli"] <= MISSED:
        return "moduli"
    good = [basis for basis in fits if missed[basis] <= MISSED]
    uncertainty = {basis: _uncertainty(fit) + float(np.log(max(missed[basis], 1.0))) for basis, fit in fits.items()}
    taken = min(good or list(fits), key=lambda basis: uncertainty[basis])
    if taken != "moduli":
        warn(
            f"storage and loss modulus do not shift together: points that are left out are missed by {missed['moduli'] ** 0.5:.2g} "
            f"standard deviations, from {BASIS_WORDS[taken]} by {missed[taken] ** 0.5:.2g}; "
            f"the shift factors are those of {BASIS_WORDS[taken]}"
        )
    return taken


def warn_of_others(temperature: Floats, taken: BasisFit, weight: Floats) -> None:
    """Warn of shift factors that differ in another basis, both relative to the temperature selected by `weight` (m,)."""
    m = temperature.size
    relative = np.eye(m) - weight
    shift, stderr = relative @ taken.fit.shift, np.sqrt(np.diag(relative @ taken.fit.covariance[:m, :m] @ relative.T))
    for other in taken.others:
        other_shift, error = relative @ other.shift, np.sqrt(np.diag(relative @ other.covariance @ relative.T))
        comparable = other.comparable & np.all(other.comparable[weight > 0]) & np.isfinite(stderr + error)
        difference = np.where(comparable, np.abs(shift - other_shift), 0.0)
        score = difference / np.maximum(np.hypot(stderr, error), EXACT)
        far = np.flatnonzero((score > DISAGREE) & (difference > NOTABLE))
        if not far.size:
            continue
        k = far[np.argmax(score[far])]
        more = f" (and so at {far.size - 1} more temperature{'s' if far.size > 2 else ''})" if far.size > 1 else ""
        warn(
            f"at {temperature[k]:g} degC {BASIS_WORDS[other.on]} gives another shift factor: "
            f"log10 a = {other_shift[k]:.3g} +- {error[k]:.2g}, "
            f"but {shift[k]:.3g} +- {stderr[k]:.2g} from {BASIS_WORDS[taken.on]}, which is taken, both relative to "
            f"{temperature[np.argmax(weight)]:g} degC{more}"
        )


def _apart(storage: FitPoints, loss: FitPoints, shaped: Flags, anchor: int) -> Flags:
    """Mask (m,) of curves without a connection to the others, which at any shift contradict one of the moduli: the storage modulus
    is level, not `shaped`, and the loss modulus has no value in common with that of the next curve towards the anchor.
    """
    apart = np.zeros(storage.curves, dtype=bool)
    low, high = (np.array([edge(loss.log_modulus[loss.curve == k]) for k in range(loss.curves)]) for edge in (np.min, np.max))
    for outwards in (range(anchor - 1, -1, -1), range(anchor + 1, storage.curves)):
        last = anchor
        for k in outwards:
            apart[k] = not shaped[k] and (apart[last] or min(high[k], high[last]) < max(low[k], low[last]))
            last = k
    return apart


def _only(data: Binned, curves: Index) -> Binned:
    """The points of the numbered `curves`, numbered from 0."""
    selected = np.isin(data.curve, curves)
    new, rows = np.searchsorted(curves, data.curve[selected]), (data.log_modulus[:, selected], data.variance[:, selected])
    return Binned(new, data.log_time[selected], *rows, data.bin_of_point)


def _of_all_curves(joined: BasisFit, curves: Index, points: FitPoints, elsewhere: Floats) -> BasisFit:
    """The fit of the numbered `curves` as a fit of all m curves with all `points`: the others stay at `elsewhere` (m,), with errors
    that are infinite.
    """
    fit, m = joined.fit, elsewhere.size

    def among(values: Array, others: float | Floats, numbers: Index = curves, size: int = m) -> Array:
        """Values (k,) or (k, k) of the fitted curves beside those of `others`."""
        result = np.full((size,) * values.ndim, others, dtype=values.dtype)
        result[np.ix_(*[numbers] * values.ndim)] = values
        return result

    whole = replace(
        fit,
        shift=among(fit.shift, elsewhere),
        vertical=among(fit.vertical, 0.0),
        covariance=among(fit.covariance, 0.0, np.concatenate((curves, m + curves)), 2 * m),
        noise_stderr=among(fit.noise_stderr, np.inf),
        misfit=replace(fit.misfit, by_curve=among(fit.misfit.by_curve, 0.0)),
    )
    others = [
        replace(o, shift=among(o.shift, 0.0), covariance=among(o.covariance, 0.0), comparable=among(o.comparable, False))
        for o in joined.others
    ]
    return BasisFit(whole, joined.on, points, joined.splines, tuple(others))


def _on_storage(alone: MasterFit, storage: FitPoints, loss: FitPoints, anchor: int) -> BasisFit:
    other = fit_held(loss, alone, anchor, False)
    fits = replace(alone, splines=alone.splines + other.splines, placed=alone.placed + other.splines)
    return BasisFit(fits, "storage", storage, alone.splines)


def _common(points: FitPoints, fit: MasterFit) -> float:
    """The fraction of the first channel's scatter that the second shares: the slope of a line through their residuals, or 0."""
    series, channel, position = points.series, points.channel, points.log_time - fit.shift[points.curve]
    residual = points.log_modulus - np.choose(channel, [spline(position) for spline in fit.splines])
    middle = np.array([np.median(residual[series == k]) for k in range(series[-1] + 1)])
    one, other = (_clipped(part) for part in (residual - middle[series]).reshape(2, -1))
    square, product = float(one @ one), float(one @ other)
    if product**2 <= CORRELATED**2 / one.size * square * float(other @ other):
        return 0.0
    return product / square


def _clipped(residual: Floats) -> Floats:
    bound = OUTLIER * robust_deviation(residual)
    return np.clip(residual, -bound, bound)


def _uncombined(fit: MasterFit, beta: float) -> MasterFit:
    """The fit of log G' and log G'' - beta log G', converted to a fit of log G' and log G''."""
    if not beta:
        return fit
    splines, placed = (
        (first, replace(second, coefficient=second.coefficient + beta * first.coefficient))
        for first, second in (fit.splines, fit.placed)
    )
    return replace(fit, splines=splines, placed=placed)


def _uncertainty(fit: MasterFit) -> float:
    """Mean logarithm of the variances of the shifts from one temperature to the next, which do not depend on the anchor."""
    m = fit.shift.size
    step = np.diff(np.eye(m), axis=0)
    variance = np.einsum("ij,jk,ik->i", step, fit.covariance[:m, :m], step)
    return float(np.mean(np.log(np.clip(variance, EXACT**2, UNKNOWN**2))))
