"""How the time to failure depends on voltage: an exponential law, a straight line of log10 t over V."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.io.result import Result
from dielast.io.table import Column, Frame, Table, to_frame
from dielast.simulate.failure_map import FailureMap

UNITS = {"slope": "1/V", "intercept": "1", "rms_residual": "1", "r_squared": "1"}


@dataclass(frozen=True, slots=True, repr=False)
class LifetimeLine(Result):
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
    electrode_share: float | None = None


class LifetimeLines(tuple[LifetimeLine, ...]):
    """Lines by temperature and prestretch, which are a table, too."""

    __slots__ = ()

    def __repr__(self) -> str:
        slopes = f": slope={self[0].slope:.5g} ... {self[-1].slope:.5g}" if self else ""
        return f"LifetimeLines(<{len(self)}{slopes}>)"

    @property
    def _framed(self) -> bool:
        return any(line.electrode_share is not None for line in self)

    def columns(self) -> Table:
        """The straight line of log10(time_to_failure) over voltage for each temperature and prestretch."""
        values = {
            ("temperature", "degC"): [line.temperature for line in self],
            **{(f"prestretch_{axis + 1}", "1"): [line.prestretch[axis] for line in self] for axis in (0, 1)},
            **({("electrode_share", "1"): [line.electrode_share for line in self]} if self._framed else {}),
            **{(name, unit): [getattr(line, name) for line in self] for name, unit in UNITS.items()},
        }
        columns = [Column(name, unit, np.array(numbers, dtype=float)) for (name, unit), numbers in values.items()]
        return [*columns, Column("points", None, np.array([line.points for line in self], dtype=np.int64))]

    def to_frame(self) -> Frame:
        """The table as a data frame."""
        return to_frame(self.columns())


def fit_lifetime(result: FailureMap) -> LifetimeLines:
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
            share = None if result.electrode_share is None else float(result.electrode_share[j])
            lines.append(LifetimeLine(float(temperature), pair, slope, intercept, residual, r_squared, count, share))
    return LifetimeLines(lines)
