"""The two ends of a relaxation curve, weights of points by their density in log time, and stray points, without any model."""

from typing import NamedTuple

import numpy as np

from dielast.numerics.arrays import Flags, Floats

# Slightly more than round numbers, so that rounding does not decide about points at round spacings.
_NEIGHBOURHOOD = 0.025 + 1e-6  # decades to either side: at most twenty units of weight a decade, about the width of one process
_END = 1.0 + 1e-6  # decades at either end of the curve, through which a line is fitted
_LAST = 0.25 + 1e-6
_AROUND, _NEARBY = 4, 10  # neighbours that a point is compared with, and points on either side with theirs
# A point is no noise if it is farther outside the range of its neighbours than this many such ranges, each about two standard
# deviations of the noise, and a share. A curve with more such points than the last share has another fault, such as wrong shifts.
_FAR, _FACTOR, _FEW = 4.0, 0.05, 0.05


def votes(log10_time: Floats) -> Floats:
    """Weight of each point of ascending `log10_time` (n,): one over the number of points within 0.025 decade of it, (n,).

    Where the sampling is dense, a least-squares fit then approaches an integral over log time: in a linearly sampled test, the last
    hour does not outweigh the first seconds. Points farther apart have weight 1, however wide the gaps between them; so, unlike
    with trapezoidal weights, a single point at the end of the curve has no extra weight.
    """
    first = np.searchsorted(log10_time, log10_time - _NEIGHBOURHOOD, side="left")
    last = np.searchsorted(log10_time, log10_time + _NEIGHBOURHOOD, side="right")
    return 1.0 / (last - first)


def away(values: Floats) -> Floats:
    """The ratio (n,) of each of the positive `values` (n,), in order of time, to the nearest of its neighbours if it is a stray
    point, far outside their range; 1 for all other points.

    Where a curve is steep, the range of neighbours is large, and so is the distance that is allowed.
    """
    y, n = np.log(values), values.size
    if n <= 2 * _NEARBY:
        return np.ones(n)
    place = np.arange(n)[:, None]
    around = np.clip(place - _AROUND // 2, 0, n - _AROUND - 1) + np.arange(_AROUND + 1)
    others = y[around[around != place].reshape(n, _AROUND)]
    low, high = np.min(others, axis=1), np.max(others, axis=1)
    beyond = y - np.clip(y, low, high)
    nearby = np.lib.stride_tricks.sliding_window_view(np.pad(high - low, _NEARBY, "reflect"), 2 * _NEARBY + 1)
    far = np.abs(beyond) > _FAR * np.median(nearby, axis=1) + _FACTOR
    return np.where(far & (np.mean(far) <= _FEW), np.exp(beyond), 1.0)


class End(NamedTuple):
    """Smoothed modulus at one end of a curve, in the curve's unit, and the slope d log10 G / d log10 t there (never positive)."""

    modulus: float
    slope: float


def short_time_end(log10_time: Floats, modulus: Floats) -> End:
    """The largest modulus of a relaxation curve, smoothed: the start of a straight line in log-log through its first decade."""
    return _end(log10_time, modulus, float(log10_time[0]))


def long_time_end(log10_time: Floats, modulus: Floats) -> End:
    """The smallest modulus of a relaxation curve, smoothed: the end of a straight line in log-log through its last decade."""
    return _end(log10_time, modulus, float(log10_time[-1]))


def least_modulus(log10_time: Floats, modulus: Floats) -> float:
    """A modulus that a relaxation curve reaches: that of its smoothed end, or the mean of the last quarter decade if it is larger.

    If the last decade bends towards a plateau, the straight line through it ends below the curve.
    """
    last = last_quarter(log10_time)
    mean = float(10 ** np.average(np.log10(modulus[last]), weights=votes(log10_time[last])))
    return max(long_time_end(log10_time, modulus).modulus, mean)


def last_quarter(log10_time: Floats) -> Flags:
    """Which points of ascending `log10_time` (n,) are in the last quarter decade, (n,)."""
    return np.asarray(log10_time >= log10_time[-1] - _LAST)


def _end(log10_time: Floats, modulus: Floats, at: float) -> End:
    near = np.abs(log10_time - at) <= _END
    x, y, weight = log10_time[near], np.log10(modulus[near]), votes(log10_time[near])
    (x_mean, y_mean), (spread, fall) = np.average([x, y], axis=1, weights=weight), np.cov(x, y, aweights=weight, ddof=0)[0]
    slope = min(float(fall / spread), 0.0) if spread > 0 else 0.0  # relaxation only softens: a rise is noise
    return End(float(10 ** (y_mean + slope * (at - x_mean))), slope)
