"""How the time to failure depends on voltage: an exponential law, a straight line of log10 t over V."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.simulate.failure_map import FailureMap


@dataclass(frozen=True, slots=True)
class LifetimeLine:
    """log10(time to failure in s) = `intercept` + `slope` V (1/V) at one temperature (degC) and prestretch, over so many `points`.

    `rms_residual` is in decades. What fewer than two points cannot tell is NaN.
    """

    temperature: float
    prestretch: tuple[float, float]
    slope: float
    intercept: float
    rms_residual: float
    r_squared: float
    points: int


def fit_lifetime(result: FailureMap) -> tuple[LifetimeLine, ...]:
    """A least-squares line for each temperature and prestretch, through the films that fail after 0 s and within the horizon."""
    lines = []
    for i, temperature in enumerate(result.temperature):
        for j, prestretch in enumerate(result.prestretch):
            time = result.time_to_failure[i, j]
            used = np.isfinite(time) & (time > 0)
            count = int(np.count_nonzero(used))
            slope = intercept = residual = r_squared = np.nan
            if count >= 2:
                voltage, decades = result.voltage[used], np.log10(time[used])
                centred = voltage - voltage.mean()
                slope = float(centred @ decades / (centred @ centred))
                intercept = float(decades.mean() - slope * voltage.mean())
                # a line through two points has no residual, but for rounding
                off = decades - intercept - slope * voltage if count > 2 else np.zeros(2)
                residual = float(np.sqrt(np.mean(off**2)))
                spread = float(np.sum((decades - decades.mean()) ** 2))
                r_squared = 1 - float(off @ off) / spread if spread > 0 else np.nan
            pair = (float(prestretch[0]), float(prestretch[1]))
            lines.append(LifetimeLine(float(temperature), pair, slope, intercept, residual, r_squared, count))
    return tuple(lines)
