"""The points of a joint fit, one channel of all curves after another, and their weights.

Weights allow for measured noise, for the misfit of the model, and for outliers.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dielast.numerics.arrays import Floats, Index
from dielast.numerics.robust import robust_variance
from dielast.relaxation.superposition.binning import Binned

SMALLEST = 1e-9  # decades squared; no test is accurate to 0.01 %, and larger weights would spoil the normal equations
BEND, ZERO = 3.0, 6.0  # standard deviations at which the trust in a point begins to fall, and reaches 0


@dataclass(frozen=True, eq=False)
class FitPoints:
    """Points (n,) of `curves` curves, sorted by channel, curve and time; `variance` is the measured variance of `log_modulus`.

    Every channel has its smooth curve, and a vertical shift log10 b shifts its points by `lift` (n,) times log10 b.
    """

    curve: Index
    log_time: Floats
    log_modulus: Floats
    variance: Floats
    curves: int
    channel: Index
    lift: Floats
    channels: int = 1

    @property
    def series(self) -> Index:
        """The index (n,) of the curve and channel of each point."""
        return self.channel * self.curves + self.curve if self.channels > 1 else self.curve

    @cached_property
    def lean(self) -> Floats:
        """The change (n,) of each point if its curve is tilted by one decade from end to end."""
        along = along_curve(self.curve, self.log_time)
        return np.asarray(along * self.lift if np.any(self.lift) else along)


def points_of(data: Binned, beta: float = 0.0) -> FitPoints:
    """The channels of `data`, one after another, the second minus `beta` times the first."""
    value, variance, lift = data.log_modulus, data.variance, np.ones(len(data.log_modulus))
    if beta:
        value = np.stack((value[0], value[1] - beta * value[0]))
        variance = np.stack((variance[0], variance[1] + beta**2 * variance[0]))
        lift = np.array([1.0, 1 - beta])
    channels, size = value.shape
    channel = np.repeat(np.arange(channels), size)
    curve, log_time = np.tile(data.curve, channels), np.tile(data.log_time, channels)
    return FitPoints(curve, log_time, value.ravel(), variance.ravel(), data.bounds.size - 1, channel, lift[channel], channels)


def one_channel(points: FitPoints, channel: int) -> FitPoints:
    """The points of one channel."""
    here = points.channel == channel
    parts = (points.curve[here], points.log_time[here], points.log_modulus[here], points.variance[here])
    return FitPoints(*parts, points.curves, np.zeros_like(parts[0]), np.ones(parts[0].size))


def loss_tangent(data: Binned) -> FitPoints:
    """Tan delta, which no vertical shift changes."""
    ratio = one_channel(points_of(data, 1.0), 1)
    return replace(ratio, lift=np.zeros(ratio.curve.size))


def along_curve(curve: Index, log_time: Floats) -> Floats:
    """Position (n,) of each point along its curve, from -1/2 at the smallest `log_time` to 1/2 at the largest; points are sorted by
    curve, then time.
    """
    first = np.flatnonzero(np.diff(curve, prepend=-1))
    owner = np.repeat(np.arange(first.size), np.diff(first, append=curve.size))
    one, other = log_time[first], log_time[np.append(first[1:], curve.size) - 1]
    low, high = np.minimum(one, other), np.maximum(one, other)
    return np.asarray((log_time - ((low + high) / 2)[owner]) / np.maximum(high - low, 1e-12)[owner])


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """`weight` (n,), inversely proportional to `variance` (n,), which is the measured one plus a `floor`, in decades squared."""

    weight: Floats
    variance: Floats
    floor: float


def even_weights(variance: Floats) -> Weights:
    """Initial weights, before there are residuals: for a misfit of 2 %."""
    return Weights(1 / (variance + 1e-4), variance + 1e-4, 0.0)


def robust_weights(variance: Floats, residual: Floats, parameters: float, share: Floats, old: Weights) -> Weights:
    """Weights from the residuals (n,) of a fit with `parameters` parameters; the floor is such that the reduced chi-square is 1.

    A point's weight is its trust, which is 0 for an outlier, over its variance. `share` (n,) is the variance of the noise of a
    point's curve relative to that of all curves, by which the floor is multiplied.
    """
    square = residual**2
    floor = old.floor if old.floor > 0 else robust_variance(residual)
    floor = max(floor, SMALLEST)
    score = np.abs(residual) / np.sqrt(variance + floor * share)
    trust = np.clip((ZERO - score) / (ZERO - BEND), 0, 1) * np.minimum(1, BEND / np.maximum(score, BEND))
    freedom = max(float(np.sum(trust)) - parameters, 1.0)
    for _ in range(5):  # Newton's method for the floor, on the reciprocal of chi-square, which is nearly linear in it
        total = variance + floor * share
        part = trust * square / total
        chi = float(np.sum(part))
        steepness = float(np.sum(part * share / total))
        if steepness <= 0:
            break
        floor = max(floor + (chi - freedom) / steepness * chi / freedom, SMALLEST)
    total = variance + floor * share
    return Weights(trust / total, total, floor)


def channel_shares(channel: Index, residual: Floats) -> Floats:
    """Variance of each point's channel relative to that of all (n,), from medians."""
    if channel[-1] == 0:
        return np.ones(channel.size)
    typical = np.array([np.median(residual[channel == k] ** 2) for k in range(channel[-1] + 1)])
    typical = np.maximum(typical, SMALLEST)
    return np.asarray((typical / np.exp(np.mean(np.log(typical))))[channel])


def noise_shares(curve: Index, residual: Floats, channel: Index) -> Floats:
    """Variance of each point's curve relative to that of all (n,), from medians; 1 unless the difference is significant.

    Curves are compared within their channel.
    """
    among = channel_shares(channel, residual)
    square = residual**2 / among
    order = np.lexsort((square, curve))
    count = np.bincount(curve)
    middle = np.cumsum(count) - count + count // 2
    typical = float(np.median(square))
    if typical <= 0:
        return among
    ratio = square[order][middle] / typical
    doubt = np.exp(7 / np.sqrt(count))  # three standard errors of the logarithm of a median of squares
    sure = (ratio > doubt) | (ratio < 1 / doubt)
    return np.asarray(among * np.where(sure, np.clip(ratio, 0.01, 100.0), 1.0)[curve])
