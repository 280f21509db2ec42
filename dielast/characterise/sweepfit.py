"""Shift factors of frequency sweeps: from storage and loss modulus together, from their ratio, or from the storage modulus alone.

The two moduli share the shift factors, a smooth curve each. Errors of geometry and force move both alike and cancel in their ratio,
tan delta. The scatter that they share is therefore taken out before the fit: log G'' - beta log G' stands for log G'', with beta
such that the scatter of the two channels is uncorrelated (beta = 0: separate errors, beta = 1: tan delta). What no scatter tells,
curves that do not superpose and vertical offsets of whole curves, is in the covariances of the fits, and the better one is taken.

Moduli with a common shift are one process. Where the storage modulus and tan delta contradict each other, as in a glass with a
secondary process, or with an instrument's own losses at high frequency, the storage modulus counts: it is the larger by far.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dielast.characterise.condense import Condensed
from dielast.characterise.doubt import have_shape
from dielast.characterise.masterfit import MasterFit, Points, fit_held, fit_master
from dielast.characterise.spline import Spline
from dielast.errors import warn

Array = NDArray[np.float64]
Basis = Literal["moduli", "tan-delta", "storage"]

UNKNOWN = 0.5  # decades of standard error beyond which one shift is as bad as another
EXACT = 1e-5  # decades below which it does not matter
CORRELATED = 3.0  # standard errors of a correlation that is believed
OUTLIER = 3.0  # standard deviations at which a residual is cut off
CONTRADICTION = 5.0  # standard deviations of a chi-square,
VISIBLE = 0.1  # and decades of shift by which storage modulus and tan delta contradict each other
ALONE = 0.3  # of the misfit of both moduli, below which the storage modulus superposes by itself


@dataclass(frozen=True, slots=True, eq=False)
class Superposition:
    """A fit of all channels, storage before loss modulus, and what its shifts were taken from: `on`, points and smooth curves."""

    fit: MasterFit
    on: Basis
    points: Points
    splines: tuple[Spline, ...]


def points_of(data: Condensed, curves: int, beta: float = 0.0) -> Points:
    """The channels of `data` one after the other, the second less `beta` times the first."""
    value, variance, lift = data.log_modulus, data.variance, np.ones(len(data.log_modulus))
    if beta:
        value = np.stack((value[0], value[1] - beta * value[0]))
        variance = np.stack((variance[0], variance[1] + beta**2 * variance[0]))
        lift = np.array([1.0, 1 - beta])
    channels, size = value.shape
    channel = np.repeat(np.arange(channels), size)
    curve, log_time = np.tile(data.curve, channels), np.tile(data.log_time, channels)
    return Points(curve, log_time, value.ravel(), variance.ravel(), curves, channel, lift[channel], channels)


def fit_sweeps(
    temperature: Array, data: Condensed, start: Array, anchor: int, vertical: bool, on: Basis | Literal["auto"]
) -> Superposition:
    """Fit frequency sweeps from the starting values `start` (m,) on what `on` says, or with "auto" on what determines most."""
    m = temperature.size
    raw = points_of(data, m)
    storage, loss = _channel(raw, 0), _channel(raw, 1)
    alone = fit_master(storage, start, anchor, vertical)
    if on == "storage":
        return _on_storage(alone, storage, loss, anchor)
    apart = _apart(storage, loss, have_shape(storage, alone.splines, alone.shift, False), anchor)
    rest = np.flatnonzero(~apart)
    if 2 <= rest.size < m:
        own = fit_sweeps(temperature[rest], _only(data, rest), start[rest], int(np.searchsorted(rest, anchor)), vertical, on)
        whole = {"moduli": raw, "tan-delta": _ratio(data, m), "storage": storage}[own.on]
        return replace(own, fit=_spread(own.fit, rest, start), points=whole)
    fit = fit_master(raw, alone.shift, anchor, vertical)
    beta = _common(raw, fit.residual)
    points = points_of(data, m, beta)
    if beta:
        fit = fit_master(points, fit.shift, anchor, vertical)
    moduli = _uncombined(fit, beta)
    if on == "moduli":
        return Superposition(moduli, on, raw, moduli.splines)
    ratio = _ratio(data, m)
    tangent = fit_master(ratio, fit.shift, anchor, False)
    if on == "auto":
        shaped = have_shape(ratio, tangent.splines, tangent.shift, True)
        if _loss_is_other(temperature, alone, moduli, tangent, shaped & have_shape(storage, alone.splines, alone.shift, False)):
            return _on_storage(alone, storage, loss, anchor)
        if not np.all(shaped) or _doubt(moduli) <= _doubt(tangent):
            return Superposition(moduli, "moduli", raw, moduli.splines)
    held = _uncombined(fit_held(points, tangent, anchor, vertical), beta)
    return Superposition(replace(held, offset_spread=moduli.offset_spread), "tan-delta", ratio, tangent.splines)


def _channel(points: Points, channel: int) -> Points:
    here = points.channel == channel
    parts = (points.curve[here], points.log_time[here], points.log_modulus[here], points.variance[here])
    return Points(*parts, points.curves, np.zeros_like(parts[0]), np.ones(parts[0].size))


def _ratio(data: Condensed, curves: int) -> Points:
    """Tan delta, which no vertical shift moves."""
    ratio = _channel(points_of(data, curves, 1.0), 1)
    return replace(ratio, lift=np.zeros(ratio.curve.size))


def _apart(storage: Points, loss: Points, shaped: NDArray[np.bool_], anchor: int) -> NDArray[np.bool_]:
    """Curves (m,) that nothing joins to the others: the storage modulus is level, not `shaped`, and the loss modulus has no value
    in common with that of the next curve towards the anchor. Wherever such a curve is put, it contradicts one modulus."""
    apart = np.zeros(storage.curves, dtype=bool)
    low, high = (np.array([edge(loss.log_modulus[loss.curve == k]) for k in range(loss.curves)]) for edge in (np.min, np.max))
    for outwards in (range(anchor - 1, -1, -1), range(anchor + 1, storage.curves)):
        last = anchor
        for k in outwards:
            apart[k] = not shaped[k] and (apart[last] or min(high[k], high[last]) < max(low[k], low[last]))
            last = k
    return apart


def _only(data: Condensed, curves: NDArray[np.intp]) -> Condensed:
    """The points of some curves, which are numbered afresh."""
    here = np.isin(data.curve, curves)
    new = np.searchsorted(curves, data.curve[here])
    return replace(
        data, curve=new, log_time=data.log_time[here], log_modulus=data.log_modulus[:, here], variance=data.variance[:, here]
    )


def _spread(fit: MasterFit, curves: NDArray[np.intp], elsewhere: Array) -> MasterFit:
    """The fit of some curves as one of all (m,): the others stay where they are, which nothing tells."""
    m = elsewhere.size
    whole = (elsewhere.copy(), np.zeros(m), np.full(m, np.inf), np.zeros(m))
    for values, own in zip(whole, (fit.shift, fit.vertical, fit.noise_stderr, fit.misfit.by_curve), strict=True):
        values[curves] = own
    shift, vertical, stderr, by_curve = whole
    covariance = np.zeros((2 * m, 2 * m))
    covariance[np.ix_(*2 * (np.concatenate((curves, m + curves)),))] = fit.covariance
    misfit = replace(fit.misfit, by_curve=by_curve)
    return replace(fit, shift=shift, vertical=vertical, covariance=covariance, noise_stderr=stderr, misfit=misfit)


def _on_storage(alone: MasterFit, storage: Points, loss: Points, anchor: int) -> Superposition:
    other = fit_held(loss, alone, anchor, False)
    both = replace(alone, splines=alone.splines + other.splines, residual=np.concatenate((alone.residual, other.residual)))
    return Superposition(both, "storage", storage, alone.splines)


def _common(points: Points, residual: Array) -> float:
    """How much of the first channel's scatter the second shares: the slope of a line through their residuals, or zero."""
    series = points.series
    middle = np.array([np.median(residual[series == k]) for k in range(series[-1] + 1)])
    one, other = (_cut(part) for part in (residual - middle[series]).reshape(2, -1))
    square, product = float(one @ one), float(one @ other)
    if product**2 <= CORRELATED**2 / one.size * square * float(other @ other):
        return 0.0
    return product / square


