"""Average curves over bins of equal width in log time, and measure the noise of every average from the scatter.

A curve sampled linearly in time has nine tenths of its points in the last decade, where noise is largest. Averages of the modulus
over short bins of log time give every decade the same weight, and the scatter within the bins is the noise.
"""

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Flags, Floats, Index

BINS_PER_DECADE = 20
POOL = 3  # number of bins on either side whose scatter is pooled
MIN_FREEDOM = 6  # degrees of freedom needed to estimate the scatter
SIGNAL_TO_NOISE = 3.0  # a mean modulus below this many standard deviations of one reading is lost in noise
FINEST = 1e-4  # decades; no oscillation is measured to 0.02 %, and no spline follows the sharp end of a loss modulus more closely
LOW = 0.1  # fraction of a curve's largest modulus, below which a noise floor lies


@dataclass(frozen=True, slots=True, eq=False)
class Binned:
    """Averages over bins (k,), sorted by `curve`, then `log_time`; `log_modulus` and its `variance` are (c, k) for c channels.

    All logarithms are decimal: of s, or of the inverse of the angular frequency for a sweep; of Pa, or of an inverse compliance for
    creep. The variance is measured, and 0 where a curve is too sparse. `bin_of_point` (n,) is the bin of each raw point, -1 where
    it was dropped as noise floor.
    """

    curve: Index
    log_time: Floats
    log_modulus: Floats
    variance: Floats
    bin_of_point: Index

    @property
    def bounds(self) -> Index:
        """The index of the first point of each curve, and the number of points at the end (m + 1,)."""
        return np.searchsorted(self.curve, np.arange(self.curve[-1] + 2))


def bin_channels(curve: Index, position: Floats, ordinates: Floats, stiffness_power: int) -> Binned:
    """Bins of `ordinates` (c, n), which fall along `position` (n,); a stiffness is an ordinate to the power `stiffness_power`.

    A compliance is averaged as a compliance, with its noise floor at short times. A bin that is noise floor in one channel is
    dropped from all channels.
    """
    channels = [bin_curves(curve, position, ordinate) for ordinate in ordinates]
    kept = np.all([channel.bin_of_point >= 0 for channel in channels], axis=0)
    places = [np.unique(channel.bin_of_point[kept]) for channel in channels]
    curve, log_position = channels[0].curve[places[0]], channels[0].log_time[places[0]]
    log_ordinate = np.array([channel.log_modulus[place] for channel, place in zip(channels, places, strict=True)])
    variance = np.array([channel.variance[place] for channel, place in zip(channels, places, strict=True)])
    if len(channels) > 1:
        variance = np.maximum(variance, FINEST**2)
    order = np.lexsort((stiffness_power * log_position, curve))
    bin_of_point = np.full(kept.size, -1)
    bin_of_point[kept] = np.argsort(order)[np.unique(channels[0].bin_of_point[kept], return_inverse=True)[1]]
    rows = (stiffness_power * log_position[order], stiffness_power * log_ordinate[:, order], variance[:, order], bin_of_point)
    return Binned(curve[order], *rows)


def bin_curves(curve: Index, time: Floats, modulus: Floats) -> Binned:
    """Bins of one channel, without its axis; raw points are sorted by curve, then time, and a `modulus` may be below zero.

    The average is that of the modulus, not of its logarithm, so that additive noise causes no bias; the trend within a bin is
    removed first. Bins start at the first time of each curve, so that the result does not depend on the unit of time.
    """
    x = np.log10(time)
    first = np.searchsorted(curve, np.arange(curve[-1] + 1))
    place = np.floor((x - x[first][curve]) * BINS_PER_DECADE + 1e-9).astype(np.intp)
    starts = np.flatnonzero(np.concatenate(([True], (np.diff(place) != 0) | (np.diff(curve) != 0))))
    count = np.diff(np.append(starts, x.size))
    owner = np.repeat(np.arange(starts.size), count)
    group = curve[starts]
    centre = np.add.reduceat(x, starts) / count
    mean = np.add.reduceat(modulus, starts) / count
    positive = mean > 0
    slope = _slope(group, centre, np.log10(np.where(positive, mean, 1.0)), positive)
    detrended = modulus * 10 ** (-slope[owner] * (x - centre[owner]))
    mean = np.add.reduceat(detrended, starts) / count
    scatter, freedom = _pooled(group, *_scatter(owner, count, x - centre[owner], detrended - mean[owner]))
    known = freedom >= MIN_FREEDOM
    scatter = _borrowed(group, mean, scatter, known)
    keep = (mean > 0) & ~_noise_floor(group, mean, mean < SIGNAL_TO_NOISE * np.sqrt(scatter), known)
    safe = np.where(keep, mean, 1.0)
    variance = (np.sqrt(scatter / count) / (safe * np.log(10))) ** 2  # the square of a tiny mean would vanish
    new_index = np.where(keep, np.cumsum(keep) - 1, -1)
    return Binned(group[keep], centre[keep], np.log10(safe[keep]), variance[keep], new_index[owner])


