"""Measurements of any kind as points that fall along log time, averaged over short bins of it: what the fits work on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.superposition.binning import bin_curves
from dielast.superposition.gather import Gathered

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FINEST = 1e-4  # decades: no oscillation is measured to 0.02 %, and a spline has its limits at the sharp end of a loss modulus


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """Points (k,) sorted by `curve`, then `log_time`; a frequency sweep has c = 2 channels, storage and loss modulus, others one.

    `log_modulus` (c, k) is log10 of Pa, of an inverse compliance for creep; `log_time` log10 of s, of the inverse of the angular
    frequency for a sweep. `variance` (c, k) is the measured variance of `log_modulus`. `bin_of_point` (n,) maps each raw point to
    its bin in any order, -1 where it was dropped as noise floor.
    """

    curve: Index
    log_time: Array
    log_modulus: Array
    variance: Array
    bin_of_point: Index


def condense(data: Gathered) -> Condensed:
    """Bin what was gathered. A compliance is averaged as such, from its end to its beginning: there it falls into the noise."""
    one, *others = (bin_curves(data.curve, data.position, ordinate) for ordinate in data.ordinates)
    if data.measurement == "creep":
        back = np.lexsort((-one.log_time, one.curve))
        time, modulus = -one.log_time[back], -one.log_modulus[back]
        return Condensed(one.curve[back], time, modulus[None], one.variance[back][None], one.bin_of_point)
    if not others:
        return Condensed(one.curve, one.log_time, one.log_modulus[None], one.variance[None], one.bin_of_point)
    # the same bins, but noise floor may have been dropped from either channel: what is left of both goes on
    (other,) = others
    both = (one.bin_of_point >= 0) & (other.bin_of_point >= 0)
    here, bin_of_point = np.unique(one.bin_of_point[both], return_inverse=True)
    there = np.unique(other.bin_of_point[both])
    number = np.full(both.size, -1, dtype=np.intp)
    number[both] = bin_of_point
    variance = np.stack((one.variance[here], other.variance[there]))
    modulus = np.stack((one.log_modulus[here], other.log_modulus[there]))
    return Condensed(one.curve[here], one.log_time[here], modulus, np.maximum(variance, FINEST**2), number)