def _cut(residual: Array) -> Array:
    bound = OUTLIER * float(np.median(np.abs(residual))) / 0.6745
    return np.clip(residual, -bound, bound)


def _uncombined(fit: MasterFit, beta: float) -> MasterFit:
    """The fit of log G' and log G'' - beta log G' as one of log G' and log G''."""
    if not beta:
        return fit
    one, other = fit.splines
    storage, rest = fit.residual.reshape(2, -1)
    loss = replace(other, coefficient=other.coefficient + beta * one.coefficient)
    return replace(fit, splines=(one, loss), residual=np.concatenate((storage, rest + beta * storage)))


def _steps(fit: MasterFit) -> tuple[Array, Array]:
    """The shifts from one temperature to the next (m - 1,) and their variances, whichever curve is held fast."""
    m = fit.shift.size
    step = np.diff(np.eye(m), axis=0)
    return np.diff(fit.shift), np.einsum("ij,jk,ik->i", step, fit.covariance[:m, :m], step)


def _doubt(fit: MasterFit) -> float:
    """Mean logarithm of the variances of the shifts."""
    return float(np.mean(np.log(np.clip(_steps(fit)[1], EXACT**2, UNKNOWN**2))))


def _loss_is_other(
    temperature: Array, storage: MasterFit, moduli: MasterFit, tangent: MasterFit, shaped: NDArray[np.bool_]
) -> bool:
    """Whether tan delta shifts otherwise than the storage modulus where both are `shaped` (m,), or only the latter superposes.

    If so, says so.
    """
    (one, variance), (other, more) = _steps(storage), _steps(tangent)
    away = np.abs(one - other) * (shaped[1:] & shaped[:-1])
    score = away**2 / np.maximum(variance + more, EXACT**2)
    count = int(np.count_nonzero(shaped[1:] & shaped[:-1]))
    if np.sum(score) > count + CONTRADICTION * np.sqrt(2 * count) and np.max(away) > VISIBLE:
        k = int(np.argmax(away * (score > CONTRADICTION)))
        what = (
            f"tan delta does not shift as the storage modulus does, most from {temperature[k]:g} to {temperature[k + 1]:g} degC "
            f"(log10 shift factor {other[k]:+.2g} and {one[k]:+.2g})"
        )
    elif moduli.misfit.matters and tangent.misfit.matters and storage.misfit.rms < ALONE * moduli.misfit.rms:
        what = "the storage moduli superpose, the loss moduli and tan delta do not"
    else:
        return False
    warn(f"{what}: a second process, or losses of the instrument; the shift factors are those of the storage modulus alone")
    return True
