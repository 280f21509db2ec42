"""How the time to failure depends on voltage: an exponential law, a straight line of log10 t over V, and the inverse power law, a
straight line of log10 t over log10 V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dielast.io.result import Result
from dielast.io.table import Column, Frame, Table, to_frame
from dielast.numerics.columns import Floats
from dielast.simulate.failure_map import FailureMap

UNITS = {"slope": "1/V", "intercept": "1", "rms_residual": "1", "r_squared": "1"}
POWER = ("power_exponent", "power_intercept", "power_rms_residual", "power_r_squared")
EXPONENTIAL_LAW, POWER_LAW = "exponential", "inverse power"
ROOM = 1.8  # factor by which a figure's axis of times goes beyond the shortest and the longest
EXACT = 1e-6  # decades, about the tolerance that times are solved to: no residual is known more exactly
MARKER = 3.5 / 150  # size of a marker over the height of the axes, both in points


@dataclass(frozen=True, slots=True, repr=False)
class LifetimeLine(Result):
    """log10(time to failure in s) = `intercept` + `slope` V (1/V) at one temperature (degC) and prestretch, over so many `points`.

    And log10(time to failure in s) = `power_intercept` - `power_exponent` log10(V/1 V), over the same points.

    Residuals are in decades; `furthest` is how far off a point is at most from the exponential and from the power law, and
    `resolution` the size of a marker in a figure of the whole map. What fewer than two points cannot tell is NaN.
    """

    temperature: float
    prestretch: tuple[float, float]
    slope: float
    intercept: float
    rms_residual: float
    r_squared: float
    points: int
    electrode_share: float | None = None
    power_exponent: float = np.nan
    power_intercept: float = np.nan
    power_rms_residual: float = np.nan
    power_r_squared: float = np.nan
    furthest: tuple[float, float] = (np.nan, np.nan)
    resolution: float = np.inf

    @property
    def aic_difference(self) -> float:
        """Akaike's criterion of the exponential law less that of the power law, n ln(sum of squares) of each, as both have as many
        constants: above 0 the power law is closer. NaN where one of them is not known, or two points do not tell them apart.
        """
        residuals = np.maximum((self.rms_residual, self.power_rms_residual), EXACT)
        return float(2 * self.points * np.log(residuals[0] / residuals[1])) if self.points > 2 else np.nan

    @property
    def drawn_law(self) -> str:
        """The law that a figure draws, the closer one; empty where that is further from a point than a marker's size."""
        law, off = (POWER_LAW, self.furthest[1]) if self.aic_difference > 0 else (EXPONENTIAL_LAW, self.furthest[0])
        return law if off <= self.resolution else ""

    def drawn(self, voltage: Floats) -> Floats:
        """Times to failure in s at voltages in V, any shape, by the law that is drawn."""
        if self.drawn_law == POWER_LAW:
            return np.asarray(10 ** (self.power_intercept - self.power_exponent * np.log10(voltage)))
        return np.asarray(10 ** (self.intercept + self.slope * voltage))


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
        return [
            *columns,
            Column("points", None, np.array([line.points for line in self], dtype=np.int64)),
            *(Column(name, "1", np.array([getattr(line, name) for line in self], dtype=float)) for name in POWER),
            Column("aic_difference", "1", np.array([line.aic_difference for line in self], dtype=float)),
        ]

    def not_drawn(self) -> str:
        """Which lines a figure does not draw, and why, in a sentence; empty where it draws all that there are."""
        there = [line for line in self if line.points > 2]
        missing = [line for line in there if not line.drawn_law]
        if not missing:
            return ""
        off = max(line.furthest[line.aic_difference > 0] for line in missing)
        return f"{len(missing)} of {len(there)} lines: no law meets all points, the closer one is up to {off:.2g} decades off"

    def to_frame(self) -> Frame:
        """The table as a data frame."""
        return to_frame(self.columns())


def fit_lifetime(result: FailureMap) -> LifetimeLines:
    """Least-squares lines of the log time to failure (s) over voltage (V), and over its log, for each temperature and prestretch
    (nt, np), through the films that fail after 0 s and within the horizon.
    """
    lines = []
    times = result.time_to_failure[np.isfinite(result.time_to_failure) & (result.time_to_failure > 0)]
    resolution = MARKER * float(np.log10(ROOM**2 * times.max() / times.min())) if times.size else np.inf
    for i, temperature in enumerate(result.temperature):
        for j, prestretch in enumerate(result.prestretch):
            time = result.time_to_failure[i, j]
            used = np.isfinite(time) & (time > 0)
            voltage, decades = result.voltage[used], np.log10(time[used])
            # a film that fails without a voltage follows no power of it
            powers = np.log10(voltage) if np.all(voltage > 0) else np.full(voltage.size, np.nan)
            slope, intercept, residual, r_squared, furthest = _line(voltage, decades)
            exponent, power_intercept, power_residual, power_r_squared, power_furthest = _line(powers, decades)
            lines.append(
                LifetimeLine(
                    float(temperature),
                    (float(prestretch[0]), float(prestretch[1])),
                    slope,
                    intercept,
                    residual,
                    r_squared,
                    voltage.size,
                    None if result.electrode_share is None else float(result.electrode_share[j]),
                    -exponent,
                    power_intercept,
                    power_residual,
                    power_r_squared,
                    (furthest, power_furthest),
                    resolution,
                )
            )
    return LifetimeLines(lines)


def _line(x: Floats, y: Floats) -> tuple[float, float, float, float, float]:
    """Slope, intercept, rms residual, R^2 and largest residual of the least-squares line of y over x, both (n,); NaN for fewer
    than two points.
    """
    if x.size < 2:
        return (np.nan,) * 5
    centred = x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    intercept = float(y.mean() - slope * x.mean())
    # a line through two points has no residual, but for rounding
    off = y - intercept - slope * x if x.size > 2 else np.zeros(2)
    spread = float(np.sum((y - y.mean()) ** 2))
    r_squared = 1 - float(off @ off) / spread if spread > 0 else np.nan
    return slope, intercept, float(np.sqrt(np.mean(off**2))), r_squared, float(np.abs(off).max())
