"""Condense relaxation curves into points of even weight in log time, with the noise of each measured from the scatter.

A curve sampled linearly in time has nine tenths of its points in the last decade, where noise is worst. Averaging the modulus over
short bins of log time gives every decade the same weight, and the scatter within the bins is the noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Flags, Floats, Index

BINS_PER_DECADE = 20
POOL = 3  # bins on either side that share one estimate of the scatter
MIN_FREEDOM = 6  # degrees of freedom that an estimate of the scatter needs
SIGNAL_TO_NOISE = 3.0  # a mean modulus below this many standard deviations of one reading is lost in the noise
LOW = 0.1  # of a curve's largest modulus: a noise floor lies below


@dataclass(frozen=True, slots=True, eq=False)
class Binned:
    """Points of all curves, sorted by curve, then time; every array has shape (n,).

    `log_time` and `log_modulus` are decimal logarithms of s and Pa, `variance` is the measured variance of `log_modulus` (0 where
    the curve is too sparse to tell), `bin_of_point` maps each raw point to its bin (-1 where it was dropped as noise floor).
    """

    curve: Index
    log_time: Floats
    log_modulus: Floats
    variance: Floats
    bin_of_point: Index


def bin_curves(curve: Index, time: Floats, modulus: Floats) -> Binned:
    """Bin raw points, sorted by curve and then time; `modulus` (Pa) may hold readings below zero, as a noise floor gives.

    The mean is taken of the modulus, not of its logarithm, so that additive noise does not bias it; the trend within a bin is
    removed first. Bins start at the first time of each curve, so that the unit of time makes no difference.
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
    variance = scatter / count / (safe * np.log(10)) ** 2
    new_index = np.where(keep, np.cumsum(keep) - 1, -1)
    return Binned(group[keep], centre[keep], np.log10(safe[keep]), variance[keep], new_index[owner])


def _scatter(owner: Index, count: Index, away: Floats, detrended: Floats) -> tuple[Floats, Index]:
    """Sum of squares of the readings' scatter in each bin, and its degrees of freedom; `away` is log time from the bin's centre.

    In bins of three readings or more, the scatter is that about a straight line through the bin: real decay is no noise.
    """
    size = count.size
    square = np.bincount(owner, detrended**2, minlength=size)
    moment = np.bincount(owner, away**2, minlength=size)
    lined = (count > 2) & (moment > 0)
    fall = np.bincount(owner, away * detrended, minlength=size) ** 2
    explained = np.divide(fall, moment, out=np.zeros(size), where=lined)
    return np.maximum(square - explained, 0.0), count - 1 - lined


def _noise_floor(group: Index, mean: Floats, lost: Flags, known: Flags) -> Flags:
    """Bins that are noise floor: `lost` in measured noise, in a tail of their curve that is low and half lost or more.

    A modulus that decays fast scatters as well, but not about a low level at the end of the curve.
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
    """d y/d x from each point's neighbours in the same curve, zero where there is none."""
    rise, run = np.zeros(x.size), np.zeros(x.size)
    joined = (group[1:] == group[:-1]) & valid[1:] & valid[:-1]
    dx, dy = np.where(joined, np.diff(x), 0.0), np.where(joined, np.diff(y), 0.0)
    for side in (slice(1, None), slice(None, -1)):
        rise[side] += dy
        run[side] += dx
    return np.divide(rise, run, out=np.zeros(x.size), where=run > 0)


def windows(group: Index, width: int) -> tuple[Index, Index]:
    """First and last but one of the points (n,) within `width` on either side in the same group; groups stand together."""
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
    """Variance of one reading; where it is not known, borrowed from the nearest later bin of the curve, or else an earlier one.

    Noise may be additive or in proportion to the modulus. From a later bin the larger of the two is borrowed; from an earlier one,
    of higher modulus, the noise in proportion, because additive noise that was never observed would drown the end of the curve.
    Zero where the whole curve is sparse.
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
