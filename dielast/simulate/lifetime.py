"""The exponential law of lifetimes: log10(time to failure) as a straight line over voltage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dielast.gent import Floats
from dielast.simulate.failure_map import FailureMap


@dataclass(frozen=True, slots=True, eq=False)
class LifetimeFit:
    """log10(time to failure in s) = `intercept` + `slope` voltage, arrays (temperatures, prestretches), slope in decades/V.

    `points` counts the films that failed after more than 0 s; with fewer than two there is no line, and the rest is NaN. `residual` is the root mean square in
    decades, `r_squared` the share of the variance that the line explains (1 for two points).
    """

    slope: Floats
    intercept: Floats
    residual: Floats
    r_squared: Floats
    points: NDArray[np.intp]


def fit_lifetime(result: FailureMap) -> LifetimeFit:
    """Least squares over all voltages at which films fail within the horizon."""
    time = result.time_to_failure
    used = time > 0
    points = np.count_nonzero(used, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        log_time = np.where(used, np.log10(np.where(used, time, 1.0)), 0.0)
        volts = np.where(used, result.voltage, 0.0)
        mean_volts, mean_time = volts.sum(axis=-1) / points, log_time.sum(axis=-1) / points
        off = np.where(used, result.voltage - mean_volts[..., None], 0.0)
        rise = np.where(used, log_time - mean_time[..., None], 0.0)
        spread = np.sum(off * off, axis=-1)
        slope = np.sum(off * rise, axis=-1) / spread
        left = np.sum(np.square(rise - np.where(used, slope[..., None] * off, 0.0)), axis=-1)
        total = np.sum(rise * rise, axis=-1)
        explained = np.where(total > 0, 1 - left / total, 1.0)
    known = (points > 1) & (spread > 0)
    intercept = mean_time - slope * mean_volts
    return LifetimeFit(
        *(np.where(known, values, np.nan) for values in (slope, intercept, np.sqrt(left / np.maximum(points, 1)), explained)), points
    )
