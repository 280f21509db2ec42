"""Shift factors of frequency sweeps: from storage and loss modulus together, from their ratio, or from the storage modulus alone.

The two moduli share the shift factors, and each has a smooth curve. Errors of geometry and force change both moduli alike, and
cancel in their ratio, tan delta. The common scatter is therefore removed before the fit: log G'' is replaced by log G'' - beta log
G', with beta such that the scatter of the two channels is uncorrelated (beta = 0: separate errors, beta = 1: tan delta).

If both moduli belong to one process, they determine the shifts better together than their ratio or one modulus alone. This is
tested: each part of all curves is omitted in turn and predicted from the others. A basis that does not predict the omitted points
is rejected, and among several that do, the one with the most certain shifts is used.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dielast.errors import warn
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.superposition.binning import Binned
from dielast.superposition.checks import have_shape
from dielast.superposition.joint_fit import MasterFit, fit_held, fit_master
from dielast.superposition.overlap import matching_shifts
from dielast.superposition.points import FitPoints, loss_tangent, one_channel, points_of
from dielast.superposition.spline import Spline

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
class BasisFit:
    """A fit of all channels (storage before loss modulus), the basis `on` which it was shifted, and the points and curves of the
    basis.

    `others` are the shifts from other bases, for comparison.
    """

    fit: MasterFit
    on: Basis
    points: FitPoints
    splines: tuple[Spline, ...]
    others: tuple[OtherShifts, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class OtherShifts:
    """Shifts (m,) from a basis that was not used, their covariance (m, m), and where (m,) both bases determine a shift."""

    on: Basis
    shift: Floats
    covariance: Floats
    comparable: Flags


def fit_sweeps(
    temperature: Floats,
    data: Binned,
    start: Floats,
    anchor: int,
    vertical: bool,
    on: Basis | Literal["auto"],
    drift: Floats | None,
) -> BasisFit:
    """Fit frequency sweeps on the basis `on`, or with "auto" on the best basis that predicts omitted points.

    Every basis is fitted from several starts, and the best fit is used: the shifts of both moduli, the starting values `start` (m,)
    of the storage moduli, and the best match of both moduli with a neighbour. With "auto" the result includes the shifts from the
    other bases. `drift` is that of `fit_master`.
    """
    m = temperature.size
    raw, ratio = points_of(data, m), loss_tangent(data, m)
    storage, loss = one_channel(raw, 0), one_channel(raw, 1)
    starts = [matching_shifts(m, data.curve, data.log_time, data.log_modulus, anchor), start]
    together = fit_master(raw, starts, anchor, vertical, drift)
    alone = fit_master(storage, [together.shift, start], anchor, vertical, drift)
    firm = have_shape(storage, alone.splines, alone.shift, False)
    if on != "storage":
        connected = np.flatnonzero(~_apart(storage, loss, firm, anchor))
        if 2 <= connected.size < m:
            part = None if drift is None else drift[np.ix_(connected, connected)]
            place = int(np.searchsorted(connected, anchor))
            joined = fit_sweeps(temperature[connected], _only(data, connected), start[connected], place, vertical, on, part)
            basis_points = {"moduli": raw, "tan-delta": ratio, "storage": storage}[joined.on]
            others = tuple(_other_of_all(other, connected, m) for other in joined.others)
            inside = np.tile(np.isin(data.curve, connected), len(data.log_modulus))
            return replace(joined, fit=_spread(joined.fit, connected, inside, start), points=basis_points, others=others)
    if on == "storage":
        return _on_storage(alone, storage, loss, anchor)
    beta = _common(raw, together.residual)
    points, fit = raw, together
    if beta:
        points = points_of(data, m, beta)
        fit = fit_master(points, [together.shift], anchor, vertical, drift)
    if on == "moduli":
        moduli = _uncombined(fit, beta)
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
        moduli = _uncombined(fit, beta)
        return BasisFit(moduli, "moduli", raw, moduli.splines, others)
    held = _uncombined(fit_held(points, tangent, anchor, vertical), beta)
    return BasisFit(replace(held, offset_spread=fit.offset_spread), "tan-delta", ratio, tangent.splines, others)


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
        beside, error = relative @ other.shift, np.sqrt(np.diag(relative @ other.covariance @ relative.T))
        comparable = other.comparable & np.all(other.comparable[weight > 0]) & np.isfinite(stderr + error)
        difference = np.where(comparable, np.abs(shift - beside), 0.0)
        score = difference / np.maximum(np.hypot(stderr, error), EXACT)
        far = np.flatnonzero((score > DISAGREE) & (difference > NOTABLE))
        if not far.size:
            continue
        k = far[np.argmax(score[far])]
        more = f" (and so at {far.size - 1} more temperature{'s' if far.size > 2 else ''})" if far.size > 1 else ""
        warn(
            f"at {temperature[k]:g} degC {BASIS_WORDS[other.on]} gives another shift factor: "
            f"log10 a = {beside[k]:.3g} +- {error[k]:.2g}, "
            f"but {shift[k]:.3g} +- {stderr[k]:.2g} from {BASIS_WORDS[taken.on]}, which is taken, both relative to "
            f"{temperature[np.argmax(weight)]:g} degC{more}"
        )


def _other_of_all(other: OtherShifts, curves: Index, m: int) -> OtherShifts:
    """The shifts of the numbered `curves` as shifts of all m curves, of which the others are not comparable."""
    shift, comparable = np.zeros(m), np.zeros(m, dtype=bool)
    covariance = np.zeros((m, m))
    shift[curves], comparable[curves], covariance[np.ix_(curves, curves)] = other.shift, other.comparable, other.covariance
    return OtherShifts(other.on, shift, covariance, comparable)


def _apart(storage: FitPoints, loss: FitPoints, shaped: Flags, anchor: int) -> Flags:
    """Mask (m,) of curves without a connection to the others: the storage modulus is level, not `shaped`, and the loss modulus has
    no
    value in common with that of the next curve towards the anchor. At any shift, such a curve contradicts one of the moduli.
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
    new = np.searchsorted(curves, data.curve[selected])
    return replace(
        data,
        curve=new,
        log_time=data.log_time[selected],
        log_modulus=data.log_modulus[:, selected],
        variance=data.variance[:, selected],
    )


