"""Measurements of any kind as the points to fit: averages over short bins, which fall along log time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.numerics.arrays import Floats, Index
from dielast.superposition.binning import bin_curves
from dielast.superposition.gather import Gathered

FINEST = 1e-4  # decades; no oscillation is measured to 0.02 %, and no spline follows the sharp end of a loss modulus more closely


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """Points (k,) sorted by `curve`, then `log_time`; a frequency sweep has c = 2 channels, storage and loss modulus, others one.

    `log_modulus` (c, k) is log10 of Pa, of an inverse compliance for creep; `log_time` log10 of s, of the inverse of the angular
    frequency for a sweep. `variance` (c, k) is the measured variance of `log_modulus`. `bin_of_point` (n,) maps each raw point to
    its bin, -1 where it was dropped as noise floor.
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


def condense(data: Gathered) -> Condensed:
    """Average the points over bins of the position along which the ordinates fall.

    A compliance is averaged as a compliance, with its noise floor at short times. A bin that is noise floor in one channel is
    dropped from all channels.
    """
    channels = [bin_curves(data.curve, data.position, ordinate) for ordinate in data.ordinates]
    kept = np.all([channel.bin_of_point >= 0 for channel in channels], axis=0)
    places = [np.unique(channel.bin_of_point[kept]) for channel in channels]
    curve, log_position = channels[0].curve[places[0]], channels[0].log_time[places[0]]
    log_ordinate = np.array([channel.log_modulus[place] for channel, place in zip(channels, places, strict=True)])
    variance = np.array([channel.variance[place] for channel, place in zip(channels, places, strict=True)])
    if len(channels) > 1:
        variance = np.maximum(variance, FINEST**2)
    power = data.kind.stiffness_power
    order = np.lexsort((power * log_position, curve))
    bin_of_point = np.full(kept.size, -1)
    bin_of_point[kept] = np.argsort(order)[np.unique(channels[0].bin_of_point[kept], return_inverse=True)[1]]
    rows = (power * log_position[order], power * log_ordinate[:, order], variance[:, order], bin_of_point)
    return Condensed(curve[order], *rows)
