"""Standard deviation and variance of normal numbers from medians, which outliers hardly change."""

import numpy as np

from dielast.numerics.arrays import Floats

MEDIAN, MEDIAN_SQUARE = 0.6745, 0.455  # medians of |x| and of x^2 for a standard normal x


def robust_deviation(values: Floats) -> float:
    """Standard deviation of normal `values` (n,) about 0, from the median of their magnitudes."""
    return float(np.median(np.abs(values))) / MEDIAN


def robust_variance(values: Floats) -> float:
    """Variance of normal `values` (n,) about 0, from the median of their squares."""
    return float(np.median(np.square(values))) / MEDIAN_SQUARE
