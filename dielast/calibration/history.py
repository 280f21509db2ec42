"""Measured histories as few straight lines for the solver, and path lengths along curves."""

from __future__ import annotations

import numpy as np

from dielast.numerics.arrays import Cases, Floats

TOLERANCE = 1e-3  # of the range of the values: lets straight lines remove the noise of a machine


def corners(time: Floats, value: Floats, tolerance: float = TOLERANCE) -> Cases:
    """Indices of corners: straight lines between them deviate by at most `tolerance` times the range of values from all points
    (n,).

    They include the first and the last point (Ramer 1972, DOI 10.1016/S0146-664X(72)80017-0; distances along the axis of values).
    """
    allowed = tolerance * float(np.ptp(value)) + 1e-12 * float(np.max(np.abs(value)))
    kept = np.zeros(time.size, dtype=bool)
    kept[[0, -1]] = True
    waiting = [(0, time.size - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        line = np.interp(time[inner], time[[first, last]], value[[first, last]])
        miss = np.abs(value[inner] - line)
        furthest = int(np.argmax(miss))
        if miss[furthest] > allowed:
            middle = first + 1 + furthest
            kept[middle] = True
            waiting += [(first, middle), (middle, last)]
    return np.flatnonzero(kept)


def path_length(time: Floats, value: Floats) -> Floats:
    """The path length (n,) of each point along a curve, in ranges of the value and decades of time; independent of the sampling.

    A ramp has a length of about 1, and so has each decade of a hold.
    """
    reach = float(np.ptp(value))
    moved = np.diff(value) / reach if reach > 0 else np.zeros(time.size - 1)
    first = time[time > 0][0] if np.any(time > 0) else 1.0
    later = np.diff(np.log10(np.maximum(time, first)))
    # the value measures the path in a ramp, time in a hold
    return np.concatenate(([0.0], np.cumsum(np.where(np.abs(moved) > 0.02 * later, np.abs(moved), later))))
