"""Times after a ramp that stand for those after a step: the mean log ages of the parts of the load.

A load that grows evenly up to the time T leaves, at the time t, the mean of the modulus (or the compliance) over the ages of its
parts, from max(0, t - T) to t, where the response is read over the load of the moment (superposition of L. Boltzmann, see J. D.
Ferry, Viscoelastic properties of polymers, 3rd ed., Wiley 1980, ch. 1). Near an age u0, every curve is a power law with its slope s
there, so that its logarithm at the age u is that at u0 plus s ln(u / u0). To first order in s, the mean of the curve is therefore
its value at the mean log age, whatever the curve: from max(0, t - T) to t, the mean of ln u is (u ln u - u) between these ends over
their distance. What is left is s^2 / 2 times the variance of ln u. The middle of the ramp, t - T/2, is the mean age; it stands for
a step where s = 1, as in steady flow (L. J. Zapas and J. C. Phillips, J. Res. Natl. Bur. Stand. A 75 (1971) 33), and is 2 % too
late for a nearly level curve at t = 2 T.
"""

from collections.abc import Sequence

import numpy as np

from dielast.base.errors import InputError
from dielast.material.measurement import Measurement, measurement_of
from dielast.numerics.arrays import Floats

DROPPED = 2.0  # durations before which no reading after a ramp stands for one after a step
_NEWTON = 4  # iterations; from the middle of the ramp, the error is below rounding after three


def mean_log_age(time: Floats, ramp: float) -> Floats:
    """Mean natural logarithm of the ages in s of the parts of a load, at times (n,) in s, with a `ramp` of this duration in s."""
    if not ramp:
        return np.log(time)
    share = np.minimum(ramp / time, 1.0)
    # the last term is 0 while the ramp goes on
    return np.asarray(np.log(time) - 1 - (1 - share) * np.log1p(-np.minimum(share, 1 - 1e-16)) / share)


def mean_age(time: Floats, ramp: float) -> Floats:
    """The times in s (n,) after a step for which times (n,) in s after the beginning of a `ramp` of this duration in s stand."""
    return np.asarray(np.exp(mean_log_age(time, ramp))) if ramp else np.asarray(time)


def time_of_age(age: Floats, ramp: float) -> Floats:
    """The times in s (n,), from the end of a `ramp` in s on, of the `mean_age` (n,) in s."""
    time = np.maximum(age + ramp / 2, ramp)
    if ramp:
        for _ in range(_NEWTON):
            slope = -np.log1p(-np.minimum(ramp / time, 1 - 1e-12)) / ramp
            time = np.maximum(time + (np.log(age) - mean_log_age(time, ramp)) / slope, ramp)
    return np.asarray(time)


def without_ramp(curves: Sequence[Measurement], ramp: float) -> list[Measurement]:
    """The tests over time as after a step: their times are mean ages, with a `ramp` in s, without points before twice that.

    Raises `InputError` for a ramp that is no duration, and for a sweep over frequency, which has none. A curve that ends before
    twice the ramp has no points left.
    """
    if not 0 <= ramp < np.inf:
        raise InputError(f"ramp must be a duration in s, 0 or more, not {ramp}")
    if not ramp:
        return list(curves)
    if any(curve.KIND.over_frequency for curve in curves):
        raise InputError("a sweep over frequency has no ramp to be taken out")
    changed = []
    for curve in curves:
        columns = curve.columns[:, curve.columns[0] >= DROPPED * ramp]
        columns[0] = mean_age(columns[0], ramp)
        changed.append(measurement_of(curve.KIND, curve.temperature, columns, curve.source, ramp))
    return changed
