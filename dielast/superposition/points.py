"""The points of a joint fit: the channels of all curves, one channel after another."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dielast.numerics.arrays import Floats, Index
from dielast.superposition.binning import Binned


@dataclass(frozen=True, slots=True, eq=False)
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

    @property
    def lean(self) -> Floats:
        """The change (n,) of each point if its curve is tilted by one decade from end to end."""
        along = along_curve(self.curve, self.log_time, self.curves)
        return np.asarray(along * self.lift if np.any(self.lift) else along)


def points_of(data: Binned, curves: int, beta: float = 0.0) -> FitPoints:
    """The channels of `data`, one after another, the second minus `beta` times the first."""
    value, variance, lift = data.log_modulus, data.variance, np.ones(len(data.log_modulus))
    if beta:
        value = np.stack((value[0], value[1] - beta * value[0]))
        variance = np.stack((variance[0], variance[1] + beta**2 * variance[0]))
        lift = np.array([1.0, 1 - beta])
    channels, size = value.shape
    channel = np.repeat(np.arange(channels), size)
    curve, log_time = np.tile(data.curve, channels), np.tile(data.log_time, channels)
    return FitPoints(curve, log_time, value.ravel(), variance.ravel(), curves, channel, lift[channel], channels)


def one_channel(points: FitPoints, channel: int) -> FitPoints:
    """The points of one channel."""
    here = points.channel == channel
    parts = (points.curve[here], points.log_time[here], points.log_modulus[here], points.variance[here])
    return FitPoints(*parts, points.curves, np.zeros_like(parts[0]), np.ones(parts[0].size))


def loss_tangent(data: Binned, curves: int) -> FitPoints:
    """Tan delta, which no vertical shift changes."""
    ratio = one_channel(points_of(data, curves, 1.0), 1)
    return replace(ratio, lift=np.zeros(ratio.curve.size))


def along_curve(curve: Index, log_time: Floats, curves: int) -> Floats:
    """Position (n,) of each point along its curve, from -1/2 at the smallest `log_time` to 1/2 at the largest."""
    low, high = np.full(curves, np.inf), np.full(curves, -np.inf)
    np.minimum.at(low, curve, log_time)
    np.maximum.at(high, curve, log_time)
    return np.asarray((log_time - ((low + high) / 2)[curve]) / np.maximum(high - low, 1e-12)[curve])
