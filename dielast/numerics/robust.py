"""Numbers that scatter: deviations from medians, which outliers hardly change, and extremes beyond noise."""

import numpy as np

from dielast.numerics.arrays import Floats

MEDIAN, MEDIAN_SQUARE = 0.6745, 0.455  # medians of |x| and of x^2 for a standard normal x


def robust_deviation(values: Floats) -> float:
    """Standard deviation of normal `values` (n,) about 0, from the median of their magnitudes."""
    return float(np.median(np.abs(values))) / MEDIAN


def robust_variance(values: Floats) -> float:
    """Variance of normal `values` (n,) about 0, from the median of their squares."""
    return float(np.median(np.square(values))) / MEDIAN_SQUARE


def extremes(values: Floats, least: float) -> list[int]:
    """Indices of the extremes between which values (n,) go up and down by more than `least`, and that of the last extreme."""
    found, last, direction = list[int](), 0, 0
    for k, value in enumerate(values.tolist()):
        change = value - values[last]
        if direction * change > 0 or (direction == 0 and abs(change) > least):
            direction, last = direction or int(np.sign(change)), k
        elif direction * change < -least:
            found.append(last)
            direction, last = -direction, k
    return [*found, last]