def _spread(fit: MasterFit, curves: Index, inside: Flags, elsewhere: Floats) -> MasterFit:
    """The fit of the numbered `curves` as a fit of all m curves: the others stay at `elsewhere` (m,), with infinite errors.

    `inside` (n,) marks the points of the fitted curves; the residuals of other points are NaN.
    """
    m = elsewhere.size
    basis_points = (elsewhere.copy(), np.zeros(m), np.full(m, np.inf), np.zeros(m))
    for values, part in zip(basis_points, (fit.shift, fit.vertical, fit.noise_stderr, fit.misfit.by_curve), strict=True):
        values[curves] = part
    shift, vertical, stderr, by_curve = basis_points
    residual = np.full(inside.size, np.nan)
    residual[inside] = fit.residual
    covariance = np.zeros((2 * m, 2 * m))
    covariance[np.ix_(*2 * (np.concatenate((curves, m + curves)),))] = fit.covariance
    misfit = replace(fit.misfit, by_curve=by_curve)
    return replace(
        fit, shift=shift, vertical=vertical, covariance=covariance, noise_stderr=stderr, residual=residual, misfit=misfit
    )


def _on_storage(alone: MasterFit, storage: FitPoints, loss: FitPoints, anchor: int) -> BasisFit:
    other = fit_held(loss, alone, anchor, False)
    fits = replace(
        alone,
        splines=alone.splines + other.splines,
        placed=alone.placed + other.splines,
        residual=np.concatenate((alone.residual, other.residual)),
    )
    return BasisFit(fits, "storage", storage, alone.splines)


def _common(points: FitPoints, residual: Floats) -> float:
    """The fraction of the first channel's scatter that the second shares: the slope of a line through their residuals, or 0."""
    series = points.series
    middle = np.array([np.median(residual[series == k]) for k in range(series[-1] + 1)])
    one, other = (_cut(part) for part in (residual - middle[series]).reshape(2, -1))
    square, product = float(one @ one), float(one @ other)
    if product**2 <= CORRELATED**2 / one.size * square * float(other @ other):
        return 0.0
    return product / square


def _cut(residual: Floats) -> Floats:
    bound = OUTLIER * float(np.median(np.abs(residual))) / 0.6745
    return np.clip(residual, -bound, bound)


def _uncombined(fit: MasterFit, beta: float) -> MasterFit:
    """The fit of log G' and log G'' - beta log G', converted to a fit of log G' and log G''."""
    if not beta:
        return fit
    storage, rest = fit.residual.reshape(2, -1)

    def both(splines: tuple[Spline, ...]) -> tuple[Spline, ...]:
        one, other = splines
        return one, replace(other, coefficient=other.coefficient + beta * one.coefficient)

    residual = np.concatenate((storage, rest + beta * storage))
    return replace(fit, splines=both(fit.splines), placed=both(fit.placed), residual=residual)


def _uncertainty(fit: MasterFit) -> float:
    """Mean logarithm of the variances of the shifts from one temperature to the next, which do not depend on the anchor."""
    m = fit.shift.size
    step = np.diff(np.eye(m), axis=0)
    variance = np.einsum("ij,jk,ik->i", step, fit.covariance[:m, :m], step)
    return float(np.mean(np.log(np.clip(variance, EXACT**2, UNKNOWN**2))))