def _scatter(owner: Index, count: Index, away: Floats, detrended: Floats) -> tuple[Floats, Index]:
    """Sum of squares of the scatter in each bin, and its degrees of freedom; `away` is log time minus that of the bin's centre.

    In bins of at least three readings, the scatter is taken about a straight line, as decay within the bin is not noise.
    """
    size = count.size
    square = np.bincount(owner, detrended**2, minlength=size)
    moment = np.bincount(owner, away**2, minlength=size)
    lined = (count > 2) & (moment > 0)
    fall = np.bincount(owner, away * detrended, minlength=size) ** 2
    explained = np.divide(fall, moment, out=np.zeros(size), where=lined)
    return np.maximum(square - explained, 0.0), count - 1 - lined


def _noise_floor(group: Index, mean: Floats, lost: Flags, known: Flags) -> Flags:
    """Mask of bins that are noise floor: bins `lost` in noise, in a tail of their curve that is low and at least half lost.

    A fast decay causes scatter as well, but not about a low level at the end of the curve.
    """
    lost = lost & known
    bounds = np.searchsorted(group, np.arange(group[-1] + 2))
    low = mean < LOW * np.maximum.reduceat(mean, bounds[:-1])[group]
    later = bounds[1:][group] - np.arange(group.size)  # bins from this one to the end of its curve
    total = np.concatenate(([0], np.cumsum(lost)))
    mostly = 2 * (total[bounds[1:]][group] - total[:-1]) >= later
    begins = np.where(lost & low & mostly, np.arange(group.size), group.size)
    return lost & low & (np.arange(group.size) >= np.minimum.reduceat(begins, bounds[:-1])[group])


def _slope(group: Index, x: Floats, y: Floats, valid: Flags) -> Floats:
    """d y/d x from the neighbours of each point in the same curve, 0 without neighbours."""
    rise, run = np.zeros(x.size), np.zeros(x.size)
    joined = (group[1:] == group[:-1]) & valid[1:] & valid[:-1]
    dx, dy = np.where(joined, np.diff(x), 0.0), np.where(joined, np.diff(y), 0.0)
    for side in (slice(1, None), slice(None, -1)):
        rise[side] += dy
        run[side] += dx
    return np.divide(rise, run, out=np.zeros(x.size), where=run > 0)


def windows(group: Index, width: int) -> tuple[Index, Index]:
    """The range [first, last) of points within `width` of each point (n,) in the same group; groups are contiguous."""
    here = np.arange(group.size)
    low = np.maximum(here - width, np.searchsorted(group, group))
    return low, np.minimum(here + width + 1, np.searchsorted(group, group, side="right"))


def _pooled(group: Index, square: Floats, freedom: Index) -> tuple[Floats, Index]:
    """Variance of one reading in each bin, pooled over `POOL` bins on either side in the same curve, and its degrees of freedom."""
    low, high = windows(group, POOL)
    squares = np.concatenate(([0.0], np.cumsum(square)))
    freedoms = np.concatenate(([0], np.cumsum(freedom)))
    pooled = freedoms[high] - freedoms[low]
    total = np.maximum(squares[high] - squares[low], 0.0)
    return total / np.maximum(pooled, 1), pooled


def _borrowed(group: Index, mean: Floats, scatter: Floats, known: Flags) -> Floats:
    """Variance of one reading; where it is unknown, that of the nearest later bin of the curve, else of the nearest earlier one.

    Noise may be additive or proportional to the modulus. From a later bin, the larger of these two estimates is used; from an
    earlier bin, whose modulus is higher, only the proportional one: additive noise that was never observed would hide the end of
    the curve. The variance is 0 if the whole curve is sparse.
    """
    sources = np.flatnonzero(known)
    if sources.size in (0, known.size):
        return np.where(known, scatter, 0.0)
    here = np.arange(group.size)
    later = sources[np.minimum(np.searchsorted(sources, here), sources.size - 1)]
    earlier = sources[np.maximum(np.searchsorted(sources, here, side="right") - 1, 0)]
    onwards = (group[later] != group) | (later < here)  # no later bin of the curve has a known scatter
    source = np.where(onwards, earlier, later)
    gain = np.abs(mean) / np.where(mean[source] > 0, mean[source], np.inf)
    gain = np.where(onwards, gain, np.maximum(gain, 1.0))
    return np.where(known, scatter, np.where(group[source] == group, scatter[source] * gain**2, 0.0))
